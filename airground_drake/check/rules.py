"""Rules, and what is said of a broken one: the rule, where, when, and both values.

A rule is a call of `same`, `agrees`, `close`, `at_most` or `holds` with its name, the recorded and the recomputed
value. So nothing is rejected without a reason.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

SMALL = 1e-9
"""Tolerance of the claims on times (s), lengths (m) and velocities (m/s): thousands of roundings err by less."""


@dataclass(eq=False)
class Disagreement(Exception):  # noqa: N818 - what the program is for, not an error of it
    """A rule that the files break.

    Attributes:
        rule: its name.
        recorded: what the files say.
        recomputed: what follows from them.
        about: the robot, pair, event, decision or file.
        t_s: when in the run, s; None where there is no time.
    """

    rule: str
    recorded: Any
    recomputed: Any
    about: str = ""
    t_s: float | None = None


@dataclass(eq=False)
class NotEstablished(Exception):  # noqa: N818
    """A rule that cannot be applied, because a file cannot be read or something is missing.

    Attributes:
        rule: its name.
        why: the reason.
        about: as above.
    """

    rule: str
    why: str
    about: str = ""


@dataclass(frozen=True)
class Found:
    """What the checker's own formula gives for a claim.

    Attributes:
        status: the verdict.
        margin: distance from refutation; None where the claim has no number.
        exercised: how often the claim was put to the test, at least and at most; they differ where rounding decides.
        because: the broken rule that refutes the claim; None if its margin decides.
    """

    status: str
    margin: float | None = None
    exercised: tuple[int, int] | None = None
    because: Disagreement | None = None


def same(rule: str, recorded: Any, recomputed: Any, *, about: str = "", t_s: float | None = None) -> None:
    """Raise Disagreement unless both are equal; of nested values the first part that differs is named.

    Raises:
        Disagreement: if they differ.
    """
    _compare(rule, recorded, recomputed, about, t_s, within=0.0, every_key=True)


def agrees(
    rule: str, recorded: Any, recomputed: Any, *, within: float, about: str = "", t_s: float | None = None
) -> None:
    """Raise Disagreement unless every recomputed part is recorded, numbers to within `within` * (1 + size).

    Keys that are recorded and not recomputed are left alone.

    Raises:
        Disagreement: if a part differs.
    """
    _compare(rule, recorded, recomputed, about, t_s, within=within, every_key=False)


def close(
    rule: str, recorded: Any, recomputed: Any, *, within: Any, about: str = "", t_s: float | Array | None = None
) -> None:
    """Raise Disagreement unless two arrays of one shape differ by `within` at most; a nan differs from everything.

    Args:
        rule: name of the rule.
        recorded: numbers, any shape.
        recomputed: numbers of the same shape.
        within: absolute tolerance; a number, or an array that broadcasts.
        about: of what.
        t_s: one time, or one for each entry along the first axis.

    Raises:
        Disagreement: with the first entry along the first axis that differs.
    """
    theirs, ours = np.asarray(recorded, dtype=np.float64), np.asarray(recomputed, dtype=np.float64)
    if theirs.shape != ours.shape:
        raise Disagreement(f"{rule}: number of values", list(theirs.shape), list(ours.shape), about)
    with np.errstate(invalid="ignore"):
        holds(rule, np.abs(theirs - ours) <= within, theirs, ours, about=about, t_s=t_s)


def at_most(
    rule: str, recorded: Any, limit: Any, *, within: float = 0.0, about: str = "", t_s: float | Array | None = None
) -> None:
    """Raise Disagreement where a number is above its limit by more than `within`, or is not a number.

    Raises:
        Disagreement: with the first entry along the first axis that is.
    """
    theirs, most = np.broadcast_arrays(np.asarray(recorded, dtype=np.float64), np.asarray(limit, dtype=np.float64))
    holds(f"{rule} (at most)", theirs <= most + within, theirs, most, about=about, t_s=t_s)


def holds(
    rule: str, held: Any, recorded: Any, recomputed: Any, *, about: str = "", t_s: float | Array | None = None
) -> None:
    """Raise Disagreement where a condition does not hold.

    Args:
        rule: name of the rule.
        held: the condition, (), (K,) or (K, ...).
        recorded: what it is about, of that shape.
        recomputed: what it should be: of that shape, or one text.
        about: of what.
        t_s: one time, or one for each entry along the first axis.

    Raises:
        Disagreement: with the first entry along the first axis for which it does not hold.
    """
    wrong = ~np.asarray(held)
    if not wrong.any():
        return
    k = int(np.argmax(wrong.reshape(len(wrong), -1).any(axis=1))) if wrong.ndim else None
    raise Disagreement(rule, _entry(recorded, k), _entry(recomputed, k), about, _entry(t_s, k))


def _entry(values: Any, k: int | None) -> Any:
    """Entry k along the first axis, as plain numbers; a text, None or a single number is the same for all entries."""
    if values is None or isinstance(values, str) or np.ndim(values) == 0:
        return values.item() if isinstance(values, (np.ndarray, np.generic)) else values
    found = np.asarray(values)
    return found.tolist() if k is None else found[k].tolist()


def _compare(
    rule: str, recorded: Any, recomputed: Any, about: str, t_s: float | None, *, within: float, every_key: bool
) -> None:
    def descend(theirs: Any, ours: Any, path: str) -> None:
        _compare(rule, theirs, ours, f"{about}.{path}".strip("."), t_s, within=within, every_key=every_key)

    if isinstance(recomputed, Mapping) and isinstance(recorded, dict):
        keys = {*recomputed, *recorded} if every_key else {*recomputed}
        for key in sorted(keys, key=str):
            descend(recorded.get(key, "nothing"), recomputed.get(key, "nothing"), str(key))
    elif isinstance(recomputed, (list, tuple)) and isinstance(recorded, list):
        if len(recomputed) != len(recorded):
            raise Disagreement(f"{rule}: number of entries", len(recorded), len(recomputed), about, t_s)
        for k, (theirs, ours) in enumerate(zip(recorded, recomputed, strict=True)):
            descend(theirs, ours, str(k))
    elif not _equal(recorded, recomputed, within):
        raise Disagreement(rule, recorded, recomputed, about, t_s)


def _equal(recorded: Any, recomputed: Any, within: float) -> bool:
    """Numbers to within a tolerance, everything else exactly; a truth value is no number."""
    if _is_number(recorded) and _is_number(recomputed):
        return bool(recorded == recomputed or abs(recorded - recomputed) <= within * (1.0 + abs(recomputed)))
    return type(recorded) is type(recomputed) and bool(recorded == recomputed)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
