"""`airground budget SCENARIO`: what the distances of a scenario cost, and what one imperfection changes."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

from airground_drake.base.parallel import processors
from airground_drake.base.usage import refuse
from airground_drake.scenario.options import Parser, option, parser_of

if TYPE_CHECKING:
    from airground_drake.scenario.budget import PairBudget
    from airground_drake.scenario.schema import Scenario

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
            "--json": "print all of it as JSON",
            "--vary": option("a key, such as channel.delay_s=0,0.1,0.3; without values some usual ones", "KEY=VALUES"),
            "--jobs": None,
            "--set": None,
        },
    )


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    from airground_drake.scenario.budget import alike, budget
    from airground_drake.scenario.load import load

    scenario = load(options.scenario, options.set)
    if options.vary is not None:
        return _vary(scenario, options)
    if options.run is not None:
        return refuse(f"run {options.run!r}: a budget is the same for all runs; wanted: --vary, or no run")
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
        if pair.start:
            print(f"    promised only with {pair.start}")
    return 0


def _vary(scenario: Scenario, options: argparse.Namespace) -> int:
    from airground_drake.scenario.document import parsed
    from airground_drake.study.campaign.vary import as_text, usual_values, vary

    key, _, given = options.vary.partition("=")
    values = parsed(f"[{given}]", "--vary").data or usual_values(key)
    rows = vary(scenario, key, values, [options.run] if options.run else (), options.jobs or processors())
    if options.json:
        print(json.dumps(rows.astype(object).where(rows.notna(), None).to_dict("records"), indent=1))
        return 0
    print(as_text(rows, key))
    return 0


def _about(group: Sequence[PairBudget]) -> str:
    """The pairs of a group in words."""
    first, second = (list(dict.fromkeys(getattr(pair, name) for pair in group)) for name in ("first", "second"))
    kind = group[0].kind
    if kind in ("ugv", "uav"):
        return f"two {kind.upper()}s ({_named([*dict.fromkeys([*first, *second])])})"
    if kind == "air_ground":
        return f"{_named(first)} and {_named(second)}"
    return f"{_named(first)} beside {_named(second)}{', which may move' if kind == 'moving' else ''}"


def _named(names: Sequence[str]) -> str:
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def _entry(group: Sequence[PairBudget]) -> dict[str, object]:
    pair = group[0]
    return {
        "kind": pair.kind,
        "pairs": [[member.first, member.second] for member in group],
        "promised_m": pair.promised_m,
        "in_the_law_m": pair.gap_m,
        "terms": [{"key": term.key, "metres": term.metres} for term in pair.terms],
        **({"promised_only_with": pair.start} if pair.start else {}),
    }
