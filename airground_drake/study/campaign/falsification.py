"""Search for a violation: simulate and judge the points of the unit cube that a sampler asks for."""

import math
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import PluginError, ScenarioError, described, one_line, raised_as
from airground_drake.base.progress import SILENT, Progress
from airground_drake.scenario.estimate import Limits
from airground_drake.scenario.load import from_data
from airground_drake.sim.simulation import Engine
from airground_drake.study.campaign.distributions import dimensions, values_at
from airground_drake.study.campaign.pool import Pool
from airground_drake.study.campaign.rows import JUDGED, Row
from airground_drake.study.campaign.search import Sampler
from airground_drake.study.campaign.spec import Spec
from airground_drake.study.campaign.work import rows_at, rows_of_scenario

FAILED = -1.0  # value of a violation without a margin below 0
LATEST_S = 1e9  # time of an arrival that never happens, s; infinity would mean "not measured"


@dataclass(frozen=True)
class Margin:
    """The least margin of a claim; a refuted claim is a counterexample."""

    claim: str

    def value(self, rows: Sequence[Row]) -> float:
        return min((self._of(row) for row in rows if row["claim"] == self.claim), default=math.inf)

    def found(self, rows: Sequence[Row]) -> bool:
        return any(row["claim"] == self.claim and row["status"] == "refuted" for row in rows)

    def said(self, value: float) -> str:
        return f"{self.claim} is refuted" if value == FAILED else f"least margin of {self.claim} {value:.6g}"

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
        return self.value(rows) < -self.limit

    def said(self, value: float) -> str:
        return "a UGV does not arrive" if -value == LATEST_S else f"largest {self.column} {-value:.6g}"

    def _of(self, row: Row) -> float:
        """The value of a row; LATEST_S for a UGV that does not arrive, NaN if the run was shorter than the limit."""
        if self.column != "arrival_s" or row["arrived"] == row["ugvs"]:
            return float(row[self.column])
        return math.nan if row["duration_s"] < self.limit < math.inf else LATEST_S


Objective = Margin | Most


@dataclass(frozen=True)
class Search:
    """A search; it is sent to the processes that simulate."""

    spec: Spec  # of the scenarios; a course is that of draw 0
    objective: Objective  # is minimised
    limits: Limits  # largest scenario and longest time
    engine: Engine = "batch"  # simulator of the runs

    def values(self, point: Array) -> dict[str, Any]:
        """By dotted key, at a point of the unit cube."""
        return values_at(self.spec.drawn, point)

    def at(self, points: Array, k: int) -> tuple[float, bool]:
        """The objective at a point, and whether it is a counterexample."""
        return self._judge(rows_at(self.spec, self.values(points[k]), 0, self.limits, self.engine))

    def fails(self, data: dict[str, Any]) -> bool:
        """Whether a scenario, as nested dicts and lists, is valid and a counterexample."""
        try:
            scenario = from_data(data, "smaller scenario")
        except ScenarioError:
            return False
        return self._judge(rows_of_scenario(self.spec, scenario, self.limits, engine=self.engine))[1]

    def _judge(self, rows: list[Row]) -> tuple[float, bool]:
        return self.objective.value(rows), self.objective.found(rows)


@dataclass(frozen=True)
class Best:
    """The result of a search."""

    tried: int  # number of points
    value: float  # least objective; infinite if it was never measured
    point: Array  # its point, (n,); (0,) if it was never measured
    found: bool  # whether this is a counterexample


def falsify(search: Search, sampler: Sampler, number: int, pool: Pool, progress: Progress = SILENT) -> Best:
    """Try points until there is a counterexample, or `number` of them were tried."""
    # number: largest number of points; the last batch of the sampler is cut without informing the sampler.
    best = Best(0, np.inf, np.empty(0), False)
    while best.tried < number and not best.found:
        asked = _asked(sampler, dimensions(search.spec.drawn))
        points = asked[: number - best.tried]
        values = np.full(len(points), np.inf)
        refuted = np.zeros(len(points), dtype=bool)
        for k, judged in pool(partial(search.at, points), range(len(points))):
            if judged is not None:
                values[k], refuted[k] = judged
        if len(points) == len(asked):
            with _guarded(sampler, "tell"):
                sampler.tell(points.copy(), values.copy())
        k = int(np.argmin(np.where(refuted, values, np.inf))) if refuted.any() else int(values.argmin())
        tried = best.tried + len(points)
        if refuted.any() or values[k] < best.value:
            best = Best(tried, float(values[k]), points[k], bool(refuted[k]))
        else:
            best = replace(best, tried=tried)
        progress.advance(len(points), f"least {best.value:.6g}")
    return best


def _asked(sampler: Sampler, n: int) -> Array:
    """The points (k, n) that a sampler asks for; PluginError if they are not one or more points in [0, 1)."""
    with _guarded(sampler, "ask"):
        points = np.array(sampler.ask(), dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != n or not len(points):
        raise PluginError(f"ask of sampler {_name(sampler)}: array {points.shape}, wanted (k, {n}), k at least 1")
    if not ((points >= 0.0) & (points < 1.0)).all():
        raise PluginError(f"ask of sampler {_name(sampler)}: a point outside [0, 1)")
    return points


def _guarded(sampler: Sampler, what: str) -> AbstractContextManager[None]:
    """Turn an exception of a sampler's method into a `PluginError` that names the method."""
    return raised_as(lambda error: PluginError(f"{what} of sampler {_name(sampler)}: {described(error)}"))


def _name(sampler: Sampler) -> str:
    return one_line(type(sampler).__name__)
