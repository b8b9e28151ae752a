"""Disturbed runs of the running avoidance layer keep d - W/A wherever their inequalities were met (SAFE-DIST)."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from builders.worlds import among_points
from hypotheses.demands import Demands, limited, nearest, unit

from airground_drake.base.arrays import Array
from airground_drake.model.law.avoidance import Avoidance, HalfSpaces
from airground_drake.scenario.load import load
from airground_drake.verify.claims.safe_dist import SafeDist

TOLERANCE = 1e-9
STEPS = 250
FAR = [0.0, 0.0, 1e3]
D, PAIR, LOW = 2.0, 2.0, 1.0
"""Safe distances of case A, m: obstacles, UGVs, the UAV above a UGV."""
SCENES: dict[str, tuple[list[list[float]], list[list[float]]]] = {
    "obstacle": ([[0.0, 0.0, 0.0]], [[1.01 * D, 0.0, 0.0], FAR]),
    "notch": ([[-0.8 * D, 0.0, 0.0], [0.8 * D, 0.0, 0.0]], [[0.0, 0.7 * D, 0.0], FAR]),
    "gap": ([[-D, 0.0, 0.0], [D, 0.0, 0.0]], [[0.0, 0.0, 0.0], FAR]),
    "uav low": ([], [[0.0, 0.0, 0.0], [0.1 * LOW, 0.0, 1.01 * LOW]]),
    "uav overhead": ([], [[0.0, 0.0, 0.0], [0.0, 0.0, LOW]]),
    "ugv pair": ([], [[0.0, 0.0, 0.0], [1.1 * PAIR, 0.0, 0.0], FAR]),
    "squeezed": ([[0.0, 0.0, 0.0]], [[D, 0.0, 0.0], [D + PAIR, 0.0, 0.0], FAR]),
}
"""Obstacles and robots, the UAV last; where a UGV is squeezed its inequalities contradict each other."""


class Tally(NamedTuple):
    """Least distance less d - W/A, m; misses of inequalities; distances below the bound though these were met."""

    margin: float
    unmet: int
    broken: int


def scene(name: str) -> tuple[Demands, Array]:
    obstacles, robots = (np.array(rows, dtype=np.float64).reshape(-1, 3) for rows in SCENES[name])
    scenario, m, n = load("case_a"), len(obstacles), len(robots)
    known = Demands.of(scenario)
    share = np.hstack([np.ones((n, m)), np.full((n, n), 0.5)])
    safe = np.hstack([np.full((n, m), D), np.full((n, n), PAIR)])
    safe[:-1, -1] = safe[-1, m:] = LOW
    rows = [*range(n - 1), -1]
    chosen = replace(
        known, robots=known.robots[:n], obstacles=obstacles, mobility=known.mobility[rows],
        max_speed=known.max_speed[rows], safe=safe, share=share,
    )  # fmt: skip
    return chosen, robots


def run(
    name: str, how: str, *, edit: Callable[[HalfSpaces], HalfSpaces] = lambda spaces: spaces, force: float = 1.0
) -> Tally:
    """Drive all robots towards the nearest thing, at up to their speed limits, with disturbances at their bound."""
    demands, positions = scene(name)
    scenario = load("case_a")
    w = SafeDist().inputs(scenario)["disturbance_m_s"]
    layer = Avoidance(demands.gain, demands.period, demands.reach, "augmented")
    rng, count, m = np.random.default_rng(5), len(positions), len(demands.obstacles)
    robots = np.arange(count)
    other = np.array([[k for k in range(m + count) if k != m + i] for i in robots])  # what each keeps away from
    safe, share = (np.take_along_axis(each, other, axis=1) for each in (demands.safe, demands.share))
    bound = safe - np.where(share < 1.0, 2.0, 1.0) * w / demands.gain
    met = np.ones((count, m + count), dtype=np.bool_)
    worst, unmet, broken = np.inf, 0, 0
    for k in range(STEPS):
        things = np.vstack([demands.obstacles, positions])
        x = positions[:, None] - things[other]
        reach = np.linalg.norm(x, axis=-1)
        if how != "switching" or k % 20 == 0:
            target = rng.integers(other.shape[1], size=count) if how == "switching" else np.argmin(reach - safe, axis=1)
        inward = -x[robots, target] / np.maximum(reach[robots, target], 1e-9)[:, None]
        push = unit(rng, count) if how == "random" else inward
        wanted = (0.0 if how == "idle" else 100.0) * push * demands.mobility
        spaces = edit(layer.half_spaces(*among_points(positions, things[other], safe, share, demands.mobility)))
        velocity = layer.apply(limited(wanted, demands.max_speed), spaces)
        rate = np.einsum("ika,ia->ik", spaces.normal, velocity)
        short = np.where(np.isfinite(spaces.bound), spaces.bound - rate, -np.inf)
        unmet += int((short > TOLERANCE).sum())
        np.put_along_axis(met, other, np.take_along_axis(met, other, axis=1) & (short <= TOLERANCE), axis=1)
        moved = velocity + force * w * push * demands.mobility
        relative = moved[:, None] - np.vstack([np.zeros((m, 3)), moved])[other]
        least = nearest(x, relative, demands.period)
        both = met.copy()
        both[:, m:] &= met[:, m:].T
        broken += int(((least < bound - TOLERANCE) & np.take_along_axis(both, other, axis=1)).sum())
        worst = min(worst, float((least - bound).min()))
        positions = positions + demands.period * moved
    return Tally(worst, unmet, broken)


@pytest.mark.parametrize("how", ["pinned", "idle", "switching", "random"])
@pytest.mark.parametrize("name", SCENES)
def test_the_bound_is_kept_where_the_inequalities_are_met(name: str, how: str) -> None:
    found = run(name, how)
    assert found.broken == 0
    if name not in ("squeezed", "uav overhead"):
        assert found.margin > -TOLERANCE
    assert found.margin < 2.0  # it came near


def test_the_uavs_half_suffices_straight_above_a_ugv_and_contradicting_inequalities_are_counted() -> None:
    """The UGV cannot move along the line to the UAV (Gate.overhead)."""
    assert all(run("uav overhead", how).margin > -TOLERANCE for how in ("pinned", "idle"))
    assert run("squeezed", "pinned").unmet > 0


def weakened(spaces: HalfSpaces) -> HalfSpaces:
    """Inside a safe distance less is asked than the law does."""
    return HalfSpaces(spaces.normal, np.where(spaces.bound > 0.0, 0.3, 1.0) * spaces.bound)


@pytest.mark.parametrize(("edit", "force"), [(lambda spaces: spaces, 2.5), (weakened, 1.0)])
def test_a_weaker_layer_or_a_larger_disturbance_breaks_the_bound(
    edit: Callable[[HalfSpaces], HalfSpaces], force: float
) -> None:
    assert any(run("obstacle", how, edit=edit, force=force).broken for how in ("pinned", "idle"))


@pytest.mark.parametrize("value", [np.nan, -np.inf, -1e300])
def test_a_velocity_that_is_no_number_does_not_lead_inside(value: float) -> None:
    layer = Avoidance(3.0, 0.05, 5.0, "augmented")
    one, robot = np.ones((1, 1)), np.array([[2.0, 0.0, 0.0]])
    spaces = layer.half_spaces(*among_points(robot, np.zeros((1, 1, 3)), 2.0 * one, one, np.ones((1, 3))))
    velocity = layer.apply(np.array([[value, 0.0, 0.0]]), spaces)
    assert not np.isfinite(velocity).all() or spaces.normal[0, 0] @ velocity[0] >= spaces.bound[0, 0]
