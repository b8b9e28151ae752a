"""LIVE-GOAL and COMM: what a run achieved, and what it spent on messages and computation."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from itertools import pairwise

import numpy as np

from .files import Json
from .proposals import answers_of, proposals_of, taken_back_s
from .rules import SMALL, Array, Found, at_most, holds, same
from .run import Run

AT_REST_S = 1.0
"""A stalled UGV must have stood still for this long at the end."""
AT_REST_M = 1e-3
"""Standing still: no farther than this from the end."""


def live_goal(run: Run, claim: Json) -> Found:
    """LIVE-GOAL: every robot ended at its target, or standing where the scenario declares that it stalls."""
    conditions = [*_ends(run)]
    margin = min(float(entry["margin_m"]) for entry in conditions)
    found = Found.with_margin("holds" if margin >= 0.0 else "refuted", margin, conditions=conditions)
    farther = {
        robot: float(np.linalg.norm(run.position_m[robot][0] - place)) - near for robot, place, near in _goals(run)
    }
    least, most = ([robot for robot in farther if farther[robot] > side * SMALL] for side in (1.0, -1.0))
    went = partial(_had_a_way_to_go, claim["evidence"]["had_a_way_to_go"], least, most)
    found = found.counted(len(least), len(most)).judging(went, "evidence.had_a_way_to_go")
    shown = (f"counterexample.{key}" for key in CONDITION)
    return found.judging(partial(_worst_end, claim, margin), "where.robot", "where.condition", *shown)


def _had_a_way_to_go(recorded: list[str], least: list[str], most: list[str]) -> None:
    """Those who were farther than the tolerance from where they must end; rounding may decide."""
    possible = {*least} <= {*recorded} and recorded == [robot for robot in most if robot in recorded]
    holds("who had a way to go", possible, str(recorded), str(most))


CONDITION = ("robot", "condition", "point_m", "final_m", "distance_m", "moved_m", "margin_m")
"""What is recorded of a condition on the end of a robot."""


def _worst_end(claim: Json, margin_m: float) -> None:
    """Where the margin is attained, and the counterexample if it is negative, is a condition of least margin."""
    where, shown = claim["where"], claim["counterexample"]
    listed = [entry for entry in claim["evidence"]["conditions"] if entry["margin_m"] <= margin_m + SMALL]
    places = [{key: entry[key] for key in ("robot", "condition")} for entry in listed]
    holds("where the margin is attained", where in places, str(where), str(places))
    if shown:
        holds("counterexample", shown == listed[places.index(where)], str(shown), "the condition of least margin")


def _goals(run: Run) -> Iterator[tuple[str, Array, float]]:
    """Robot, where it must end, and the tolerance, m."""
    scenario = run.scenario
    stalls, arrival = scenario["runs"][run.name]["stalls_m"], scenario["arrival_tolerance_m"]
    for ugv in run.ugvs:
        if ugv in stalls:
            yield ugv, np.array(stalls[ugv]), scenario["stall_tolerance_m"]
        else:
            yield ugv, np.array(scenario["ugvs"][ugv]["target_m"]), arrival
    yield run.uav, _above_the_centroid_m(run) if stalls else np.array(scenario["uav"]["target_m"]), arrival


def _above_the_centroid_m(run: Run) -> Array:
    """The place at the flight altitude above the centroid of the UGVs at the end, (3,)."""
    centroid = np.mean([run.position_m[ugv][-1] for ugv in run.ugvs], axis=0)
    return np.asarray(centroid + np.array([0.0, 0.0, run.scenario["uav"]["altitude_m"]]))


def _ends(run: Run) -> Iterator[Json]:
    """What is recorded of each condition, in the order of the report."""
    scenario = run.scenario
    stalls, arrival = scenario["runs"][run.name]["stalls_m"], scenario["arrival_tolerance_m"]
    for ugv in run.ugvs:
        target = np.array(scenario["ugvs"][ugv]["target_m"])
        if ugv in stalls:
            yield _end(run, ugv, "at its stall point", np.array(stalls[ugv]), scenario["stall_tolerance_m"])
            moved = _moved_at_the_end_m(run, ugv)
            yield {"robot": ugv, "condition": "stands", "moved_m": moved, "margin_m": AT_REST_M - moved}
            short = float(np.linalg.norm(run.position_m[ugv][-1] - target))
            yield {"robot": ugv, "condition": "short of its target", "margin_m": short - arrival}
        else:
            yield _end(run, ugv, "at its target", target, arrival)
    if stalls:
        yield _end(run, run.uav, "over the centroid of the UGVs", _above_the_centroid_m(run), arrival)
    else:
        yield _end(run, run.uav, "at its target", np.array(scenario["uav"]["target_m"]), arrival)


def _end(run: Run, robot: str, condition: str, point_m: Array, tolerance_m: float) -> Json:
    """That a robot ended within a tolerance of a point."""
    final = run.position_m[robot][-1]
    distance = float(np.linalg.norm(final - point_m))
    places = {"point_m": point_m.tolist(), "final_m": final.tolist()}
    return {
        "robot": robot, "condition": condition, **places, "distance_m": distance, "margin_m": tolerance_m - distance,
    }  # fmt: skip


def _moved_at_the_end_m(run: Run, robot: str) -> float:
    """Largest distance from the end during the last second; it is convex between rows."""
    begin = max(float(run.t_s[-1]) - AT_REST_S, float(run.t_s[0]))
    places = np.vstack([run.place_m(robot, begin), run.position_m[robot][run.t_s >= begin]])
    return float(np.linalg.norm(places - places[-1], axis=1).max())


def comm(run: Run, claim: Json) -> Found:
    """COMM: proposals and decisions only while their UGV or their cause is intervened on, and not too many of them.

    Too many are more than an always-on scheme has.

    The UAV withdraws its proposal at its next planning instant after a release, and the gatekeeper notices at its next
    sample: hence the allowance of one period each.
    """
    planning_s, gating_s = run.scenario["intervention"]["period_s"], run.scenario["gatekeeper"]["period_s"]
    gated = run.method in ("c", "d")
    _messages_are_to_ugvs(run)
    for ugv in run.ugvs:
        decided = decided_s(run, ugv)
        _decisions_are_on_proposals(run, ugv)
        sent = run.times_s(ugv, "proposal")
        _no_strays(run, ugv, "proposal", sent, sent, planning_s + gating_s)
        issued = run.decisions.loc[run.decisions["robot"] == ugv, "issued_s"].to_numpy(dtype=np.float64)
        _no_strays(run, ugv, "decision", decided, issued, planning_s + gating_s)
        silent = not len(run.times_s(ugv, "proposal")) or (gated and not len(decided))
        if silent and run.talk_is_due(ugv):
            return Found("not_run")
        _proposals_stand_as_long_as_they_must(run, ugv)
    _obstacles_are_what_the_uav_knew(run)
    proposals = sum(event["kind"] == "proposal" for event in run.events)
    before, n = run.scenario["duration_s"] - SMALL, len(run.ugvs)  # the first instant is at 0
    spent = {"proposal": proposals, "decision": len(run.decisions)}
    always_on = {
        "proposal": n * math.ceil(before / planning_s),
        "decision": n * math.ceil(before / gating_s) if gated else 0,
    }
    saved = {kind: 1.0 - spent[kind] / most for kind, most in always_on.items() if most}
    status = "holds" if all(spent[kind] <= most for kind, most in always_on.items()) else "refuted"
    per_ugv = {
        ugv: {
            "proposal": len(run.times_s(ugv, "proposal")),
            "decision": len(decided_s(run, ugv)),
            "intervals_s": run.interventions_s(ugv).tolist(),
        }
        for ugv in run.ugvs
    }
    facts: Json = {"spent": spent, "always_on": always_on, "saved": saved, "ugvs": per_ugv, "outside_interventions": []}
    found = Found.with_margin(status, min(saved.values()), **facts) if saved else Found(status, facts=facts)
    over = {"spent": spent, "always_on": always_on} if status == "refuted" else None
    shown = partial(same, "counterexample", claim["counterexample"], over)
    return found.counted(proposals).judging(shown, "counterexample")


def decided_s(run: Run, ugv: str) -> Array:
    """Times of the decisions on a UGV's proposals."""
    return run.decisions.loc[run.decisions["robot"] == ugv, "t_s"].to_numpy(dtype=np.float64)


def _messages_are_to_ugvs(run: Run) -> None:
    named = {event["robot"] for event in run.events if event["kind"] == "proposal"} | {*run.decisions["robot"]}
    same("messages are to UGVs", sorted(named - {*run.ugvs}), [])


def _decisions_are_on_proposals(run: Run, ugv: str) -> None:
    mine = run.decisions[run.decisions["robot"] == ugv]
    issued, when = mine["issued_s"].to_numpy(dtype=np.float64), mine["t_s"].to_numpy(dtype=np.float64)
    known = np.isin(issued, run.times_s(ugv, "proposal"))
    holds("decisions are on proposals", known, issued, "the time of a proposal", about=ugv, t_s=when)


def _no_strays(run: Run, ugv: str, kind: str, times_s: Array, issued_s: Array, allowance_s: float) -> None:
    """Messages on proposals issued at some times are within a stay in mode 'intervening' of the UGV or of a cause."""
    causes = {(p.ugv, p.issued_s): p.cause for p in proposals_of(run)}
    stays = {name: run.interventions_s(name) for name in run.ugvs}
    inside = []
    for when, issued in zip(times_s.tolist(), issued_s.tolist(), strict=True):
        concerned = {ugv, causes.get((ugv, issued), ugv)}
        inside.append(
            any(
                begin - SMALL <= when <= end + allowance_s + SMALL
                for name in concerned
                for begin, end in stays[name].tolist()
            )
        )
    holds(f"a {kind} only during interventions", np.array(inside, bool), times_s, "during one", about=ugv, t_s=times_s)


def _proposals_stand_as_long_as_they_must(run: Run, ugv: str) -> None:
    """None is decided on once it is taken back; one in force is replaced only where joint plans may be the reason."""
    mine, answers = [p for p in proposals_of(run) if p.ugv == ugv], answers_of(run, ugv)
    ends_s = {p.issued_s: taken_back_s(run, p, mine, answers) for p in mine}
    for when, issued, _ in answers:
        at_most("a decision before the proposal is taken back", when, ends_s.get(issued, np.inf), about=ugv, t_s=when)
    sent_s = [p.issued_s for p in proposals_of(run)]
    for before, after in pairwise(mine):
        now = after.issued_s + SMALL
        over = before.times_s[-1] <= now or taken_back_s(run, before, [before], answers) <= now + SMALL
        joint = max(sent_s.count(p.issued_s) for p in (before, after)) > 1 or after.cause != ugv
        holds("a proposal stands until it is over", over or joint, after.policy, before.policy, about=ugv, t_s=now)


def _obstacles_are_what_the_uav_knew(run: Run) -> None:
    """Beyond its own map: all that UGVs sensed at refusals that it has noticed, and nothing that no UGV has told it.

    It notices the last answer to a proposal before that is taken back.
    """
    obstacles = [*run.scenario["obstacles"].values()]
    known = {(*map(float, o["position_m"]), float(o["radius_m"])) for o in obstacles if o["known_to_uav"]}
    known |= {(*map(float, place), 0.0) for place in run.scenario["uav"]["phantoms_m"]}
    surely: list[tuple[float, set[tuple[float, ...]]]] = []
    perhaps: list[tuple[float, set[tuple[float, ...]]]] = []
    for proposal in proposals_of(run):
        mine, answers = [p for p in proposals_of(run) if p.ugv == proposal.ugv], answers_of(run, proposal.ugv)
        end = taken_back_s(run, proposal, mine, answers)
        on_it = [(when, yes) for when, issued, yes in answers if issued == proposal.issued_s]
        perhaps += [(when, _sensed(run, proposal.ugv, when, SMALL)) for when, yes in on_it if not yes]
        before = [(when, yes) for when, yes in on_it if when < end - 2.0 * SMALL]
        if before and not before[-1][1] and np.isfinite(end):
            surely.append((end, _sensed(run, proposal.ugv, before[-1][0], -SMALL)))
    for proposal in proposals_of(run):
        if ":" in proposal.policy:
            continue
        t, about = proposal.issued_s, f"proposal to {proposal.ugv}"
        rows = np.column_stack([proposal.mapped_m, proposal.mapped_radius_m]).tolist()
        said = {tuple(row) for row in rows} - known
        least = {disc for end, discs in surely if end <= t + 2.0 * SMALL for disc in discs} - known
        most = {disc for when, discs in perhaps if when < t - SMALL for disc in discs} - known
        holds("obstacles that the UAV knows of", least <= said <= most, str(said), str(least), about=about, t_s=t)


def _sensed(run: Run, ugv: str, t_s: float, margin_m: float) -> set[tuple[float, ...]]:
    """Obstacles, centre and radius, within sensing range and a margin of a UGV."""
    reach, here = run.scenario["control"]["sensing_range_m"] + margin_m, run.place_m(ugv, t_s)
    discs = [(*map(float, o["position_m"]), float(o["radius_m"])) for o in run.scenario["obstacles"].values()]
    return {disc for disc in discs if np.linalg.norm(here - np.array(disc[:3])) <= reach}
