"""`airground budget SCENARIO`: the distance budget of a scenario, and the effect of one imperfection."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

from airground_drake.base import files
from airground_drake.base.errors import ScenarioError
from airground_drake.base.parallel import processors
from airground_drake.base.usage import output_file, refuse
from airground_drake.report.rules import DISTANCES
from airground_drake.report.sentences import some
from airground_drake.scenario import plugins
from airground_drake.scenario.options import Parser, option, parser_of
from airground_drake.study.campaign.rows import JUDGED

if TYPE_CHECKING:
    from pandas import DataFrame

    from airground_drake.scenario.budget import PairBudget
    from airground_drake.scenario.schema import Scenario

# Default values of a varied key, by its unit; the last entry is for shares.
USUAL = {"_s": (0.0, 0.1, 0.3, 1.0), "_m": (0.0, 0.02, 0.05, 0.1), "": (0.0, 0.1, 0.5)}
PROMISED, LAW, OLD = "promised_m", "law_m", "old_positions_m"  # columns about a kind of pair
MEANING = "metres, by kind of pair: the distance promised between surfaces -> the distance that the law keeps"
MEANING_OF_OLD = "; + how far the other UGV may have driven: within this sum two UGVs may only separate"
EXIT_UNDECIDED = 3
MOST_NAMED = 6  # bodies that are named in a line at most


def parser() -> Parser:
    return parser_of(
        "budget",
        "Print, for each kind of pair, the promised distance, the distance that the law keeps between steered points, "
        "and what each term takes. Distances are between surfaces. With --vary, simulate the runs for each value of a "
        "key, and print distances and arrivals.",
        {
            "scenario": None,
            "run": "with --vary (default: all runs)",
            "--json": "print everything as JSON",
            "--vary": option("values of a key: channel.delay_s=0,0.1,0.3 (default: usual values)", "KEY=VALUES"),
            "-o --output": option("with --vary: also draw the results, as SVG", "FILE", output_file),
            "--jobs": None,
            "--set": None,
            plugins.OPTION: None,
        },
        "exit codes: 0 distances are printed, 2 usage or bad scenario, 3 with --vary, nothing was judged",
    )


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    from airground_drake.scenario.budget import alike, budget
    from airground_drake.scenario.load import load

    scenario = load(options.scenario, options.set)
    if options.vary is not None:
        return _vary(scenario, options)
    if options.run is not None:
        return refuse(f"run {options.run!r}: all runs have the same budget; wanted: --vary, or no run")
    if options.output is not None:
        return refuse("--output needs --vary")
    groups = alike(budget(scenario))
    if options.json:
        print(json.dumps([_entry(group) for group in groups], indent=1))
        return 0
    for group in groups:
        pair = group[0]
        print(f"{_about(group)}: promised {pair.promised_m:.3f} m, in the law {pair.gap_m:.3f} m")
        for term in pair.terms:
            owner = f" of {term.of}" if term.of and len(group) == 1 else ""
            print(f"    {term.key}{owner}: {term.metres:.4f} m")
        if pair.unsure_m:
            near_m = pair.gap_m + pair.unsure_m
            print(f"    old positions: within {near_m:.3f} m they may only separate; more while messages are lost")
        if pair.start:
            print(f"    promised only with {pair.start}")
    return 0


def _vary(scenario: Scenario, options: argparse.Namespace) -> int:
    from pandas import DataFrame

    from airground_drake.scenario.document import parsed
    from airground_drake.study.campaign.sweep import sweep

    key, _, given = options.vary.partition("=")
    usual = next(values for unit, values in USUAL.items() if key.endswith(unit))
    values = parsed(f"[{given}]", "--vary").data or usual
    runs = [options.run] if options.run else ()
    allow, jobs = options.allow_plugins, options.jobs or processors()
    with plugins.admitted(scenario, options.scenario, allow=allow):
        rows = sweep(scenario, {key: values}, runs, [DISTANCES], jobs, allow_plugins=allow)
    costs = [{"index": k} | _costs(scenario, key, value) for k, value in enumerate(values)]
    rows = rows.merge(DataFrame(costs))
    if options.output is not None:
        from airground_drake.report.view.budget import drawn

        files.write_text(options.output, drawn(rows, key))
    if options.json:
        print(json.dumps(rows.astype(object).where(rows.notna(), None).to_dict("records"), indent=1))
    else:
        print(_as_text(rows, key))
    return 0 if (rows["ended"] == JUDGED).any() else EXIT_UNDECIDED


def _costs(scenario: Scenario, key: str, value: object) -> dict[str, float]:
    """By kind of pair, promise and law distance of the pair with the largest cost; empty for a refused value."""
    from airground_drake.scenario.budget import budget
    from airground_drake.scenario.load import validated

    try:
        pairs = budget(validated(scenario, {key: value}))
    except ScenarioError:
        return {}
    dearest = {
        pair.kind: pair for pair in sorted(pairs, key=lambda pair: (pair.gap_m - pair.promised_m, pair.unsure_m))
    }
    return {
        f"{kind} {name}": metres
        for kind, pair in dearest.items()
        for name, metres in ((PROMISED, pair.promised_m), (LAW, pair.gap_m), (OLD, pair.unsure_m))
        if name != OLD or metres
    }


def _as_text(rows: DataFrame, key: str) -> str:
    """A line for each value and run; then an explanation of the columns, and why runs were not judged."""
    judged = rows["ended"] == JUDGED
    shown = rows[[key, "run", "ended"]].copy()
    for law in rows.columns[rows.columns.str.endswith(LAW)]:
        kind = law.removesuffix(LAW)
        promised = rows[f"{kind}{PROMISED}"].map("{:.3f}".format)
        distances = promised + rows[law].map(" -> {:.3f}".format)
        if (old := f"{kind}{OLD}") in rows:
            distances += rows[old].map(" + {:.3f}".format).where(rows[old].notna(), "")
        shown[f"{kind}m"] = distances.where(rows[law].notna(), "-")
    shown["arrived"] = (rows["arrived"].map(str) + " of " + rows["ugvs"].map(str)).where(judged, "-")
    shown["last at, s"] = rows["arrival_s"].round(2)
    shown[DISTANCES] = rows[DISTANCES].fillna("-") if DISTANCES in rows else "-"
    meaning = f"{MEANING}{MEANING_OF_OLD}" if any(rows.columns.str.endswith(OLD)) else MEANING
    return "\n".join([shown.to_string(index=False, na_rep="-"), "", meaning, *dict.fromkeys(rows["what"][~judged])])


def _about(group: Sequence[PairBudget]) -> str:
    first, second = (list(dict.fromkeys(getattr(pair, name) for pair in group)) for name in ("first", "second"))
    kind = group[0].kind
    if kind in ("ugv", "uav"):
        return f"two {kind.upper()}s ({some([*dict.fromkeys([*first, *second])], MOST_NAMED)})"
    if kind == "air_ground":
        return f"{some(first, MOST_NAMED)} and {some(second, MOST_NAMED)}"
    moves = ", which may move" if kind == "moving" else ""
    return f"{some(first, MOST_NAMED)} beside {some(second, MOST_NAMED)}{moves}"


def _entry(group: Sequence[PairBudget]) -> dict[str, object]:
    pair = group[0]
    return {
        "kind": pair.kind,
        "pairs": [[member.first, member.second] for member in group],
        "promised_m": pair.promised_m,
        "in_the_law_m": pair.gap_m,
        "terms": [{"key": term.key, "metres": term.metres} for term in pair.terms],
        **({"promised_only_with": pair.start} if pair.start else {}),
        **({"old_positions_m": pair.unsure_m} if pair.unsure_m else {}),
    }
