"""Rules to end a campaign early: with `SAFE-TRACE < 1e-4`, when the anytime-valid bound is below 1e-4."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass

from airground_drake.base.errors import UnknownNameError
from airground_drake.base.registry import RUN_CLAIMS
from airground_drake.base.statuses import UNDECIDED
from airground_drake.study.campaign.rows import UNFINISHED, Row, is_tested
from airground_drake.study.campaign.statistics import confidence_sequence

_RULE = re.compile(r"\s*(?P<claim>[A-Za-z0-9_.-]+)\s*(?P<sign>[<>])\s*(?P<value>[0-9.eE+-]+)\s*")


@dataclass
class Stopping:
    """Stop when the probability of a violation is known to be below, or above, a value."""

    claim: str  # identifier
    below: bool  # whether the upper bound must be below `value`; otherwise the lower bound must be above it
    value: float  # a probability

    def __post_init__(self) -> None:
        self._counts: dict[str, list[int]] = {}
        self._unfinished = Counter[str]()

    @classmethod
    def parse(cls, text: str, claims: Collection[str] = ()) -> Stopping:
        # claims: identifiers of the claims that are judged; empty: all about runs.
        match = _RULE.fullmatch(text)
        try:
            value = float(match["value"]) if match else 0.0
        except ValueError:
            value = 0.0
        if match is None or not 0.0 < value < 1.0:
            raise ValueError(f"{text!r} is not allowed; wanted: CLAIM < PROBABILITY or CLAIM > PROBABILITY")
        if match["claim"] not in (judged := claims or tuple(RUN_CLAIMS)):
            raise UnknownNameError("claim that is judged", match["claim"], judged)
        return cls(match["claim"], match["sign"] == "<", value)

    def met(self, rows: list[Row]) -> bool:
        """Count the rows of one more draw; return whether every run of the scenario now meets the rule."""
        for row in rows:
            self._unfinished[row["run"]] += row["ended"] in UNFINISHED
            if row["claim"] != self.claim and not (row["run"] and row["ended"] in UNFINISHED):
                continue
            counts = self._counts.setdefault(row["run"], [0, 0, 0])
            if row["claim"] and is_tested(row["status"], row["exercised"]):
                counts[0] += row["status"] == "refuted"
                counts[1] += row["status"] in UNDECIDED
                counts[2] += 1
        return bool(self._counts) and all(map(self._decides, self._counts))

    def _decides(self, run: str) -> bool:
        refuted, undecided, tested = self._counts[run]
        unfinished = self._unfinished[run] + self._unfinished[""]
        if self.below:
            return confidence_sequence(refuted + undecided + unfinished, tested + unfinished).high < self.value
        return confidence_sequence(refuted, tested + unfinished).low > self.value


class InOrder:
    """Gives a rule the draws in the order of their numbers, since short draws finish first."""

    def __init__(self, rule: Stopping, wanted: Iterable[int]) -> None:
        """Expect the draws with these numbers, in this order."""
        self._rule, self._wanted = rule, iter(wanted)
        self._next = next(self._wanted, None)
        self._waiting: dict[int, list[Row]] = {}
        self.last: int | None = None  # the draw that met the rule

    def met(self, index: int, rows: list[Row]) -> bool:
        """Take one more finished draw; return whether the draws without a gap before them meet the rule."""
        self._waiting[index] = rows
        while self.last is None and self._next in self._waiting:
            if self._rule.met(self._waiting.pop(self._next)):
                self.last = self._next
            self._next = next(self._wanted, None)
        return self.last is not None
