"""The running kernel of the avoidance inequalities against the encoded relation, and what its rounding may cost."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from math import isfinite, isqrt
from typing import Any

import numpy as np

from airground_drake.arrays import ROUNDOFF
from airground_drake.nsbc.avoidance import Surroundings
from airground_drake.scenarios.rounding import TOLERANCE_M, Rounding
from airground_drake.verify.engines.obligation import rational
from airground_drake.verify.engines.rounding import SEED, unit
from airground_drake.verify.model.avoidance.constants import Inputs, kinds, running_avoidance

POINTS = 600
"""Points compared, from inside the safe distance to beyond the sensing range, many at D = d."""
Relation = Callable[[Fraction, Fraction, Fraction, Fraction, Fraction], Fraction]


def relation(D: Fraction, d: Fraction, share: Fraction, gain: Fraction, period: Fraction) -> Fraction:
    """The bound on n.v, m/s, as the obligations encode it."""
    return share * gain * (d - D) if d >= D else -share * (D - d) / period


def conformance(inputs: Inputs, encoded: Relation = relation) -> dict[str, Any]:
    """Compare the encoded relation, in exact arithmetic, with what `fill_half_spaces` computes.

    With e = D - d, rounding changes D by 3.5u, e by 3.5u D + u e, the bound by 2u more; a normal by 5.5u. So bounds
    may differ by 8u share max(A, 1/h) max(D, d) (the maximum, as rounding may take the other branch at D = d) and
    components of normals by 6u times themselves.

    Args:
        inputs: constants of the running code.
        encoded: the relation to compare with.

    Returns:
        Evidence; `agrees` is the verdict, and ratios are differences over what rounding may do.
    """
    rng, count = np.random.default_rng(SEED), POINTS
    avoidance = running_avoidance(inputs)
    kind = [(k.safe, k.share) for k in kinds(inputs)]
    safe, share = np.array(kind)[rng.integers(len(kind), size=count)].T
    factor = rng.choice([0.0, 1e-15, 1e-9, 1.0], count) * rng.uniform(-1.0, 1.0, count)
    reach = np.where(rng.random(count) < 0.1, 2.0 * avoidance.sensing_range, safe * (1.0 + 0.9 * factor))
    position = rng.uniform(-20.0, 20.0, 3)
    around = Surroundings((position - reach[:, None] * unit(rng, count))[None], safe[None], share[None])
    mobility = np.array([1.0, 1.0, 0.0])
    spaces = avoidance.half_spaces(position[None], mobility[None], around)
    h, gain = Fraction(rational(avoidance.period)), Fraction(rational(avoidance.gain))
    u = Fraction(ROUNDOFF)
    steep = max(gain, 1 / h)
    unseen = 0
    worst = {"bound": 0.0, "normal": 0.0}
    first: dict[str, Any] | None = None
    for k in range(count):
        x = [Fraction(float(a)) - Fraction(float(b)) for a, b in zip(position, around.centre[0, k], strict=True)]
        D = root(sum((c * c for c in x), Fraction(0)))
        d = Fraction(float(safe[k]))
        part = Fraction(float(share[k]))
        bound, normal = float(spaces.bound[0, k]), spaces.normal[0, k]
        off = [abs(Fraction(float(normal[a])) * D / x[a] - int(mobility[a])) for a in range(3)]
        worst["normal"] = max(worst["normal"], float(max(off) / (6 * u)))
        hidden = Fraction(avoidance.sensing_range) < D
        unseen += hidden
        if hidden or bound == -np.inf:
            ratio = 0.0 if hidden and bound == -np.inf else 1e300
        else:
            ratio = float(abs(Fraction(bound) - encoded(D, d, part, gain, h)) / (8 * u * part * steep * max(D, d)))
        worst["bound"] = max(worst["bound"], ratio)
        if ratio > 1.0 and first is None:
            first = {"D_m": float(D), "d_m": float(d), "share": float(part), "bound_of_kernel_m_s": str(bound)}
    agrees = all(ratio <= 1.0 for ratio in worst.values())
    return {"agrees": agrees, "points": count, "unseen": unseen, "worst_ratio": worst, "first_difference": first}


def root(square: Fraction) -> Fraction:
    """Square root, rounded down, of relative error below 1e-40 (for squares above 1e-40)."""
    scale = 10**60
    return Fraction(isqrt(square.numerator * square.denominator * scale * scale), square.denominator * scale)


def rounding_margins(inputs: Inputs) -> Inputs:
    """What rounding can take from the safe distance, m, by kind of pair: see `scenarios/rounding.py`.

    Without a gain nothing is restored, and the losses of all steps add up. So they would where the inequalities of
    several deficits contradict each other, as v = 0 is kept then.
    """
    found = {}
    for kind in kinds(inputs):
        reach = max(inputs["sensing_range_m"], kind.safe)
        loss = Rounding(reach, kind.closing, inputs["period_s"], inputs["avoidance_gain_1_s"])
        one = loss.of_a_step(inputs["extent_m"], inputs["duration_s"])
        alone = loss.restored(inputs["extent_m"], inputs["duration_s"])
        found[kind.name] = {"margin_of_a_step_m": one, "margin_with_restoring_m": alone if isfinite(alone) else None}
    return found


def rounding_leaves(margins: Inputs) -> tuple[str, float | None]:
    """The kind of pair that rounding takes most from, and what it leaves of `TOLERANCE_M`, m; None with no bound."""
    unbounded = [name for name, each in margins.items() if each["margin_with_restoring_m"] is None]
    if unbounded:
        return unbounded[0], None
    name = max(margins, key=lambda each: float(margins[each]["margin_with_restoring_m"]))
    return name, TOLERANCE_M - margins[name]["margin_with_restoring_m"]
