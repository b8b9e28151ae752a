"""GATE-MODEL under method (d): what comes of accepting a proposal and of refusing it, rolled out again."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from .law import PLANE, avoiding, inequalities, limited
from .proposals import Proposal, proposals_of
from .rules import SMALL, Array, Found, at_most, close, holds, same
from .run import Run
from .scenario import apart_m

STILL_M = 0.05
"""Less than this within the last second is at rest, or less than a tenth of what a slow UGV can do in a second."""
OUTCOME = 1e-6
"""Recorded and recomputed outcomes may differ by this, relative, or in m^2 s."""
TOLD = 1e-2
"""Part of that tolerance by which what is left of it may differ: roll-outs by other code differ by 1e-9 or so."""
LEFT_M = 1e-3
"""A way left may be outside its bounds by this: the recomputed end is not quite the recorded one."""
AROUND = 40
"""Points around a safe circle."""
MOST_CLAIMED = 64
"""Obstacles of a message that a UGV takes into account."""
CHOICES = ("refuse", "accept")


class Foreseen(NamedTuple):
    """What comes of a choice.

    Attributes:
        places_m: at the control samples, (S + 1, 3).
        stalls: whether it is at rest short of the goal in the end.
        home: whether it is at the goal.
        integral_m2_s: of the squared distance from the preset trajectory.
        goal_m: end of the preset trajectory, (3,).
        discs_m: obstacles that are known, (k, 3).
        safe_m: distances to keep from them, (k,).
    """

    places_m: Array
    stalls: bool
    home: bool
    integral_m2_s: float
    goal_m: Array
    discs_m: Array
    safe_m: Array


def rows_of(run: Run) -> list[dict[str, Any]]:
    """The decisions of a run under method (d), finite, and without problems (26)."""
    same("problems of decisions by outcomes", len(run.problems), 0)
    rows = [{str(name): value for name, value in row.items()} for row in run.decisions.to_dict("records")]
    for row in rows:
        numbers = np.array([value for value in row.values() if isinstance(value, float)])
        about = f"decision of {row['robot']}"
        holds("numbers of a decision are finite", np.isfinite(numbers), numbers, "a number", about=about)
        holds("a decision is of a UGV", row["robot"] in run.ugvs, row["robot"], "a UGV of the run", about=about)
        _nothing_where_nothing_is_said(row)
    return rows


OF_PROBLEMS = (
    "relaxed_first_stage", "objective", "route_bound", "gap", "objective_accept", "objective_refuse",
    "accept_throughout", "refuse_throughout", "rounding_deviation_s", "predicted_clearance_m",
)  # fmt: skip
"""Columns about problem (26)."""
OF_OUTCOMES = tuple(f"{choice}_{name}" for choice in CHOICES for name in ("outcome_m2_s", "stalls", "left_m"))
"""Columns about what comes of a choice."""
NOTHING = -1.0
"""Stands where a column says nothing."""


def _nothing_where_nothing_is_said(row: dict[str, Any]) -> None:
    """No problem (26); outcomes only where they were looked at; lags while something is executed."""
    about: dict[str, Any] = {"about": f"decision of {row['robot']}", "t_s": row["t_s"]}
    looked, lags = any(row[name] >= 0.0 for name in OF_OUTCOMES), ("lag_m", "predicted_lag_m")
    for name in (*OF_PROBLEMS, *(() if looked else OF_OUTCOMES)):
        holds(f"nothing is said of {name}", row[name] == NOTHING, row[name], NOTHING, **about)
    for name in lags:
        there = row[name] >= 0.0 or row[name] == NOTHING
        holds(f"{name} is a distance or nothing", there, row[name], NOTHING, **about)
    for name in ("accept_stalls", "refuse_stalls") if looked else ():
        holds(f"{name} is 0 or 1", row[name] in (0.0, 1.0), row[name], "0 or 1", **about)


def outcomes(run: Run) -> Found:
    """Every outcome that was looked at, against the roll-out."""
    rows, most = rows_of(run), 0.0
    looked = [row for row in rows if row["accept_stalls"] >= 0.0]
    for row in looked:
        about: dict[str, Any] = {"about": f"decision of {row['robot']}", "t_s": row["t_s"]}
        speed = run.scenario["ugvs"][row["robot"]]["preset"]["speed_m_s"]
        for choice, found in zip(CHOICES, foreseen(run, row["robot"], row["t_s"], row["issued_s"]), strict=True):
            left, recorded = row[f"{choice}_left_m"], row[f"{choice}_outcome_m2_s"]
            same(f"{choice}: stalls", row[f"{choice}_stalls"], float(found.stalls), **about)
            _way_left(found, left, choice, about)
            due = left**3 / (3.0 * speed) + (0.0 if found.stalls else found.integral_m2_s)
            allowed = OUTCOME * max(1.0, due)
            close(f"{choice}: outcome", recorded, due, within=allowed, **about)
            most = max(most, abs(recorded - due) / allowed)
    facts = {"decisions": len(rows), "outcomes": 2 * len(looked)}
    left = 1.0 - most
    return Found("holds", max(0.0, left - TOLD), min(1.0, left + TOLD), facts, 0.0).counted(len(looked))


def on_which(run: Run, ugv: str, issued_s: float) -> Proposal:
    """The proposal that a decision is on."""
    found = [proposal for proposal in proposals_of(run) if (proposal.ugv, proposal.issued_s) == (ugv, issued_s)]
    holds("the decision is on a proposal", len(found) == 1, issued_s, "one that was sent", about=ugv)
    return found[0]


@lru_cache(maxsize=256)
def foreseen(run: Run, ugv: str, t_s: float, issued_s: float) -> tuple[Foreseen, Foreseen]:
    """What comes of refusing and of accepting a proposal at a time."""
    gate, h = run.scenario["gatekeeper"], run.scenario["control"]["period_s"]
    asked, preset = on_which(run, ugv, issued_s), run.presets[ugv]
    arrives = float(preset.corner_s[-1]) if len(preset.corner_s) else 0.0
    until = min(float(asked.times_s[-1]), t_s + gate["longest_s"])
    ends = min(max(until, arrives), t_s + gate["longest_s"]) + gate["settling_s"]
    after = h * np.arange(np.ceil((ends - t_s) / h) + 1.0)
    discs, distances = _known_m(run, ugv, t_s, asked)
    fixed, over = np.tile(discs, (len(after), 1, 1)), [until, arrives, float(t_s + gate["horizon_s"])]
    ways: tuple[list[Array], list[Array]] = ([fixed], [fixed])  # if it is refused, if it is accepted
    views = [pair for pair in run.views[ugv] if pair.other in run.robots]
    for pair in views:
        refused, accepted, way_over = _way_of(run, pair.other, t_s, after)
        ways[0].append(refused[:, None])
        ways[1].append(accepted[:, None])
        over.append(way_over)
    safe = np.append(distances, [p.safe_m for p in views])
    share = np.append(np.ones(len(discs)), [pair.share for pair in views])
    settled = int(np.ceil((max(over) - t_s) / h - SMALL))
    start, goal = run.place_m(ugv, t_s), preset.corners_m[-1]
    own, wanted = preset.position_m(t_s + after), asked.place_m(t_s + after)
    executed = (0, max(0, int(np.ceil((until - t_s) / h - SMALL))))
    still_m = min(STILL_M, run.robots[ugv]["max_speed_m_s"] / 10.0)
    found = []
    for periods, around in zip(executed, ways, strict=True):
        points = np.concatenate(around, axis=1)
        places, integral = [start], 0.0
        for k in range(len(after) - 1):
            given = inequalities((places[-1] - points[k])[None], safe, share, run.scenario["control"], PLANE)
            intervention = (wanted[k], wanted[k + 1], asked.projector) if k < periods else None
            v = _command(run, ugv, places[-1], own[k : k + 2], intervention)
            places.append(places[-1] + h * avoiding(v, given, run.scenario["runs"][run.name]["composition"])[0])
            integral += h * float(((own[k + 1] - places[-1]) ** 2).sum())
            if k >= settled and _resting(run, places, goal, h, still_m):
                break
        end, earlier = places[-1], places[max(0, len(places) - 1 - max(1, round(1.0 / h)))]
        home = bool(np.linalg.norm(end - goal) <= run.scenario["arrival_tolerance_m"])
        stalls = not home and bool(np.linalg.norm(end - earlier) < still_m)
        found.append(Foreseen(np.array(places), stalls, home, integral, goal, discs, distances))
    return found[0], found[1]


def _command(run: Run, ugv: str, place: Array, own: Array, asked: tuple[Array, Array, Array] | None) -> Array:
    """What is wanted below the inequalities, (1, 3): (6), and with an intervention (14) above it."""
    control, limit = run.scenario["control"], run.robots[ugv]["max_speed_m_s"]
    h = control["period_s"]
    task = limited((PLANE * ((own[1] - own[0]) / h + control["motion_gain_1_s"] * (own[0] - place)))[None], limit)
    if asked is None:
        return task
    here, there, projector = asked
    wish = PLANE * ((there - here) / h + control["intervention_gain_1_s"] * (here - place))
    return limited((PLANE * (task[0] + projector @ (wish - task[0])))[None], limit)


def _resting(run: Run, places: list[Array], goal: Array, h: float, still_m: float) -> bool:
    """Whether the roll-out may end: it is home, or has hardly moved for a second."""
    second = max(1, round(1.0 / h))
    if np.linalg.norm(goal - places[-1]) < run.scenario["arrival_tolerance_m"]:
        return True
    return len(places) > second and bool(np.linalg.norm(places[-1] - places[-1 - second]) < 0.1 * still_m)


def _known_m(run: Run, ugv: str, t_s: float, asked: Proposal) -> tuple[Array, Array]:
    """Obstacles within sensing range at a sample of the gatekeeper up to now, the nearest of the message out of it.

    Of the message none that has a negative radius. Centres, (k, 3), and distances to keep from them, (k,).
    """
    reach, gate_s = run.scenario["control"]["sensing_range_m"], run.scenario["gatekeeper"]["period_s"]
    samples = np.minimum(gate_s * np.arange(round(t_s / gate_s) + 1.0), t_s)
    was = np.stack([np.interp(samples, run.t_s, axis) for axis in run.position_m[ugv].T], axis=1)
    bodies = list(run.scenario["obstacles"].values())
    bodies = [o for o in bodies if (np.linalg.norm(was - np.array(o["position_m"]), axis=1) <= reach).any()]
    known = [np.array(o["position_m"], dtype=np.float64) for o in bodies]
    away = np.linalg.norm(asked.mapped_m - was[-1], axis=1)
    new = [k for k in np.flatnonzero(away > reach) if all(np.linalg.norm(asked.mapped_m[k] - o) > SMALL for o in known)]
    new = [k for k in new if asked.mapped_radius_m[k] >= 0.0]
    nearest = sorted(sorted(new, key=lambda k: away[k])[:MOST_CLAIMED])
    bodies += [{"radius_m": asked.mapped_radius_m[k]} for k in nearest]
    distances = [apart_m(run.scenario, "obstacle_m", run.robots[ugv], body) for body in bodies]
    return np.concatenate([np.array(known).reshape(-1, 3), asked.mapped_m[nearest]]), np.array(distances)


def _way_of(run: Run, robot: str, t_s: float, after: Array) -> tuple[Array, Array, float]:
    """Where another robot is predicted, (S + 1, 3), if the proposal is refused, and if it is accepted.

    On the motion that it is asked for, or coasting to a stop; if the proposal is refused, it does what it is asked for
    only if it has accepted that before.
    """
    here = run.place_m(robot, t_s)
    held = min(int(np.searchsorted(run.t_s, t_s - SMALL)), len(run.t_s) - 1)
    coasting = here + np.minimum(after, run.scenario["gatekeeper"]["horizon_s"])[:, None] * run.command_m_s[robot][held]
    asked, accepted = _asked_of(run, robot, t_s)
    if asked is None:
        return coasting, coasting, -np.inf
    beside = here - asked.place_m(np.array([t_s]))[0]
    goes = asked.place_m(t_s + after) + np.exp(-after)[:, None] * beside
    return goes if accepted else coasting, goes, float(asked.times_s[-1])


def _asked_of(run: Run, ugv: str, t_s: float) -> tuple[Proposal | None, bool]:
    """What a UGV decides about at a sample, if it has not refused it before; and whether it has accepted it before."""
    for row in run.decisions[run.decisions["robot"] == ugv].to_dict("records"):
        if abs(row["t_s"] - t_s) <= SMALL:
            earlier = run.decisions[
                (run.decisions["robot"] == ugv)
                & (run.decisions["issued_s"] == row["issued_s"])
                & (run.decisions["t_s"] < t_s - SMALL)
            ]
            answer = earlier["decision"].iloc[-1] if len(earlier) else ""
            return None if answer == "refuse" else on_which(run, ugv, row["issued_s"]), answer == "accept"
    return None, False


def _way_left(found: Foreseen, left_m: float, choice: str, about: dict[str, Any]) -> None:
    """The way that is left is no shorter than straight, and no longer than one over points around the circles."""
    if found.home:
        same(f"{choice}: way left", left_m, 0.0, **about)
        return
    end, goal = found.places_m[-1], found.goal_m
    direct = float(np.linalg.norm((goal - end)[:2]))
    within = max(LEFT_M, OUTCOME * left_m)
    at_most(f"{choice}: straight way", direct, left_m, within=within, **about)
    if left_m > direct + within:
        around = _way_around_m(end, goal, found.discs_m, found.safe_m)
        at_most(f"{choice}: way left", left_m, around, within=within, **about)


def _way_around_m(start: Array, goal: Array, discs_m: Array, safe_m: Array) -> float:
    """Length of a way outside the safe circles, infinite if none is found.

    Found round the circles that are in the way, and then round those besides that the way so far runs into.
    """
    squared = safe_m**2 - (discs_m[:, 2] - start[2]) ** 2
    centres, radii = discs_m[squared > 0.0, :2], np.sqrt(squared[squared > 0.0])
    taken, way = np.full(len(radii), False), np.stack([start[:2], goal[:2]])
    while len(way):
        legs = np.diff(way, axis=0)
        share = ((centres[:, None] - way[:-1]) * legs).sum(axis=2) / np.maximum((legs**2).sum(axis=1), 1e-150)
        nearest = way[:-1] + np.clip(share, 0.0, 1.0)[..., None] * legs - centres[:, None]
        hit = (np.linalg.norm(nearest, axis=2) < radii[:, None] * (1.0 - 1e-6)).any(axis=1)
        if not (hit & ~taken).any():
            return float(np.linalg.norm(legs, axis=1).sum())
        taken |= hit
        way = _way_around(way[0], way[-1], centres[taken], radii[taken])
    return np.inf


def _way_around(start: Array, goal: Array, centres: Array, radii: Array) -> Array:
    """A way (M, 2) outside the circles, (0, 2) if none is found: Dijkstra over points around them."""
    angle = 2.0 * np.pi * np.arange(AROUND) / AROUND
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1) / np.cos(np.pi / AROUND) * (1.0 + SMALL)
    around = (centres[:, None] + radii[:, None, None] * ring).reshape(-1, 2)
    outside = (np.linalg.norm(around[:, None] - centres, axis=2) >= radii).all(axis=1)
    nodes = np.concatenate([start[None], goal[None], around[outside]])
    length = np.full(len(nodes), np.inf)
    length[0] = 0.0
    before = np.zeros(len(nodes), dtype=np.intp)
    left = np.full(len(nodes), True)
    while left.any():
        to_go = np.where(left, length, np.inf)
        here = int(to_go.argmin())
        if np.isinf(to_go[here]) or here == 1:
            break
        left[here] = False
        legs = nodes - nodes[here]
        reach = np.linalg.norm(legs, axis=1)
        share = np.clip(((centres - nodes[here]) @ legs.T) / np.maximum(reach, 1e-150) ** 2, 0.0, 1.0)
        nearest = nodes[here] + share[..., None] * legs - centres[:, None]
        clear = (np.linalg.norm(nearest, axis=2) >= radii[:, None] * (1.0 - 1e-6)).all(axis=0)
        shorter = clear & (length[here] + reach < length)
        length, before = np.where(shorter, length[here] + reach, length), np.where(shorter, here, before)
    if not np.isfinite(length[1]):
        return np.empty((0, 2))
    chain = [1]
    while chain[-1] != 0:
        chain.append(int(before[chain[-1]]))
    return np.asarray(nodes[chain[::-1]])
