"""A report made again from its recorded traces: claims judged anew, pages rendered from the recorded report.json.

`python -P -m airground_drake.report.rebuild DIR LIMIT_S` does this in a process that cannot import Drake: nothing is
simulated, and no third-party code is imported. It prints what it found as JSON lines, which `airground check` shows.
"""

import json
import re
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from importlib.metadata import version
from itertools import zip_longest
from pathlib import Path
from typing import Any

from airground_drake.base import files
from airground_drake.base.errors import short
from airground_drake.base.registry import MODEL_CLAIMS
from airground_drake.base.statuses import meets
from airground_drake.check.line import AGREES, DISAGREES, OPEN, RECORDED
from airground_drake.report.compare import WITHIN, differences
from airground_drake.report.lines import Line, different, line_of, print_lines

WITHIN_PX = 0.02  # coordinates in drawings agree to this: they are rounded to 0.01

_DRAWING = re.compile(r"(<svg\b.*?</svg>)", re.DOTALL)
_TEXT = re.compile(r">\s*([^<>\s][^<>]*)<")
# Attributes in which numbers may differ by rounding. A scale of 0.01 may not become 0.
_GEOMETRY = re.compile(r'(\s(?:d|points|[xyr]|[cr][xy]|[xy][12]|width|height|viewBox|transform)="(?![^"]*scale)[^"]*")')
_NUMBER = re.compile(r"(-?[0-9]+(?:\.[0-9]+)?)")
Judge = Callable[[Any, Sequence[Any]], Sequence[Any]]  # from a scenario and its traces to verdicts, like `judge_all`


def lines(folder: Path, judge: Judge) -> Iterator[Line]:
    """Make a report again and compare it: a line for each claim and each other part."""
    from airground_drake.report.possible import impossible
    from airground_drake.scenario.load import from_data, own
    from airground_drake.sim import trace

    report = json.loads(files.read_text(folder / "report.json"))
    scenario = from_data(report["scenario"]["resolved"], str(folder / "report.json"))
    traces = {name: with_events(trace.load(folder / "trace" / name, name)) for name in scenario.runs}
    wrong = [line for name, run in traces.items() for line in impossible(run, own(scenario, name))]
    if wrong:
        yield from wrong
        return  # what is judged on such a run is not about the scenario
    again = document_again(report, scenario, traces, judge)
    other_code = _other_code(report["provenance"])
    parts = [_with_note(line, other_code) for line in _parts(report, again, scenario)]
    yield from parts
    if any(line["outcome"] == DISAGREES for line in parts):
        return  # pages that show a wrong report.json need no comparison
    yield from _map(folder, scenario)
    try:
        for line in _pages(folder, report, scenario, traces):
            yield _with_note(line, other_code)
    except Exception as error:  # the parts that are taken as recorded may have any content
        why = f"{type(error).__name__}: {error}"
        yield line_of("report.html", "", OPEN, f"the pages cannot be made again: {short(repr(why))}", "pages")


def with_events(trace: Any) -> Any:
    from airground_drake.sim.events import extract

    return replace(trace, meta=trace.meta | {"events": extract(trace)})


def document_again(report: Mapping[str, Any], scenario: Any, traces: Mapping[str, Any], judge: Judge) -> dict[str, Any]:
    """report.json from the traces; what only other runs or third-party code can tell is taken from the recorded one."""
    from airground_drake.report import document, metrics
    from airground_drake.report.audit import of_runs
    from airground_drake.scenario.load import from_data

    own = _without_claims(report["scenario"]["resolved"])
    judged = [replace(run, meta=run.meta | {"scenario": own}) for run in traces.values()]
    here = of_runs(scenario, traces)
    others = [item for item in report["audit"] if item.get("id") not in {finding["id"] for finding in here}]
    again = document.build(
        scenario,
        traces,
        judge(from_data(own, scenario.name), judged),
        report["provenance"] | {"seed": scenario.seed},
        audit=[*here, *others],
        audited=bool(others),
        seeds=[metrics.outcome(traces[row["run"]]) if row["seed"] == scenario.seed else row for row in report["seeds"]],
    )
    cached = {(entry["id"], entry["run"]) for entry in report["claims"] if entry["from_cache"] is True}
    for entry in again["claims"]:
        entry["from_cache"] = entry["id"] in MODEL_CLAIMS and (entry["id"], entry["run"]) in cached
    again["claims"] += [_expected(entry, scenario) for entry in report["claims"] if entry["id"] in scenario.claims]
    order = {(entry["id"], entry["run"]): k for k, entry in enumerate(report["claims"])}
    again["claims"].sort(key=lambda entry: order.get((entry["id"], entry["run"]), len(order)))
    missing = document.missing(scenario, traces, again["claims"])
    again["overall"] = document.overall(
        again["claims"], missing, again["audit"] if others else (), document.expected_numbers(scenario, again["runs"])
    )
    return again


def _without_claims(scenario: Mapping[str, Any]) -> dict[str, Any]:
    def expecting_less(part: Mapping[str, Any]) -> dict[str, Any]:
        expected = {name: value for name, value in part["expected"].items() if name not in scenario["claims"]}
        return {**part, "expected": expected}

    runs = {name: expecting_less(run) for name, run in scenario["runs"].items()}
    return {**expecting_less(scenario), "runs": runs, "claims": {}}


def _expected(entry: Mapping[str, Any], scenario: Any) -> dict[str, Any]:
    """A recorded third-party claim, with the expectation that the scenario declares for it, if any."""
    declared = (scenario.runs[entry["run"]] if entry["run"] else scenario).expected
    expected = declared.get(entry["id"], entry["expected"])
    met = meets(expected, entry["status"], entry["exercised"])
    return {**entry, "expected": expected, "as_expected": met}


def _other_code(provenance: Mapping[str, Any]) -> str:
    """A note if other code wrote the report: it may word or draw things otherwise; empty if this code wrote it."""
    from airground_drake.report.document import commit

    written = (provenance.get("package"), provenance.get("git"))
    here = (version("airground_drake"), commit())
    if written == here:
        return ""
    return "; other code wrote the report ({}, {}); this is {}, {}".format(*written, *here)


def _with_note(line: Line, note: str) -> Line:
    return line | {"text": line["text"] + note} if line["outcome"] == DISAGREES else line


def _parts(report: Mapping[str, Any], again: Mapping[str, Any], scenario: Any) -> Iterator[Line]:
    """Each claim and each other part of report.json, compared with what was made again."""
    recorded, rebuilt = ({(claim["id"], claim["run"]): claim for claim in of["claims"]} for of in (report, again))
    if len(report["claims"]) != len(recorded):
        yield different("claims", "", "number of claims", len(report["claims"]), len(recorded))
    for claim, run in {**recorded, **rebuilt}:
        line = _compared(claim, run, recorded.get((claim, run)), rebuilt.get((claim, run)))
        status = line["text"].partition(",")[0]
        why = f"{status}, by third-party code, which runs only with --simulate --allow-plugins"
        yield _taken(line, why, claim in scenario.claims)
    for part in {**again, **report}:
        if part not in ("claims", "files"):
            line = _compared(part, "", report.get(part), again.get(part))
            line = _taken(line, "but for the seed, which is the scenario's", part == "provenance")
            others = any(row["seed"] != scenario.seed for row in report["seeds"])
            yield _taken(line, "but for the scenario's seed; --simulate runs the others", part == "seeds" and others)


def _taken(line: Line, why: str, applies: bool) -> Line:
    """If it applies, the line of what agrees with itself only, since it was taken as recorded."""
    if not applies or line["outcome"] != AGREES:
        return line
    return line | {"outcome": RECORDED, "text": why}


def _map(folder: Path, scenario: Any) -> Iterator[Line]:
    from airground_drake.report.folder import of_map
    from airground_drake.scenario import map_file

    if scenario.map is None:
        return
    recorded = scenario.map.cells
    about = next(iter(recorded.sha256), "")
    if not (folder / of_map(about)).exists():
        yield line_of("map", "", OPEN, "the report has no copy of its files")
        return
    made = map_file.cells(
        replace(scenario.map, file=of_map(about)), folder, recorded.starts_m, str(folder), copied=True
    )
    changes = list(differences(asdict(recorded), asdict(replace(made, file=recorded.file))))
    yield from (different("map", "", place, theirs, ours) for place, theirs, ours in changes[:1])
    if not changes:
        yield line_of("map", "", AGREES, f"{len(recorded.rectangles)} rectangles follow from its files")


def _pages(folder: Path, report: Mapping[str, Any], scenario: Any, traces: Mapping[str, Any]) -> Iterator[Line]:
    """The files that follow from report.json and the traces: pages, and what `airground prove` has added."""
    from airground_drake.report import junit, model, proved
    from airground_drake.report.figures.draw import draw
    from airground_drake.report.html import page
    from airground_drake.verify.proofs.runs import broken_rules

    made = model.of(report)
    proofs: Any = None
    if (folder / "proofs").is_dir():
        try:
            proofs, broken = broken_rules(folder / "proofs", traces)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            broken = [("proofs.json", "what `airground prove` writes", repr(error))]
        for about, ours, theirs in broken:
            yield different("proofs", "", about, theirs, ours)
        if broken:
            return
        yield line_of("proofs", "", AGREES, "the files are about the recorded runs")
    if "junit.xml" in report["files"]:
        yield _same_text("junit.xml", folder, junit.render(made))
    if "report.html" in report["files"]:
        text = page(made, draw(scenario, traces), files.read_text(folder / "diagram.svg"))
        text = text if proofs is None else proved.filled(text, proofs)
        drawn_by = report["provenance"]["packages"]["matplotlib"]
        yield _same_text("report.html", folder, text, other_drawings=drawn_by != version("matplotlib"))


def _same_text(name: str, folder: Path, rebuilt: str, *, other_drawings: bool = False) -> Line:
    recorded = files.read_text(folder / name)
    for k, (theirs, ours) in enumerate(zip_longest(_DRAWING.split(recorded), _DRAWING.split(rebuilt))):
        drawings = bool(k % 2) and theirs is not None and ours is not None
        if theirs == ours or (drawings and _is_same_drawing(theirs, ours, shapes=not other_drawings)):
            continue
        both = zip_longest(
            (theirs or "").splitlines(keepends=True), (ours or "").splitlines(keepends=True), fillvalue=""
        )
        return different(name, "", "the page", *next(lines for lines in both if lines[0] != lines[1]))
    if other_drawings and recorded != rebuilt:
        how = "drawings by another version of matplotlib: only texts and kinds of elements were compared, no shapes"
        return line_of(name, "", RECORDED, how)
    return line_of(name, "", AGREES, "as recorded")


def _is_same_drawing(theirs: str, ours: str, *, shapes: bool) -> bool:
    """Whether two drawings have the same texts and, with `shapes`, are equal except for rounded coordinates."""
    # Without `shapes`, theirs has no other kinds of elements and attributes than ours: so nothing is painted outside of
    # the drawing, is active, or leads to another page.
    if _TEXT.findall(theirs) != _TEXT.findall(ours):
        return False
    if not shapes:
        return theirs.count("<!") + theirs.count("<?") == 0 and _kinds(theirs) <= _kinds(ours)
    was, now = _GEOMETRY.split(theirs), _GEOMETRY.split(ours)  # every second part is an attribute
    return was[::2] == now[::2] and all(map(_is_near, was[1::2], now[1::2]))


def _is_near(theirs: str, ours: str) -> bool:
    """Whether two attributes are equal except for numbers, and these to WITHIN_PX."""
    was, now = _NUMBER.split(theirs), _NUMBER.split(ours)  # every second part is a number
    words = was[::2] == now[::2]
    return words and all(abs(float(a) - float(b)) <= WITHIN_PX for a, b in zip(was[1::2], now[1::2], strict=True))


def _kinds(drawing: str) -> set[tuple[str, str, str]]:
    """The kinds of elements in a drawing: names, attributes, and the values of those that lead or style elsewhere."""
    try:
        elements = ET.fromstring(drawing).iter()
    except ET.ParseError:
        return {("not well-formed", "", "")}
    return {
        (element.tag, name, value if name == "class" or (name == "href" and not value.startswith("#")) else "")
        for element in elements
        for name, value in [("", ""), *element.items()]
    }


def _compared(claim: str, run: str, recorded: Any, rebuilt: Any) -> Line:
    for about, theirs, ours in differences(recorded, rebuilt):
        return different(claim, run, about, theirs, ours)
    status = rebuilt.get("status", "the same") if isinstance(rebuilt, dict) else "the same"
    exactly = "exactly" if recorded == rebuilt else f"numbers to {WITHIN:g}"
    return line_of(claim, run, AGREES, f"{status}, {exactly}")


def main(arguments: Sequence[str]) -> int:
    """Print the lines of a report, see `print_lines`; the arguments are its folder and the limit, s."""
    from airground_drake.verify import judge_all

    folder, limit_s = arguments
    return print_lines(lambda told: lines(Path(folder), partial(judge_all, progress=told)), limit_s)


if __name__ == "__main__":
    sys.modules["pydrake"] = None  # type: ignore[assignment]  # claims are judged again without Drake
    sys.exit(main(sys.argv[1:]))
