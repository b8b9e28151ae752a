"""A figure of distances and arrivals over the values of one imperfection."""

import pandas as pd
from matplotlib.figure import Figure

from airground_drake.report.view import canvas

NAMES = {"ugv": "two UGVs", "air_ground": "UGV and UAV", "obstacle": "at rest", "moving": "may move"}


def drawn(rows: pd.DataFrame, key: str) -> str:
    """An SVG document of distances in the law, and of arrivals, by the values of a key."""
    rows = rows[rows["run"] != ""]  # without values that the scenario cannot have
    values = rows.drop_duplicates("index")
    all_there = rows["arrival_s"].where(rows["arrived"] == rows["ugvs"])
    with canvas.style():
        figure = Figure(figsize=(7.5, 3.2))
        costs, arrivals = (figure.add_axes((left, 0.32, 0.4, 0.58)) for left in (0.08, 0.57))
        for position, law in enumerate(rows.columns[rows.columns.str.endswith("law_m")]):
            kind = law.split()[0]
            look = canvas.look(position)
            costs.plot(values[key], values[law], color=look.color, marker=look.marker, label=NAMES.get(kind, kind))
            costs.plot(values[key], values[f"{kind} promised_m"], color=look.color, linestyle=(0, (2, 2)))
            if (old := f"{kind} old_positions_m") in values:
                may_part = values[law] + values[old].fillna(0.0)
                costs.plot(values[key], may_part, color=look.color, linestyle=":", label="may only separate within")
        for position, (run, of_run) in enumerate(rows.groupby("run")):
            look, times = canvas.look(position), all_there[of_run.index]
            arrivals.plot(of_run[key], times, color=look.color, marker=look.marker, label=f"run {run}")
        costs.set_title("distance in the law (dashed: promised), m")
        arrivals.set_title("last arrival, where all arrive, s")
        for axes in (costs, arrivals):
            axes.set_xlabel(key)
            axes.set_ylim(0.0, 1.1 * max(axes.dataLim.y1, 0.1))
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.24), ncols=3, frameon=False, fontsize=8.5)
        return canvas.svg(figure)
