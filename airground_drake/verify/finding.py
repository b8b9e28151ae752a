"""The shape of what a check found: a status, a margin, the evidence."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from airground_drake.registry import Status


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
        certificates: texts that others can check, by file name.
        quantity: what the margin is of, in a few words.
        exercised: how often the claim was put to the test, in what its `exercised_by` counts; 0: nothing could have
            refuted it; None: not counted.
    """

    status: Status
    margin: float | None = None
    unit: str = ""
    where: dict[str, Any] = field(default_factory=dict)
    counterexample: dict[str, Any] | None = None
    evidence: dict[str, Any] = field(default_factory=dict)
    certificates: dict[str, str] = field(default_factory=dict)
    quantity: str = ""
    exercised: int | None = None
