"""A replay as one HTML file that works offline: Meshcat's own page, with names, states, events and a time slider."""

import re
from functools import cache
from typing import Any

from jinja2 import Template

from airground_drake.base.errors import ReplayError
from airground_drake.report.html import digest
from airground_drake.report.replay.recording import recorded
from airground_drake.report.replay.scene import FRAMES_PER_S, MAX_NAMED_BARRIERS, Scene
from airground_drake.report.templating import environment_of
from airground_drake.report.view import looks
from airground_drake.report.view.draw import barrier_path, robot_path
from airground_drake.report.view.stage import STATES

MAX_EVENTS = 300  # events that are listed


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
    """Data for the page's script: the names to show, and their places in Meshcat's tree."""
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
