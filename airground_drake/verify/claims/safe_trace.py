"""SAFE-TRACE: the distances of a run, over continuous time."""

from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from airground_drake.scenario.schema import MAP
from airground_drake.sim.trace import Trace, per_trace
from airground_drake.verify.claim import TraceClaim
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.encounters import encounters
from airground_drake.verify.runs.pairs import (
    DISTANCE_TOLERANCE_M,
    MOST_LISTED,
    apart_of,
    least_gap,
    least_of,
    pairs_of,
    place_on_map,
    snapshot,
    steered_margin,
)


class SafeTrace(TraceClaim):
    id = "SAFE-TRACE"
    subject = "distances"
    summary = "No robot came closer to an obstacle or to another robot than the safe distance."
    statement = "During the whole run every robot kept the safe distance from every obstacle and every other robot."
    latex = (
        r"\min_{t \in [0, T]} \mathrm{dist}(p_i(t), C_j) - (r_i + r_j) \ge d_{ij} - 10^{-9} \text{ m} \quad "
        r"\text{for every pair } (i, j)",
    )
    method = (
        "Exact minimum of the distance of the bodies on every segment between two rows, in closed form: nothing is "
        "sampled. A straight motion is nearest to a convex core at an end, where it passes a corner or an edge at "
        "right angles, or where it crosses the line of an edge; in a polygon, it is deepest where two edges are "
        "equally near. The distance from a barrier is the least over its convex parts. A body that turns or lags "
        "leaves the straight line, so its distance is reduced by this deviation; if the result may be too small, the "
        "segment is divided until it is straight to 1e-10 m. Before that, each recorded step of a steered point must "
        "equal command times duration, and each recorded body must obey its plant, to 1e-9 m; otherwise the verdict is"
        " `error`."
    )
    equations = "(7)-(8), (11)"
    assumptions = (
        "Between two rows every robot moves on a straight line at constant speed (integrator plant, zero-order hold), "
        "a unicycle on an arc, and a body with a lag by the equation of the lag. A user's plant moves straight between"
        " rows, which are the steps of an integrator with error control.",
        "Robots are balls of the scenario's radii r (`radius_m`; by default points), and C is the centre of the other "
        "body. A barrier consists of all points within its radius of its core C: a point, walls, a polygon, or a prism"
        " up to its height. A distance is the gap between surfaces; below 0 they overlap. d_ij is the obstacle's own "
        "`distance_m`, or the safe distance of the kind of pair.",
        "For a UGV, walls are infinitely high. Obstacles are static for the whole run, as listed in the scenario, or "
        "move without rotation as recorded in the trace, straight between two rows. An obstacle is judged from "
        "`appears_s` to `disappears_s`, each rounded up to a control sample and included.",
    )
    does_not_establish = (
        "Safety of any other run, start or seed, or of a plant that does not follow its velocity exactly (SAFE-DIST); "
        "nor that positions in the trace are those of a real robot. It does not explain why the distance was kept. "
        "Beside moving obstacles a refutation does not mean that a robot caused it (SAFE-OWN)."
    )

    exercised_by = (
        "pairs that came so close that one control period at full speed would have broken the distance, or the law's "
        "distance between steered points"
    )

    def check(self, trace: Trace) -> Finding:
        pairs = pairs_of(trace)
        entry = partial(_entry, trace)
        least = apart_of(trace) - np.array([pair.safe_m for pair in pairs])
        listed = [entry(k) for k in least_of(least, MOST_LISTED, lambda k: entry(k).margin_m)]
        reach = np.array([pair.reach_m + pair.cover_m + pair.more_m for pair in pairs])
        close_by = np.flatnonzero(least < reach).tolist()
        worst = min(listed, key=lambda distance: distance.margin_m)
        safe = worst.margin_m >= -DISTANCE_TOLERANCE_M
        both = (worst.first, worst.second)
        at_map = place_on_map(trace, worst.first, worst.t_s) if worst.second == MAP else {}
        against: dict[str, Any] | None = None
        if not safe:
            why = next(encounter.cause(trace) for encounter in encounters(trace) if encounter[:2] == both)
            against = asdict(worst) | at_map | {"why": why} | snapshot(trace, both, worst.t_s)
        return Finding(
            "holds" if safe else "refuted",
            margin=worst.margin_m,
            unit="m",
            quantity="least distance of a pair less its safe distance",
            where={"first": worst.first, "second": worst.second, "t_s": worst.t_s, **at_map},
            counterexample=against,
            evidence={
                "pairs": [asdict(distance) for distance in listed],
                "pairs_in_all": len(pairs),
                "encounters": [encounter._asdict() for encounter in encounters(trace)[:MOST_LISTED]],
                "tolerance_m": DISTANCE_TOLERANCE_M,
            },
            exercised=sum(entry(k).exercised for k in close_by),
        )


@dataclass(frozen=True)
class Distance:
    """The closest approach of a pair, in row `row`: distances of surfaces, m, and the time, s."""

    # It was exercised if one control period at full speed would have broken the safe distance, or the law's distance.

    first: str
    second: str
    safe_distance_m: float
    min_distance_m: float
    margin_m: float
    t_s: float
    row: int
    exercised: bool


@per_trace
def _entry(trace: Trace, k: int) -> Distance:
    pair, gap_m, margin_m, t_s, row = least_gap(trace, pairs_of(trace)[k])
    near = margin_m < pair.reach_m or (pair.more_m > 0.0 and steered_margin(trace, pair) < pair.reach_m)
    return Distance(pair.first, pair.second, pair.required_m, gap_m, margin_m, t_s, row, near)
