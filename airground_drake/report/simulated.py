"""The runs of a report simulated again, with its other seeds, its third-party claims and its block diagram.

`python -P -m airground_drake.report.simulated DIR LIMIT_S [--allow-plugins]` prints what it found as JSON lines, which
`airground check --simulate` shows. A run can honestly differ on another processor: from the last digit of one number,
chaos makes other events. So a difference is "not reproduced here", and proves nothing by itself.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from airground_drake.base import files
from airground_drake.base.progress import SILENT, Progress
from airground_drake.check.line import AGREES, NOT_HERE
from airground_drake.report.after_runs import versions, with_seeds
from airground_drake.report.lines import Line, differences, line_of, print_lines, short
from airground_drake.scenario import plugins
from airground_drake.scenario.estimate import DEFAULT_LIMITS, within
from airground_drake.scenario.load import from_data
from airground_drake.scenario.schema import Scenario
from airground_drake.sim import graphviz, trace
from airground_drake.sim.diagram import build_diagram, method_drawn
from airground_drake.sim.runs import simulate_all
from airground_drake.sim.tables import TABLES
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge_all

Difference = tuple[str, Any, Any]  # where two things differ, what is recorded, and what was made here


def lines(folder: Path, *, allow_plugins: bool = False, progress: Progress = SILENT) -> Iterator[Line]:
    """Simulate every run of a report again: a line for each run, and for each other part that takes execution."""
    # allow_plugins: whether third-party code that the report names may be imported and run.
    report = json.loads(files.read_text(folder / "report.json"))
    scenario = from_data(report["scenario"]["resolved"], str(folder))
    seeds = max((row["seed"] for row in report["seeds"]), default=0)
    within(scenario, DEFAULT_LIMITS, 1 + seeds)
    recorded = {name: trace.load(folder / "trace" / name, name) for name in scenario.runs}
    others = _other_versions(report["provenance"])
    with plugins.admitted(scenario, str(folder), allow=allow_plugins):
        made = simulate_all(scenario, progress=progress)
        for name, run in recorded.items():
            rows = f"{len(run.t)} rows and {len(run.events)} events, exactly"
            yield _line("trace", name, first_difference(run, made[name]), rows, others)
        if seeds:
            again = with_seeds(scenario, made, seeds, progress)
            yield _line("seeds", "", _first(report["seeds"], again), f"{len(again)} runs, exactly", others)
        if scenario.claims:
            yield from _third_party(report["claims"], scenario, recorded, others)
    dot = graphviz.dot(build_diagram(plugins.without(scenario), method_drawn(scenario)))
    for name, text in (("diagram.dot", dot), ("diagram.svg", graphviz.svg(dot))):
        both = (files.read_text(folder / name).splitlines(), text.splitlines())
        yield _line(name, "", _first(*both), "exactly", others)


def _other_versions(provenance: Mapping[str, Any]) -> str:
    """A note on the libraries whose versions are others here."""
    here = versions()
    written = {"drake": provenance.get("drake")} | dict(provenance.get("packages") or {})
    other = [f"{name} {was}, here {here[name]}" for name, was in written.items() if here.get(name, was) != was]
    return f"; made with {'; '.join(other)}" if other else ""


def _line(claim: str, run: str, found: Difference | None, exactly: str, note: str) -> Line:
    if found is None:
        return line_of(claim, run, AGREES, exactly)
    about, theirs, ours = found
    text = f"{about or 'it'} is {short(ours)} here, recorded {short(theirs)}{note}"
    values = {"about": about, "recorded": theirs, "recomputed": ours}
    return line_of(claim, run, NOT_HERE, text, "the same scenario gives the same run") | json.loads(json.dumps(values))


def first_difference(recorded: Trace, made: Trace) -> Difference | None:
    """The first value in which two traces differ, of the earliest row of a table; None if they are equal."""
    # Numbers are compared exactly; times by the clock are not compared.
    for name in TABLES:
        found = _first_cell(name, getattr(recorded, name), getattr(made, name))
        if found is not None:
            return found
    return _first(recorded.meta, made.meta, "meta.json")


def _first_cell(name: str, recorded: pd.DataFrame, made: pd.DataFrame) -> Difference | None:
    """The first cell in which two tables differ."""
    if [*recorded] != [*made]:
        return _first([*recorded], [*made], f"{name}: column")
    rows = min(len(recorded), len(made))
    first, column = rows, ""
    for k, each in enumerate(recorded):
        theirs, ours = recorded.iloc[:first, k].tolist(), made.iloc[:first, k].tolist()
        row = next((row for row, both in enumerate(zip(theirs, ours, strict=True)) if not _equal(*both)), first)
        if row < first:
            first, column = row, str(each)
    if column:
        at = f", t = {recorded['t_s'].iloc[first]:.9g} s" if "t_s" in recorded else ""
        both = recorded[column].iloc[first], made[column].iloc[first]
        return f"{name}, row {first}{at}: {column}", *map(_plain, both)
    return None if len(recorded) == len(made) else (f"{name}: number of rows", len(recorded), len(made))


def _equal(theirs: Any, ours: Any) -> bool:
    """Whether two cells are equal, as numbers, texts or arrays; one that is not a number equals another."""
    if isinstance(theirs, (np.ndarray, list)) and isinstance(ours, (np.ndarray, list)):
        return [*theirs] == [*ours]
    return bool(theirs == ours or (theirs != theirs and ours != ours))


def _plain(value: Any) -> Any:
    """A cell as strict JSON has it: an array as a list, a number that is not finite as a text."""
    value = value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
    return value if isinstance(value, (str, int, list)) or np.isfinite(value) else str(value)


def _first(recorded: Any, made: Any, path: str = "") -> Difference | None:
    """The first part in which two JSON values differ, with its dotted path."""
    return next(differences(recorded, made, path, within=0.0), None)


def _third_party(
    claims: Sequence[Mapping[str, Any]], scenario: Scenario, traces: Mapping[str, Trace], note: str
) -> Iterator[Line]:
    """The verdicts of the claims that the scenario adds, judged again."""
    verdicts = judge_all(scenario, traces.values(), claims=scenario.claims)
    made = {(each.claim.id, each.run): json.loads(json.dumps(each.to_json())) for each in verdicts}
    recorded = {(each["id"], each["run"]): dict(each) for each in claims if each["id"] in scenario.claims}
    for key in {**recorded, **made}:
        theirs, ours = recorded.get(key), made.get(key)
        if theirs is not None and ours is not None:
            theirs.pop("rerun", None)  # the command that judges it again may differ
        yield _line(*key, _first(theirs, ours), f"{ours and ours['status']}, exactly", note)


def main(arguments: Sequence[str]) -> int:
    """Print the lines of a report, see `print_lines`; the arguments are its folder, the limit, s, and the option."""
    folder, limit_s, *option = arguments
    made = partial(lines, Path(folder), allow_plugins=option == [plugins.OPTION])
    return print_lines(lambda told: made(progress=told), limit_s)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
