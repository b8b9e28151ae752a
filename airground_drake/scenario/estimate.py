"""An estimate of a scenario's work, computed from its numbers before the work begins.

A run has n UGVs and the UAV, T seconds, control period h, and m obstacles and phantoms. A UGV keeps away from
K = n + m points. The run asks for:

    rows        T / min(h, noise period) + 1; each event adds a few
    steps       (n + 1) rows: robots moved by one step
    decisions   n (T / gatekeeper's period + 1) at most, if the method has a gatekeeper
    predictions a decision of method (c) predicts both choices for horizon / h periods; one of method (d), made once
                per proposal, predicts them for (longest + settling) / h periods
    searches    a decision of method (c) also looks for a plan, the longer the more points are near
    memory      tables of the trace, one number per pair and row for distances, records of the decisions of method (c),
                the longest prediction, and tangents of the discs on a shortest path

These are counts, not times: the time of a step depends on the machine.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from airground_drake.base.errors import LimitError
from airground_drake.base.registry import METHODS
from airground_drake.ugv.budget import Budget

if TYPE_CHECKING:  # pydantic, which the schema imports, would delay `report --list`
    from airground_drake.scenario.schema import Run, Scenario

# Work to predict one period of one UGV beside one point (30 ns, compiled), in simulated steps (0.2 ms).
PREDICTED = 2e-4

# Work to look for a plan of 60 stages (5 ms), and more for each point in sight (1 ms), in simulated steps.
SEARCHED, SEARCHED_POINT = 25.0, 5.0
STEP_S = 2e-4  # what a simulated step takes, s, roughly: on slow machines it is several times as much
LONG_S = 60.0  # searches that take longer than this together are announced

GIB = 2**30
FLOAT = 8  # bytes of a number
COPIES = 6  # of a table while it is logged, made, written and judged
OF_A_DECISION = 2048  # bytes, without its arrays: a row of a table and some objects
OF_A_TANGENT = 320  # bytes of a tangent of two discs: complex numbers and copies of them
PROGRAM = GIB // 2  # bytes of the program with its libraries

# Largest number of rows of a campaign, one per draw, run and claim; a row takes up to 1.7 kB of memory (measured).
MOST_ROWS = 4_000_000


class Limits(NamedTuple):
    """Limits of a scenario's work."""

    work: float = 1e7  # steps
    memory: float = 8.0 * GIB  # bytes
    time: float = 3600.0  # wall-clock time for a draw of a campaign, s, as third-party code may never end
    plugins: bool = False  # whether the third-party code of a draw may be imported and run


DEFAULT_LIMITS = Limits()


class Estimate(NamedTuple):
    """The work of all runs of a scenario."""

    rows: float  # rows of the traces' signals
    steps: float  # robots moved by one step
    decisions: float  # largest number of gatekeepers' decisions
    predicted: float  # largest number of predicted periods of a UGV, times the points that it keeps away from
    searched: float  # largest work of all searches for plans, in steps
    memory: float  # bytes

    @property
    def work(self) -> float:
        """Steps, with predictions and searches counted as steps."""
        return self.steps + PREDICTED * self.predicted + self.searched

    @property
    def announcement(self) -> str:
        """One line about long work; '' if none will be long."""
        seconds = STEP_S * self.searched
        if seconds < LONG_S:
            return ""
        return (
            f"method (c) searches for a plan at up to {self.decisions:.0f} decisions: about {seconds:.0f} s if the UAV "
            f"proposes all the time, more if searches are hard; each ends after {Budget().search_s:g} s"
        )

    def __str__(self) -> str:
        return (
            f"{self.work:.2g} steps ({self.rows:.2g} rows, up to {self.decisions:.2g} decisions), "
            f"{self.memory / GIB:.2g} GiB"
        )


def estimate(scenario: Scenario) -> Estimate:
    from airground_drake.scenario.load import own

    of_runs = [_of_run(own(scenario, name), run) for name, run in scenario.runs.items()]
    rows, steps, decisions, predicted, searched, memory = (sum(column) for column in zip(*of_runs, strict=True))
    return Estimate(rows, steps, decisions, predicted, searched, PROGRAM + memory + _planning(scenario))


def within(scenario: Scenario, limits: Limits, times: int = 1) -> Estimate:
    # limits: what it may ask for.
    once = estimate(scenario)
    total = Estimate._make([*(times * count for count in once[:-1]), once.memory])
    if not (total.work <= limits.work and total.memory <= limits.memory):
        raise LimitError(scenario.name, str(total), f"{limits.work:.2g} steps, {limits.memory / GIB:.2g} GiB")
    return total


def _of_run(scenario: Scenario, run: Run) -> Estimate:
    gate = scenario.gatekeeper
    h = scenario.control.period_s
    duration = scenario.duration_s
    n = len(scenario.ugvs)
    points, by_outcome = n + _discs(scenario), not METHODS[run.method].intervention_on_top
    robots = len(scenario.robots)
    rows = duration / min(h, scenario.decision.noise_period_s) + 1.0
    columns = 1 + 6 * robots + 10 * n
    memory = FLOAT * COPIES * rows * (columns + robots * points)
    if not METHODS[run.method].gated:
        return Estimate(rows, robots * rows, 0.0, 0.0, 0.0, memory)

    decisions = n * (duration / gate.period_s + 1.0)
    periods = ((gate.longest_s + gate.settling_s) if by_outcome else gate.horizon_s) / h
    judged = min(decisions, n * (duration / scenario.intervention.period_s + 1.0)) if by_outcome else decisions
    prediction = FLOAT * periods * 3 * (points + 4)
    problem = 0.0 if by_outcome else FLOAT * gate.stages * (18 + 6 * points) + prediction
    memory += decisions * (OF_A_DECISION + problem) + 2.0 * prediction
    searched = 0.0 if by_outcome else decisions * (SEARCHED + SEARCHED_POINT * points)
    return Estimate(rows, robots * rows, decisions, judged * 2.0 * periods * points, searched, memory)


def _discs(scenario: Scenario) -> int:
    return len(scenario.obstacles) + sum(len(uav.phantoms_m) for uav in scenario.aerial.values())


def _planning(scenario: Scenario) -> float:
    """Bytes for a shortest path among all discs, if a run plans any: two discs have four tangents."""
    if not any(METHODS[run.method].intervenes for run in scenario.runs.values()):
        return 0.0
    return 2.0 * OF_A_TANGENT * math.pow(len(scenario.ugvs) + _discs(scenario), 2)
