"""From a safe state the running avoidance layer meets every inequality as floats, whatever it is asked for."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from hypotheses.demands import Demands, nearest, unit

from airground_drake.base.arrays import ROUNDOFF, Array
from airground_drake.nsbc import kernels
from airground_drake.nsbc.avoidance import Avoidance, HalfSpaces, Surroundings
from airground_drake.scenarios.load import load

COUNT, MOST = 2400, 12


class States(NamedTuple):
    """The layer, and n robots with K points each around them."""

    layer: Avoidance
    position: Array
    mobility: Array
    around: Surroundings
    spaces: HalfSpaces
    lower: Array


@pytest.fixture(scope="module")
def states() -> States:
    """Safe states with 1 to 12 points, many at exactly the safe distance; velocities up to 1e6 m/s towards them."""
    rng, demands = np.random.default_rng(20211209), Demands.of(load("case_a")[0])
    layer = Avoidance(demands.gain, demands.period, demands.reach, "augmented")
    kinds = np.unique(np.stack([demands.safe, demands.share], axis=-1).reshape(-1, 2), axis=0)
    safe, share = np.moveaxis(kinds[rng.integers(len(kinds), size=(COUNT, MOST))], -1, 0)
    position = rng.uniform(-20.0, 20.0, (COUNT, 3))
    mobility = np.where(rng.random((COUNT, 1)) < 0.5, [1.0, 1.0, 0.0], 1.0)
    away = unit(rng, COUNT * MOST).reshape(COUNT, MOST, 3)
    excess = rng.choice([0.0, 0.0, 1e-12, 1.0], (COUNT, MOST)) * 10.0 ** rng.uniform(-6.0, 0.5, (COUNT, MOST))
    used = np.arange(MOST) < rng.integers(1, MOST + 1, (COUNT, 1))
    reach, grow = np.where(used, safe + excess, 10.0 * demands.reach + safe), 4.0 * ROUNDOFF
    while True:  # moved outward by some 1e-15 m, until no bound is above 0 as computed
        around = Surroundings(position[:, None] - reach[..., None] * away, safe, share)
        spaces = layer.half_spaces(position, mobility, around)
        inside = spaces.bound > 0.0
        if not inside.any():
            break
        reach, grow = np.where(inside, reach * (1.0 + grow), reach), 2.0 * grow
    between = -(away * used[..., None]).sum(axis=1)
    how = rng.integers(3, size=(COUNT, 1))
    lower = np.where(how == 0, -away[:, 0], np.where(how == 1, between, unit(rng, COUNT)))
    lower = lower * mobility * 10.0 ** rng.uniform(-3.0, 6.0, (COUNT, 1))
    return States(layer, position, mobility, around, spaces, lower)


def rates(spaces: HalfSpaces, velocity: Array) -> Array:
    """n.v in the kernels' order of operations, so that comparisons with bounds are exact."""
    n, v = spaces.normal, velocity[:, None]
    found: Array = n[..., 0] * v[..., 0] + n[..., 1] * v[..., 1] + n[..., 2] * v[..., 2]
    return found


def missed(velocity: Array, spaces: HalfSpaces) -> int:
    return int((~(rates(spaces, velocity) >= spaces.bound)).sum())


def test_every_inequality_is_met_as_floats(states: States) -> None:
    layer, _, mobility, _, spaces, lower = states
    velocity = layer.apply(lower, spaces)
    assert missed(velocity, spaces) == 0
    assert (velocity * (1.0 - mobility) == 0.0).all()
    faster = np.linalg.norm(velocity, axis=1) / np.linalg.norm(lower, axis=1)
    assert faster.max() <= 1.0 + 1e-9
    assert np.isfinite(spaces.bound).sum() > 5 * COUNT


def test_no_distance_to_a_point_at_rest_falls_short_in_the_next_period(states: States) -> None:
    layer, position, _, around, spaces, lower = states
    velocity = layer.apply(lower, spaces)
    alone = np.isfinite(spaces.bound) & (around.share == 1.0)
    x = position[:, None] - around.centre
    short = around.distance - nearest(x, velocity[:, None], layer.period)
    rounding = (
        100.0 * ROUNDOFF * (np.linalg.norm(x, axis=-1) + layer.period * np.linalg.norm(velocity, axis=1)[:, None])
    )
    assert (short <= rounding)[alone].all()


def unscaled(layer: Avoidance, lower: Array, spaces: HalfSpaces) -> Array:
    """A broken layer: the projection without the scaling step."""
    found = lower.copy()
    for i in np.flatnonzero((rates(spaces, lower) < spaces.bound).any(axis=1)):
        found[i] = kernels._closest_feasible(lower[i], spaces.normal[i], spaces.bound[i])
    return found


@pytest.mark.parametrize("composition", ["recursion_listed", "recursion_nearest"])
def test_the_papers_recursion_misses_inequalities(states: States, composition: Any) -> None:
    layer, *_, spaces, lower = states
    broken = Avoidance(layer.gain, layer.period, layer.sensing_range, composition)
    assert missed(broken.apply(lower, spaces), spaces) > 0


def test_a_layer_that_is_not_scaled_back_misses_inequalities(states: States) -> None:
    layer, *_, spaces, lower = states
    assert missed(unscaled(layer, lower, spaces), spaces) > 0


@pytest.mark.parametrize("value", [np.nan, -np.inf, -1e300])
def test_a_velocity_that_is_no_number_does_not_lead_inside(value: float) -> None:
    layer = Avoidance(3.0, 0.05, 5.0, "augmented")
    around = Surroundings(np.zeros((1, 1, 3)), np.full((1, 1), 2.0), np.ones((1, 1)))
    spaces = layer.half_spaces(np.array([[2.0, 0.0, 0.0]]), np.ones((1, 3)), around)
    velocity = layer.apply(np.array([[value, 0.0, 0.0]]), spaces)
    assert not np.isfinite(velocity).all() or missed(velocity, spaces) == 0
