"""Objectives that a falsification minimises: the margin of a claim, or a negated time."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from airground_drake.study.campaign.rows import JUDGED, Row

FAILED = -1.0  # value of a violation that has no margin


@dataclass(frozen=True)
class Margin:
    """The least margin of a claim; a refuted claim is a counterexample."""

    claim: str

    def value(self, rows: Sequence[Row]) -> float:
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
    """The largest value of a column of `rows.COLUMNS`; a value above the limit is a counterexample."""

    column: str
    limit: float = math.inf

    def value(self, rows: Sequence[Row]) -> float:
        values = [-self._of(row) for row in rows if row["ended"] == JUDGED]
        return min((value for value in values if not math.isnan(value)), default=math.inf)

    def found(self, rows: Sequence[Row]) -> bool:
        """Whether the limit is exceeded."""
        return self.value(rows) < -self.limit

    def _of(self, row: Row) -> float:
        """The value of a row. A UGV that does not arrive counts as LATEST_S."""
        never = self.column == "arrival_s" and row["arrived"] < row["ugvs"]
        return LATEST_S if never else float(row[self.column])


Objective = Margin | Most

LATEST_S = 1e9  # time of an arrival that never happens, s; infinity would mean that nothing was measured
