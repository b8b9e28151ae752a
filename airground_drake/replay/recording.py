"""A scene as a Meshcat recording: robots move, change with their state, and proposals come and go."""

from __future__ import annotations

import logging

import numpy as np
import numpy.typing as npt
from pydrake.geometry import Box, Cylinder, Meshcat, MeshcatAnimation, MeshcatCone, MeshcatParams, Rgba
from pydrake.math import RigidTransform, RollPitchYaw

from airground_drake.arrays import Array
from airground_drake.errors import ReplayError
from airground_drake.replay.geometry import camera, grid, ribbon
from airground_drake.replay.looks import (
    OBSTACLE_COLOR,
    OUTCOME_COLORS,
    PATH_COLOR,
    SAFE_COLOR,
    STATE_COLORS,
    UAV_COLOR,
    UNSEEN_COLOR,
)
from airground_drake.replay.proposals import Sent
from airground_drake.replay.scene import FRAMES_PER_S, STATES, TRIGGERED, Body, Pillar, Scene

ELEVATION = np.radians(58.0)
OPENING_DEG, MARGIN_DEG = 46.0, 7.0
"""Angle of the camera, and how much of it is left to the panels."""
STRAIGHT_M = 1e-9
"""A frame is left out if it is so close to the middle of its neighbours: over an hour that adds up to millimetres."""


def recorded(scene: Scene) -> Meshcat:
    """A Meshcat with the scene and its recording, which serves itself on this machine as long as it lives.

    Raises:
        ReplayError: if there is no port that it may listen on.
    """
    logging.getLogger("drake").setLevel(logging.WARNING)  # it tells its address, which says nothing about the file
    try:
        meshcat = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    except RuntimeError as error:
        raise ReplayError(f"Meshcat cannot listen on any port of this machine: {error}") from error
    _stage(meshcat, scene)
    for k, obstacle in enumerate(scene.obstacles):
        _pillar(meshcat, obstacle_path(k), obstacle, scene.mark_m * (1.0 + k / len(scene.obstacles)))
    for k, phantom in enumerate(scene.phantoms_m):
        _cylinder(meshcat, f"/phantoms/{k}", scene.mark_m, scene.mark_m, phantom, UNSEEN_COLOR, 0.5)
    animation = MeshcatAnimation(FRAMES_PER_S)
    for k, body in enumerate(scene.robots):
        _robot(meshcat, animation, k, body)
    for k, proposal in enumerate(scene.proposals):
        _proposal(meshcat, animation, scene, proposal, k)
    meshcat.SetAnimation(animation)
    return meshcat


def robot_path(k: int) -> str:
    """Where robot k is in Meshcat's tree; below it is one child per state.

    The tree has numbers, no names: its nodes are JavaScript objects, in which `__proto__` or `constructor` is no
    child's name.
    """
    return f"/robots/{k}"


def obstacle_path(k: int) -> str:
    """Where obstacle k is in Meshcat's tree."""
    return f"/obstacles/{k}"


def _rgba(color: str, alpha: float = 1.0) -> Rgba:
    return Rgba(*(int(color[i : i + 2], 16) / 255.0 for i in (1, 3, 5)), alpha)


def _cylinder(
    meshcat: Meshcat, path: str, radius: float, height: float, foot: Array, color: str, alpha: float = 1.0
) -> None:
    meshcat.SetObject(path, Cylinder(radius, height), _rgba(color, alpha))
    meshcat.SetTransform(path, RigidTransform(foot + np.array([0.0, 0.0, height / 2.0])))


def _stage(meshcat: Meshcat, scene: Scene) -> None:
    """Ground and camera."""
    for path in ("/Grid", "/Axes"):
        meshcat.SetProperty(path, "visible", False)
    for edge, shade in (("top_color", [0.93, 0.95, 0.97]), ("bottom_color", [0.98, 0.98, 0.98])):
        meshcat.SetProperty("/Background/<object>", edge, shade)
    start, end = grid(scene.low_m[:2], scene.high_m[:2])
    meshcat.SetLineSegments("/ground", start, end, 1.0, _rgba("#c4ccd4"))
    for light in ("SpotLight", "PointLightNegativeX", "PointLightPositiveX"):  # these fade away from the origin
        meshcat.SetProperty(f"/Lights/{light}/<object>", "visible", False)
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", 2.4)
    meshcat.SetProperty("/Lights/FillLight/<object>", "intensity", 1.2)
    place, target = camera(scene.low_m, scene.high_m, ELEVATION, np.radians(OPENING_DEG - MARGIN_DEG))
    distance = float(np.linalg.norm(place - target))
    meshcat.SetCamera(Meshcat.PerspectiveCamera(fov=OPENING_DEG, aspect=1.6, near=0.01 * distance, far=10.0 * distance))
    meshcat.SetCameraPose(place, target)


def _pillar(meshcat: Meshcat, path: str, obstacle: Pillar, height: float) -> None:
    """An obstacle in its safe cylinder; no two of the same height, so that each is seen where they overlap."""
    color = OBSTACLE_COLOR if obstacle.known_to_uav else UNSEEN_COLOR
    _cylinder(meshcat, f"{path}/body", obstacle.radius_m, 2.0 * height, obstacle.centre_m, color)
    _cylinder(meshcat, f"{path}/safe", obstacle.safe_m, height, obstacle.centre_m, SAFE_COLOR, 0.2)
    angle = np.linspace(0.0, 2.0 * np.pi, 73)
    rim = np.array([obstacle.safe_m * np.cos(angle), obstacle.safe_m * np.sin(angle), np.full_like(angle, height)])
    meshcat.SetLine(f"{path}/rim", rim + obstacle.centre_m[:, None], 1.0, _rgba(SAFE_COLOR))


def _robot(meshcat: Meshcat, animation: MeshcatAnimation, k: int, body: Body) -> None:
    path, r = robot_path(k), body.radius_m
    meshcat.SetLine(f"/paths/{k}", body.positions.T, 1.0, _rgba(PATH_COLOR))
    if body.kind == "UAV":
        _uav(meshcat, path, r)
        _cylinder(meshcat, f"/shadows/{k}/disc", r, 0.02 * r, np.zeros(3), "#000000", 0.25)
        _move(meshcat, animation, f"/shadows/{k}", body.positions * [1.0, 1.0, 0.0])
    else:
        for state in range(len(STATES)):
            _ugv(meshcat, f"{path}/{state}", r, state)
            _show(meshcat, animation, f"{path}/{state}", body.states == state)
        for turn in (45.0, -45.0):
            bar = f"/targets/{k}/{turn:g}"
            meshcat.SetObject(bar, Box(2.4 * r, 0.35 * r, 0.05 * r), _rgba(PATH_COLOR))
            meshcat.SetTransform(bar, RigidTransform(RollPitchYaw(0.0, 0.0, np.radians(turn)), body.target_m))
    _move(meshcat, animation, path, body.positions)


def _ugv(meshcat: Meshcat, path: str, r: float, state: int) -> None:
    """A low cylinder in the colour of its state: with a cone over it if triggered, a ring round it if intervened."""
    color = STATE_COLORS[state]
    _cylinder(meshcat, f"{path}/body", r, r, np.zeros(3), color)
    if state == TRIGGERED:
        meshcat.SetObject(f"{path}/mark", MeshcatCone(1.4 * r, 0.7 * r, 0.7 * r), _rgba(color))
        meshcat.SetTransform(f"{path}/mark", RigidTransform([0.0, 0.0, 1.3 * r]))
    elif state > TRIGGERED:
        _cylinder(meshcat, f"{path}/mark", 1.7 * r, 0.2 * r, np.zeros(3), color, 0.5)


def _uav(meshcat: Meshcat, path: str, r: float) -> None:
    """Two crossed arms with a rotor at each end."""
    for turn in (45.0, 135.0):
        arm = f"{path}/arm{turn:g}"
        meshcat.SetObject(arm, Box(2.4 * r, 0.2 * r, 0.2 * r), _rgba(UAV_COLOR))
        meshcat.SetTransform(arm, RigidTransform(RollPitchYaw(0.0, 0.0, np.radians(turn)), np.zeros(3)))
    for x in (-0.85, 0.85):
        for y in (-0.85, 0.85):
            _cylinder(meshcat, f"{path}/rotor{x:g}{y:g}", 0.6 * r, 0.08 * r, r * np.array([x, y, 0.12]), UAV_COLOR, 0.6)


def _proposal(meshcat: Meshcat, animation: MeshcatAnimation, scene: Scene, proposal: Sent, k: int) -> None:
    """A band on the ground while the proposal stands: in full once accepted, else dashed."""
    width = 0.35 * scene.mark_m
    height = scene.mark_m * (0.05 + 0.2 * k / len(scene.proposals))  # no two in the same plane
    for outcome in {span.outcome: None for span in proposal.spans}:
        path = f"/proposals/{k}/{outcome}"
        mesh = ribbon(proposal.path, width, None if outcome == "accepted" else 6.0 * width)
        if not mesh.faces.size:
            continue
        meshcat.SetTriangleMesh(path, mesh.vertices, mesh.faces, _rgba(OUTCOME_COLORS[outcome]))
        meshcat.SetTransform(path, RigidTransform([0.0, 0.0, height]))
        standing = np.zeros(len(scene.times_s), dtype=bool)
        for span in proposal.spans:
            if span.outcome == outcome:
                standing |= (scene.times_s >= span.start_s) & (scene.times_s < span.end_s)
        _show(meshcat, animation, path, standing)


def _move(meshcat: Meshcat, animation: MeshcatAnimation, path: str, positions: Array) -> None:
    """Keyframes where the motion is not as between its neighbours."""
    bent = np.abs(np.diff(positions, n=2, axis=0)).max(axis=1, initial=0.0) > STRAIGHT_M
    for k in np.flatnonzero(np.concatenate([[True], bent, [True]])[: len(positions)]):
        animation.SetTransform(int(k), path, RigidTransform(positions[k]))
    meshcat.SetTransform(path, RigidTransform(positions[0]))


def _show(meshcat: Meshcat, animation: MeshcatAnimation, path: str, shown: npt.NDArray[np.bool_]) -> None:
    """Keyframes where a body comes and goes."""
    for k in np.flatnonzero(np.append(True, shown[1:] != shown[:-1])):
        animation.SetProperty(int(k), path, "visible", bool(shown[k]))
    meshcat.SetProperty(path, "visible", bool(shown[0]))
