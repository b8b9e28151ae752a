"""From a solved problem to the UGV's answer to a proposal."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from airground_drake.uav.messages import ACCEPT, SILENT
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.budget import Budget
from airground_drake.ugv.outcome import USELESS, Outcome
from airground_drake.ugv.problem import Problem
from airground_drake.ugv.reasons import WORDS, Reason
from airground_drake.ugv.solution import Solution


@dataclass(frozen=True)
class Rules:
    """How a solution becomes an answer, and the effort that solving may take."""

    switching_margin: float = 0.0  # relative gain that a reversal needs over keeping the answer throughout
    min_dwell: float = 0.0  # least time between opposite answers to a proposal, s
    # The paper's own rule: the first stage of every rounded plan is the answer, whatever stands.
    first_stage: bool = False
    budget: Budget = field(default_factory=Budget)  # of one solution, in counts
    # Time by the budget's clock that all solutions of a sample may take, s; None: no limit.
    allowance_s: float | None = None

    def budgets(self, count: int) -> Iterator[Budget]:
        """The budget of each of `count` problems of one sample; the clock is read when the first is asked for."""
        if self.allowance_s is None:
            yield from [self.budget] * count
            return
        begin = self.budget.clock()
        for i in range(count):
            yield replace(self.budget, deadline_s=begin + self.allowance_s * (i + 1) / count)


class Basis(NamedTuple):
    """The basis of a prediction; empty without one. Obstacles are indices in the world's order."""

    sensed: tuple[int, ...] = ()  # obstacles within sensing range
    known: tuple[int, ...] = ()  # under method (d), obstacles sensed so far and not seen to be gone
    new: tuple[int, ...] = ()  # of these, those sensed for the first time that are not on the proposal's map
    told: tuple[int, ...] = ()  # rows of the proposal's map that the UGV believed


@dataclass(frozen=True)
class GatekeeperDecision:
    """The decision about one proposal for one UGV at one sample: a row of the trace's table `decisions`.

    Under method (c) it rests on `problem`, `solution` and `throughout`; under (d), on `refuse`, `accept` and `tries`.
    """

    t: float  # time, s
    robot: int  # index of the UGV
    proposal: Proposal
    accepted: bool
    reason: Reason  # see `reasons.WORDS`
    problem: Problem | None = None  # (26) as predicted
    solution: Solution | None = None  # the route's
    # costs (25) of accepting and of refusing throughout; -1 without a plan
    throughout: tuple[float, float] = (-1.0, -1.0)
    refuse: Outcome | None = None  # outcome of refusing; None if no outcomes were compared
    accept: Outcome | None = None  # outcome of accepting; None if no outcomes were compared
    tries: int = 0  # acceptances since the last rest, with this decision
    answer: int = -1  # number of the answer by which the UAV is told of it; -1: it changes nothing
    basis: Basis = field(default_factory=Basis)  # inputs of the prediction
    # CPU time of prediction and decision, s, in which identical runs differ
    cpu_s: float = field(default=0.0, compare=False)


def in_words(decision: GatekeeperDecision) -> str:
    """The reason as a sentence for the UAV."""
    words = WORDS[decision.reason].sentence
    if decision.reason == "waits" and decision.solution is not None:
        accept, refuse = decision.throughout
        words += f": cost {decision.solution.objective:.4g}, {accept:.4g} to accept throughout, {refuse:.4g} to refuse"
    if decision.reason == "stalls" and decision.accept is not None:
        x, y, _ = decision.accept.end
        words += f": at ({x:.2f}, {y:.2f}) m, {decision.accept.left:.2f} m short"
    return words


def settle(
    solution: Solution, throughout: tuple[float, float], standing: float, stood: float, rules: Rules
) -> tuple[bool, Reason]:
    """Whether the proposal is accepted, and why; `stood` in s."""
    # Without a plan (the data are not finite) it is refused, whatever stands. By the rule `first_stage` the answer is,
    # at every sample, the first stage of the rounded plan, or of the optimum if the route rounds nothing.
    #
    # Otherwise there is hysteresis. A new proposal is accepted if the best plan starts by accepting it, unless it makes
    # no difference. It is refused if that plan accepts it later, even if accepting throughout costs less than refusing
    # throughout: so a UGV may wait for ever. A standing answer is reversed only if the best plan starts with the other
    # choice and is cheaper, by the switching margin, than to keep the answer throughout, and not before the dwell is
    # over. (It would decide nothing to compare with the best plan that keeps the answer for one more stage: that plan
    # costs nearly the same as changing now.)
    if not solution.has_plan:
        return False, "no_plan"
    if rules.first_stage:
        plan = solution.plan if solution.rounded is None else solution.rounded
        return plan is not None and bool(plan[0] == 1.0), "first_stage"
    if standing == SILENT:
        return _first_answer(solution, throughout)
    accepted = standing == ACCEPT
    kept = throughout[0] if accepted else throughout[1]
    cheaper = solution.objective < (1.0 - rules.switching_margin) * kept
    if not (cheaper and solution.accept_first != accepted):
        return accepted, "kept"
    if stood < rules.min_dwell - 1e-9:
        return accepted, "dwell"
    return not accepted, "reversed"


def _first_answer(solution: Solution, throughout: tuple[float, float]) -> tuple[bool, Reason]:
    gains = solution.objective < (1.0 - USELESS) * throughout[1]
    if solution.accept_first:
        return (True, "cheaper") if gains else (False, "no_difference")
    return False, "waits" if gains else "not_cheaper"
