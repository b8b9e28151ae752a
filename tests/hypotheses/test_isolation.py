"""The running trigger takes what was due in a step, and nothing else (THR-TRIG): against an evaluation in 256 bits."""

from typing import Any

import flint
import numpy as np
import numpy.typing as npt
import pytest
from builders.worlds import world

from airground_drake.base.arrays import Array
from airground_drake.model.trigger.automaton import FIELDS, Mode, Trigger
from airground_drake.model.trigger.excursion import extremes
from airground_drake.sim.blocks.decision import DecisionBlock, DecisionVariable, EventTrigger

UGVS = 400
"""Steps compared at a time."""
BITS = 256
HALVINGS = 64
ROUNDING = 1e-13
"""A level may be missed by this, relative to the largest number of a step: some ten rounded operations, each by 1e-16,
and the subtraction of two errors that are nearly the same."""


def disagreements(trigger: Trigger, block: type[DecisionVariable] = DecisionVariable) -> int:
    """How often the running block and EventTrigger miss at the end of a step what was due in it, or invent something.

    Errors pass the origin closely or not, stand still, or are tiny; noise changes slowly or fast; x is near the levels.
    """
    rng, wrong = np.random.default_rng(7), 0
    for _ in range(3):
        modes = rng.integers(0, 2, UGVS)
        levels = np.where(modes == Mode.SUPERVISING, trigger.zeta, trigger.release)
        before, after = _random_steps(rng, levels)
        due = _running(block(world(UGVS)), EventTrigger(UGVS, trigger), modes, before, after)
        for j in range(UGVS):
            size = float(np.abs(np.concatenate([before[j], after[j]])).max()) + abs(float(levels[j]))
            low, high = _range(before[j], after[j])
            spare = high - levels[j] if modes[j] == Mode.SUPERVISING else levels[j] - low
            wrong += due[j] != (spare >= 0.0) and abs(spare) > ROUNDING * size
    return wrong


@pytest.mark.parametrize("trigger", [Trigger(3.0, 2.0, 0.5), Trigger(1.5, 0.5, 0.0)])
def test_no_crossing_is_missed_and_none_is_invented(trigger: Trigger) -> None:
    assert disagreements(trigger) == 0


class EndsOnly(DecisionVariable):
    extremes = DecisionBlock.extremes


def test_a_block_that_looks_at_the_ends_of_steps_only_is_noticed() -> None:
    assert disagreements(Trigger(3.0, 2.0, 0.5), EndsOnly) > 0


def _random_steps(rng: np.random.Generator, levels: Array) -> tuple[Array, Array]:
    """Errors and noise at the beginnings and ends of steps, (UGVS, 4) each, m."""
    size = 10.0 ** rng.uniform(-3.0, 1.0, (UGVS, 1))
    before = size * rng.normal(size=(UGVS, 4))
    passing = -before[:, :3] * rng.uniform(0.0, 2.0, (UGVS, 1)) + 0.1 * size * rng.normal(size=(UGVS, 3))
    away = before[:, :3] + 10.0 ** rng.uniform(-9.0, 0.0, (UGVS, 1)) * size * rng.normal(size=(UGVS, 3))
    kind = rng.integers(0, 3, (UGVS, 1))
    after = np.select([kind == 0, kind == 1], [passing, away], before[:, :3])
    noise = before[:, 3:] + size * rng.normal(size=(UGVS, 1)) * 10.0 ** rng.uniform(-6.0, 0.5, (UGVS, 1))
    after = np.hstack([after, noise])
    near = np.where(rng.random(UGVS) < 0.5, *_ranges(before, after))  # move x so that this is near the level
    shift = levels - near + size[:, 0] * rng.choice([-1.0, 1.0], UGVS) * 10.0 ** rng.uniform(-9.0, 0.0, UGVS)
    before[:, 3] += shift
    after[:, 3] += shift
    return before, after


def _ranges(before: Array, after: Array) -> Array:
    x = [np.linalg.norm(parts[:, :3], axis=1) + parts[:, 3] for parts in (before, after)]
    return extremes(before, after, np.array(x))


def _running(
    variable: DecisionVariable, system: EventTrigger, modes: npt.NDArray[np.int64], before: Array, after: Array
) -> list[bool]:
    count, step = len(modes), 0.1
    source = variable.CreateDefaultContext()
    source.SetTime(1.0 + step)
    begun = np.column_stack([before, variable.value(1.0, np.ascontiguousarray(before))])
    source.SetDiscreteState(0, np.concatenate([[1.0], begun.ravel()]))
    variable.GetInputPort("bodies").FixValue(source, np.zeros(3 * count + 3))
    variable.GetInputPort("reference").FixValue(source, np.concatenate([after[:, :3].ravel(), np.zeros(3 * count)]))
    variable.GetInputPort("noise").FixValue(source, after[:, 3])
    context = system.CreateDefaultContext()
    context.SetTime(1.0 + step)
    status = np.column_stack([modes, modes, np.where(modes > 0, 0.0, -1.0), np.full(count, -1.0)])
    context.SetDiscreteState(0, status.ravel())
    context.SetDiscreteState(1, [1.0])
    for port in ("decision_variable", "decision_range"):
        system.GetInputPort(port).FixValue(context, variable.GetOutputPort(port).Eval(source))
    updated = system.AllocateDiscreteVariables()
    updated.SetFrom(context.get_discrete_state())
    system.update(context, updated)
    found = np.array(updated.value(0)).reshape(-1, FIELDS)
    moved = (found[:, 1] != status[:, 1]) | (found[:, 3] != status[:, 3])
    if system.nothing_due(context) != (-1.0 if moved.any() else 1.0):
        raise ArithmeticError("the witness and the update disagree about what is due")
    return [bool(each) for each in moved]


def _range(before: Array, after: Array) -> tuple[float, float]:
    """Least and largest x over a step, m: ends, and where the slope of x changes its sign, in 256 bits.

    With e = e0 + s d: ||e||^2 = e0.e0 + 2 s e0.d + s^2 d.d, and ||e|| dx/ds = e0.d + s d.d + (n1 - n0) ||e||.
    """
    with flint.ctx.workprec(BITS):
        start = [flint.arb(float(value)) for value in before]
        change = [flint.arb(float(value)) - begin for value, begin in zip(after, start, strict=True)]
        square, across, along = _dot(start, start), _dot(start, change), _dot(change, change)

        def length(share: Any) -> Any:
            """||e||, m; rounding must not make its square negative."""
            return (square + share * (2 * across + share * along)).nonnegative_part().sqrt()

        def x(share: Any) -> float:
            return float((length(share) + start[3] + share * change[3]).mid())

        low, high = flint.arb(0), flint.arb(1)
        for _ in range(HALVINGS):
            middle = ((low + high) / 2).mid()
            if (across + middle * along + change[3] * length(middle)).mid() < 0:
                low = middle
            else:
                high = middle
        ends = x(flint.arb(0)), x(flint.arb(1))
        return min(x(low), *ends), max(ends)


def _dot(a: list[Any], b: list[Any]) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
