"""A replay as one HTML file that works offline: Meshcat's own page, with names, states, events and a time slider."""

from __future__ import annotations

from functools import cache
from typing import Any

from jinja2 import Template

from airground_drake.errors import ReplayError
from airground_drake.replay.looks import (
    OBSTACLE_COLOR,
    OUTCOME_COLORS,
    STATE_COLORS,
    STATE_MARKS,
    UAV_COLOR,
    UNSEEN_COLOR,
)
from airground_drake.replay.recording import recorded, robot_path
from airground_drake.replay.scene import FRAMES_PER_S, MAX_NAMED_OBSTACLES, STATES, Scene
from airground_drake.report.templating import environment_of

MAX_EVENTS = 300
"""Events that are listed."""


def page(scene: Scene) -> str:
    """The page of a run.

    Raises:
        ReplayError: if there is no port for Meshcat, or its page is not as expected.
    """
    html = str(recorded(scene).StaticHtml())
    if html.count("</body>") != 1:
        raise ReplayError("the page of this version of Drake's Meshcat has no place for the time slider")
    return html.replace("</body>", f"{_overlay().render(scene=scene, data=_data(scene), looks=_LOOKS)}\n</body>")


_LOOKS = {
    "states": list(zip(STATES, STATE_MARKS, STATE_COLORS, strict=True)),
    "outcomes": OUTCOME_COLORS,
    "uav": UAV_COLOR,
    "obstacle": OBSTACLE_COLOR,
    "unseen": UNSEEN_COLOR,
}


def _data(scene: Scene) -> dict[str, Any]:
    """What the page's script reads: the names to show, and where in Meshcat's tree they belong."""
    return {
        "title": f"{scene.scenario}, run {scene.run}",
        "end_s": float(scene.times_s[-1]),
        "frame_s": 1.0 / FRAMES_PER_S,
        "marks": STATE_MARKS,
        "robots": [
            {"name": body.name, "path": robot_path(body).split("/")[1:], "ugv": body.kind == "UGV"}
            for body in scene.robots
        ],
        "obstacles": [
            {"name": obstacle.name, "path": ["obstacles", obstacle.name, "body"]}
            for obstacle in (scene.obstacles if len(scene.obstacles) <= MAX_NAMED_OBSTACLES else ())
        ],
    }


@cache
def _overlay() -> Template:
    environment = environment_of("airground_drake.replay")
    environment.globals["max_events"] = MAX_EVENTS
    return environment.get_template("overlay.html.j2")
