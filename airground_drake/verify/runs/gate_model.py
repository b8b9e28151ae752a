"""GATE-MODEL: what the data of the gatekeeper's problems are worth: predictions rolled out again, what came of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.arrays import Array
from airground_drake.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.segments import interpolate, travelled
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.control_law import (
    ON_TOP,
    Asked,
    Inequalities,
    avoiding,
    inequalities,
    intervened,
    tracking,
)
from airground_drake.verify.runs.control_samples import control_samples
from airground_drake.verify.runs.gate_record import GateClaim, Off, Row, conclude
from airground_drake.verify.runs.outcome_rolls import foreseen
from airground_drake.verify.runs.pairs import pairs_of
from airground_drake.verify.runs.proposals import Sent, accepted_at, proposals_of

VELOCITY_TOLERANCE_M_S = 1e-6
"""Recorded and recomputed mode velocities may differ by this, m/s: rounding of two algorithms, which the closed loop
damps; a corner of nearly parallel inequalities enlarges it."""
OUTCOME_TOLERANCE = 1e-6
"""Recorded and recomputed outcomes may differ by this, relative, or in m^2 s: they are sums over such velocities."""
LEFT_TOLERANCE_M = 1e-3
"""A recorded way may be outside its bounds by this, m, or by `OUTCOME_TOLERANCE` of it: the recomputed end is not quite
the recorded one."""
BLOCKS = 6
"""Of stages, for each of which the plans that a decision's plan is compared with choose a mode."""
MOST_REGRETS = 12
"""Decisions of a run whose plans are compared with all of these on the closed loop."""
FAR_M = 1e9
"""Where the points of no meaning are that make all scenes have as many."""


class Scenes(NamedTuple):
    """What B decisions predict from: their closed loops, over S control periods, with K points each.

    Attributes:
        start: (B, 3), m.
        preset: at the control samples, (B, S + 1, 3), m.
        wanted: the proposed motion, the same.
        chosen: J_int^+ J_int, (B, 3, 3).
        centres: points to keep away from at the beginning, (B, K, 3), m.
        velocities: of those points, (B, K, 3), m/s.
        safe: distances d, (B, K), m.
        share: of the inequalities, (B, K).
        limit: speed limits, (B,), m/s.
    """

    start: Array
    preset: Array
    wanted: Array
    chosen: Array
    centres: Array
    velocities: Array
    safe: Array
    share: Array
    limit: Array


class Ways(NamedTuple):
    """Where B closed loops lead: positions at the ends of N stages, m, and their mean velocities, m/s, (B, N, 3)."""

    positions: Array
    velocities: Array


class GateModel(GateClaim):
    """GATE-MODEL."""

    id = "GATE-MODEL"
    summary = "What the gatekeeper predicted for yes and for no is what the UGV would have done."
    statement = (
        "The mode velocities that every gatekeeper decision rests on are those of the UGV's closed loop, "
        "with the proposal accepted throughout and refused throughout, rolled out again from what it sensed."
    )
    formula = (
        "a_k, b_k = mean velocity over stage k of rho+ = rho + h law(rho; accepted | refused), rho(0) = p(t), others "
        "at their velocities at t; |recorded - recomputed| <= 1e-6 m/s"
    )
    latex = (
        r"\rho^+ = \rho + h \, \text{law}(\rho; \text{accepted or refused}), \quad \rho(0) = p(t)",
        r"a_k, b_k = \text{mean velocity over stage } k, \quad |\text{recorded} - \text{recomputed}| \le "
        r"10^{-6} \text{ m/s}",
    )
    method = (
        "The control law in numpy as for EXEC, with code of its own, from the signals, the scenario and the table of "
        "proposals, all decisions side by side. Reported besides, and never a reason to refute: by how much a UGV was "
        "elsewhere than predicted while its answer stood; and the regret of chosen plans, "
        "rolled out on the closed loop, against the constant plans and all plans of 6 blocks, for at most 12 decisions "
        "(the first on each proposal, reversals, then evenly spaced), in units of the cheaper constant plan's cost."
    )
    equations = "(23), (25)"
    assumptions = (
        "A UGV predicts with what is within sensing range when it decides, moving on as it does then.",
        "In a prediction the rates of preset and proposed motion are those of the motion sampled every control period.",
    )
    does_not_establish = (
        "That the run went as predicted: others turn, and what is out of sight is left out; the largest difference is "
        "reported. For plans that change their mode (23) adds velocities of two different ways and is an "
        "approximation: the regret says how good its plans are on the closed loop, among few others, not against all "
        "2^N."
    )

    exercised_by = "decisions that were rolled out again"

    def judge_rows(self, trace: Trace, rows: list[Row]) -> Finding:
        """Roll out both choices of every decision; the margin is the tolerance less the largest difference."""
        if trace.meta["method"] not in ON_TOP:
            return judge_outcomes(trace, rows)
        sent = proposals_of(trace)
        scenes = scenes_of(trace, rows, sent)
        compared = []
        largest = 0.0
        constant, telling = np.tile(np.arange(len(rows)), 2), _telling(rows)
        modes = np.repeat([0.0, 1.0], len(rows))[:, None] * np.ones(len(rows[0]["reference_m"]))
        plans = [np.concatenate([rows[k]["plan"][None], _plans_of_blocks(len(modes[0]))]) for k in telling]
        of = np.concatenate([constant, np.repeat(telling, 1 + 2**BLOCKS)])
        ways = roll_out(trace, scenes, of, np.concatenate([modes, *plans]))
        for k, row in enumerate(rows):
            for name, at in (("refuse", k), ("accept", len(rows) + k)):
                off = row[f"{name}_m_s"] - ways.velocities[at]
                largest = max(largest, float(np.abs(off).max()))
                compared.append(Off(row, f"velocity of mode {name}, m/s", off, VELOCITY_TOLERANCE_M_S))
        evidence = {"decisions": len(rows), "largest_difference_m_s": largest}
        finding = Finding(
            "holds",
            margin=VELOCITY_TOLERANCE_M_S - largest,
            unit="m/s",
            quantity="tolerance left by which a predicted velocity may differ from the closed loop's",
            evidence=evidence
            | _realised(trace, rows)
            | _regrets([rows[k] for k in telling], ways.positions[len(constant) :]),
            exercised=len(rows),
        )
        return conclude(finding, compared)


def judge_outcomes(trace: Trace, rows: Sequence[Row]) -> Finding:
    """Method (d): what comes of either choice, rolled out again for every first decision about a proposal."""
    sent, compared, largest = proposals_of(trace), list[Off](), 0.0
    speeds = {ugv: trace.scenario["ugvs"][ugv]["preset"]["speed_m_s"] for ugv in trace.ugvs}
    looked = [row for row in rows if row.given["accept_stalls"] >= 0.0]
    for row in looked:
        for choice, found in zip(("refuse", "accept"), foreseen(trace, row.given, sent), strict=True):
            cost, left = (float(row.given[f"{choice}_{name}"]) for name in ("outcome_m2_s", "left_m"))
            ahead = left**3 / (3.0 * speeds[str(row.given["robot"])])
            due = ahead if found.stalls else found.integral_m2_s + ahead
            compared.append(Off(row, f"{choice}: stalls", row.given[f"{choice}_stalls"] - float(found.stalls), 0.0))
            allowed = OUTCOME_TOLERANCE * max(1.0, due)
            compared.append(Off(row, f"{choice}: outcome, m^2 s", cost - due, allowed, recomputed=due, recorded=cost))
            largest = max(largest, abs(cost - due) / allowed)
            short = max(0.0, found.least_left_m - left, left - found.most_left_m)
            within = max(LEFT_TOLERANCE_M, OUTCOME_TOLERANCE * left)
            compared.append(Off(row, f"{choice}: way left, m", short, within, recorded=left))
    finding = Finding(
        "holds",
        margin=1.0 - largest,
        unit="of the tolerance",
        quantity="part left of the tolerance of a recorded outcome",
        evidence={"decisions": len(rows), "outcomes": 2 * len(looked)},
        exercised=len(looked),
    )
    return conclude(finding, compared)


def scenes_of(trace: Trace, rows: Sequence[Row], sent: Sequence[Sent]) -> Scenes:
    """What each decision predicts from, by the signals at its time."""
    scenario, control = trace.scenario, trace.scenario["control"]
    stages = len(rows[0]["reference_m"])
    steps = stages * round(scenario["gatekeeper"]["horizon_s"] / stages / control["period_s"])
    known = {one.number: one for one in sent}
    pairs = list(pairs_of(trace))
    parts: list[list[Array]] = []
    for row in rows:
        t, robot = float(row.given["t_s"]), str(row.given["robot"])
        proposal = known[row.given["number"]]
        spec = scenario["ugvs"][robot]
        after = t + control["period_s"] * np.arange(steps + 1.0)
        here = interpolate(trace.t, trace.position(robot), t)
        around = [pair for pair in pairs if robot in (pair.first, pair.second)]
        things = [_thing(trace, pair.second if pair.first == robot else pair.first, t) for pair in around]
        centres, velocities = (np.array([thing[k] for thing in things]).reshape(-1, 3) for k in (0, 1))
        unseen = np.linalg.norm(centres - here, axis=1) > control["sensing_range_m"]
        centres[unseen], velocities[unseen] = FAR_M, 0.0
        corners = np.asarray(spec["preset"]["waypoints_m"], dtype=np.float64)
        parts.append([
            here, travelled(corners, spec["preset"]["speed_m_s"], after), proposal.place(after), proposal.chosen,
            centres, velocities, np.array([pair.safe_m for pair in around]), np.array([pair.share for pair in around]),
            np.array(spec["max_speed_m_s"]),
        ])  # fmt: skip
    return Scenes(*(np.stack(part) for part in zip(*parts, strict=True)))


def _thing(trace: Trace, name: str, t: float) -> tuple[Array, Array]:
    """Where an obstacle or a robot is at a time, (3,), m, and its velocity up to then, (3,), m/s."""
    if name not in trace.robots:
        return np.asarray(trace.scenario["obstacles"][name]["position_m"], dtype=np.float64), np.zeros(3)
    row = min(int(np.searchsorted(trace.t, t - TIME_TOLERANCE_S)), len(trace.t) - 1)
    return interpolate(trace.t, trace.position(name), t), trace.command(name)[row]


def roll_out(trace: Trace, scenes: Scenes, of: npt.NDArray[np.intp], plans: Array) -> Ways:
    """Closed loops under plans (B, N) of 0 (refused) and 1 (accepted), each from the scene of a decision, `of` (B,).

    As long as plans of one decision agree, so do their ways, which are then one.
    """
    control, composition = trace.scenario["control"], trace.meta["composition"]
    on_top, h = trace.meta["method"] in ON_TOP, control["period_s"]
    steps, stages = scenes.preset.shape[1] - 1, plans.shape[1]
    each = steps // stages
    way, position = of, scenes.start
    positions, velocities = np.empty((len(plans), stages, 3)), np.empty((len(plans), stages, 3))
    for stage in range(stages):
        parted, first, way = np.unique(2 * way + (plans[:, stage] == 1.0), return_index=True, return_inverse=True)
        position, row, accepted = position[parted // 2], of[first], parted % 2 == 1
        mean = np.zeros_like(position)
        for k in range(stage * each, (stage + 1) * each):
            centres = scenes.centres[row] + k * h * scenes.velocities[row]
            given = inequalities(position, centres, scenes.safe[row], scenes.share[row], control, planar=True)
            preset, rate = scenes.preset[row, k], (scenes.preset[row, k + 1] - scenes.preset[row, k]) / h
            own = tracking(position, preset, rate, control["motion_gain_1_s"], scenes.limit[row])
            velocity = avoiding(own, given, composition, planar=True)
            if accepted.any():
                here = row[accepted]
                wanted = scenes.wanted[here, k]
                asked = Asked(wanted, (scenes.wanted[here, k + 1] - wanted) / h, scenes.chosen[here])
                lower = (velocity if on_top else own)[accepted]
                gain = control["intervention_gain_1_s"]
                task = intervened(position[accepted], lower, asked, gain, scenes.limit[here])
                bounds = Inequalities(given.normal[accepted], given.bound[accepted])
                velocity[accepted] = task if on_top else avoiding(task, bounds, composition, planar=True)
            position = position + h * velocity
            mean += velocity / each
        positions[:, stage], velocities[:, stage] = position[way], mean[way]
    return Ways(positions, velocities)


def _realised(trace: Trace, rows: Sequence[Row]) -> dict[str, Any]:
    """By how much UGVs were elsewhere than predicted while the answer stood."""
    t = trace.t[control_samples(trace.t, trace.scenario["control"]["period_s"])]
    accepted = {ugv: accepted_at(trace, ugv) for ugv in trace.ugvs}
    farthest: dict[str, Any] = {}
    stood = 0
    for row in rows:
        begin, ugv = float(row.given["t_s"]), str(row.given["robot"])
        yes = row.given["decision"] == "accept"
        due = row.given["number"] if yes else None
        first = int(np.searchsorted(t, begin - TIME_TOLERANCE_S))
        numbers = [None if one is None else one.number for one in accepted[ugv][first:]]
        other = next((k for k, found in enumerate(numbers) if found != due), None)
        until = min(float(trace.t[-1]), float(t[first + other]) if other is not None else np.inf)
        ends = begin + row.dt * np.arange(1.0, len(row["reference_m"]) + 1.0)
        stood += bool(ends[-1] <= until + TIME_TOLERANCE_S)
        ends = ends[ends <= until + TIME_TOLERANCE_S]
        went = interpolate(trace.t, trace.position(ugv), ends)
        away = np.linalg.norm(went - row.constant[int(yes)][: len(ends)], axis=1)
        if away.max(initial=0.0) >= farthest.get("away_m", 0.0) and len(ends):
            k = int(np.argmax(away))
            farthest = {"robot": ugv, "t_s": begin, "decision": str(row.given["decision"])}
            farthest |= {"away_m": float(away[k]), "after_s": float(ends[k] - begin)}
    return {"answers_that_stood_to_the_horizon": stood, "farthest_from_predicted": farthest}


def _telling(rows: Sequence[Row]) -> npt.NDArray[np.intp]:
    """Numbers of the decisions whose regret is looked at: the first on each proposal, reversals, others in between."""
    planned = [k for k, row in enumerate(rows) if row.planned]
    seen: set[Any] = set()
    telling = []
    for k in planned:
        key = rows[k].given["number"]
        if key not in seen or rows[k].given["reason"] == "reversed":
            telling.append(k)
        seen.add(key)
    rest = [k for k in planned if k not in telling]
    spare = max(0, MOST_REGRETS - len(telling))
    spaced = np.linspace(0, len(rest) - 1, min(spare, len(rest))).round().astype(int) if rest and spare else ()
    return np.array([*telling[:MOST_REGRETS], *(rest[k] for k in dict.fromkeys(spaced))], dtype=np.intp)


def _plans_of_blocks(stages: int) -> Array:
    """All plans of BLOCKS blocks, (2^BLOCKS, N); the first is all 0, the last all 1."""
    modes = (np.arange(2**BLOCKS)[:, None] >> np.arange(BLOCKS)) % 2
    return modes[:, np.arange(stages) * BLOCKS // stages].astype(np.float64)


def _regrets(rows: Sequence[Row], positions: Array) -> dict[str, Any]:
    """What chosen plans cost on the closed loop above the cheapest constant one, and of the plans of few blocks.

    Args:
        rows: the decisions that are looked at.
        positions: of each, one after the other, those of its own plan and of `_plans_of_blocks`, (..., N, 3), m.
    """
    if not rows:
        return {"regrets": 0}
    found: list[dict[str, Any]] = []
    for row, ways in zip(rows, np.split(positions, len(rows)), strict=True):
        cost = row.cost(ways) / row.scale
        at = {"robot": str(row.given["robot"]), "t_s": float(row.given["t_s"])}
        constant = float(cost[0] - min(cost[1], cost[-1]))
        found.append({**at, "against_constant_plans": constant, "against_blocks": float(cost[0] - cost[1:].min())})
    return {
        "regrets": len(found),
        "largest_regret_against_constant_plans": max(found, key=lambda one: one["against_constant_plans"]),
        "largest_regret_against_blocks": max(found, key=lambda one: one["against_blocks"]),
    }
