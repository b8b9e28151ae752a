"""A judged log as a page: verdict, map, distances over time, results of each pair; and a replay."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from airground_drake.base import files
from airground_drake.base.arrays import Array
from airground_drake.check.files import Json
from airground_drake.report.figures.panels import Figure, Table, panel, spread
from airground_drake.report.html import render_beside
from airground_drake.report.replay.page import page as replay_page
from airground_drake.report.replay.scene import DrawnBody, Scene, frame_times
from airground_drake.report.view import canvas
from airground_drake.report.view.canvas import ALARM, INK, Look, label_right, level, look, rule, short, time_line
from airground_drake.report.view.labels import Label, place
from airground_drake.report.view.plane import Frame, axes_over, draw_barriers, frame_of, looks_of
from airground_drake.report.view.stage import Robot, stage
from airground_drake.scenario.load import resolved
from airground_drake.scenario.schema import Scenario
from airground_drake.study.logs import words
from airground_drake.study.logs.judging import BROKEN, KEPT, Judged, JudgedPair, courses
from airground_drake.study.logs.tracks import Track, Tracks

PAGE, REPLAY = "judged.html", "replay.html"
MOST_PANELS, MOST_ROWS = 6, 500  # pairs with a drawing of their distance, and pairs in the table; `--json` has all
NEAR = 2.0  # a pair came near if its least distance is below this multiple of the required one
CELLS = 400  # parts of a map's larger side within which a step is not drawn
LONGEST_REPLAY_S = 1200.0  # of a longer log there is no replay: its page would be too large
_MAP_IN, _PANEL_IN, _HEIGHT_IN = 6.0, 7.5, 2.1


def write(
    folder: Path, judged: Judged, tracks: Tracks, scenario: Scenario, errors_m: Mapping[str, float], logs: Sequence[str]
) -> list[Path]:
    pages = {}
    if judged.end_s - judged.begin_s <= LONGEST_REPLAY_S and not judged.is_far:  # it would show targets, too
        pages[REPLAY] = replay_page(scene(judged, tracks, scenario, logs))
    pages[PAGE] = page(judged, tracks, scenario, errors_m, logs, REPLAY if pages else "")
    for name, text in pages.items():
        with files.wanted(folder / name, "a folder for the page"):
            files.write_text(folder / name, text)
    return [folder / name for name in pages]


def page(
    judged: Judged, tracks: Tracks, scenario: Scenario, errors_m: Mapping[str, float], logs: Sequence[str], replay: str
) -> str:
    """The page; `replay` is the name of the file beside it, '' without one."""
    with canvas.style():
        drawn = [_map(judged, tracks, scenario), *_distances(judged, tracks, resolved(scenario))]
    return render_beside(
        "judged.html.j2", judged=judged, tracks=tracks, scenario=scenario, logs=logs, replay=replay, words=words,
        figures=drawn, errors={name: error_m for name, error_m in errors_m.items() if error_m}, most=MOST_ROWS,
        mark={KEPT: "yes" if judged.covers_all else "partly", BROKEN: "no"}.get(judged.status, "open"),
        marks_of={KEPT: "yes", BROKEN: "no"}, remarks=[*tracks.remarks, *words.remarks(judged)],
    )  # fmt: skip


def _map(judged: Judged, tracks: Tracks, scenario: Scenario) -> Figure:
    """The ways of all bodies; nothing is drawn where one was not recorded."""
    known = {name: name if name in scenario.robots else next(iter(scenario.aerial)) for name in tracks.bodies}
    robots = [name for name in tracks.bodies if name not in scenario.obstacles]
    frame = frame_of(scenario, [(known[name], tracks.bodies[name].places_m) for name in robots], targets=False)
    figure, axes = axes_over(frame, frame.width_in(_MAP_IN, canvas.TALLEST_IN), _MAP_IN)
    of_barriers, edges = draw_barriers(axes, scenario, moving=False)
    looks = looks_of(scenario, [name for name in robots if name in scenario.ugvs])
    labels, ways = list[Label](), list[Array]()
    for name, track in tracks.bodies.items():
        appearance = looks.get(known[name], canvas.UAV_LOOK) if name in robots else Look(INK, (0, (1.0, 1.5)), "h")
        parts = [track.places_m[(track.t_s >= span.begin) & (track.t_s <= span.end), :2] for span in track.spans]
        for part in parts:
            axes.plot(*_drawn(part, frame).T, color=appearance.color, linestyle=appearance.dash)
        axes.plot(*track.places_m[0, :2], "o", markersize=6, color=appearance.color, markerfacecolor="white", zorder=4)
        axes.plot(*track.places_m[-1, :2], "s", markersize=5, color=appearance.color, zorder=4)
        labels += [Label(track.places_m[-1], short(name, 12), appearance.color, weight="bold")]
        ways += parts
    for pair in [pair for pair in judged.pairs if pair.status == BROKEN][: words.MOST_NAMED]:
        recorded = [name for name in (pair.first, pair.second) if name in tracks.bodies]
        both = [tracks.bodies[name].at(np.array([pair.at_s]))[0, :2] for name in recorded]
        axes.plot(*np.transpose(both), "-X", color=ALARM, markersize=9, markeredgecolor="white", zorder=6)
        labels.append(Label(both[0], f"{pair.least_m:.3f} m at {pair.at_s:.2f} s", ALARM))
    place(axes, [*labels, *of_barriers], [*ways, *edges])
    says = "Ways seen from above: rings are first positions, squares last ones; gaps are where a body was not recorded."
    rows = tuple(
        (name, f"{track.t_s[0]:.2f}", *(f"{c:.3f}" for c in track.places_m[0, :2]), f"{track.t_s[-1]:.2f}",
         *(f"{c:.3f}" for c in track.places_m[-1, :2])) for name, track in tracks.bodies.items()
    )  # fmt: skip
    columns = ("body", "first, s", "x, m", "y, m", "last, s", "x, m", "y, m")
    drawn = panel(figure, "map", "Map of the log", says, "", Table("First and last positions", columns, rows))
    return Figure("map", "Where they were", says + " Crosses in red: where a broken distance was least.", (drawn,))


def _drawn(way_m: Array, frame: Frame) -> Array:
    """A way (K, 2), m, as it is drawn; a row of nan stands where it repeats what is drawn already."""
    # Of a long log, rows at equal distances in time would cut corners, and the ways would lead through obstacles.
    if len(way_m) <= canvas.MAX_POINTS:
        return way_m
    cells = np.round(way_m * (CELLS / max(frame.right - frame.left, frame.top - frame.bottom)))
    moves = np.append(True, np.diff(cells, axis=0).any(axis=1))
    at = np.unique(cells[moves], axis=0, return_inverse=True)[1].reshape(-1)
    new = np.zeros(len(at) - 1, dtype=bool)
    new[np.unique(np.sort(np.stack([at[:-1], at[1:]], axis=1), axis=1), axis=0, return_index=True)[1]] = True
    kept = np.append(new, False) | np.append(False, new)
    return np.where(kept[:, None], way_m[moves], np.nan)[kept | np.append(True, kept[:-1])]


def _distances(judged: Judged, tracks: Tracks, scenario: Json) -> list[Figure]:
    """Distances over time of the pairs that came near; no figure if none did."""
    near = [pair for pair in judged.pairs if pair.status != KEPT or pair.least_m < NEAR * pair.safe_m][:MOST_PANELS]
    if not near:
        return []
    over_time = courses(tracks, scenario)
    panels = []
    for k, pair in enumerate(near):
        figure = Drawing(figsize=(_PANEL_IN, _HEIGHT_IN))
        axes = figure.add_axes((0.55 / _PANEL_IN, 0.2, 1.0 - 1.75 / _PANEL_IN, 0.7))
        _distance(axes, pair, over_time[pair.first, pair.second], judged)
        name = f"{pair.first}, {pair.second}"
        says = f"Distance between {pair.first} and {pair.second} over time; {words.least(pair)}."
        panels.append(panel(figure, f"distance-{k}", name, says, f"{name}: {pair.status}", _table(pair, over_time)))
    caption = (
        "Distances between surfaces of the pairs that came near; the hatched band is below the required one. "
        "Lines are broken, and the ground is dark, where a body was not recorded: nothing is claimed there."
    )
    return [Figure("distances", "How near they came", caption, tuple(panels), look="wide")]


def _distance(axes: Axes, pair: JudgedPair, course: Sequence[tuple[Array, Array]], judged: Judged) -> None:
    distances_m = np.concatenate([values for _, values in course])
    top = max(min(float(distances_m.max()), 4.0 * pair.safe_m), 1.3 * pair.safe_m)
    bottom = min(0.0, pair.least_m)
    axes.set_xlim(judged.begin_s, max(judged.end_s, judged.begin_s + 1e-6))
    axes.set_ylim(bottom, top)
    axes.axhspan(bottom, pair.safe_m, **canvas.FORBIDDEN)
    for gap in pair.gaps_s:
        axes.axvspan(*gap, facecolor="#dddddd", zorder=0.2)
    level(axes, pair.safe_m, "-")
    appearance = look(0)
    for t_s, values in course:
        time_line(axes, t_s, values, appearance._replace(marker=""))
    color = ALARM if pair.status == BROKEN else INK
    ring: Any = {"markersize": 9, "markerfacecolor": "none", "markeredgewidth": 1.6, "clip_on": False}
    axes.plot(pair.at_s, pair.least_m, "o", **ring, color=color)
    rule(axes, "time, s", "distance, m")
    label_right(axes, [(pair.safe_m, f"required {pair.safe_m:.3g}", INK), (pair.least_m, f"{pair.least_m:.3f}", color)])


def _table(pair: JudgedPair, over_time: Mapping[tuple[str, str], Sequence[tuple[Array, Array]]]) -> Table:
    course = over_time[pair.first, pair.second]
    t_s, values = (np.concatenate([stretch[k] for stretch in course]) for k in (0, 1))
    cells = tuple((f"{t_s[k]:.2f}", f"{values[k]:.4f}") for k in spread(len(t_s)))
    return Table(f"{pair.first}, {pair.second}: distance between surfaces", ("t, s", "distance, m"), cells)


def scene(judged: Judged, tracks: Tracks, scenario: Scenario, logs: Sequence[str]) -> Scene:
    """The log as a replay shows it, from its first position on; bodies are hidden while they were not recorded."""
    still = stage(scenario, np.concatenate([track.places_m for track in tracks.bodies.values()]))
    times = frame_times(np.array([judged.end_s - judged.begin_s]))
    known = {robot.name: robot for robot in still.robots}

    def positions(track: Track) -> Array:
        at_s = times + judged.begin_s
        there = np.any([(at_s >= span.begin) & (at_s <= span.end) for span in track.spans], axis=0)
        return np.where(there[:, None], track.at(at_s), np.nan)

    bodies = []
    for name, track in tracks.bodies.items():
        if name in scenario.obstacles:
            continue
        radius_m = known[next(iter(scenario.aerial))].radius_m
        robot = known.get(name) or Robot(name, "UAV", radius_m, track.places_m[-1], turns=False)
        unturned = {**vars(robot), "turns": False, "headings": np.zeros(len(times))}  # a log need not have headings
        bodies.append(DrawnBody(**unturned, positions=positions(track), states=np.zeros(len(times), dtype=np.intp)))
    moved = {}
    for k, barrier in enumerate(still.barriers):
        if barrier.name in tracks.bodies:
            stands = scenario.obstacles[barrier.name].position_m
            home = barrier.way_m[0] if len(barrier.way_m) else np.array([*stands, 0.0, 0.0])[:3]
            moved[k] = (positions(tracks.bodies[barrier.name]) - home) * [1.0, 1.0, 0.0]
    events = [
        {"t_s": max(0.0, span.begin - judged.begin_s), "kind": "too near", "robot": f"{pair.first}, {pair.second}"}
        for pair in judged.pairs if pair.status == BROKEN for span in pair.below_s
    ]  # fmt: skip
    events += [
        {"t_s": gap.begin - judged.begin_s, "kind": "not recorded", "robot": f"{name}, for {gap.end - gap.begin:.2f} s"}
        for name, track in tracks.bodies.items() for gap in track.gaps
    ]  # fmt: skip
    return Scene(
        **{**vars(still), "robots": tuple(bodies)}, scenario=scenario, run=", ".join(Path(log).name for log in logs),
        says="Recorded positions. Nothing is shown of a body where it was not recorded.", times_s=times, moved_m=moved,
        proposals=(), has_states=False,
        events=tuple(sorted(events, key=lambda event: float(str(event["t_s"])))),
    )  # fmt: skip
