"""The gatekeeper's decisions as its code has to make them: situations, answers, and the bounds of its routes.

GATE-PLAN judges plans for the problem that was recorded. Here that problem is compared with the run, the answer with
the rules, and what a route says of its own plan with bounds of the optimum.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.scenario.schema import Gatekeeper
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.claims.gate_plan import BLOCKS, Bounded, Enclosure, bound, cheapest_of_blocks
from airground_drake.verify.engines.geometry import travelled
from airground_drake.verify.engines.outlines import Cores, away_from
from airground_drake.verify.runs.control_law import ON_TOP
from airground_drake.verify.runs.gate_record import (
    POSITION_TOLERANCE_M,
    DecisionRecord,
    Deviation,
    cost_tolerance,
    rows_of,
)
from airground_drake.verify.runs.pairs import pairs_beside, preset_of
from oracles.beginnings import movers
from oracles.fault import Fault
from oracles.sensing import place_of, sensed, still_parts

NO_DIFFERENCE = 1e-6
"""Relative gain from which on a new proposal makes a difference."""
OVERSTATED, UNDERSTATED = 1e-5, 1e-3
"""A recorded lower bound may be above the optimum by the first, relative: a solver's primal cost errs by 1e-6 or less.
If it is below it by more than the second, it is not the optimum of the relaxation."""
GAP_TOLERANCE = 1e-6
"""Recorded and recomputed gaps may differ by this."""
LARGEST_GAP = 0.05
"""A plan of a route that searches binary plans may cost so much more than the optimum of the relaxation, of the cheaper
constant plan's cost; where it costs more, no plan of a few blocks of stages may be cheaper than the plan by so much. A
route that rounds promises no such share: its plan costs no more than the rounded one."""
PROVED_ROUTES = ("mixed_integer",)
"""Routes whose bound is the optimum over binary plans."""


def wrong_decisions(trace: Trace) -> list[Fault]:
    """Everything about the decisions of a run under (c) that is not as it should be."""
    if trace.meta["method"] not in ON_TOP:
        return []
    rows = rows_of(trace)
    compared = [one for row in rows for one in compare_situation(trace, row)]
    compared += compare_answers(trace, rows)
    compared += compare_routes(trace, [row for row in rows if row.planned])
    return [Fault(one.what, one.row.robot, one.row.t_s, one.off) for one in compared if one.wrong]


def compare_situation(trace: Trace, row: DecisionRecord) -> Iterator[Deviation]:
    """The data of (26) against the scenario and the signals at the time of the decision."""
    gate = trace.scenario.gatekeeper
    t, robot = row.t_s, row.robot
    after = gate.horizon_s / gate.stages * np.arange(1.0, gate.stages + 1.0)
    yield Deviation(row, "length of a stage, s", row.dt - after[0], TIME_TOLERANCE_S)
    yield Deviation(row, "weight of task errors", row.error_weight - gate.error_weight_1_m2_s, 0.0)
    yield Deviation(row, "weight of slack", row.slack_weight - gate.slack_weight_1_m2_s, 0.0)
    yield Deviation(row, "weight of the terminal cost", row.terminal_weight - gate.terminal_weight_s, 0.0)
    own = place_of(trace, robot, t)
    yield Deviation(row, "initial position, m", row["initial_m"] - own, POSITION_TOLERANCE_M)
    reference = travelled(*preset_of(trace, robot), t + after)
    yield Deviation(row, "reference, m", row["reference_m"] - reference, POSITION_TOLERANCE_M)
    left = list(_beside(trace, row, after))
    for j, distance in enumerate(row["distances_m"]):
        differ = [max(np.abs(of.at - row["centres_m"][:, j]).max(), abs(of.safe - distance)) for of in left]
        nearest = int(np.argmin(differ)) if left else -1
        found = float(differ[nearest]) if left else np.inf
        yield Deviation(row, f"point {j}: nothing that the UGV senses, m", min(found, 1e9), POSITION_TOLERANCE_M)
        if found <= POSITION_TOLERANCE_M:
            left.pop(nearest)
    fastest = np.linalg.norm(np.stack([row["accept_m_s"], row["refuse_m_s"]]), axis=2).max(axis=0)
    reach = row.dt * np.cumsum(fastest)
    for of in left:
        lacking = np.minimum(of.safe + reach - of.apart(own), of.safe - of.above(float(own[2]))).max()
        if row.planned:
            lacking = max(lacking, (of.safe - of.apart(row["positions_m"])).max())
        yield Deviation(row, f"{of.name} is left out though within reach, m", max(0.0, lacking), POSITION_TOLERANCE_M)


class _Beside(NamedTuple):
    """What a UGV senses: its name, its points in (26) (N, 3), m, its safe distance, m, and its cores, (1,) or (N,)."""

    name: str
    at: Array
    safe: float
    cores: Cores

    def apart(self, place: Array) -> Array:
        """Distances of a place, or of one for each stage, (1,) or (N,), m."""
        return away_from(self.cores, place, planar=True).distance

    def above(self, height: float) -> Array:
        """How far a height is from those of the cores, (1,) or (N,), m: UGVs keep their height."""
        return np.abs(height - np.clip(height, self.cores.base, self.cores.top))


def _beside(trace: Trace, row: DecisionRecord, after: Array) -> Iterator[_Beside]:
    """What a UGV senses at a decision. Of a core, (26) has the points nearest to the way without intervention."""
    there, parts, pairs = sensed(trace, row.robot, row.t_s, after), still_parts(trace), pairs_beside(trace, row.robot)
    refused = row.constant[0]
    for k in there.parts.tolist():
        core, name = parts.cores.take(slice(k, k + 1)), parts.names[parts.owner[k]]
        yield _Beside(name, _nearest(core, refused), pairs[name].law_m, core)
    for pair, places in zip(there.robots, there.places, strict=True):
        yield _Beside(pair.second if pair.first == row.robot else pair.first, places, pair.law_m, Cores.at(places))
    for pair, core, places, _ in movers(trace, row.robot, row.t_s, after):
        moved = Cores(core.corners + places[:, None, :2], core.base + places[:, 2], core.top + places[:, 2])
        yield _Beside(pair.second, _nearest(moved, refused), pair.law_m, moved)


def _nearest(cores: Cores, way: Array) -> Array:
    """The point of a core, or of one core for each place, that is nearest to each place of a way (N, 3), m: (N, 3)."""
    if cores.are_points:
        return np.broadcast_to(cores.points, way.shape)
    away = away_from(cores, way, planar=True)
    return way - away.distance[:, None] * away.normal


def compare_answers(trace: Trace, rows: Sequence[DecisionRecord]) -> Iterator[Deviation]:
    """The answers against the rules, decision by decision."""
    gate, since = trace.scenario.gatekeeper, 0.0
    for row, last in in_turn(trace, rows):
        standing = None if last is None else str(last.given["decision"])
        accept, reason = rule(row, standing, row.t_s - since, gate)
        ours, theirs = ("accept" if accept else "refuse", reason), (row.given["decision"], row.given["reason"])
        yield Deviation(row, "answer or reason", float(ours != theirs), 0.0)
        since = since if row.given["decision"] == standing else row.t_s


def rule(row: DecisionRecord, standing: str | None, stood: float, gate: Gatekeeper) -> tuple[bool, str]:
    """Whether a proposal is accepted and why, from the recorded costs."""
    given = row.given
    if not row.planned:
        return False, "no_plan"
    if gate.rule == "first_stage":  # of the rounded plan, whatever stands; of the plan if none was rounded
        plan = row["plan"] if row.data["rounded"] is None else row["rounded"]
        return bool(plan[0] == 1.0), "first_stage"
    if standing is None:
        gains = given["objective"] < (1.0 - NO_DIFFERENCE) * given["refuse_throughout"]
        if row["plan"][0] != 1.0:
            return False, "waits" if gains else "not_cheaper"
        return gains, "cheaper" if gains else "no_difference"
    accepted = standing == "accept"
    enough = (1.0 - gate.switching_margin) * given[f"{standing}_throughout"]
    cheaper = (row["plan"][0] == 1.0) != accepted and given["objective"] < enough
    if not cheaper:
        return accepted, "kept"
    if stood < gate.min_dwell_s - TIME_TOLERANCE_S:
        return accepted, "dwell"
    return not accepted, "reversed"


def compare_routes(trace: Trace, planned: Sequence[DecisionRecord]) -> Iterator[Deviation]:
    """What the shipped routes promise of their plans: no constant plan is cheaper, and bounds and gaps are right."""
    blocks = int(trace.scenario.gatekeeper.blocks)
    for row in planned:
        for name, constant in zip(("refuse", "accept"), row.cost(row.constant).tolist(), strict=True):
            for column in ("objective", f"objective_{name}"):
                excess = max(0.0, row.given[column] - constant)
                yield Deviation(row, f"{column} above {name} throughout", excess, cost_tolerance(constant))
        if row.data["rounded"] is not None:
            rounded = float(row.cost(row.positions(row["rounded"])))
            excess = max(0.0, row.given["objective"] - rounded)
            yield Deviation(row, "objective above the rounded plan's", excess, cost_tolerance(rounded))
        if row.given["route"] in PROVED_ROUTES:
            arrays = [name for name in ("relaxed", "rounded") if row.data[name] is not None]
            numbers = [row.given[name] + 1.0 for name in ("rounding_deviation_s", "relaxed_first_stage")]
            yield Deviation(row, "a relaxation that the route has not", [len(arrays), *numbers], 0.0)
        if row.given["route_bound"] != -1.0 and row.given["status"] == "optimal":
            yield Deviation(row, "a bound without unit normals", float(not row.unit_normals), 0.0)
    for each in bound([row for row in planned if row.given["route_bound"] != -1.0 and row.unit_normals], blocks):
        yield from compare_bounds(each.row, each.optimum, blocks)
        if each.gap > LARGEST_GAP and not blocks and each.row.given["route"] in PROVED_ROUTES:
            yield compare_with_blocks(each)


def compare_bounds(row: DecisionRecord, found: Enclosure, blocks: int) -> Iterator[Deviation]:
    """The recorded lower bound and gap; `blocks`: binaries of the route, 0: one per stage."""
    given, normals = row.given, row.half_planes
    proved = given["route"] in PROVED_ROUTES
    lower, scale = float(given["route_bound"]), row.scale
    own = float(row.cost(row["positions_m"], normals))
    known = [*row.constant, *([row.positions(row["rounded"])] if row.data["rounded"] is not None else [])]
    # the losing choice's plan is not recorded, but along normals it costs no less than by exact distances
    loser = max(given["objective_accept"], given["objective_refuse"])
    best = min(own, loser, *(float(row.cost(positions, normals)) for positions in known))
    upper = found.upper
    if proved:  # the optimum may be another plan, which exact distances make no cheaper than the one recorded
        best = min(best, given["objective"])
        upper = float(row.cost(row.positions(neighbours(row["plan"], blocks)), normals).min())
    yield Deviation(row, "lower bound above the plan's cost", max(0.0, lower - own) / scale, OVERSTATED)
    yield Deviation(row, "lower bound overstated", max(0.0, lower - upper) / scale, OVERSTATED)
    if given["status"] == "optimal":
        short = max(0.0, found.lower - lower) / scale
        yield Deviation(row, "lower bound understated", short, UNDERSTATED)
    if given["status"] == "optimal" and proved:
        yield Deviation(row, "optimal, but with a gap", max(0.0, given["gap"]), GAP_TOLERANCE)
    least, most = ((cost - lower) / max(cost, 1e-12) for cost in (best, own))
    beyond = max(0.0, least - given["gap"], given["gap"] - most)
    yield Deviation(row, "recorded gap", beyond, GAP_TOLERANCE)


def compare_with_blocks(each: Bounded) -> Deviation:
    """A gap that is too wide is wrong only if the route's problem has a cheaper plan."""
    row = each.row
    shown = (float(row.cost(row["positions_m"])) - cheapest_of_blocks(row, BLOCKS).lower) / row.scale
    return Deviation(row, "a plan of blocks is cheaper", max(0.0, shown), LARGEST_GAP)


def neighbours(plan: Array, blocks: int) -> Array:
    stages = len(plan)
    count = min(blocks or stages, stages)
    turned = np.arange(stages) * count // stages == np.arange(count)[:, None]
    return np.vstack([plan, np.where(turned, 1.0 - plan, plan), np.zeros(stages), np.ones(stages)])


def in_turn(trace: Trace, rows: Sequence[DecisionRecord]) -> Iterator[tuple[DecisionRecord, DecisionRecord | None]]:
    """Each decision, by UGV and time, with the one before it on the same proposal, if there is one."""
    for ugv in trace.ugvs:
        last: DecisionRecord | None = None
        for row in (row for row in rows if row.robot == ugv):
            yield row, last if last and last.number == row.number else None
            last = row
