"""campaign.html: an offline page with the evidence of a campaign; no JavaScript."""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from jinja2 import Environment
from markupsafe import Markup
from matplotlib.figure import Figure

from airground_drake.base.arrays import Array
from airground_drake.report import rules
from airground_drake.report.html import environment_of
from airground_drake.report.sentences import MARKS, Line, number
from airground_drake.report.view import canvas, svg
from airground_drake.scenario.shipped import argument
from airground_drake.study.campaign import swept
from airground_drake.study.campaign.evidence import MOST_LISTED
from airground_drake.study.campaign.rows import BATCH, BOTH, CLOCK, DRAKE, JUDGED, SCREENED
from airground_drake.study.campaign.statistics import outward

BARS = 40
MOST_CLAIMS = 8  # sentences about claims on the first screen; the others are folded
SHOWN = (rules.DISTANCES, rules.CONDITIONS, rules.ARRIVAL)  # claims whose margins are drawn


class Drawing(NamedTuple):
    """A figure and its title."""

    title: str
    svg: Markup


def page(result: dict[str, Any], table: pd.DataFrame) -> str:
    template = _environment().get_template("campaign.html.j2")
    return template.render(
        found=result, claim_lines=lines_of(result), engines=made_by(result["engines"]), separated=_separated(result),
        figures=_figures(result, table),
        sweeps=[
            (sweep["key"], sweep["entries"], swept.drawing(sweep["entries"], sweep["key"], f"swept{k}"))
            for k, sweep in enumerate(result.get("swept", ())) if sweep["entries"]
        ],
    )  # fmt: skip


def lines_of(result: Mapping[str, Any]) -> list[Line]:
    """A sentence for each claim, with its bound: violations first, then open claims."""
    lines = []
    for claim in result["claims"]:
        what = f"{claim['claim']} in run {claim['run']}"
        bounds = claim["anytime"] and [number(bound, 2) for bound in outward(claim["anytime"])]
        confidence = f"confidence {result.get('confidence', 0.0):g}"
        differs = f", {claim['differs']} not as declared" if claim["differs"] != claim["refuted"] else ""
        if claim["untested"]:
            lines.append(Line("open", f"{what}: the scenario expects a test, but no run tested it."))
        elif claim["refuted"]:
            bound = f"; probability {bounds[0]} to {bounds[1]} ({confidence})" if bounds else ""
            admitted = differs if claim["differs"] else ", which the scenario admits"
            counts = claim["broken_first"].items()
            first = f"; broken first: {', '.join(f'{name} ({count})' for name, count in counts)}" if counts else ""
            runs = f"refuted in {claim['refuted']} of {claim['tested']} runs{admitted}"
            lines.append(Line("no", f"{what}: {runs}{first}{bound}."))
        elif claim["undecided"]:
            lines.append(Line("open", f"{what}: undecided in {claim['undecided']} of {claim['tested']} runs{differs}."))
        elif claim["tested"]:
            bound = f"; probability of a violation at most {bounds[1]} ({confidence})" if bounds else ""
            mark = "no" if differs else "yes"
            lines.append(Line(mark, f"{what}: never refuted in {claim['tested']} runs{differs}{bound}."))
        else:
            lines.append(Line("none", f"{what}: not tested."))
    return sorted(lines, key=lambda line: ("no", "open", "yes", "none").index(line.mark))


def made_by(engines: Mapping[str, int]) -> str:
    screens, compared, clock = (engines.get(name, 0) for name in (SCREENED, BOTH, CLOCK))
    loop = screens + engines.get(BATCH, 0) + compared + clock
    clauses = [f"Drake made {engines[DRAKE]} of these runs"] if engines.get(DRAKE) else []
    if loop:
        clauses.append(f"the compiled loop made {loop}, and Drake {compared} of them again, bit by bit the same")
    if screens:
        others = "the others were judged by their traces"
        clauses.append(f"array judges screened {screens} of them without a trace, which proves nothing; {others}")
    if clock:
        clauses.append(f"{clock} are not compared, because a policy met its limit of time by the clock")
    sentence = "; ".join(clauses)
    return f"{sentence[:1].upper()}{sentence[1:]}." if sentence else ""


class Separation(NamedTuple):
    """What separates failures from passes, in words and as a figure."""

    words: str
    drawing: Drawing


def _separated(result: Mapping[str, Any]) -> list[Separation]:
    """One for each claim with violations that depend on a drawn key."""
    separations = list[Separation]()
    for claim in result["claims"]:
        if where := claim["fails_where"]:
            cells = sorted(where["cells"], key=lambda cell: cell["refuted"] / cell["runs"])
            most, least = (f"in {c['refuted']} of {c['runs']} runs with {_cell(c)}" for c in (cells[-1], cells[0]))
            words = f"{claim['claim']} in run {claim['run']} fails {most}, and {least}."
            title = f"Share of runs in which {claim['claim']} is refuted, run {claim['run']}"
            text = svg.inline(_shares(cells), f"separated{len(separations)}", title, words)
            separations.append(Separation(words, Drawing(title, Markup(text))))
    return separations


def _cell(cell: Mapping[str, Any]) -> str:
    return ", ".join(f"{key} {value}" for key, value in cell["where"].items())


def _shares(cells: Sequence[Mapping[str, Any]]) -> str:
    """A bar for each combination of values: the share of runs that fail, with the counts beside it."""
    with canvas.style():
        height_in = 1.0 + 0.22 * len(cells)
        figure = Figure(figsize=(canvas.FULL_IN, height_in))
        axes = figure.add_axes((0.5, 0.45 / height_in, 0.4, (height_in - 0.9) / height_in))
        axes.set_xlim(0.0, 1.0)
        axes.set_ylim(-0.6, len(cells) - 0.4)
        keys = "\n".join(canvas.short(key, 70) for key in cells[0]["where"])
        axes.text(-0.01, 1.0, keys, transform=axes.transAxes, ha="right", va="bottom", fontsize=8.5, weight="bold")
        for k, cell in enumerate(cells):
            share = cell["refuted"] / cell["runs"]
            axes.barh(k, share, color=canvas.ALARM, height=0.6)
            values = canvas.short(", ".join(map(str, cell["where"].values())), 70)
            axes.text(-0.01, k, values, ha="right", va="center", fontsize=8.5)
            axes.text(share + 0.01, k, f"{cell['refuted']} of {cell['runs']}", va="center", fontsize=8.5)
        canvas.rule(axes, "share of runs refuted", "")
        return canvas.svg(figure)


def _figures(result: dict[str, Any], table: pd.DataFrame) -> list[Drawing]:
    judged = table[table["ended"] == JUDGED]
    drawn = []
    measured = judged[judged["claim"].isin(SHOWN) & judged["margin"].notna()]
    for (run, claim, unit), rows in measured.groupby(["run", "claim", "unit"]):
        drawn.append(_histogram(rows["margin"].to_numpy(), f"{claim} in run {run}: margin", f"margin, {unit}", 0.0))
    runs = judged.drop_duplicates(["index", "run"])
    marks = {times["run"]: times["first_trigger_s"].get("mark") for times in result["times"]}
    for run, rows in runs.groupby("run"):
        values = rows["first_trigger_s"].dropna().to_numpy()
        if len(values):
            drawn.append(_histogram(values, "Run " + str(run) + ": first trigger", "time, s", marks.get(str(run))))
    return [
        Drawing(title, Markup(svg.inline(text, f"figure{i}", title, title))) for i, (title, text) in enumerate(drawn)
    ]


def _histogram(values: Array, title: str, label: str, mark: float | None) -> tuple[str, str]:
    """A histogram, with its title; a dashed line at the mark, if there is one."""
    with canvas.style():
        figure = Figure(figsize=(canvas.WIDE_IN, 2.2))
        axes = figure.add_axes((0.16, 0.26, 0.8, 0.6))
        low, high = canvas.interval(values)
        span = high - low
        counts, edges = np.histogram(values, bins=BARS, range=(low - 0.01 * span, high + 0.01 * span))
        percent = 100.0 * counts / len(values)  # a million runs would leave no room for their number
        axes.stairs(percent, edges, fill=True, color="#9db8d2", edgecolor=canvas.INK, linewidth=0.6)
        ends = [edges[0], edges[-1], *([] if mark is None else [mark])]
        reach = 0.03 * (max(ends) - min(ends))
        axes.set_xlim(min(ends) - reach, max(ends) + reach)
        axes.set_ylim(0.0, 1.08 * percent.max())
        if mark is not None:
            axes.axvline(mark, color=canvas.ALARM, linestyle=(0, (4, 2)), linewidth=1.2)
            above = axes.get_xaxis_transform()
            axes.text(mark, 1.0, f" {mark:g}", color=canvas.ALARM, transform=above, va="bottom", ha="center")
        canvas.rule(axes, label, "runs, %")
        return title, canvas.svg(figure)


@cache
def _environment() -> Environment:
    environment = environment_of("airground_drake.study.campaign", "airground_drake.report")
    environment.filters.update(num=number, outward=outward, argument=argument)
    environment.globals.update(marks=MARKS, most_claims=MOST_CLAIMS, most_listed=MOST_LISTED)
    return environment
