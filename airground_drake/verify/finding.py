"""The shape of what a check found: a status, a margin, the evidence."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from airground_drake.base.statuses import Status

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
    evidence: Mapping[str, Any] = field(default_factory=dict)
    quantity: str = ""
    exercised: int | None = None
    from_cache: bool = False
