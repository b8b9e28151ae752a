"""`airground budget SCENARIO`: what the distances of a scenario cost, kind of pair by kind of pair."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

from airground_drake.base import files
from airground_drake.base.usage import output_file
from airground_drake.scenario.options import Parser, option, parser_of

if TYPE_CHECKING:
    from airground_drake.scenario.budget import PairBudget

MOST_NAMED = 6  # bodies that are named in a line at most


def parser() -> Parser:
    return parser_of(
        "budget",
        "Print, for each kind of pair, the promised distance, the distance that the law keeps between steered points, "
        "and what each term takes. Distances are between surfaces.",
        {
            "scenario": None,
            "-o --output": option("draw the budget, too, as SVG", "FILE", output_file),
            "--json": "print every kind of pair as JSON",
            "--set": None,
        },
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the budget, and draw it on request."""
    options = parser().parse_args(arguments)
    from airground_drake.scenario.budget import alike, budget
    from airground_drake.scenario.load import load

    scenario = load(options.scenario, options.set)
    groups = alike(budget(scenario))
    if options.output is not None:
        from airground_drake.report.view.budget import drawn

        files.write_text(options.output, drawn([(_about(group), group[0]) for group in groups]))
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


def _about(group: Sequence[PairBudget]) -> str:
    """The pairs of a group in words."""
    first, second = (list(dict.fromkeys(getattr(pair, name) for pair in group)) for name in ("first", "second"))
    kind = group[0].kind
    if kind == "ugv":
        return f"two UGVs ({_named([*dict.fromkeys([*first, *second])])})"
    if kind == "air_ground":
        return f"{_named(first)} and {_named(second)}"
    return f"{_named(first)} beside {_named(second)}{', which may move' if kind == 'moving' else ''}"


def _named(names: Sequence[str]) -> str:
    """Some names, and how many more there are."""
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
