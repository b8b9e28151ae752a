"""Array judges come to what the judge of traces comes to, and pass nothing that is wrong with a run."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from verify.judging import findings_agreed

from airground_drake.scenario.load import load
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.batch.loop import Log
from airground_drake.sim.batch.run import Batch, LeftToDrakeError
from airground_drake.study.testing.strategies import scenarios
from airground_drake.verify import judge
from airground_drake.verify.array_judges import SCREENED, ArrayJudges, NoScreenError, replayed, triggers
from airground_drake.verify.finding import Finding

SHORT = ["duration_s=17.33", "reproduction=[]"]


def compared(scenario: Scenario, run: str, seeds: range = range(1)) -> set[str]:
    loop, screened = Batch(scenario, run), set[str]()
    for seed in seeds:
        made = loop.made(seed)
        trace = made.trace()
        screened |= findings_agreed(loop, made, trace, judge(trace, SCREENED))
    return screened


@pytest.mark.parametrize("run", ["a", "b", "d"])
def test_findings_are_those_of_the_judge_of_traces(run: str) -> None:
    """Proposals, a release, robots that slide along an obstacle and one that stalls are among them."""
    assert compared(load("case_a", SHORT), run, range(2)) == {*SCREENED}


@pytest.mark.slow
@given(scenarios())
@settings(max_examples=30)
def test_drawn_scenarios(scenario: Scenario) -> None:
    for run in scenario.runs:
        try:
            compared(scenario, run)
        except (LeftToDrakeError, NoScreenError):
            continue


@pytest.fixture(scope="module")
def loop() -> Batch:
    return Batch(load("case_a", [*SHORT, "obstacles.obstacle_3.radius_m=0.2"]), "d")


@pytest.fixture(scope="module")
def log(loop: Batch) -> Log:
    return loop.made().log


def moved(log: Log) -> Log:
    log.bodies[200:, 6] += 1e-6
    return log


def overtaken(log: Log) -> Log:
    log.bodies[:, 3], log.bodies[:, 4] = 4.0 + 0.5 * (log.t - 8.0), 7.0
    log.command[:, 3:5] = [0.5, 0.0]
    return log


def late(log: Log) -> Log:
    row = int(np.flatnonzero(log.status[:, 0])[0]) - 1
    by = 2e-5 / (log.t[row + 1] - log.t[row])
    for column in log[1:]:
        if column is not log.command and column is not log.status and column is not log.executing:
            column[row] += by * (column[row + 1] - column[row])
    log.t[row] += 2e-5
    log.status[log.status[:, 2] > 0.0, 2] = log.t[row]
    return log


def missed(log: Log) -> Log:
    log.status[:, :4] = log.status[0, :4]
    return log


def other_mode(log: Log) -> Log:
    log.status[100, 0] = 2.0
    return log


def other_variable(log: Log) -> Log:
    log.x[100, 0] += 1e-5
    return log


def jump_of_the_noise(log: Log) -> Log:
    log.noise[100:, 0] += 1e-4
    log.x[100:, 0] += 1e-4
    return log


def shorter(log: Log) -> Log:
    return Log(*(column[:-1] for column in log))


def later(log: Log) -> Log:
    return Log(*(column[1:] for column in log))


def noise_at_the_start(log: Log) -> Log:
    log.noise[:, 1] += 2e-8
    log.x[:, 1] += 2e-8
    return log


def hole(log: Log) -> Log:
    return Log(*(np.delete(column, slice(100, 103), axis=0) for column in log))


WRONG: dict[Callable[[Log], Log], str] = {
    moved: "SAFE-TRACE", overtaken: "SAFE-TRACE", late: "THR-TRIG", missed: "THR-TRIG", other_mode: "THR-TRIG",
    other_variable: "THR-TRIG", jump_of_the_noise: "THR-TRIG", shorter: "SAFE-TRACE", hole: "THR-TRIG",
    later: "SAFE-TRACE", noise_at_the_start: "THR-TRIG",
}  # fmt: skip


@pytest.mark.parametrize("change", WRONG, ids=[change.__name__ for change in WRONG])
def test_what_is_wrong_with_a_run_does_not_pass(change: Callable[[Log], Log], loop: Batch, log: Log) -> None:
    judges = ArrayJudges(loop)
    assert judges.findings(log)[WRONG[change]].status == "holds"
    finding = judges.findings(change(Log(*(column.copy() for column in log)))).get(WRONG[change])
    assert finding is None or finding.status == "refuted"


def test_what_a_collision_the_end_or_rounding_decides_is_left_to_the_judge_of_traces(
    loop: Batch, log: Log, monkeypatch: pytest.MonkeyPatch
) -> None:
    judges, given, hit = ArrayJudges(loop), loop.given, Log(*(column.copy() for column in log))
    hit.bodies[:, :3] = given.obstacles["obstacle_3"].position_m + np.array([given.safe_distance.collision_m, 0.1, 0.0])
    hit.command[:, :3] = 0.0
    assert judges.findings(hit) == {}  # its radius is 0.2 m
    row = int(np.flatnonzero(log.status[:, 0])[0])  # before it, a trigger is due
    of_rows = log.t, log.bodies, log.noise, log.x, log.status
    ends = [
        replayed(*(column[:end] for column in of_rows), loop.team.corners, loop.team.levels) for end in (row, row + 1)
    ]
    assert [agreed for *_, agreed in ends] == [False, True]
    margin = judges.findings(log)["LIVE-GOAL"].margin
    monkeypatch.setattr(given, "arrival_tolerance_m", given.arrival_tolerance_m - margin)
    monkeypatch.setattr(given.decision, "min_inter_event_s", 0.0)
    assert judges.findings(log, ["LIVE-GOAL", "ZENO-TRACE"]) == {"ZENO-TRACE": Finding("not_run")}


def test_a_run_may_begin_with_a_trigger() -> None:
    begun = SimpleNamespace(status=np.array([[1.0, 1.0, 0.0, -1.0], [1.0, 2.0, 5.0, 3.0]]))
    assert [times.tolist() for times in triggers(cast("Any", begun))] == [[0.0, 5.0]]


def test_robots_that_are_left_to_the_judge_of_traces() -> None:
    turns, appears = load("case_a_unicycle"), load("case_a", [*SHORT, "obstacles.obstacle_1.appears_s=2.0"])
    for scenario, what in (turns, "does not follow its commands exactly"), (appears, "an obstacle that appears"):
        with pytest.raises(NoScreenError, match=what):
            ArrayJudges(Batch(scenario, "a"))
