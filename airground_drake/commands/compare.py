"""`airground compare BEFORE AFTER`: list what has changed from one report to another."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from airground_drake.base import files
from airground_drake.base.errors import one_line, short
from airground_drake.base.usage import output_file
from airground_drake.report import compare
from airground_drake.report.sentences import counted
from airground_drake.scenario.options import Parser, option, parser_of

if TYPE_CHECKING:
    from airground_drake.report.model import Report

EXIT_WORSE = 1
PARTS = tuple(compare.PARTS)
MOST_LINES, MOST_ROWS = 20, 200  # changes of one part that are shown, in the terminal and on the page; `--json` has all
_ABOUT = ("claim", "id", "run", "robot", "kind", "n")


def parser() -> Parser:
    return parser_of(
        "compare",
        "List the differences of two reports: keys of the scenario and versions, then verdicts, runs with other seeds, "
        "margins, counts of tests, events, metrics. Changes by rounding are only counted.",
        {
            "before": option("folder of a report", "BEFORE", Path),
            "after": option("folder of another report", "AFTER", Path),
            "--json": None,
            "--html": option("write a page", "FILE", output_file),
            "--exact": "exit code 1 if any of these results differs, to the last digit",
        },
        "verdicts from the best to the worst: "
        + "; ".join(map(", ".join, compare.ORDER)).replace("exercised", "tested").replace("_", " ")
        + ". A verdict that is no longer the expected one is worse, too; so is a run with another seed that no longer "
        "keeps distances or brings all robots home. Exit codes: 0 nothing got worse, 1 "
        "something did (with --exact: any result differs), 2 usage, or a folder is not a report.",
    )


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    from airground_drake.report import model

    before, after = model.read(options.before), model.read(options.after)
    changed = compare.compared(before, after)
    if options.html is not None:
        page = _page((options.before, options.after), before, after, changed)
        with files.wanted(options.html, "a file for the page"):
            files.write_text(options.html, page)
    if options.json:
        places = {"schema": compare.SCHEMA, "before": str(options.before), "after": str(options.after)}
        print(json.dumps({**places, **changed}, indent=1, allow_nan=False))
    else:
        print("\n".join(one_line(line) for line in _lines(changed)))
    differs = any(changed[part] for part in PARTS[1:])
    return EXIT_WORSE if changed["regressions"] or (options.exact and differs) else 0


def _lines(changes_of: Mapping[str, Any]) -> Iterator[str]:
    changed, rounded = [], 0
    for part in PARTS:
        changes, hidden = compare.parted(changes_of, part)
        changes.sort(key=lambda change: not change.get("worse"))
        rounded += len(hidden)
        if changes:
            changed.append(f"{len(changes)} {part}")
            yield f"{part}:"
        yield from (f"  {_line(change)}" for change in changes[:MOST_LINES])
        if len(changes) > MOST_LINES:
            yield f"  and {len(changes) - MOST_LINES} more: --json has all"
    if rounded:
        yield f"{counted(rounded, 'number')} changed by no more than rounding: --json has all"
    count = changes_of["regressions"]
    summary = ", ".join(changed) or ("nothing else" if rounded else "nothing")
    yield f"{summary} changed; {counted(count, 'regression') if count else 'no regressions'}"


def _line(change: Mapping[str, Any]) -> str:
    about = " ".join(str(change[key]) for key in _ABOUT if change.get(key))
    unit = f" {change['unit']}" if change.get("unit") and change["after"] is not None else ""
    relative = change.get("relative")
    percent = "" if relative is None else f" ({100.0 * relative:+.3g} %)"
    expected = " (not as expected)" if change.get("as_expected") is False and change["after"] else ""
    worse = "worse: " if change.get("worse") else ""
    was, now = (short(_side(change[side])) for side in ("before", "after"))
    return f"{worse}{about}: {was} -> {now}{unit}{percent}{expected}"


def _side(value: Any) -> str:
    if value in ("", [], {}):
        return "empty"
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_side(item)}" for name, item in value.items())
    return f"{value:.9g}" if isinstance(value, float) else "none" if value is None else str(value)


def _page(folders: tuple[Path, Path], before: Report, after: Report, changed: Mapping[str, Any]) -> str:
    from airground_drake.report.html import render_beside

    worse = [
        _line(change).removeprefix("worse: ")
        for part in (*PARTS[2:], PARTS[1])
        for change in changed[part]
        if change["worse"]
    ]
    return render_beside(
        "compare.html.j2", before=before, after=after, found=changed, parts=PARTS, most=MOST_ROWS, regressions=worse,
        parted={part: compare.parted(changed, part) for part in PARTS},
        places=[str(folder) for folder in folders],
    )  # fmt: skip
