"""SAFE-INV."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.nsbc.avoidance import Avoidance, Surroundings
from airground_drake.scenarios.rounding import loss_of_inequality
from airground_drake.verify.engines.rounding import unit


@examples(60)
@given(st.integers(0, 2**31), st.integers(1, 12), st.sampled_from([0.01, 0.05, 0.2]))
def test_one_step_keeps_the_distance_in_exact_arithmetic(seed: int, count: int, h: float) -> None:
    """Running layer, then exact motion: the least distance falls short of d by no more than the rounding bound."""
    rng = np.random.default_rng(seed)
    away = unit(rng, count)
    reach = 2.0 + rng.choice([0.0, 1e-9, 1.0], count) * rng.random(count)
    position, avoidance = rng.uniform(-20, 20, 3), Avoidance(3.0, h)
    around = Surroundings((position - reach[:, None] * away)[None], np.full((1, count), 2.0), np.ones((1, count)))
    spaces = avoidance.half_spaces(position[None], np.ones((1, 3)), around)
    lower = -away[rng.integers(count)] * 10.0 ** rng.uniform(0, 4)
    v = avoidance.apply(lower[None], spaces)[0]
    velocity = [Fraction(float(c)) for c in v]
    for k in range(count):
        if spaces.bound[0, k] > 0.0:  # inside by rounding
            continue
        x = [Fraction(float(a)) - Fraction(float(b)) for a, b in zip(position, around.centre[0, k], strict=True)]
        vv, xv = sum(c * c for c in velocity), sum(a * b for a, b in zip(x, velocity, strict=True))
        s = min(max(-xv / vv, Fraction(0)), Fraction(h)) if vv else Fraction(0)
        least = sum((a + s * b) ** 2 for a, b in zip(x, velocity, strict=True))
        loss = loss_of_inequality(float(reach[k]), float(np.linalg.norm(v)), h)
        assert least >= (2 - Fraction(float(loss)) - Fraction(2, 10**16)) ** 2
