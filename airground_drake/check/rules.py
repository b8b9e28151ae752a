"""Rules of the checker. A broken rule is reported with its name, place, time and both values.

A rule is a call of `same`, `close` or `holds` with a name, the recorded and the recomputed value.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

# Tolerance of the claims on times (s), lengths (m) and velocities (m/s): thousands of roundings err by less.
SMALL = 1e-9


@dataclass(eq=False)
class Disagreement(Exception):  # noqa: N818 - a result of the check, not an error of the program
    """The files violate a rule: `recorded` differs from `recomputed`."""

    # `about` is the robot, pair, event, decision or file; `t_s` is the time in the run, s, if there is one.

    rule: str
    recorded: Any
    recomputed: Any
    about: str = ""
    t_s: float | None = None


@dataclass(eq=False)
class NotEstablished(Exception):  # noqa: N818
    """A rule cannot be applied, because a file cannot be read or something is missing; `why` says what."""

    rule: str
    why: str
    about: str = ""


@dataclass(frozen=True)
class Found:
    """The checker's own result for a claim."""

    status: str  # the verdict
    margin: float | None = None  # distance from refutation; None where the claim has no number
    # How often the claim was tested, at least and at most; they differ where rounding decides.
    exercised: tuple[int, int] | None = None
    because: Disagreement | None = None  # the broken rule that refutes the claim; None if its margin decides


def same(rule: str, recorded: Any, recomputed: Any, *, about: str = "", t_s: float | None = None) -> None:
    """Compare two values exactly; the first part of nested values that differs is named."""

    def descend(theirs: Any, ours: Any, path: Any) -> None:
        same(rule, theirs, ours, about=f"{about}.{path}".strip("."), t_s=t_s)

    if isinstance(recomputed, Mapping) and isinstance(recorded, dict):
        for key in sorted({*recomputed, *recorded}):
            descend(recorded.get(key, "nothing"), recomputed.get(key, "nothing"), key)
    elif isinstance(recomputed, (list, tuple)) and isinstance(recorded, list):
        if len(recomputed) != len(recorded):
            raise Disagreement(f"{rule}: number of entries", len(recorded), len(recomputed), about, t_s)
        for k, (theirs, ours) in enumerate(zip(recorded, recomputed, strict=True)):
            descend(theirs, ours, k)
    elif recorded != recomputed or not (type(recorded) is type(recomputed) or _are_numbers(recorded, recomputed)):
        raise Disagreement(rule, recorded, recomputed, about, t_s)


def _are_numbers(*values: Any) -> bool:
    return all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in values)


def close(
    rule: str, recorded: Any, recomputed: Any, *, within: Any, about: str = "", t_s: float | Array | None = None
) -> None:
    """Compare two arrays of one shape, to an absolute tolerance `within`; a nan differs from everything."""
    # `t_s` is one time, or one for each entry along the first axis; likewise below.
    theirs, ours = np.asarray(recorded, dtype=np.float64), np.asarray(recomputed, dtype=np.float64)
    if theirs.shape != ours.shape:
        raise Disagreement(f"{rule}: number of values", list(theirs.shape), list(ours.shape), about)
    holds(rule, np.abs(theirs - ours) <= within, theirs, ours, about=about, t_s=t_s)


def holds(
    rule: str, held: Any, recorded: Any, recomputed: Any, *, about: str = "", t_s: float | Array | None = None
) -> None:
    """Require a condition `held`, (), (K,) or (K, ...)."""
    # `recorded` has that shape; `recomputed` has it too, or is one text.
    wrong = ~np.asarray(held)
    if not wrong.any():
        return
    k = int(np.argmax(wrong.reshape(len(wrong), -1).any(axis=1))) if wrong.ndim else None
    raise Disagreement(rule, _entry(recorded, k), _entry(recomputed, k), about, _entry(t_s, k))


def _entry(values: Any, k: int | None) -> Any:
    """Entry k along the first axis, as plain numbers; a text, None or a single number applies to all entries."""
    if values is None or isinstance(values, str) or np.ndim(values) == 0:
        return values.item() if isinstance(values, (np.ndarray, np.generic)) else values
    entries = np.asarray(values).tolist()
    return entries if k is None else entries[k]
