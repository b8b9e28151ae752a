"""The obligations of THR-ISO, and the running witness against an evaluation of its own in 256 bits.

Symbols: a task error of length A at the beginning and B at the end of a step, C their scalar product, E its length at
the share l of the step; on the line of the error, u is the distance from the point nearest to the origin, p that
point's distance, N = sqrt(u^2 + p^2); k is the change of the noise over that of the error's place, w = sqrt(1 - k^2).
"""

from __future__ import annotations

from typing import Any

import flint
import numpy as np
import numpy.typing as npt

from airground_drake.arrays import Array
from airground_drake.decision.excursion import extremes
from airground_drake.decision.trigger import Mode, Trigger
from airground_drake.systems.decision import FIELDS, EventTrigger
from airground_drake.verify.engines.obligation import Obligation, Term
from airground_drake.verify.engines.rewriting import terms

UGVS = 400
"""Steps compared at a time."""
BITS = 256
HALVINGS = 64
ROUNDING = 1e-13
"""A level may be missed by this, relative to the largest number of a step: some ten rounded operations, each by 1e-16,
and the subtraction of two errors that are nearly the same."""

_FAR = "(1 - l)*A + l*B"
_MIXED = "(1 - l)**2*A**2 + 2*l*(1 - l)*C + l**2*B**2"
_AHEAD = "p*w - k*u"


def obligations() -> list[Obligation]:
    """x is largest at an end of a step, and on a line nowhere less than p w (+ const), which it attains if |k| < 1."""
    share = {"l": "l", "rest": "1 - l"}
    lengths = {**share, "A": "A", "B": "B", "E": "E"}
    convex, line = ("A", "B", "C", "E", "l"), ("u", "p", "k", "w", "N")
    length, unit = {"length": f"E**2 - ({_MIXED})"}, {"norm": "N**2 - u**2 - p**2", "unit": "w**2 + k**2 - 1"}
    return [
        Obligation(
            "convex", "on a straight way an error is no longer than its ends' lengths mixed: E <= (1 - l) A + l B",
            convex, f"{_FAR} - E", hypotheses={**lengths, "cauchy": "A*B - C"}, strict={"level": f"{_FAR} + E"},
            equations=length, certificate=terms("2 l rest cauchy"), multiplier=terms("level"),
            equation_multipliers={"length": "-1"},
        ),
        Obligation(
            "convex_at_origin", "the same where all three lengths are 0", convex, f"{_FAR} - E",
            hypotheses={**lengths, "level": f"-({_FAR} + E)"}, certificate=terms("2 rest A", "2 l B", "level"),
        ),
        Obligation(
            "largest_at_an_end", "with linear noise x is nowhere above the larger of its ends, M",
            ("A", "B", "E", "l", "n0", "n1", "M"), "M - E - (1 - l)*n0 - l*n1",
            hypotheses={**share, "first": "M - A - n0", "last": "M - B - n1", "convex": f"{_FAR} - E"},
            certificate=terms("rest first", "l last", "convex"),
        ),
        Obligation(
            "nowhere_below", "on the line N + k u >= p w, because N^2 - (p w - k u)^2 = (u w + p k)^2", line,
            f"N - ({_AHEAD})", hypotheses={"N": "N"}, strict={"level": f"N + {_AHEAD}"}, equations=unit,
            certificate=(Term(square="u*w + p*k"),), multiplier=terms("level"),
            equation_multipliers={"norm": "1", "unit": "-(u**2 + p**2)"},
        ),
        Obligation(
            "nowhere_below_trivially", "the same where N + p w - k u <= 0", line, f"N - ({_AHEAD})",
            hypotheses={"N": "N", "level": f"-(N + {_AHEAD})"}, certificate=terms("2 N", "level"),
        ),
        Obligation(
            "attained", "where u w = -p k, x is not above p w either", line, f"{_AHEAD} - N",
            hypotheses={"p": "p", "N": "N"}, strict={"w": "w", "positive": "p + N*w"},
            equations={**unit, "place": "u*w + p*k"}, multiplier=terms("w positive"),
            equation_multipliers={"norm": "-w**2", "unit": "N*w*p", "place": "-u*w - k*N*w"},
        ),
    ]  # fmt: skip


def conformance(trigger: Trigger) -> dict[str, Any]:
    """What the running EventTrigger does at the ends of random steps against what is due in them.

    Steps: errors that pass the origin closely or not, stand still, or are tiny; noise that changes slowly or fast; x
    near the levels. What is due is found without the package's formula: the least x by bisection on the slope of the
    convex function in 256 bits, to a width of 2^-64 of the step. A disagreement is excused only where x comes within
    `ROUNDING` of the level.
    """
    rng = np.random.default_rng(7)
    compared, missed, spurious, excused = 0, 0, 0, 0
    first: dict[str, Any] | None = None
    for _ in range(3):
        modes = rng.integers(0, 2, UGVS)
        levels = np.where(modes == Mode.SUPERVISING, trigger.zeta, trigger.release)
        before, after = _random_steps(rng, levels)
        due = _running(EventTrigger(UGVS, trigger), modes, before, after)
        for j in range(UGVS):
            size = float(np.abs(np.concatenate([before[j], after[j]])).max()) + abs(float(levels[j]))
            low, high = _range(before[j], after[j])
            spare = high - levels[j] if modes[j] == Mode.SUPERVISING else levels[j] - low
            compared += 1
            if due[j] == (spare >= 0.0):
                continue
            if abs(spare) <= ROUNDING * size:
                excused += 1
                continue
            missed, spurious = missed + (not due[j]), spurious + bool(due[j])
            first = first or {
                "mode": Mode(int(modes[j])).name, "begins": before[j].tolist(), "ends": after[j].tolist(),
                "least_m": low, "largest_m": high, "level_m": float(levels[j]),
            }  # fmt: skip
    return {"steps": compared, "missed": missed, "spurious": spurious, "within_rounding": excused, "first": first}


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
    near = np.where(rng.random(UGVS) < 0.5, *extremes(before, after))  # move x so that this is near the level
    shift = levels - near + size[:, 0] * rng.choice([-1.0, 1.0], UGVS) * 10.0 ** rng.uniform(-9.0, 0.0, UGVS)
    before[:, 3] += shift
    after[:, 3] += shift
    return before, after


def _running(system: EventTrigger, modes: npt.NDArray[np.int64], before: Array, after: Array) -> list[bool]:
    """For which UGVs the running system makes a transition at the end of its step."""
    context, count, step = system.CreateDefaultContext(), len(modes), 0.1
    context.SetTime(1.0 + step)

    def signals(parts: Array) -> list[Array]:
        return [np.zeros(3 * count), parts[:, :3].ravel(), parts[:, 3]]

    status = np.column_stack([modes, modes, np.where(modes > 0, 0.0, -1.0), np.full(count, -1.0)])
    context.SetDiscreteState(0, status.ravel())
    context.SetDiscreteState(1, np.concatenate([[1.0], *signals(before)]))
    position, reference, noise = signals(after)
    system.GetInputPort("team_position").FixValue(context, np.concatenate([position, np.zeros(3)]))
    system.GetInputPort("reference").FixValue(context, np.concatenate([reference, np.zeros(3 * count)]))
    system.GetInputPort("noise").FixValue(context, noise)
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
    """Product of two errors, without their noise."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
