"""Draw a scenario in Meshcat."""

import logging

import numpy as np
from pydrake.geometry import Box, Cylinder, Meshcat, MeshcatCone, MeshcatParams, Rgba
from pydrake.math import RigidTransform, RollPitchYaw

from airground_drake.base.arrays import Array
from airground_drake.base.errors import ReplayError
from airground_drake.report.view.geometry import camera, grid, prisms
from airground_drake.report.view.stage import (
    FINE,
    OBSTACLE_COLOR,
    PATH_COLOR,
    SAFE_COLOR,
    STATE_COLORS,
    STATES,
    TRIGGERED,
    UAV_COLOR,
    UNSEEN_COLOR,
    Barrier,
    Robot,
    Stage,
    rgb,
)

ELEVATION = np.radians(58.0)
# Tops of safe zones that overlap differ by up to this share of their height: the higher one hides the lower one.
LOWER = 0.05
# Opening angle of the camera, and the part of it that the panels of the page may cover.
OPENING_DEG, MARGIN_DEG = 46.0, 7.0


def served() -> Meshcat:
    """A new Meshcat, which listens on a port of this machine as long as it exists."""
    logging.getLogger("drake").setLevel(logging.WARNING)  # suppress Meshcat's log of its address, irrelevant for a file
    try:
        return Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    except RuntimeError as error:
        raise ReplayError(f"Meshcat cannot listen on any port of this machine: {error}") from error


def draw(meshcat: Meshcat, stage: Stage) -> None:
    """Draw a scenario; robots are drawn at the origin, each UGV once in every state."""
    _ground(meshcat, stage)
    for k, barrier in enumerate(stage.barriers):
        height = stage.mark_m * (1.0 + k / len(stage.barriers))  # different heights show safe zones that overlap
        (_pillar if barrier.is_round else _wall)(meshcat, barrier_path(k), barrier, height, stage.high_m[2])
    if stage.arena:
        _arena(meshcat, stage)
    for k, phantom in enumerate(stage.phantoms_m):
        _cylinder(meshcat, f"/phantoms/{k}", stage.mark_m, stage.mark_m, phantom, UNSEEN_COLOR, 0.5)
    for k, robot in enumerate(stage.robots):
        _robot(meshcat, k, robot)


def robot_path(k: int) -> str:
    """Place of robot k in Meshcat's tree; below it is one child per state."""
    # The tree has numbers instead of names: its nodes are JavaScript objects, which reserve names such as `__proto__`.
    return f"/robots/{k}"


def state_path(k: int, state: int) -> str:
    """Place of UGV k as it looks in a state, an index of STATES."""
    return f"{robot_path(k)}/{state}"


def shadow_path(k: int) -> str:
    """Place of the shadow of robot k."""
    return f"/shadows/{k}"


def barrier_path(k: int) -> str:
    """Place of barrier k; its child `body` is at a point of it."""
    return f"/obstacles/{k}"


def rgba(color: str, alpha: float = 1.0) -> Rgba:
    return Rgba(*rgb(color), alpha)


def _cylinder(
    meshcat: Meshcat, path: str, radius: float, height: float, foot: Array, color: str, alpha: float = 1.0
) -> None:
    meshcat.SetObject(path, Cylinder(radius, height), rgba(color, alpha))
    meshcat.SetTransform(path, RigidTransform(foot + np.array([0.0, 0.0, height / 2.0])))


def _ground(meshcat: Meshcat, stage: Stage) -> None:
    for path in ("/Grid", "/Axes"):
        meshcat.SetProperty(path, "visible", False)
    for edge, shade in (("top_color", [0.93, 0.95, 0.97]), ("bottom_color", [0.98, 0.98, 0.98])):
        meshcat.SetProperty("/Background/<object>", edge, shade)
    start, end = grid(stage.low_m[:2], stage.high_m[:2])
    meshcat.SetLineSegments("/ground", start, end, 1.0, rgba("#c4ccd4"))
    for light in ("SpotLight", "PointLightNegativeX", "PointLightPositiveX"):  # these fade away from the origin
        meshcat.SetProperty(f"/Lights/{light}/<object>", "visible", False)
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", 2.4)
    meshcat.SetProperty("/Lights/FillLight/<object>", "intensity", 1.2)
    place, target = camera(stage.low_m, stage.high_m, ELEVATION, np.radians(OPENING_DEG - MARGIN_DEG))
    distance = float(np.linalg.norm(place - target))
    meshcat.SetCamera(Meshcat.PerspectiveCamera(fov=OPENING_DEG, aspect=1.6, near=0.01 * distance, far=10.0 * distance))
    meshcat.SetCameraPose(place, target)


def _pillar(meshcat: Meshcat, path: str, pillar: Barrier, height: float, highest: float) -> None:
    """A ball or a post in its safe cylinder."""
    foot, safe = pillar.place_m, float(pillar.safe_m[0])
    tall = max(2.0 * height, min(pillar.top_m, highest) - foot[2])
    _cylinder(meshcat, f"{path}/body", float(pillar.radius_m[0]), tall, foot, pillar.color)
    _cylinder(meshcat, f"{path}/safe", safe, height, foot, SAFE_COLOR, 0.2)
    angle = np.linspace(0.0, 2.0 * np.pi, 73)
    rim = np.array([safe * np.cos(angle), safe * np.sin(angle), np.full_like(angle, height)])
    meshcat.SetLine(f"{path}/rim", rim + foot[:, None], 1.0, rgba(SAFE_COLOR))


def _wall(meshcat: Meshcat, path: str, wall: Barrier, height: float, highest: float) -> None:
    """Polygons and walls, as high as they are, in the zone that the surfaces of robots keep out of."""
    foot = wall.place_m
    body = prisms([part - foot[:2] for part in wall.body], max(2.0 * height, min(wall.top_m, highest)))
    meshcat.SetTriangleMesh(f"{path}/body", body.vertices, body.faces, rgba(wall.color))
    meshcat.SetTransform(f"{path}/body", RigidTransform(foot))
    zone = prisms(wall.safe, height, lower=LOWER * height / len(wall.parts))
    meshcat.SetTriangleMesh(f"{path}/safe", zone.vertices, zone.faces, rgba(SAFE_COLOR, 0.2))
    if wall.rays == FINE:
        start, end = (np.column_stack([edge, np.full(len(edge), height)]).T for edge in wall.rim)
        meshcat.SetLineSegments(f"{path}/rim", start, end, 1.0, rgba(SAFE_COLOR))


def _arena(meshcat: Meshcat, stage: Stage) -> None:
    """Low transparent walls, and the frame that the surfaces of robots keep to."""
    frame, inner = (np.column_stack([ring, np.zeros(4)]) for ring in stage.arena)
    after, up = np.roll(frame, -1, axis=0), np.array([0.0, 0.0, 4.0 * stage.mark_m])
    corners = np.stack([frame, after, after + up, frame + up], axis=1).reshape(-1, 3)
    faces = np.concatenate([np.array([[0, 1, 2], [0, 2, 3]]) + 4 * k for k in range(4)])
    meshcat.SetTriangleMesh("/arena/walls", corners.T, faces.T.astype(np.int32), rgba(OBSTACLE_COLOR, 0.3))
    for name, ring, color in (("frame", frame, OBSTACLE_COLOR), ("safe", inner, SAFE_COLOR)):
        meshcat.SetLine(f"/arena/{name}", np.concatenate([ring, ring[:1]]).T, 2.0, rgba(color))


def _robot(meshcat: Meshcat, k: int, robot: Robot) -> None:
    r = robot.radius_m
    if robot.kind == "UAV":
        _uav(meshcat, robot_path(k), r)
        _cylinder(meshcat, f"{shadow_path(k)}/disc", r, 0.02 * r, np.zeros(3), "#000000", 0.25)
        return
    for state in range(len(STATES)):
        _ugv(meshcat, state_path(k, state), r, state, nose=robot.turns)
    for turn in (45.0, -45.0):
        bar = f"/targets/{k}/{turn:g}"
        meshcat.SetObject(bar, Box(2.4 * r, 0.35 * r, 0.05 * r), rgba(PATH_COLOR))
        meshcat.SetTransform(bar, RigidTransform(RollPitchYaw(0.0, 0.0, np.radians(turn)), robot.target_m))


def _ugv(meshcat: Meshcat, path: str, r: float, state: int, *, nose: bool) -> None:
    """A low cylinder in the colour of its state, with a cone above it if triggered, a ring if intervened."""
    color = STATE_COLORS[state]
    _cylinder(meshcat, f"{path}/body", r, r, np.zeros(3), color)
    if nose:
        meshcat.SetObject(f"{path}/nose", Box(0.9 * r, 0.3 * r, 0.3 * r), rgba(PATH_COLOR))
        meshcat.SetTransform(f"{path}/nose", RigidTransform([0.9 * r, 0.0, 0.5 * r]))
    if state == TRIGGERED:
        meshcat.SetObject(f"{path}/mark", MeshcatCone(1.4 * r, 0.7 * r, 0.7 * r), rgba(color))
        meshcat.SetTransform(f"{path}/mark", RigidTransform([0.0, 0.0, 1.3 * r]))
    elif state > TRIGGERED:
        _cylinder(meshcat, f"{path}/mark", 1.7 * r, 0.2 * r, np.zeros(3), color, 0.5)


def _uav(meshcat: Meshcat, path: str, r: float) -> None:
    """Two crossed arms with a rotor at each end."""
    for turn in (45.0, 135.0):
        arm = f"{path}/arm{turn:g}"
        meshcat.SetObject(arm, Box(2.4 * r, 0.2 * r, 0.2 * r), rgba(UAV_COLOR))
        meshcat.SetTransform(arm, RigidTransform(RollPitchYaw(0.0, 0.0, np.radians(turn)), np.zeros(3)))
    for x in (-0.85, 0.85):
        for y in (-0.85, 0.85):
            _cylinder(meshcat, f"{path}/rotor{x:g}{y:g}", 0.6 * r, 0.08 * r, r * np.array([x, y, 0.12]), UAV_COLOR, 0.6)
