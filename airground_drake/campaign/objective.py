"""Objectives that a falsification minimises: the margin of a claim, or a negated time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from airground_drake.campaign.rows import JUDGED, Row

FAILED = -1.0
"""Value of a violation that has no margin."""


@dataclass(frozen=True)
class Margin:
    """The least margin of a claim; below 0, or refuted, is found."""

    claim: str

    def value(self, rows: Sequence[Row]) -> float:
        """Of the rows of a draw; infinite where nothing was measured."""
        return min((self._of(row) for row in rows if row["claim"] == self.claim), default=math.inf)

    def found(self, rows: Sequence[Row]) -> bool:
        """Whether the claim is refuted."""
        return any(row["claim"] == self.claim and row["status"] == "refuted" for row in rows)

    def _of(self, row: Row) -> float:
        if row["status"] == "refuted":
            return min(FAILED, row["margin"]) if math.isnan(row["margin"]) or row["margin"] >= 0.0 else row["margin"]
        return math.inf if math.isnan(row["margin"]) else float(row["margin"])


@dataclass(frozen=True)
class Most:
    """The largest value of a column of `rows.COLUMNS`, over the runs; above a limit, if one is given, is found."""

    column: str
    limit: float = math.inf

    def value(self, rows: Sequence[Row]) -> float:
        """Of the rows of a draw, with the sign changed; infinite where nothing was measured."""
        values = [-self._of(row) for row in rows if row["ended"] == JUDGED]
        return min((each for each in values if not math.isnan(each)), default=math.inf)

    def found(self, rows: Sequence[Row]) -> bool:
        """Whether the limit is passed."""
        return self.value(rows) < -self.limit

    def _of(self, row: Row) -> float:
        """The value of a row; a UGV that does not arrive is later than all others."""
        never = self.column == "arrival_s" and row["arrived"] < row["ugvs"]
        return LATEST_S if never else float(row[self.column])


Objective = Margin | Most

LATEST_S = 1e9
"""In place of infinity, which means that nothing was measured."""
