"""GATE-MODEL under method (d): what comes of accepting a proposal and of refusing it, rolled out again."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from .proposals import Proposal, proposals_of
from .rollouts import Loop, Rolled, rolled_out
from .rules import SMALL, Array, Found, at_most, close, holds, same
from .run import Run
from .scenario import apart_m

OUTCOME = 1e-6
"""Recorded and recomputed outcomes may differ by this, relative, or in m^2 s."""
TOLD, APART = 1e-2, 10.0
"""How much of that tolerance is used may differ by the first, and by a factor of the second: it is rounding, which the
roll-outs of others accumulate in another order, and more of it where inequalities contradict each other."""
LEFT_M = 1e-3
"""A way left may be outside its bounds by this: the recomputed end is not quite the recorded one."""
AROUND = 40
"""Points around a safe circle."""
MOST_CLAIMED = 64
"""Obstacles of a message that a UGV takes into account."""
CHOICES = ("refuse", "accept")

Asked = tuple[str, float, float]
"""UGV, time of the decision, and time at which the proposal was sent, s."""


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
        for choice, found in zip(CHOICES, foreseen(run)[asked_in(row)], strict=True):
            left, recorded = row[f"{choice}_left_m"], row[f"{choice}_outcome_m2_s"]
            same(f"{choice}: stalls", row[f"{choice}_stalls"], float(found.stalls), **about)
            _way_left(found, left, choice, about)
            due = left**3 / (3.0 * speed) + (0.0 if found.stalls else found.integral_m2_s)
            allowed = OUTCOME * max(1.0, due)
            close(f"{choice}: outcome", recorded, due, within=allowed, **about)
            most = max(most, abs(recorded - due) / allowed)
    facts = {"decisions": len(rows), "outcomes": 2 * len(looked)}
    least_left, most_left = max(0.0, 1.0 - APART * most - TOLD), min(1.0, 1.0 - most / APART + TOLD)
    return Found("holds", least_left, most_left, facts, 0.0).counted(len(looked))


def on_which(run: Run, ugv: str, issued_s: float) -> Proposal:
    """The proposal that a decision is on."""
    found = [proposal for proposal in proposals_of(run) if (proposal.ugv, proposal.issued_s) == (ugv, issued_s)]
    holds("the decision is on a proposal", len(found) == 1, issued_s, "one that was sent", about=ugv)
    return found[0]


@lru_cache(maxsize=4)
def foreseen(run: Run) -> dict[Asked, tuple[Rolled, Rolled]]:
    """What comes of refusing and of accepting, for each decision that looked at it."""
    each = [asked_in(row) for row in rows_of(run) if row["accept_stalls"] >= 0.0]
    found = rolled_out(run, (loop for asked in each for loop in _loops(run, *asked)))
    return {asked: (next(found), next(found)) for asked in each}


def asked_in(row: dict[str, Any]) -> Asked:
    """Of which UGV a decision is, when, and on the proposal of when."""
    return row["robot"], row["t_s"], row["issued_s"]


def _loops(run: Run, ugv: str, t_s: float, issued_s: float) -> tuple[Loop, Loop]:
    """The closed loops of a UGV that refuses, and that accepts."""
    gate, h = run.scenario["gatekeeper"], run.scenario["control"]["period_s"]
    asked, preset = on_which(run, ugv, issued_s), run.presets[ugv]
    arrives = float(preset.corner_s[-1]) if len(preset.corner_s) else 0.0
    until = min(float(asked.times_s[-1]), t_s + gate["longest_s"])
    ends = min(max(until, arrives), t_s + gate["longest_s"]) + gate["settling_s"]
    after = h * np.arange(np.ceil((ends - t_s) / h) + 1.0)
    views = [pair for pair in run.views[ugv] if pair.other in run.robots]
    ways = [_way_of(run, pair.other, t_s, after) for pair in views]
    over = max([until, arrives, float(t_s + gate["horizon_s"]), *(way_over for _, _, way_over in ways)])
    discs, distances = _known_m(run, ugv, t_s, asked)
    refusing = Loop(
        start_m=run.place_m(ugv, t_s),
        goal_m=preset.corners_m[-1],
        own_m=preset.position_m(t_s + after),
        asked_m=asked.place_m(t_s + after),
        projector=asked.projector,
        periods=0,
        discs_m=discs,
        disc_safe_m=distances,
        others_m=_beside([refused for refused, _, _ in ways], len(after)),
        other_safe_m=np.array([pair.safe_m for pair in views]),
        other_share=np.array([pair.share for pair in views]),
        settled=int(np.ceil((over - t_s) / h - SMALL)),
        limit_m_s=run.robots[ugv]["max_speed_m_s"],
    )
    return refusing, refusing._replace(
        periods=max(0, int(np.ceil((until - t_s) / h - SMALL))),
        others_m=_beside([accepted for _, accepted, _ in ways], len(after)),
    )


def _beside(ways: list[Array], samples: int) -> Array:
    """Ways (S + 1, 3) of other robots as (S + 1, V, 3)."""
    return np.stack(ways, axis=1) if ways else np.empty((samples, 0, 3))


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


def _way_left(found: Rolled, left_m: float, choice: str, about: dict[str, Any]) -> None:
    """The way that is left is no shorter than straight, and no longer than one over points around the circles."""
    if found.home:
        same(f"{choice}: way left", left_m, 0.0, **about)
        return
    end, goal = found.places_m[-1], found.goal_m
    direct = float(np.linalg.norm((goal - end)[:2]))
    within = max(LEFT_M, OUTCOME * left_m)
    at_most(f"{choice}: straight way", direct, left_m, within=within, **about)
    if left_m > direct + within:
        around = _way_around_m(end, goal, found.discs_m, found.disc_safe_m)
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
