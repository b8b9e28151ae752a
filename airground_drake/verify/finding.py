"""The shape of what a check found: a status, a margin, the evidence."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field, fields
from typing import Any

from airground_drake.statuses import STATUSES, Status

PLAIN_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}")
"""A file name that stays in its folder, on any system."""


@dataclass(frozen=True)
class Finding:
    """What a check found.

    Attributes:
        status: the verdict class.
        margin: signed distance from refutation (negative: refuted), in `unit`; None where there is none.
        unit: unit of the margin.
        where: where the margin is attained: robot, obstacle, time and the like.
        counterexample: for `refuted`: enough to reproduce it by hand.
        evidence: numbers behind the verdict, strict JSON.
        quantity: what the margin is of, in a few words.
        exercised: how often the claim was put to the test, in what its `exercised_by` counts; 0: nothing could have
            refuted it; None: not counted.
        from_cache: whether it was made by an earlier report, with the same inputs, code and engines, and kept.
    """

    status: Status
    margin: float | None = None
    unit: str = ""
    where: dict[str, Any] = field(default_factory=dict)
    counterexample: dict[str, Any] | None = None
    evidence: dict[str, Any] = field(default_factory=dict)
    quantity: str = ""
    exercised: int | None = None
    from_cache: bool = False

    @classmethod
    def from_json(cls, value: Any) -> Finding:
        """The finding that `dataclasses.asdict` has made this of.

        Raises:
            ValueError: if a field is missing, unknown or of another type, or the status is none.
        """
        known = {each.name for each in fields(cls)}
        if not isinstance(value, dict) or set(value) != known:
            raise ValueError(f"a finding has the fields {sorted(known)}")
        for name, allowed in _TYPES.items():
            if type(value[name]) not in allowed:
                raise ValueError(f"{name} of a finding is a {type(value[name]).__name__}")
        if value["status"] not in STATUSES:
            raise ValueError(f"{value['status']!r} is no status; allowed: {', '.join(STATUSES)}")
        if value["margin"] is not None and not math.isfinite(value["margin"]):
            raise ValueError("a margin is finite")
        if value["exercised"] is not None and value["exercised"] < 0:
            raise ValueError(f"a claim cannot be exercised {value['exercised']} times")
        return cls(**value)


_TYPES: dict[str, tuple[type, ...]] = {
    "status": (str,),
    "margin": (float, int, type(None)),
    "unit": (str,),
    "where": (dict,),
    "counterexample": (dict, type(None)),
    "evidence": (dict,),
    "quantity": (str,),
    "exercised": (int, type(None)),
    "from_cache": (bool,),
}
"""What each field of a finding is in JSON; a truth value is no number."""
