"""A campaign from beginning to end: judge unfinished draws, store them, write the evidence."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass
from decimal import Decimal
from functools import partial
from importlib.metadata import version
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Any

from airground_drake.base import files
from airground_drake.base.errors import FolderError, LimitError, UnknownNameError
from airground_drake.base.progress import SILENT, Progress
from airground_drake.base.registry import RUN_CLAIMS
from airground_drake.base.statuses import UNDECIDED
from airground_drake.scenario.estimate import DEFAULT_LIMITS, MOST_ROWS, Limits
from airground_drake.sim.simulation import Engine
from airground_drake.study.campaign.evidence import evidence
from airground_drake.study.campaign.page import page
from airground_drake.study.campaign.pool import Pool
from airground_drake.study.campaign.rows import UNFINISHED, Row, is_tested
from airground_drake.study.campaign.spec import Spec
from airground_drake.study.campaign.statistics import confidence_sequence
from airground_drake.study.campaign.store import Store
from airground_drake.study.campaign.swept import by_value, per_run
from airground_drake.study.campaign.work import died, rows_of

EVIDENCE, PAGE = "evidence.json", "campaign.html"
_RULE = re.compile(r"\s*(?P<claim>[A-Za-z0-9_.-]+)\s*(?P<sign>[<>])\s*(?P<value>[0-9.eE+-]+)\s*")


def conduct(
    spec: Spec,
    folder: Path,
    pool: Pool,
    number: int | None = None,
    *,
    resume: bool = False,
    stopping: Stopping | None = None,
    limits: Limits = DEFAULT_LIMITS,
    engine: Engine = "batch",
    progress: Progress = SILENT,
) -> dict[str, Any]:
    # folder: new or empty; with `resume`, a folder with a part of the same campaign.
    # number: of draws; default: all combinations of the grids.
    if stopping is not None and spec.dependent:
        raise ValueError(f"--stop-when needs independent draws; not independent: {', '.join(spec.dependent)}")
    wanted = range(spec.combinations if number is None else number)
    base = spec.base()
    asked = wanted.stop * len(spec.runs or base.runs) * len(spec.claims or (*RUN_CLAIMS, *base.claims))
    if asked > MOST_ROWS:
        allowed = f"{MOST_ROWS:g} rows, one for each draw, run and claim"
        raise LimitError(spec.name, f"{Decimal(wanted.stop):.3g} draws ({Decimal(asked):.3g} rows)", allowed)
    if not limits.plugins:
        spec.refuse_plugins()
    store = Store(folder, _manifest(spec, limits), resume=resume)
    try:
        if (last := max(store.finished, default=0)) >= wanted.stop:
            raise FolderError(f"{folder} has draw {last}; allowed: -n {last + 1} or more")
        before: Any = store.table().to_dict("records") if stopping is not None else ()
        known = groupby(before, key=itemgetter("index"))
        met = stopping is not None and any(stopping.met_in_order(index, list(rows)) for index, rows in known)
        left = [] if met else [index for index in wanted if index not in store.finished]
        progress.stage(spec.name, len(left), "draws")
        refuted = Counter[str]()
        for index, judged in pool(partial(rows_of, spec, limits=limits, engine=engine), left):
            rows = judged or died(index, spec.values(index))
            store.add(rows)
            refuted.update(row["claim"] for row in rows if row["status"] == "refuted")
            counts = ", ".join(f"{claim} {count}" for claim, count in refuted.most_common(3))
            progress.advance(1.0, f"refuted: {counts or 'nothing'}")
            if stopping is not None and stopping.met_in_order(index, rows):
                break
        table = store.table()
    finally:
        store.close()
    stopped = stopping.last if stopping is not None else None
    of: dict[str, Any] = {"name": spec.name, "title": spec.title, "spec": spec.source, "stopped": stopped}
    if stopped is not None:  # other processes may have finished later draws meanwhile
        table = table[table["index"] <= stopped]
    runs = per_run(table) if spec.swept else table[:0]
    of["swept"] = [{"key": key, "entries": by_value(runs, key)} for key in spec.swept]
    result: dict[str, Any] = files.strict(evidence(table, spec.marks, spec.dependent) | of)
    files.write_json(folder / EVIDENCE, result)
    files.write_text(folder / PAGE, page(result, table))
    return result


def _manifest(spec: Spec, limits: Limits) -> dict[str, Any]:
    third_party = spec.third_party if limits.plugins else {}
    return ({"third_party": third_party} if third_party else {}) | {
        "name": spec.name,
        "spec_sha256": spec.digest,
        "scenario_sha256": spec.base().digest,
        "package": version("airground_drake"),
        "drake": version("drake"),
        "limits": {name: value for name, value in limits._asdict().items() if name != "plugins"},
    }


@dataclass
class Stopping:
    """Stopping rule: the probability of a violation is known to be below, or above, a value."""

    claim: str  # identifier
    below: bool  # whether the upper bound must be below `value`; otherwise the lower bound must be above it
    value: float  # a probability

    def __post_init__(self) -> None:
        self._counts: dict[str, list[int]] = {}
        self._unfinished = Counter[str]()
        self._waiting: dict[int, list[Row]] = {}  # finished draws with a gap before them
        self._next = 0
        self.last: int | None = None  # the draw that met the rule

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

    def met_in_order(self, index: int, rows: list[Row]) -> bool:
        """Add a finished draw; return whether the draws up to the first unfinished one meet the rule."""
        self._waiting[index] = rows  # short draws finish first
        while self.last is None and self._next in self._waiting:
            if self.met(self._waiting.pop(self._next)):
                self.last = self._next
            self._next += 1
        return self.last is not None

    def _decides(self, run: str) -> bool:
        refuted, undecided, tested = self._counts[run]
        unfinished = self._unfinished[run] + self._unfinished[""]
        if self.below:
            return confidence_sequence(refuted + undecided + unfinished, tested + unfinished).high < self.value
        return confidence_sequence(refuted, tested + unfinished).low > self.value
