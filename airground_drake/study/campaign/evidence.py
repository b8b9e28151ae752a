"""Conclusions from the rows of a campaign: bounds for each claim, where it fails, the worst runs."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import chain, combinations
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from pandas.api.types import is_numeric_dtype
from scipy.stats import MonteCarloMethod, chi2_contingency

from airground_drake.base.arrays import Array
from airground_drake.base.statuses import UNDECIDED
from airground_drake.study.campaign.rows import BOTH, DRAKE, JUDGED, TIMES, UNFINISHED, is_tested
from airground_drake.study.campaign.statistics import CONFIDENCE, clopper_pearson, confidence_sequence

WORST = 5  # runs of least margin that are listed for each claim
BINS = 4  # parts of a key in maps of where a claim fails: quarters of its draws
MOST_VALUES = 12  # most values of a key that is not a number, such as lists of policies, in these maps
MOST_LISTED = 50  # runs that are listed at most; the dataset has them all
UNRELATED = "seed"  # a key that cannot explain a failure: neighbouring seeds of the noise are unrelated
TABLES = 999  # tables that are drawn for a p-value, for each pair of keys
BY_CHANCE = 0.05  # significance level: a map is shown if its differences have a p-value below this
QUANTILES = (0.0, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 1.0)

Json = dict[str, Any]


class Counts(NamedTuple):
    """Counts of the runs of one claim, over all draws."""

    tested: int  # runs that could have refuted the claim, and unfinished ones
    refuted: int  # violations
    undecided: int  # tested runs without a decision; they count as violations in every upper bound
    idle: int  # runs that could not have refuted the claim; these are ignored

    @classmethod
    def of(cls, rows: pd.DataFrame, unfinished: int) -> Counts:
        """Count the rows of one claim and run; `unfinished` is the number of further runs without a row."""
        tested = _tested(rows)
        status = rows.loc[tested, "status"]
        refuted, undecided = int((status == "refuted").sum()), int(status.isin(UNDECIDED).sum())
        return cls(int(tested.sum()) + unfinished, refuted, undecided + unfinished, int((~tested).sum()))

    def interval(self, *, anytime: bool) -> tuple[float, float]:
        # Undecided runs count as passes in the lower bound and as violations in the upper bound.
        bounds = confidence_sequence if anytime else clopper_pearson
        low = bounds(self.refuted, self.tested).low
        return low, bounds(self.refuted + self.undecided, self.tested).high


def _tested(rows: pd.DataFrame) -> pd.Series:
    return pd.Series(map(is_tested, rows["status"], rows["exercised"]), rows.index, dtype=bool)


def evidence(table: pd.DataFrame, marks: Mapping[str, float] | None = None, dependent: Sequence[str] = ()) -> Json:
    # dependent: keys whose values depend on other draws; with any, claims have no intervals.
    drawn = drawn_keys(table.drop_duplicates("index"))
    table = table.drop(columns=["drawn", "digest"])  # long texts, which would be copied below
    judged = table[table["ended"] == JUDGED]
    runs = judged.drop_duplicates(["index", "run"])
    failed = table[table["ended"] != JUDGED]
    unfinished = failed.loc[failed["ended"].isin(UNFINISHED), "run"].value_counts()
    ended = pd.concat([failed, judged]).drop_duplicates("index")["ended"]  # one run that was not judged is enough
    return {
        "confidence": CONFIDENCE,
        "dependent": list(dependent),
        "draws": len(drawn),
        "ended": {str(name): int(count) for name, count in ended.value_counts().items()},
        "not_judged": failed[["index", "run", "ended", "what"]].head(MOST_LISTED).to_dict("records"),
        "runs": len(runs),
        "engines": {str(name): int(count) for name, count in runs["engine"].value_counts().items() if name},
        "by_drake": runs.loc[runs["engine"].isin((DRAKE, BOTH)), ["index", "run"]].head(MOST_LISTED).to_dict("records"),
        "simulated_s": float(runs["duration_s"].sum()),
        "claims": sorted(
            (
                _claim(rows, int(unfinished.get(run, 0) + unfinished.get("", 0)), drawn, bounded=not dependent)
                for (run, claim), rows in judged.groupby(["run", "claim"])
                if claim
            ),
            key=lambda claim: tuple(not claim[name] for name in ("differs", "refuted", "undecided", "untested")),
        ),
        "times": [_times(str(run), rows, marks or {}) for run, rows in runs.groupby("run")],
        "keys": [str(key) for key in drawn.columns],
    }


def drawn_keys(first: pd.DataFrame) -> pd.DataFrame:
    """The drawn values by index and key: numbers as they are, entries of lists of one length as key.0, or text."""
    drawn = [json.loads(text) for text in first["drawn"]]
    columns: dict[str, Any] = {}
    for key in dict.fromkeys(chain.from_iterable(drawn)):
        values = [of_draw.get(key) for of_draw in drawn]
        lengths = {*map(_length, values)}
        if len(lengths) == 1 and lengths != {0}:
            columns |= {f"{key}.{i}": [value[i] for value in values] for i in range(len(values[0]))}
        else:
            columns[key] = [value if type(value) in (int, float) else json.dumps(value) for value in values]
    return pd.DataFrame(columns, index=first["index"].tolist())


def _length(value: Any) -> int:
    """The length of a list of numbers; 0 for any other value."""
    numbers = isinstance(value, list) and all(type(item) in (int, float) for item in value)
    return len(value) if numbers else 0


def _claim(rows: pd.DataFrame, unfinished: int, drawn: pd.DataFrame, *, bounded: bool) -> Json:
    counts = Counts.of(rows, unfinished)
    tested = rows[_tested(rows)]
    margins = tested[tested["margin"].notna()]
    unmeasured = tested[(tested["status"] == "refuted") & tested["margin"].isna()]
    worst = pd.concat([unmeasured, margins.nsmallest(WORST, "margin")]).head(WORST)
    unit = str(margins["unit"].mode().max()) if len(margins) else ""  # each hypothesis has its own
    violated = tested.set_index("index")["status"] == "refuted"
    undecided = rows["status"].isin(UNDECIDED)
    return {
        **{key: str(rows[key].iloc[0]) for key in ("run", "method", "claim")},
        **counts._asdict(),
        "differs": int((~tested["as_expected"] & ~tested["status"].isin(UNDECIDED)).sum()),
        "untested": not counts.tested and not rows["as_expected"].all(),
        "fixed": list(counts.interval(anytime=False)) if bounded else None,
        "anytime": list(counts.interval(anytime=True)) if bounded else None,
        "unit": unit,
        "margins": _quantiles(margins.loc[margins["unit"] == unit, "margin"].to_numpy()),
        "worst": worst[["index", "margin", "unit", "status"]].to_dict("records"),
        "broken_first": Counter(what.partition(",")[0] for what in rows["what"] if what),
        "refuted_draws": tested.loc[tested["status"] == "refuted", "index"].head(WORST).tolist(),
        "undecided_draws": rows.loc[undecided, "index"].head(WORST).tolist(),
        "fails_where": _where(violated, drawn) if 0 < violated.sum() < len(violated) else None,
    }


def _times(run: str, rows: pd.DataFrame, marks: Mapping[str, float]) -> Json:
    sums = {name: int(rows[name].sum()) for name in ("arrived", "ugvs")}
    times: Json = {"run": run, "runs": len(rows), **sums}
    for name in TIMES:
        values = rows[name].dropna().to_numpy()
        times[name] = {"count": len(values), "quantiles": _quantiles(values)}
        if name in marks and len(values):
            times[name]["mark"] = marks[name]
            times[name]["share_below_mark"] = float((values < marks[name]).mean())
    return times


def _quantiles(values: Array) -> dict[str, float]:
    return {f"{q:g}": float(np.quantile(values, q)) for q in QUANTILES} if len(values) else {}


def _where(violated: pd.Series, drawn: pd.DataFrame) -> Json | None:
    """Count violations and runs in each pair of quarters of the two keys by which violations differ most."""
    # None if chance may explain the differences: the p-value of the pair of largest effect, times the number of pairs
    # (Bonferroni). It is that of tables drawn with the same sums, because the chi-squared distribution is wrong where
    # few violations fall into many cells.
    keys = drawn.loc[violated.index].drop(columns=UNRELATED, errors="ignore")
    parts = {str(key): part for key in keys if (part := _parts(keys[key])) is not None}
    tables = {
        pair: pd.crosstab([parts[key] for key in pair], violated.to_numpy())
        for pair in ([(key,) for key in parts] if len(parts) == 1 else combinations(parts, 2))
    }
    if not tables:
        return None
    pair = min(tables, key=lambda pair: _by_chance(tables[pair].to_numpy()))  # many draws: several p-values are 0
    drawn_tables = MonteCarloMethod(TABLES * len(tables), batch=TABLES, rng=np.random.default_rng(0))
    chance = len(tables) * _by_chance(tables[pair].to_numpy(), drawn_tables)[0]
    if chance >= BY_CHANCE:
        return None
    cells = [
        {"where": dict(zip(pair, at if isinstance(at, tuple) else (at,), strict=True)),
         "refuted": int(row.get(True, 0)), "runs": int(row.sum())}
        for at, row in tables[pair].iterrows()
    ]  # fmt: skip
    return {"keys": list(pair), "by_chance": chance, "cells": cells}


def _by_chance(table: Array, method: MonteCarloMethod | None = None) -> tuple[float, float]:
    """Probability of differences as large if the keys have no effect; -chi-squared per cell, which breaks ties."""
    if min(table.shape) < 2:
        return 1.0, 0.0
    chi2 = chi2_contingency(table, correction=False, method=method)
    return float(chi2.pvalue), -float(chi2.statistic) / table.size


def _parts(values: pd.Series) -> pd.Series | None:
    """The quarter, or the value, of each draw of a key, as text; None if there is only one, or too many texts."""
    if not is_numeric_dtype(values) and values.nunique() > MOST_VALUES:
        return None
    if not is_numeric_dtype(values) or values.nunique() <= BINS:
        texts = values.astype(str)
    else:
        quarters = pd.qcut(values, BINS, labels=False, duplicates="drop")
        ends = values.groupby(quarters).agg(["min", "max"])
        for digits in (4, 17):  # more if quarters could not be told apart
            words = {quarter: f"{low:.{digits}g} to {high:.{digits}g}" for quarter, low, high in ends.itertuples()}
            if len({*words.values()}) == len(words):
                break
        texts = quarters.map(words)
    return texts.reset_index(drop=True) if len(texts.unique()) > 1 else None
