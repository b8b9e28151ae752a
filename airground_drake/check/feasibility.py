"""GATE-FEAS: a decision is about the UGV's situation, its plan satisfies (26b)-(26e), its answer follows the rules."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from .decisions import LEAST_COST, Decision, decisions_of, silent_ugvs
from .files import Json
from .foresight import rows_of
from .proposals import proposals_of
from .rules import SMALL, Array, Flags, Found, at_most, close, holds, same
from .run import Run
from .scenario import Pair

COST = 1e-9
"""Recorded and recomputed costs may differ by this, relative: rounding of 3 N additions errs by 1e-13."""
SPEED = 1e-4
"""A step may be longer than the speed limit allows by this, relative."""
INSIDE_M = 1e-6
"""Closer than the safe distance by more than this, avoidance may ask for more speed than the limit."""
NO_DIFFERENCE = 1e-6
"""Relative gain from which on a new proposal makes a difference."""
TIE = 1e-9
"""Deficits of sum-up rounding closer to 1/2 than this are a tie: either mode may follow."""
ROUNDING_ROUTES = ("relaxed", "nonlinear")
"""Routes that round a relaxed plan."""
CHOICES = ("refuse", "accept")


def gate_feas(run: Run, claim: Json) -> Found:
    """GATE-FEAS: situation, plan and answer; the margin is the part of a tolerance that rounding leaves."""
    if silent_ugvs(run):
        return Found("not_run")
    if run.method == "d":
        return _in_time(run)
    decisions = decisions_of(run)
    for decision in decisions:
        _on_a_proposal(run, decision)
        _about_the_situation(run, decision)
        _about_what_is_sensed(run, decision)
        if decision.planned:
            _plan_and_its_positions(decision)
            _costs_and_clearance(decision)
        _no_faster_than_the_limit(run, decision)
    route = run.scenario["gatekeeper"]["route"]
    rounded = [each for each in decisions if len(each.relaxed) and route in ROUNDING_ROUTES]
    for decision in rounded:
        _is_rounded_by_the_rule(decision)
    for ugv in run.ugvs:
        mine = [decision for decision in decisions if decision.ugv == ugv]
        _answers_follow_the_rules(run, mine)
        _every_proposal_is_decided_on(run, ugv, mine)
    if not decisions:
        return Found("holds", facts={"decisions": 0}).counted(0)
    facts = {
        "decisions": len(decisions),
        "wrong": 0,
        "reasons": reasons_of(run),
        "without_a_plan": [f"decision of {each.ugv} at t = {each.t_s} s" for each in decisions if not each.planned],
        "rounded_plans": len(rounded),
        "largest_rounding_error_s": max(map(rounding_error_s, rounded), default=0.0),
    }
    slack = partial(_slack, [decision for decision in decisions if decision.planned], claim["evidence"])
    found = Found("holds", 0.0, 1.0, facts).counted(len(decisions))
    return found.judging(slack, "evidence.largest_slack_m", "evidence.plans_with_slack")


def reasons_of(run: Run) -> dict[str, int]:
    """How many decisions have each reason."""
    return dict(Counter(map(str, run.decisions["reason"])))


def rounding_error_s(decision: Decision) -> float:
    """max_k |dt sum_(r <= k) (relaxed_r - rounded_r)|."""
    return float(decision.dt_s * np.abs(np.cumsum(decision.relaxed - decision.rounded)).max())


def _is_rounded_by_the_rule(decision: Decision) -> None:
    """rounded_k = 1 where D_k >= 1/2, D_k = sum_(r <= k) relaxed_r - sum_(r < k) rounded_r."""
    relaxed, rounded, at = decision.relaxed, decision.rounded, _at(decision)
    close("relaxed omega is in [0, 1]", relaxed, np.clip(relaxed, 0.0, 1.0), within=0.0, **at)
    holds("rounded omega is 0 or 1", (rounded == 0.0) | (rounded == 1.0), rounded, "0 or 1", **at)
    deficit = np.cumsum(relaxed) - (np.cumsum(rounded) - rounded)
    tie = np.abs(deficit - 0.5) <= TIE
    holds("sum-up rounding", (rounded == (deficit >= 0.5)) | tie, rounded, (deficit >= 0.5) * 1.0, **at)
    error = rounding_error_s(decision)
    at_most("integrated rounding error", error, decision.dt_s / 2.0, within=TIE * decision.dt_s, **at)
    close("recorded rounding error", decision.row["rounding_deviation_s"], error, within=TIE, **at)
    close("relaxed first stage", decision.row["relaxed_first_stage"], relaxed[0], within=TIE, **at)


def _slack(planned: list[Decision], recorded: Json) -> None:
    """The largest slack of a plan, and how many have any; of one within rounding of none either may be said."""
    slack = [-float(each.gaps_m(each.positions_m).min(initial=np.inf)) for each in planned]
    close("largest slack", recorded["largest_slack_m"], max([0.0, *slack]), within=SMALL)
    least, most = (sum(value > side * SMALL for value in slack) for side in (1.0, -1.0))
    count = recorded["plans_with_slack"]
    holds("plans with slack", type(count) is int and least <= count <= most, count, f"{least} to {most}")


class Answer(NamedTuple):
    """A decision of method (d), as far as its time and its answer go."""

    row: dict[str, Any]

    @property
    def t_s(self) -> float:
        """When."""
        return float(self.row["t_s"])

    @property
    def ugv(self) -> str:
        """Who decides."""
        return str(self.row["robot"])


def _in_time(run: Run) -> Found:
    """Method (d): decisions come when they are due."""
    answers = [Answer(row) for row in rows_of(run)]
    for answer in answers:
        _on_a_proposal(run, answer)
    for ugv in run.ugvs:
        mine = [answer for answer in answers if answer.ugv == ugv]
        _decisions_come_when_due(run, mine)
        _every_proposal_is_decided_on(run, ugv, mine)
    if not answers:
        return Found("holds", facts={"decisions": 0}).counted(0)
    number = len(answers)
    facts = {"decisions": number, "wrong": 0, "reasons": reasons_of(run)}
    return Found("holds", 0.0, 1.0, facts).counted(number)


def _decisions_come_when_due(run: Run, decisions: Sequence[Decision | Answer]) -> None:
    """The first decision on a proposal within a period of it, the others a period apart."""
    period = run.scenario["gatekeeper"]["period_s"]
    last: Decision | Answer | None = None
    for decision in decisions:
        row, at = decision.row, _at(decision)
        if last is None or last.row["issued_s"] != row["issued_s"]:
            at_most("the first decision on a proposal comes within a period", row["t_s"], row["issued_s"] + period,
                    within=SMALL, **at)  # fmt: skip
            at_most("a decision comes after its proposal", row["issued_s"], row["t_s"], within=SMALL, **at)
        else:
            close("decisions follow each other by a period", row["t_s"], last.t_s + period, within=SMALL, **at)
        last = decision


def _at(decision: Decision | Answer, what: str = "") -> Json:
    """Arguments of a rule: of which UGV's decision, when."""
    return {"about": f"decision of {decision.ugv}{what and ', '}{what}", "t_s": decision.t_s}


def _on_a_proposal(run: Run, decision: Decision | Answer) -> None:
    """It is on a proposal that was sent, by the policy that it names, and by the scenario's route."""
    sent = [[event["robot"], event["t_s"], event["policy"]] for event in run.events if event["kind"] == "proposal"]
    named = [decision.ugv, decision.row["issued_s"], decision.row["policy"]]
    holds("the decision is on a proposal", named in sent, named, str(sent), **_at(decision))
    route = run.scenario["gatekeeper"]["route"] if run.method != "d" else ""
    same("route of the decision", decision.row["route"], route, **_at(decision))


def _stage_ends_s(run: Run) -> Array:
    """Ends of the stages after the time of a decision, (N,)."""
    gate = run.scenario["gatekeeper"]
    return gate["horizon_s"] / gate["stages"] * np.arange(1.0, gate["stages"] + 1.0)


def _about_the_situation(run: Run, decision: Decision) -> None:
    """Stages, weights, position and reference are the scenario's and the signals'."""
    gate, at, after = run.scenario["gatekeeper"], _at(decision), _stage_ends_s(run)
    close("length of a stage", decision.dt_s, after[0], within=SMALL, **at)
    same("weight of errors", decision.error_weight_1_m2_s, gate["error_weight_1_m2_s"], **at)
    same("weight of slack", decision.slack_weight_1_m2_s, gate["slack_weight_1_m2_s"], **at)
    same("weight of the terminal cost", decision.terminal_weight_s, gate["terminal_weight_s"], **at)
    close("initial position", decision.initial_m, run.place_m(decision.ugv, decision.t_s), within=SMALL, **at)
    reference = run.presets[decision.ugv].position_m(decision.t_s + after)
    close("reference", decision.reference_m, reference, within=SMALL, **at)


def _about_what_is_sensed(run: Run, decision: Decision) -> None:
    """The points of (26) are what the UGV senses, moving on straight; what is left out is out of reach of any plan."""
    unexplained, left_out = [*range(len(decision.distances_m))], []
    for pair, path in _sensed(run, decision):
        same_point = [
            j
            for j in unexplained
            if abs(decision.distances_m[j] - pair.safe_m) <= SMALL
            and np.abs(decision.centres_m[:, j] - path).max() <= SMALL
        ]
        if same_point:
            unexplained.remove(same_point[0])
        else:
            left_out.append((pair, path))
    strange = decision.centres_m[0, unexplained].tolist()
    holds("points are what the UGV senses", not unexplained, strange, "no other points", **_at(decision))
    for pair, path in left_out:
        _out_of_reach(run, decision, pair, path)


def _sensed(run: Run, decision: Decision) -> Iterator[tuple[Pair, Array]]:
    """What is within sensing range, and where it will be at the ends of the stages, (N, 3), m."""
    here, after = run.place_m(decision.ugv, decision.t_s), _stage_ends_s(run)[:, None]
    held = min(int(np.searchsorted(run.t_s, decision.t_s - SMALL)), len(run.t_s) - 1)
    for pair in run.near_views[decision.ugv]:
        there = run.place_m(pair.other, decision.t_s)
        if np.linalg.norm(there - here) <= run.scenario["control"]["sensing_range_m"]:
            velocity = run.command_m_s[pair.other][held] if pair.other in run.robots else np.zeros(3)
            yield pair, there + after * velocity


def _out_of_reach(run: Run, decision: Decision, pair: Pair, path_m: Array) -> None:
    """No plan comes within the safe distance of what is left out: too far, or above (UGVs keep their height)."""
    modes = np.stack([decision.accept_m_s, decision.refuse_m_s])
    fastest = np.linalg.norm(modes, axis=2).max(axis=0)
    if decision.row["route"] == "rollout":  # between two changes of mode a plan may be as fast as any
        fastest = np.maximum(fastest, run.robots[decision.ugv]["max_speed_m_s"])
    reach = decision.dt_s * np.cumsum(fastest)
    apart = np.linalg.norm(path_m - decision.initial_m, axis=1) - reach
    above = np.abs(path_m[:, 2] - decision.initial_m[2])
    spare = np.maximum(apart, above)
    at_most("what is left out is out of reach", pair.safe_m - spare, 0.0, within=SMALL, **_at(decision, pair.other))
    if decision.planned:
        clear = np.linalg.norm(decision.positions_m - path_m, axis=1)
        at_most(
            "the plan stays clear of what is left out",
            pair.safe_m - clear,
            0.0,
            within=SMALL,
            **_at(decision, pair.other),
        )


def _plan_and_its_positions(decision: Decision) -> None:
    """Omega is 0 or 1; positions are those of (23), for route 'rollout' up to the first change of mode."""
    plan, at = decision.plan, _at(decision)
    holds("omega is 0 or 1", (plan == 0.0) | (plan == 1.0), plan, "0 or 1", **at)
    follows = np.full(decision.stages, True)
    if decision.row["route"] == "rollout":
        follows = np.logical_and.accumulate(plan == plan[0])
    predicted = decision.positions_of(plan)[follows]
    close("positions of the plan, (23)", decision.positions_m[follows], predicted, within=SMALL, **at)
    same("first stage", decision.row["first_stage"], CHOICES[int(plan[0])], **at)


def _costs_and_clearance(decision: Decision) -> None:
    """Costs are those of (25), and the plan is no dearer than the best of the other choice."""
    row, at = decision.row, _at(decision)
    cost = float(decision.cost(decision.positions_m))
    slop = COST * max(cost, LEAST_COST)
    close("objective, (25)", row["objective"], cost, within=slop, **at)
    close("objective of the first stage's choice", row[f"objective_{row['first_stage']}"], cost, within=slop, **at)
    at_most("objective", row["objective"], min(row["objective_accept"], row["objective_refuse"]), within=slop, **at)
    for choice, constant in zip(CHOICES, decision.constant_cost, strict=True):
        slop = COST * max(constant, LEAST_COST)
        close(f"cost of {choice} throughout", row[f"{choice}_throughout"], constant, within=slop, **at)
    clearance = min(float(decision.gaps_m(decision.positions_m).min(initial=np.inf)), 1e9)
    close("predicted clearance", row["predicted_clearance_m"], clearance, within=SMALL, **at)


def _no_faster_than_the_limit(run: Run, decision: Decision) -> None:
    """No step of the plan, or of a constant one, is longer than the speed limit allows, unless it begins inside.

    By (23) a plan has the velocity of a constant one at every stage, so that it counts where that one is.
    """
    limit = run.robots[decision.ugv]["max_speed_m_s"]
    refusing, accepting = decision.constant_m
    clear_refusing = _clear_of_safe_distances(run, decision, refusing)
    clear_accepting = _clear_of_safe_distances(run, decision, accepting)
    ways = [("refusing throughout", refusing, clear_refusing), ("accepting throughout", accepting, clear_accepting)]
    if decision.planned:
        clear = _clear_of_safe_distances(run, decision, decision.positions_m)
        if decision.row["route"] != "rollout":
            clear = np.where(decision.plan == 1.0, clear_accepting, clear_refusing)
        ways.append(("the plan", decision.positions_m, clear))
    for name, positions, clear in ways:
        steps = np.linalg.norm(np.diff(positions, axis=0, prepend=decision.initial_m[None]), axis=1)
        longest = limit * decision.dt_s * (1.0 + SPEED)
        at_most("length of a step", steps[clear], longest, **_at(decision, name))


def _clear_of_safe_distances(run: Run, decision: Decision, positions_m: Array) -> Flags:
    """Stages (N,) in which no control sample is within a safe distance by more than rounding."""
    centres = decision.centres_m
    before = 2.0 * centres[0] - centres[min(1, decision.stages - 1)]
    start = np.linalg.norm(decision.initial_m - before, axis=1) - decision.distances_m
    gaps = decision.gaps_m(positions_m).min(axis=1, initial=np.inf)
    inside = np.append(start.min(initial=np.inf), gaps) < -INSIDE_M
    several_samples = decision.dt_s > run.scenario["control"]["period_s"] + SMALL
    return np.asarray(~(inside[:-1] | (inside[1:] & several_samples)))


def _answers_follow_the_rules(run: Run, decisions: list[Decision]) -> None:
    """While a proposal stands a decision follows every period, and each answer has its reason."""
    gate = run.scenario["gatekeeper"]
    _decisions_come_when_due(run, decisions)
    last: Decision | None = None
    since = 0.0
    for decision in decisions:
        row, at = decision.row, _at(decision)
        if last is not None and last.row["issued_s"] != row["issued_s"]:
            last = None
        standing = None if last is None else last.row["decision"]
        answer = _answer(decision, standing, decision.t_s - since, gate)
        same("answer and its reason", [row["decision"], row["reason"]], list(answer), **at)
        if row["decision"] != standing:
            since = decision.t_s
        last = decision


def _answer(decision: Decision, standing: str | None, stood_s: float, gate: Json) -> tuple[str, str]:
    """Answer and reason by the rules, from the recorded costs.

    Args:
        decision: the decision.
        standing: the answer to this proposal so far, or None.
        stood_s: for how long it has been that.
        gate: the scenario's margins.
    """
    row = decision.row
    if not decision.planned:
        return "refuse", "no_plan"
    first = CHOICES[int(decision.plan[0])]
    if standing is None:
        if first == "refuse":
            return "refuse", "not_cheaper"
        if row["objective"] >= (1.0 - NO_DIFFERENCE) * row["refuse_throughout"]:
            return "refuse", "no_difference"
        return "accept", "cheaper"
    enough = (1.0 - gate["switching_margin"]) * row[f"{standing}_throughout"]
    if first == standing or row["objective"] >= enough:
        return standing, "kept"
    if stood_s < gate["min_dwell_s"] - SMALL:
        return standing, "dwell"
    return ("refuse" if standing == "accept" else "accept"), "reversed"


def _every_proposal_is_decided_on(run: Run, ugv: str, decisions: Sequence[Decision | Answer]) -> None:
    """A proposal that stands for a period of the planner and one of the gatekeeper is decided on.

    It stands while the UGV, or the one that it is to make way for, is intervened on, unless another one replaces it,
    its motion is over or the run ends.
    """
    allowed_s = run.scenario["gatekeeper"]["period_s"] + run.scenario["intervention"]["period_s"] + SMALL
    answered = {decision.row["issued_s"] for decision in decisions}
    sent = [proposal for proposal in proposals_of(run) if proposal.ugv == ugv]
    for proposal in sent:
        issued, until_s = proposal.issued_s, proposal.issued_s + allowed_s
        stays = np.concatenate([run.interventions_s(name) for name in sorted({ugv, proposal.cause})])
        called = ((stays[:, 0] <= issued + SMALL) & (stays[:, 1] > until_s)).any()
        replaced = any(issued < other.issued_s <= until_s for other in sent)
        if called and not replaced and proposal.times_s[-1] > until_s:
            holds("a proposal is decided on", issued in answered, "no decision", "a decision", about=ugv, t_s=issued)
