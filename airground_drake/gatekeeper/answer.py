"""From a solved problem to the UGV's answer to a proposal, and what solving it may cost."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from airground_drake.gatekeeper.budget import Budget, Clock
from airground_drake.gatekeeper.problem import Problem
from airground_drake.gatekeeper.solution import ConstantPlans, Solution
from airground_drake.intervention.messages import ACCEPT, SILENT
from airground_drake.intervention.policy import Proposal

USELESS = 1e-6
"""Relative gain below which an intervention makes no difference: ten times the solver's tolerance."""


@dataclass(frozen=True)
class Rules:
    """When a solution becomes an answer, and what it may cost.

    Attributes:
        switching_margin: relative gain that a reversal needs over keeping the answer throughout.
        min_dwell: least time between opposite answers to a proposal, s.
        max_bend: largest share of its motion by which a proposal may be bent by the avoidance inequalities.
        budget: of one solution, in counts.
        budget_share: of the sampling period that all solutions of a sample may take by the clock; None: no limit.
        clock: what that is measured with.
    """

    switching_margin: float = 0.0
    min_dwell: float = 0.0
    max_bend: float = np.inf
    budget: Budget = field(default_factory=Budget)
    budget_share: float | None = None
    clock: Clock = time.monotonic

    def budgets(self, count: int, period: float) -> Iterator[Budget]:
        """The budget of each of `count` problems of one sample; the clock is read when the first is asked for.

        Args:
            count: of problems.
            period: sampling period, s.
        """
        if self.budget_share is None:
            yield from [self.budget] * count
            return
        begin, allowance = self.clock(), self.budget_share * period
        for i in range(count):
            yield replace(self.budget, deadline_s=begin + allowance * (i + 1) / count, clock=self.clock)


Reason = Literal["cheaper", "not_cheaper", "no_difference", "bent", "kept", "dwell", "reversed", "no_plan"]
"""Why an answer is what it is: see `settle`."""


@dataclass(frozen=True)
class Decision:
    """What the gatekeeper decided about one proposal at one sample: a row of the trace's table `decisions`.

    Attributes:
        t: when, s.
        robot: for which UGV.
        proposal: on what.
        problem: (26) as predicted.
        solution: the route's.
        throughout: costs (25) of accepting and of refusing throughout; -1 without a plan.
        accepted: the answer.
        reason: why.
    """

    t: float
    robot: int
    proposal: Proposal
    problem: Problem
    solution: Solution
    throughout: tuple[float, float]
    accepted: bool
    reason: Reason


def costs_throughout(problem: Problem, solution: Solution) -> tuple[float, float]:
    """Costs (25) of accepting and of refusing throughout; mode velocities are exact for them. -1 without a plan."""
    if not solution.has_plan:
        return -1.0, -1.0
    constants = ConstantPlans.of(problem)
    return constants.accept.objective, constants.refuse.objective


def settle(
    solution: Solution, throughout: tuple[float, float], bend: float, standing: float, stood: float, rules: Rules
) -> tuple[bool, Reason]:
    """Whether the proposal is accepted, and why.

    Without a plan it is refused, whatever stands. A new proposal is accepted if the best plan starts by accepting
    it, unless it makes no difference (one that the avoidance inequalities block entirely) or they would bend it
    too much. A standing answer is reversed only if the best plan starts with the other choice and is cheaper, by
    the switching margin, than to keep the answer throughout; or if an accepted proposal has come to be bent too
    much; and not before the dwell is over. (The best plan that keeps the answer for one more stage and then
    changes it costs nearly the same as the one that changes it now: that comparison would decide nothing.)

    Args:
        solution: the route's.
        throughout: costs (25) of accepting and of refusing throughout the horizon.
        bend: see `Problem.bend`.
        standing: ACCEPT, REFUSE or SILENT.
        stood: for how long that has been the answer, s.
        rules: margins and limits.
    """
    if not solution.has_plan:
        return False, "no_plan"
    bent = bend > rules.max_bend
    if standing == SILENT:
        return _first_answer(solution, throughout, bent)
    accepted = standing == ACCEPT
    kept = throughout[0] if accepted else throughout[1]
    cheaper = solution.objective < (1.0 - rules.switching_margin) * kept
    better = cheaper and solution.accept_first != accepted
    if not ((better or bent) if accepted else (better and not bent)):
        return accepted, "kept"
    if stood < rules.min_dwell - 1e-9:
        return accepted, "dwell"
    return not accepted, "reversed"


def _first_answer(solution: Solution, throughout: tuple[float, float], bent: bool) -> tuple[bool, Reason]:
    if not solution.accept_first:
        return False, "not_cheaper"
    if not solution.objective < (1.0 - USELESS) * throughout[1]:
        return False, "no_difference"
    return (False, "bent") if bent else (True, "cheaper")
