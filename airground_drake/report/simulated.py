"""Simulates the runs of a report again, with its other seeds, third-party claims and block diagram.

`python -P -m airground_drake.report.simulated DIR LIMIT_S [--allow-plugins]` prints what it found as JSON lines, which
`airground check --simulate` shows. A correct run can differ on another processor, because chaos amplifies a difference
in the last digit. So a difference is "not reproduced here", and proves nothing by itself.
"""

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from airground_drake.base import files
from airground_drake.base.errors import short
from airground_drake.base.progress import SILENT, Progress
from airground_drake.check.line import AGREES, NOT_HERE
from airground_drake.report.after_runs import versions, with_seeds
from airground_drake.report.difference import Difference, first_difference, first_of
from airground_drake.report.lines import Line, line_of, print_lines
from airground_drake.scenario import plugins
from airground_drake.scenario.estimate import DEFAULT_LIMITS, within
from airground_drake.scenario.load import from_data
from airground_drake.scenario.schema import Scenario
from airground_drake.sim import graphviz, trace
from airground_drake.sim.diagram import build_diagram, method_drawn
from airground_drake.sim.runs import simulate_all
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge_all


def lines(folder: Path, *, allow_plugins: bool = False, progress: Progress = SILENT) -> Iterator[Line]:
    """Simulate every run of a report again: a line for each run, and for each other part that needs execution."""
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
            yield _line("seeds", "", first_of(report["seeds"], again), f"{len(again)} runs, exactly", others)
        if scenario.claims:
            yield from _third_party(report["claims"], scenario, recorded, others)
    dot = graphviz.dot(build_diagram(plugins.without(scenario), method_drawn(scenario)))
    for name, text in (("diagram.dot", dot), ("diagram.svg", graphviz.svg(dot))):
        both = (files.read_text(folder / name).splitlines(), text.splitlines())
        yield _line(name, "", first_of(*both), "exactly", others)


def _other_versions(provenance: Mapping[str, Any]) -> str:
    here = versions()
    written = {"drake": provenance.get("drake")} | dict(provenance.get("packages") or {})
    other = [f"{name} {was}, here {here[name]}" for name, was in written.items() if here.get(name, was) != was]
    return f"; made with {'; '.join(other)}" if other else ""


def _line(claim: str, run: str, difference: Difference | None, exactly: str, note: str) -> Line:
    if difference is None:
        return line_of(claim, run, AGREES, exactly)
    about, theirs, ours = difference
    text = f"{about or 'it'} is {short(repr(ours))} here, recorded {short(repr(theirs))}{note}"
    values = {"about": about, "recorded": theirs, "recomputed": ours}
    return line_of(claim, run, NOT_HERE, text, "the same scenario gives the same run") | json.loads(json.dumps(values))


def _third_party(
    claims: Sequence[Mapping[str, Any]], scenario: Scenario, traces: Mapping[str, Trace], note: str
) -> Iterator[Line]:
    verdicts = judge_all(scenario, traces.values(), claims=scenario.claims)
    made = {(verdict.claim.id, verdict.run): json.loads(json.dumps(verdict.to_json())) for verdict in verdicts}
    recorded = {(claim["id"], claim["run"]): dict(claim) for claim in claims if claim["id"] in scenario.claims}
    for key in {**recorded, **made}:
        theirs, ours = recorded.get(key), made.get(key)
        if theirs is not None and ours is not None:
            theirs.pop("rerun", None)  # the command that judges it again may differ
        yield _line(*key, first_of(theirs, ours), f"{ours and ours['status']}, exactly", note)


def main(arguments: Sequence[str]) -> int:
    """Print the lines of a report, see `print_lines`; the arguments are its folder, the limit, s, and the option."""
    folder, limit_s, *option = arguments
    made = partial(lines, Path(folder), allow_plugins=option == [plugins.OPTION])
    return print_lines(lambda told: made(progress=told), limit_s)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
