"""Array judges come to what the judge of traces comes to, and pass nothing that is wrong with a run."""

from collections.abc import Callable

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
from airground_drake.verify.array_judges import SCREENED, ArrayJudges, NoScreenError

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
    return Batch(load("case_a", SHORT), "d")


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


def hole(log: Log) -> Log:
    return Log(*(np.delete(column, slice(100, 103), axis=0) for column in log))


WRONG: dict[Callable[[Log], Log], str] = {
    moved: "SAFE-TRACE", overtaken: "SAFE-TRACE", late: "THR-TRIG", missed: "THR-TRIG", other_mode: "THR-TRIG",
    other_variable: "THR-TRIG", jump_of_the_noise: "THR-TRIG", shorter: "SAFE-TRACE", hole: "THR-TRIG",
}  # fmt: skip


@pytest.mark.parametrize("change", WRONG, ids=[change.__name__ for change in WRONG])
def test_what_is_wrong_with_a_run_does_not_pass(change: Callable[[Log], Log], loop: Batch, log: Log) -> None:
    judges = ArrayJudges(loop)
    assert judges.findings(log)[WRONG[change]].status == "holds"
    finding = judges.findings(change(Log(*(column.copy() for column in log)))).get(WRONG[change])
    assert finding is None or finding.status == "refuted"


def test_robots_that_are_left_to_the_judge_of_traces() -> None:
    turns, appears = load("case_a_unicycle"), load("case_a", [*SHORT, "obstacles.obstacle_1.appears_s=2.0"])
    for scenario, what in (turns, "does not follow its commands exactly"), (appears, "an obstacle that appears"):
        with pytest.raises(NoScreenError, match=what):
            ArrayJudges(Batch(scenario, "a"))
