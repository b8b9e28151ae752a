"""The result of a check: status, margin, evidence, chart."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.statuses import Status


@dataclass(frozen=True)
class Chart:
    """Lines and marked points, drawn in a report beside the claim that it is about.

    Attributes:
        title: of the picture.
        x: name of the axis across, with its unit.
        y: name of the axis up, with its unit.
        lines: by name, numbers across and as many up.
        marks: points by name.
        log: the axes that are logarithmic, among "xy"; numbers there are above 0.
        caption: what to see.
    """

    title: str
    x: str
    y: str
    lines: Mapping[str, tuple[Sequence[float] | Array, Sequence[float] | Array]]
    marks: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    log: str = ""
    caption: str = ""

    def __post_init__(self) -> None:
        for name, (x, y) in self.lines.items():
            if not len(x) == len(y) > 0:
                raise ValueError(f"line {name!r} has {len(x)} numbers across and {len(y)} up; wanted: as many, not 0")
        for axis in self.log:
            numbers = np.hstack([at["xy".index(axis)] for at in (*self.lines.values(), *self.marks.values())])
            if not (numbers > 0.0).all():
                raise ValueError(f"{numbers.min():g} on the logarithmic axis {axis}; allowed: numbers above 0")


@dataclass(frozen=True)
class Finding:
    """The result of a check.

    Attributes:
        status: the verdict class.
        margin: signed distance from refutation (negative: refuted), in `unit`; None if the claim has no margin. With
            `Claim.margin_decides` false it refutes nothing, such as a gap to an optimum.
        unit: unit of the margin.
        where: where the margin is attained: robot, obstacle, time and the like.
        counterexample: for `refuted`: enough to reproduce it by hand.
        evidence: numbers behind the verdict: the keys are those in report.json, the values strict JSON, arrays and
            dataclasses. If the claim could not be decided, `error` says why.
        quantity: what the margin is of, in a few words.
        exercised: how often the claim was put to the test, in what its `exercised_by` counts; 0: nothing could have
            refuted it; None: not counted.
        figure: drawn beside the claim, or None.
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
    figure: Chart | None = None
    from_cache: bool = False

    def to_json(self) -> dict[str, Any]:
        """All fields, with records as objects."""
        return {column.name: _in_json(getattr(self, column.name)) for column in fields(Finding)}


def _in_json(value: Any) -> Any:
    if is_dataclass(value):
        return {column.name: _in_json(getattr(value, column.name)) for column in fields(value)}
    if isinstance(value, Mapping):
        return {key: _in_json(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return value.tolist()
    return [_in_json(item) for item in value] if isinstance(value, (list, tuple)) else value
