"""The runs of a campaign as one table, and their results by the value of a swept key."""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from airground_drake.base.statuses import NOT_EXERCISED, UNDECIDED, outcome
from airground_drake.report import rules
from airground_drake.report.view import canvas, svg
from airground_drake.study.campaign.rows import JUDGED

# Columns about a run, besides its claims. A drawn key of the same name, `ugvs`, gets a column `ugvs drawn`.
OF_A_RUN = ("ended", "what", "ugvs", "arrived", "arrival_s", "triggers", "first_trigger_s", "intervened_s")
MARGIN = " margin"
# Claims whose margins are drawn, if they were judged: the first of them.
DRAWN = (rules.DISTANCES, rules.OWN_DOING, rules.ARRIVAL)
MOST_RUNS = len(canvas.LOOKS)
SHARE = "share of UGVs that arrived"
SAME = 1e-6  # relative difference of values that are drawn as one

Json = dict[str, Any]


def per_run(table: pd.DataFrame) -> pd.DataFrame:
    """A row for each draw and run: the drawn values, then `OF_A_RUN`, then the verdict and margin of each claim.

    Args:
        table: rows of `rows.COLUMNS`, as `store.read` gives.

    Returns:
        Columns `index`; `column_of` each drawn key (numbers as they are, others as JSON); `run`; `OF_A_RUN`; and for
        each claim CLAIM its verdict and, as `CLAIM margin`, its margin, NaN without one.
    """
    runs = table.drop_duplicates(["index", "run"]).set_index(["index", "run"])
    keys = pd.DataFrame([_plain(text) for text in runs["drawn"]], runs.index)
    judged = table[table["claim"] != ""].set_index(["index", "run", "claim"])
    outcomes = [outcome(*pair) for pair in zip(judged["status"], judged["exercised"], strict=True)]
    verdicts = pd.Series(outcomes, judged.index, dtype=object).unstack()  # noqa: PD010 - `pivot_table` leaves out
    margins = judged["margin"].unstack().add_suffix(MARGIN)  # noqa: PD010 - claims without margins
    claims = [name for claim in verdicts for name in (claim, f"{claim}{MARGIN}")]
    joined = pd.concat([keys, runs[list(OF_A_RUN)], verdicts, margins], axis=1).reindex(runs.index).reset_index()
    return joined[["index", *keys.columns, "run", *OF_A_RUN, *claims]]


def _plain(text: str) -> Json:
    values = json.loads(text)
    return {
        column_of(key): value if type(value) in (int, float) else json.dumps(value) for key, value in values.items()
    }


def column_of(key: str) -> str:
    """The column of a drawn key in `per_run`."""
    return f"{key} drawn" if key in OF_A_RUN else key


def by_value(runs: pd.DataFrame, key: str) -> list[Json]:
    """Results of the runs for each value of a key: an entry for each value and run, as strict JSON.

    Args:
        runs: from `per_run`.
        key: drawn.

    Returns:
        Entries with `value`, `run`, `runs` (number), `judged`, `arrived` and `ugvs` (numbers), the medians of
        `first_trigger_s` and `arrival_s` (of the last UGV, where all arrived; None without one), and `claims`: by
        claim, how many runs tested it, refuted it and left it undecided, and the least margin, or None.
    """
    claims = [str(name).removesuffix(MARGIN) for name in runs if str(name).endswith(MARGIN)]
    entries = []
    for (value, run), rows in runs.groupby([column_of(key), "run"], sort=True, dropna=False):
        judged = rows[rows["ended"] == JUDGED]
        all_there = judged[judged["arrived"] == judged["ugvs"]]
        entries.append({
            "value": value.item() if isinstance(value, np.generic) else value, "run": str(run), "runs": len(rows),
            "judged": len(judged), "arrived": int(judged["arrived"].sum()), "ugvs": int(judged["ugvs"].sum()),
            "first_trigger_s": _number(judged["first_trigger_s"].median()),
            "arrival_s": _number(all_there["arrival_s"].median()),
            "claims": {claim: _counted(judged[claim], judged[f"{claim}{MARGIN}"]) for claim in claims},
        })  # fmt: skip
    return entries


def _counted(verdicts: pd.Series, margins: pd.Series) -> Json:
    tested = verdicts.notna() & (verdicts != NOT_EXERCISED)
    counts = {"tested": tested, "refuted": verdicts == "refuted", "undecided": tested & verdicts.isin(UNDECIDED)}
    return {name: int(mask.sum()) for name, mask in counts.items()} | {"margin": _number(margins[tested].min())}


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def drawing(entries: Sequence[Json], key: str, name: str) -> Markup:
    """Margin, share that arrived, and time of arrival by the value of a key, as inline SVG."""
    runs = list(dict.fromkeys(entry["run"] for entry in entries if entry["judged"]))[:MOST_RUNS]
    values = list(dict.fromkeys(entry["value"] for entry in entries))
    numbers = all(isinstance(value, int | float) for value in values)
    places = {value: float(value) if numbers else float(k) for k, value in enumerate(values)}
    claims = entries[0]["claims"]
    claim = next((name for name in DRAWN if name in claims), next(iter(claims), None))
    panels = [
        *([(f"least margin of {claim}", [entry["claims"][claim]["margin"] for entry in entries])] if claim else []),
        (SHARE, [entry["arrived"] / entry["ugvs"] if entry["ugvs"] else None for entry in entries]),
        ("median time of the last arrival, s", [entry["arrival_s"] for entry in entries]),
    ]  # fmt: skip
    with canvas.style():
        height_in = 2.6
        figure = Figure(figsize=(canvas.FULL_IN, height_in))
        for k, (label, up) in enumerate(panels):
            axes = figure.add_axes((0.06 + k * 0.3, 0.24, 0.23, 0.64))
            _lines(axes, entries, runs, places, up)
            axes.set_title(label)
            if label == SHARE:
                axes.set_ylim(-0.05, 1.05)
            canvas.rule(axes, canvas.short(key, 40) if numbers else "", " ")
            if not numbers:
                for value, at in places.items():
                    axes.text(at, -0.06, canvas.short(str(value), 14), transform=axes.get_xaxis_transform(),
                              ha="center", va="top", fontsize=8.5)  # fmt: skip
        if runs:
            axes.legend(loc="center left", bbox_to_anchor=(1.02, 0.5), frameon=False, fontsize=8.5)
        text = canvas.svg(figure)
    title = f"What became of the runs, by {key}"
    return Markup(svg.inline(text, name, title, "; ".join(label for label, _ in panels)))


def _lines(
    axes: Axes, entries: Sequence[Json], runs: Sequence[str], places: dict[Any, float], up: Sequence[float | None]
) -> None:
    """A line for each run; values that do not exist are left out."""
    for position, run in enumerate(runs):
        shown = [(places[e["value"]], y) for e, y in zip(entries, up, strict=True) if e["run"] == run and y is not None]
        look = canvas.look(position)
        x, y = np.reshape(shown, (-1, 2)).T
        axes.plot(x, y, color=look.color, linestyle=look.dash, marker=look.marker, markersize=5, label=f"run {run}")
    axes.set_xlim(_around([*places.values()]))
    axes.set_ylim(_around([y for y in up if y is not None]))


def _around(values: Sequence[float]) -> tuple[float, float]:
    """Limits of an axis for these values; a single one gets room."""
    low, high = min(values, default=0.0), max(values, default=0.0)
    room = 0.08 * (high - low) if high - low > SAME * (1.0 + abs(high)) else 0.5
    return low - room, high + room
