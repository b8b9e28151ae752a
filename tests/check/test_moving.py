"""Runs beside obstacles that move or disappear: the checker agrees with the claims, and refuses forged ways."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import persons
import pytest
from builders import logs
from builders.edits import moved, with_meta, with_scenario
from check.forgeries import all_of, cells, claim, everywhere, rows
from check.forging import Edit, edited_report, edited_table, mend, refusals
from hypothesis import given
from hypothesis import strategies as st
from persons import FORK, lone, walking
from sharing import once

from airground_drake.base import files
from airground_drake.base.errors import LogError
from airground_drake.check.rules import SMALL
from airground_drake.check.scenario import Pair, pairs_of, way_m
from airground_drake.report import document
from airground_drake.scenario.courses import course
from airground_drake.scenario.load import resolved
from airground_drake.scenario.schema import Moves
from airground_drake.sim.events import extract
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace, save
from airground_drake.study.logs.judging import KEPT
from airground_drake.study.logs.judging import judge as judge_log
from airground_drake.verify import judge

ROUND = [[-1.0, 1.0], [1.0, 1.0], [1.0, -0.3], [-1.0, -0.3]]
CROWD: dict[str, Any] = {
    "obstacles": {
        "walker": {"radius_m": 0.2, "distance_m": 0.2, "moves": {
            "waypoints_m": ROUND, "speed_m_s": 0.7, "at_end": "loop", "start_s": 0.33}},
        "cart": FORK | {"polygon_m": [[0.0, 0.0], [0.6, 0.0], [0.6, 0.6], [0.3, 0.2], [0.0, 0.6]], "heading_rad": 0.4},
        "dog": {"position_m": [1.4, -0.4, 0.0], "radius_m": 0.1, "max_speed_m_s": 0.8},
        "ghost": walking([2.5, 0.5], [0.0, 0.5], speed=1.0, appears_s=1.98, disappears_s=4.02),
        "drone": walking([-2.0, 2.0, 3.6], [2.0, -2.0, 3.6], speed=1.5, height_m=0.0),
        "lorry": {"size_m": [0.6, 0.6], "height_m": 3.5,
                  "moves": {"waypoints_m": [[0.5, -3.0], [0.5, 3.0]], "speed_m_s": 0.9, "at_end": "reverse"}},
    },
    "safe_distance": {"obstacle_m": 0.25, "moving_m": 0.35, "ugv_m": 0.3, "air_ground_m": 1.0},
    "arena_m": [[-3.0, -3.5], [4.0, 3.5]],
}  # fmt: skip
"""All kinds of motion and shape, with one that might move and two that are not there all the time."""


def crowd() -> Trace:
    return simulate(lone("crowd", -2.0, 3.0, duration=10.0, **CROWD), "a")


def near_from_the_start() -> Trace:
    """A person stands up and leaves, faster than the robot that retreats."""
    person = walking([-1.0, 0.5], [-1.0, 3.0])
    return simulate(lone("near", -1.0, 0.5, duration=3.0, obstacles={"person": person}), "a")


def of_one_run(trace: Trace) -> Trace:
    """The trace of a scenario that has no other run, with the events of what is in its tables."""
    runs = trace.meta["scenario"]["runs"]
    trace = with_meta(trace, scenario=trace.meta["scenario"] | {"runs": {trace.run: runs[trace.run]}})
    return with_meta(trace, events=extract(trace))


def nearer(by_m: float) -> Trace:
    """The robot that stands before a person takes a step towards it, and goes back."""
    trace = persons.run("on the goal")
    return moved(trace, "ugv1", len(trace.t) - 40, [by_m, 0.0, 0.0])


RUNS: dict[str, Callable[[], Trace]] = {
    **{name: partial(persons.run, name) for name in ("standing", "squeezed", "on the goal", "leaving", "fork")},
    "too fast": lambda: persons.run("too fast", "d"),
    "crowd": crowd,
    "near from the start": near_from_the_start,
    "a step nearer": lambda: nearer(0.01),
    "sensed too late": lambda: with_scenario(
        persons.run("on the goal"),
        control__sensing_range_m=0.82,
        safe_distance__air_ground_m=0.3,
        uav__max_speed_m_s=1.0,
    ),
    "a faster person was to be expected": lambda: with_scenario(
        persons.run("on the goal"), obstacles__person__max_speed_m_s=2.4
    ),
    "appears on the robot": lambda: of_one_run(
        with_scenario(persons.run("standing"), obstacles__person__appears_s=4.5)
    ),
    "there for no period": lambda: with_scenario(
        persons.run("standing"), obstacles__person__appears_s=4.51, obstacles__person__disappears_s=4.53
    ),
    "the person leaves later": lambda: with_scenario(persons.run("leaving"), obstacles__person__disappears_s=11.0),
}
"""Runs, and some that were changed: with claims of this package that are about the change."""
SHORT = (
    "standing", "squeezed", "fork", "crowd", "near from the start", "appears on the robot",
)  # fmt: skip
REFUTED = {
    **{each: {"SAFE-TRACE"} for each in SHORT},
    **{each: {"SAFE-HYP"} for each in ("too fast", "sensed too late")},
    "a step nearer": {"SAFE-OWN", "SAFE-HYP"}, "a faster person was to be expected": {"SAFE-OWN", "SAFE-HYP"},
    "the person leaves later": {"SAFE-TRACE", "SAFE-OWN", "SAFE-HYP"},
}  # fmt: skip


@pytest.fixture(scope="module", name="report_of")
def reports(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """A report of each run, with claims about it alone; nobody writes into it."""
    above = tmp_path_factory.mktemp("moving")

    def make(name: str, folder: Path) -> None:
        trace = of_one_run(RUNS[name]())
        save(trace, folder / "trace" / trace.run)
        files.write_json(
            folder / "report.json", document.build(trace.scenario, {trace.run: trace}, judge(trace), {"seed": 0})
        )
        mend(folder)

    return lambda name: once(above / name.replace(" ", "_"), lambda folder: make(name, folder))


FORGED = ("on the goal", "standing", "leaving", "a step nearer")
"""Runs that are forged below."""


@pytest.mark.parametrize(
    "name", [each if each in FORGED else pytest.param(each, marks=pytest.mark.slow) for each in RUNS]
)
def test_verdicts_margins_and_counts_are_those_of_the_claims(report_of: Callable[[str], Path], name: str) -> None:
    folder = report_of(name)
    assert refusals(folder, all_of()) == {}
    with edited_report(folder) as report:
        safe = {each["id"]: each["status"] for each in report["claims"] if each["id"].startswith("SAFE")}
    assert {each for each, status in safe.items() if status != "holds"} == REFUTED.get(name, set())


def stepped(by_m: float, sample: int) -> Edit:
    """The robot goes ahead by a step in one control period, and back in the next."""

    def edit(folder: Path) -> None:
        with edited_table(folder, run="a") as frame, edited_table(folder, "samples", "a") as samples:
            t = samples["t_s"].to_numpy()
            samples.loc[sample, "ugv1.vx_m_s"] += by_m / persons.H
            samples.loc[sample + 1, "ugv1.vx_m_s"] -= by_m / persons.H
            frame["ugv1.x_m"] += by_m * np.interp(frame["t_s"], t[sample : sample + 3], [0.0, 1.0, 0.0])

    return edit


def person(*path: Any, value: Any) -> Edit:
    return everywhere("obstacles", "person", *path, value=value)


WAY, OWN, TRUE, MET = "trace", "SAFE-OWN", "SAFE-TRACE", "SAFE-HYP"
FORGERIES: dict[str, tuple[str, set[str], Edit]] = {
    "shifted at a row": ("on the goal", {WAY}, cells("person.x_m", lambda old: old + 2e-9, 90, run="a")),
    "shifted throughout": ("on the goal", {WAY}, cells("person.y_m", lambda old: old - 0.01, slice(None), run="a")),
    "not recorded": ("on the goal", {WAY}, rows(lambda frame: frame.drop(columns="person.x_m"), run="a")),
    "another speed": ("on the goal", {WAY}, person("moves", "speed_m_s", value=1.1)),
    "a later start": ("on the goal", {WAY}, person("moves", "start_s", value=0.06)),
    "another waypoint": ("on the goal", {WAY}, person("moves", "waypoints_m", 1, 0, value=2.001)),
    "another end": ("on the goal", {WAY}, person("moves", "at_end", value="reverse")),
    "a faster person was to be expected": ("on the goal", {OWN, MET}, person("max_speed_m_s", value=1.3)),
    "a slower person was to be expected": ("on the goal", {MET}, person("max_speed_m_s", value=1.1)),
    "a step towards the person": ("on the goal", {OWN, MET}, stepped(0.001, 200)),
    "gone before the end": ("on the goal", {OWN}, person("disappears_s", value=11.0)),
    "gone before it came near": ("standing", {TRUE, OWN, "events"}, person("disappears_s", value=3.0)),
    "it stayed": ("leaving", {TRUE, OWN, MET, "events"}, person("disappears_s", value=0.0)),
    "gone a little later": ("leaving", {OWN}, person("disappears_s", value=6.05)),
    "appeared later": ("standing", {OWN, "events"}, person("appears_s", value=7.0)),
    "smaller distance": ("on the goal", {TRUE}, person("distance_m", value=0.29)),
    "smaller distance from what moves": (
        "on the goal", {TRUE}, everywhere("safe_distance", "moving_m", value=0.29),
    ),
    "thinner person": ("on the goal", {TRUE}, person("radius_m", value=0.24)),
    "the robot's doing": ("standing", {OWN}, claim("SAFE-OWN", "a", status="refuted")),
    "nobody's doing": ("a step nearer", {OWN}, claim("SAFE-OWN", "a", status="holds")),
    "another margin": ("a step nearer", {OWN}, claim("SAFE-OWN", "a", margin=-0.009)),
    "fewer periods": ("on the goal", {OWN}, claim("SAFE-OWN", "a", exercised=lambda old: old - 1)),
    "claim left out": ("on the goal", {OWN}, claim("SAFE-OWN", "a", id="SAFE-OTHER")),
}  # fmt: skip
"""The run, the checks that refuse the forgery, and the forgery."""


@pytest.mark.parametrize("name", FORGERIES)
def test_forged_ways_speeds_and_lifetimes_are_refused(report_of: Callable[[str], Path], name: str) -> None:
    run, due, edit = FORGERIES[name]
    assert due <= {*refusals(report_of(run), edit)}


@given(
    waypoints=st.lists(st.tuples(*[st.integers(-3, 3)] * 3), min_size=2, max_size=5),
    speed=st.sampled_from([0.1, 0.3, 1.0, 7.0, 500.0]),
    start=st.sampled_from([0.0, 0.1, 0.3, 0.33, 99.0]),
    end=st.sampled_from(["stop", "reverse", "loop"]),
    period=st.sampled_from([0.01, 0.025, 0.1, 0.3]),
)
def test_ways_are_those_of_the_simulator(
    waypoints: list[tuple[float, ...]], speed: float, start: float, end: str, period: float
) -> None:
    corners = [[*map(float, each)] for each in waypoints]
    moves = {"waypoints_m": corners, "speed_m_s": speed, "start_s": start, "at_end": end}
    t = np.union1d(period * np.arange(400), np.linspace(0.0, 400 * period, 97))
    ours = course(Moves(corners, speed, start, end), period, t[-1])
    np.testing.assert_allclose(way_m(moves, period, t), ours.sample(t), atol=SMALL)


def gap(**more: Any) -> Pair:
    """The pair of the robot and an obstacle."""
    safe = {"obstacle_m": 0.3, "ugv_m": 0.3, "air_ground_m": 1.0, "moving_m": more.pop("moving_m", 0.0)}
    rock = {"radius_m": 0.1} | ({} if "moves" in more else {"position_m": [1.0, 0.0, 0.0]}) | more
    scenario = resolved(lone("one", -1.0, 3.0, obstacles={"rock": rock}, safe_distance=safe))
    return next(pair for pair in pairs_of(scenario) if (pair.robot, pair.other) == ("ugv1", "rock"))


MOVES = {"waypoints_m": [[1.0, 0.0], [1.0, 2.0]], "speed_m_s": 0.8}


@pytest.mark.parametrize(
    ("more", "gap_m", "moves_m_s"),
    [
        ({}, 0.3, 0.0),
        ({"moving_m": 0.4}, 0.3, 0.0),
        ({"moves": MOVES}, 0.3, 0.8),
        ({"moves": MOVES, "moving_m": 0.4}, 0.4, 0.8),
        ({"moves": MOVES, "moving_m": 0.4, "max_speed_m_s": 0.5}, 0.4, 0.5),
        ({"moves": MOVES, "moving_m": 0.4, "distance_m": 0.2}, 0.2, 0.8),
        ({"max_speed_m_s": 0.5, "moving_m": 0.4}, 0.4, 0.5),
    ],
)
def test_the_required_gap_and_the_closing_speed_of_what_may_move(
    more: dict[str, Any], gap_m: float, moves_m_s: float
) -> None:
    pair = gap(**more)
    assert (pair.gap_m, pair.moves_m_s, pair.closing_m_s) == (gap_m, moves_m_s, 1.0 + moves_m_s)
    assert pair.passive(persons.H).safe_m == pytest.approx(gap_m + 0.3 + moves_m_s * persons.H)


def sampled(trace: Trace, *bodies: str) -> pd.DataFrame:
    """Where bodies were at the control samples and at the end."""
    ends = np.append(trace.sample_rows, len(trace.t) - 1)
    return pd.concat([
        pd.DataFrame(trace.position(body)[ends], columns=["x_m", "y_m", "z_m"]).assign(t_s=trace.t[ends], body=body)
        for body in bodies
    ], ignore_index=True)  # fmt: skip


@pytest.mark.parametrize("by_m", [0.0, 0.01])
def test_positions_of_persons_are_judged_too(by_m: float, tmp_path: Path) -> None:
    """Of a robot it is told by how much it came too near itself, and no distance is promised."""
    trace = nearer(by_m)
    pairs = logs.judged(sampled(trace, "ugv1", "uav", "person"), resolved(trace.scenario), tmp_path).pairs
    one = next(pair for pair in pairs if (pair.first, pair.second) == ("ugv1", "person"))
    assert one.missed_m == pytest.approx(by_m, abs=1e-9)
    assert (one.safe_m, one.status, one.promised_m) == (0.3, KEPT, None)
    assert one.least_m == pytest.approx(0.3 + 1.2 * persons.H - by_m, abs=1e-9)


def test_a_log_without_a_person_is_judged_only_if_that_is_said(tmp_path: Path) -> None:
    trace = persons.run("on the goal")
    table, document = sampled(trace, "ugv1", "uav"), resolved(trace.scenario)
    with pytest.raises(LogError, match="person is not in the log"):
        logs.judged(table, document, tmp_path)
    found = judge_log(logs.read(tmp_path / "table.csv", document, without=["person"]), document)
    assert "person" not in {pair.second for pair in found.pairs}


def test_a_person_counts_only_while_it_is_there(tmp_path: Path) -> None:
    """A recording of this package goes on after a person has disappeared."""
    trace = persons.run("leaving")
    table, document = sampled(trace, "ugv1", "uav", "person"), resolved(trace.scenario)
    gone = document["obstacles"]["person"]["disappears_s"]
    one = next(pair for pair in logs.judged(table, document, tmp_path).pairs if pair.second == "person")
    assert one.covered_s == pytest.approx(gone, abs=2.0 * persons.H)
    at_robot = table[table["body"] == "ugv1"].set_index("t_s")
    later = (table["body"] == "person") & (table["t_s"] > gone + persons.H)
    for axis in ("x_m", "y_m"):
        table.loc[later, axis] = at_robot[axis].reindex(table.loc[later, "t_s"]).to_numpy()
    again = next(pair for pair in logs.judged(table, document, tmp_path).pairs if pair.second == "person")
    assert later.any()
    assert again == one
