"""A replay as one HTML file that works offline: Meshcat's own page, with names, states, events and a time slider."""

import re
from functools import cache
from typing import Any

import numpy as np
from jinja2 import Template
from pydrake.geometry import Meshcat, MeshcatAnimation
from pydrake.math import RigidTransform, RollPitchYaw

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.errors import ReplayError
from airground_drake.report.html import digest, environment_of
from airground_drake.report.replay.scene import FRAMES_PER_S, MAX_NAMED_BARRIERS, Scene, Sent
from airground_drake.report.view import stage as looks
from airground_drake.report.view.draw import barrier_path, draw, rgba, robot_path, served, shadow_path, state_path
from airground_drake.report.view.geometry import ribbon
from airground_drake.report.view.stage import OUTCOME_COLORS, PATH_COLOR, STATES

MAX_EVENTS = 300  # events that are listed
# A frame so close to the middle of its neighbours is left out: over an hour, the errors add up to millimetres.
STRAIGHT_M = 1e-9


def page(scene: Scene) -> str:
    html = str(recorded(scene).StaticHtml())
    if html.count("</body>") != 1 or "<head>" not in html:
        raise ReplayError("the page of this version of Drake's Meshcat has no place for the time slider")
    html = html.replace("</body>", f"{_overlay().render(scene=scene, data=_data(scene), looks=_LOOKS)}\n</body>")
    scripts = _SCRIPT.findall(html.replace("\r\n", "\n"))  # as a browser reads them
    meta = f'<meta http-equiv="Content-Security-Policy" content="{_POLICY} {" ".join(map(digest, scripts))}">'
    return html.replace("<head>", f"<head>\n  {meta}", 1)


_SCRIPT = re.compile(r"<script[^>]*>(.*?)</script>", re.DOTALL)
# No network, and no scripts but those of the page; Meshcat makes its styles and its buffers as it runs.
_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data: blob:; connect-src data:; worker-src blob:; "
    "base-uri 'none'; form-action 'none'; script-src"
)


_LOOKS = {
    "states": list(zip(STATES, looks.STATE_MARKS, looks.STATE_COLORS, strict=True)),
    "outcomes": looks.OUTCOME_COLORS,
    "uav": looks.UAV_COLOR,
    "obstacle": looks.OBSTACLE_COLOR,
    "unseen": looks.UNSEEN_COLOR,
}


def _data(scene: Scene) -> dict[str, Any]:
    return {
        "title": f"{scene.scenario.name}, {'run' if scene.has_states else 'log'} {scene.run}",
        "end_s": float(scene.times_s[-1]),
        "frame_s": 1.0 / FRAMES_PER_S,
        "marks": looks.STATE_MARKS,
        "robots": [
            {"name": body.name, "path": robot_path(k).split("/")[1:], "ugv": body.kind == "UGV"}
            for k, body in enumerate(scene.robots)
        ],
        "barriers": [
            {"name": barrier.name, "path": [*barrier_path(k).split("/")[1:], "body"]}
            for k, barrier in enumerate(scene.barriers if len(scene.barriers) <= MAX_NAMED_BARRIERS else ())
        ],
    }


@cache
def _overlay() -> Template:
    environment = environment_of("airground_drake.report.replay")
    environment.globals["max_events"] = MAX_EVENTS
    return environment.get_template("overlay.html.j2")


def recorded(scene: Scene) -> Meshcat:
    meshcat = served()
    draw(meshcat, scene)
    animation = MeshcatAnimation(FRAMES_PER_S)
    for k, body in enumerate(scene.robots):
        known = _known(body.positions)
        edges = np.flatnonzero(np.diff(known, prepend=False, append=False)).reshape(-1, 2)
        for j, (begin, end) in enumerate(edges):
            meshcat.SetLine(f"/paths/{k}/{j}", body.positions[begin:end].T, 1.0, rgba(PATH_COLOR))
        _move(meshcat, animation, robot_path(k), body.positions, body.headings)
        _show(meshcat, animation, robot_path(k), known)
        if body.kind == "UAV":
            _move(meshcat, animation, shadow_path(k), body.positions * [1.0, 1.0, 0.0])
            _show(meshcat, animation, shadow_path(k), known)
            continue
        for state in range(len(STATES)):
            _show(meshcat, animation, state_path(k, state), body.states == state)
    for k, barrier in enumerate(scene.barriers):
        there = (scene.times_s >= barrier.appears_s) & (scene.times_s < barrier.disappears_s)
        if k in scene.moved_m:
            _move(meshcat, animation, barrier_path(k), scene.moved_m[k])
            there[~_known(scene.moved_m[k])] = False
        if not there.all():
            _show(meshcat, animation, barrier_path(k), there)
    for k, proposal in enumerate(scene.proposals):
        _proposal(meshcat, animation, scene, proposal, k)
    meshcat.SetAnimation(animation)
    return meshcat


def _proposal(meshcat: Meshcat, animation: MeshcatAnimation, scene: Scene, proposal: Sent, k: int) -> None:
    """A band on the ground while the proposal is open or executed: solid once accepted, else dashed."""
    width = 0.35 * scene.mark_m
    height = scene.mark_m * (0.05 + 0.2 * k / len(scene.proposals))  # no two in the same plane
    for outcome in {span.outcome: None for span in proposal.spans}:
        path = f"/proposals/{k}/{outcome}"
        mesh = ribbon(proposal.path, width, None if outcome == "accepted" else 6.0 * width)
        if not mesh.faces.size:
            continue
        meshcat.SetTriangleMesh(path, mesh.vertices, mesh.faces, rgba(OUTCOME_COLORS[outcome]))
        meshcat.SetTransform(path, RigidTransform([0.0, 0.0, height]))
        standing = np.zeros(len(scene.times_s), dtype=bool)
        for span in proposal.spans:
            if span.outcome == outcome:
                standing |= (scene.times_s >= span.start_s) & (scene.times_s < span.end_s)
        _show(meshcat, animation, path, standing)


def _known(positions: Array) -> Flags:
    """At which frames a body was recorded, (F,)."""
    return np.asarray(np.isfinite(positions).all(axis=1))


def _move(
    meshcat: Meshcat, animation: MeshcatAnimation, path: str, positions: Array, headings: Array | None = None
) -> None:
    """Keyframes where the motion bends, of positions (F, 3), m, and headings (F,), rad."""
    turned, known = np.zeros(len(positions)) if headings is None else headings, _known(positions)
    bends = np.abs(np.diff(np.column_stack([positions, turned]), n=2, axis=0)).max(axis=1, initial=0.0)
    is_straight = np.zeros(len(positions), dtype=bool)
    is_straight[1:-1] = bends <= STRAIGHT_M  # not beside a frame that is NaN
    places = {
        int(k): RigidTransform(RollPitchYaw(0.0, 0.0, turned[k]), positions[k])
        for k in np.flatnonzero(known & ~is_straight)
    }
    for k, place in places.items():
        animation.SetTransform(k, path, place)
    for place in [*places.values()][:1]:
        meshcat.SetTransform(path, place)


def _show(meshcat: Meshcat, animation: MeshcatAnimation, path: str, shown: Flags) -> None:
    """Keyframes where a body appears or disappears."""
    for k in np.flatnonzero(np.append(True, shown[1:] != shown[:-1])):
        animation.SetProperty(int(k), path, "visible", bool(shown[k]))
    meshcat.SetProperty(path, "visible", bool(shown[0]))
