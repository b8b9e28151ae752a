"""A report built again from its own files: each claim judged anew by its own code, and compared value by value.

`python -P -m airground_drake.report.rebuild DIR LIMIT_S` does this in a process that cannot import Drake: nothing is
simulated, and only the code of the claims and of the report runs. It prints what it found as JSON lines, which
`airground check` shows.
"""

from __future__ import annotations

import json
import re
import resource
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from itertools import zip_longest
from pathlib import Path
from typing import Any

from airground_drake.base import files
from airground_drake.report.compare import WITHIN

WITHIN_PX = 0.02
"""Coordinates in drawings agree to this: they are rounded to 0.01."""
JUDGED = "judged"
"""Key of a line about progress."""
TAKEN_AS_RECORDED = ("provenance", "files")
"""Parts of report.json that do not follow from its traces: the clock, versions, and the digests of files."""

_DRAWING = re.compile(r"(<svg\b.*?</svg>)", re.DOTALL)
_TEXT = re.compile(r">\s*([^<>\s][^<>]*)<")
_NUMBER = re.compile(r"(-?\d+(?:\.\d+)?)")
Line = dict[str, Any]
"""Keys `claim`, `run`, `outcome` and `text`; a difference has `rule`, `about`, `recorded` and `recomputed` besides."""
Judge = Callable[[Any, Sequence[Any]], Sequence[Any]]
"""From a scenario and its traces to verdicts, like `verify_all`."""


def lines(folder: Path, judge: Judge | None = None) -> Iterator[Line]:
    """Build report.json again and compare it: a line for each claim and each other part.

    Args:
        folder: of a report whose files are those that it names.
        judge: judges the claims; default: `verify_all`, without its cache.

    Raises:
        ScenarioError, TraceError, OSError: if a file cannot be used.
    """
    from airground_drake.audit import of_runs
    from airground_drake.report import document, metrics
    from airground_drake.run import trace
    from airground_drake.scenarios.load import from_data
    from airground_drake.verify import verify_all

    report = json.loads(files.read_text(folder / "report.json"))
    scenario = from_data(report["scenario"]["resolved"], str(folder / "report.json"))
    third_party, own = scenario.claims, replace(scenario, claims={})
    traces = {name: trace.load(folder / "trace" / name) for name in scenario.runs}
    judged = [
        replace(each, meta=each.meta | {"scenario": each.meta["scenario"] | {"claims": {}}}) for each in traces.values()
    ]
    here = of_runs(scenario, traces)
    others = [item for item in report["audit"] if item.get("id") not in {each["id"] for each in here}]
    again = document.build(
        scenario,
        report["scenario"]["sha256"],
        traces,
        (judge or verify_all)(own, judged),
        report["provenance"],
        audit=[*here, *others],
        audited=bool(others),
        seeds=[metrics.outcome(traces[row["run"]]) if row["seed"] == scenario.seed else row for row in report["seeds"]],
    )
    other_code = _other_code(report["provenance"])
    parts = [_with_note(line, other_code) for line in _parts(report, again, third_party)]
    yield from parts
    if any(line["outcome"] == "DISAGREES" for line in parts):
        return  # pages that show a wrong report.json need no comparison
    try:
        for line in _pages(folder, report, scenario, traces):
            yield _with_note(line, other_code)
    except Exception as error:  # the parts that are taken as recorded may have any content
        why = f"{type(error).__name__}: {error}"
        text = f"the pages cannot be made again: {_short(why)}"
        yield {"claim": "report.html", "run": "", "outcome": "cannot be checked", "text": text, "rule": "pages"}


def _other_code(provenance: Any) -> str:
    """A note if other code wrote the report: it may word or draw things otherwise; empty if this code wrote it."""
    from airground_drake.report.document import commit

    found = provenance if isinstance(provenance, dict) else {}
    written, here = (found.get("package"), found.get("git")), (version("airground_drake"), commit())
    if written == here:
        return ""
    return "; other code wrote the report ({}, {}); this is {}, {}".format(*written, *here)


def _with_note(line: Line, note: str) -> Line:
    return line | {"text": line["text"] + note} if line["outcome"] == "DISAGREES" else line


def _parts(report: Mapping[str, Any], again: Mapping[str, Any], third_party: Mapping[str, Any]) -> Iterator[Line]:
    """Each claim and each other part of report.json, compared with what was built again."""
    recorded = {(entry["id"], entry["run"]): entry | {"from_cache": False} for entry in report["claims"]}
    rebuilt = {(entry["id"], entry["run"]): entry for entry in again["claims"]}
    for claim, run in {**recorded, **rebuilt}:
        if claim in third_party:
            text = "a third-party claim: `airground verify --allow-plugins` judges it"
            yield {"claim": claim, "run": run, "outcome": "cannot be checked", "text": text, "rule": "own claims"}
        else:
            yield _compared(claim, run, recorded.get((claim, run)), rebuilt.get((claim, run)))
    for part in {**again, **report}:
        # with third-party claims, `overall` counts verdicts that are not judged here; the checker derives it
        if part not in ("claims", *TAKEN_AS_RECORDED) and not (part == "overall" and third_party):
            yield _compared(part, "", report.get(part), again.get(part))


def _pages(folder: Path, report: Mapping[str, Any], scenario: Any, traces: Mapping[str, Any]) -> Iterator[Line]:
    """The files that follow from report.json and the traces: pages, and what `airground prove` has added."""
    from airground_drake.proofs.compare import broken_rules
    from airground_drake.report import junit, proved
    from airground_drake.report.figures.draw import draw
    from airground_drake.report.page import page

    made = {**report, "files": {}}
    found: Any = None
    if (folder / "proofs").is_dir():
        try:
            found, broken = broken_rules(folder / "proofs", traces)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            broken = [("proofs.json", "what `airground prove` writes", repr(error))]
        for about, ours, theirs in broken:
            yield _different("proofs", "", about, theirs, ours)
        if broken:
            return
        yield {"claim": "proofs", "run": "", "outcome": "agrees", "text": "the files are about the recorded runs"}
    if "junit.xml" in report["files"]:
        yield _same_text("junit.xml", folder, junit.render(made))
    if "report.html" in report["files"]:
        text = page(made, draw(scenario, traces), files.read_text(folder / "diagram.svg"))
        text = text if found is None else proved.filled(text, found)
        drawn_by = report["provenance"]["packages"]["matplotlib"]
        yield _same_text("report.html", folder, text, other_drawings=drawn_by != version("matplotlib"))


def _same_text(name: str, folder: Path, rebuilt: str, *, other_drawings: bool = False) -> Line:
    """Compare a file with the text that it should have: exactly, except for drawings.

    With `other_drawings`, another version of matplotlib made the drawings: see `_is_same_drawing`.
    """
    recorded = files.read_text(folder / name)
    for k, (theirs, ours) in enumerate(zip_longest(_DRAWING.split(recorded), _DRAWING.split(rebuilt))):
        drawings = bool(k % 2) and theirs is not None and ours is not None
        if theirs == ours or (drawings and _is_same_drawing(theirs, ours, shapes=not other_drawings)):
            continue
        both = zip_longest((theirs or "").splitlines(), (ours or "").splitlines(), fillvalue="")
        return _different(name, "", "the page", *next(lines for lines in both if lines[0] != lines[1]))
    how = "; drawings by another version of matplotlib: only texts and kinds of elements were compared, no shapes"
    how *= other_drawings
    return {"claim": name, "run": "", "outcome": "agrees", "text": f"as recorded{how}"}


def _is_same_drawing(theirs: str, ours: str, *, shapes: bool) -> bool:
    """Whether two drawings have the same texts and, with `shapes`, the same elements at the same places.

    Without `shapes`, theirs has at least no other kinds of elements and attributes than ours: nothing that is painted
    outside of the drawing, is active, or leads to another page.
    """
    if _TEXT.findall(theirs) != _TEXT.findall(ours):
        return False
    if not shapes:
        return theirs.count("<!") + theirs.count("<?") == 0 and _kinds(theirs) <= _kinds(ours)
    one, other = _NUMBER.split(theirs), _NUMBER.split(ours)  # every second part is a number
    words = one[::2] == other[::2]
    return words and all(abs(float(a) - float(b)) <= WITHIN_PX for a, b in zip(one[1::2], other[1::2], strict=True))


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
        return _different(claim, run, about, theirs, ours)
    status = rebuilt.get("status", "as recorded") if isinstance(rebuilt, dict) else "as recorded"
    exactly = "exactly" if recorded == rebuilt else f"numbers to {WITHIN:g}"
    return {"claim": claim, "run": run, "outcome": "agrees", "text": f"{status}, {exactly}"}


def _different(claim: str, run: str, about: str, theirs: Any, ours: Any) -> Line:
    """A line about a value that is not as recorded."""
    text = f"judged again, {about or 'it'} is {_short(ours)}; recorded {_short(theirs)}"
    broken = {"rule": "the files give what is recorded", "about": about, "recorded": theirs, "recomputed": ours}
    return {"claim": claim, "run": run, "outcome": "DISAGREES", "text": text, **broken}


def differences(recorded: Any, rebuilt: Any, path: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Each value that differs, with its dotted path: numbers by more than `WITHIN`, anything else at all."""
    if isinstance(recorded, dict) and isinstance(rebuilt, dict):
        for key in {**rebuilt, **recorded}:
            both = recorded.get(key, "nothing"), rebuilt.get(key, "nothing")
            yield from differences(*both, f"{path}.{key}".strip("."))
    elif isinstance(recorded, list) and isinstance(rebuilt, list) and len(recorded) == len(rebuilt):
        for k, (theirs, ours) in enumerate(zip(recorded, rebuilt, strict=True)):
            yield from differences(theirs, ours, f"{path}.{k}".strip("."))
    elif _is_number(recorded) and _is_number(rebuilt):
        if not abs(recorded - rebuilt) <= WITHIN * (1.0 + abs(rebuilt)):
            yield path, recorded, rebuilt
    elif type(recorded) is not type(rebuilt) or recorded != rebuilt:
        yield path, recorded, rebuilt


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _short(value: Any, most: int = 120) -> str:
    text = repr(value)
    return text if len(text) <= most else f"{text[:most]}..."


def main(arguments: Sequence[str]) -> int:
    """Print the lines of a report, one JSON object each; before them, one with the key `JUDGED` for each claim.

    Args:
        arguments: the folder of the report, and the CPU time that each process may take, s.

    Returns:
        Exit code: 0, or 2 if a file cannot be used.
    """
    from airground_drake.base.errors import AirgroundError
    from airground_drake.base.progress import Progress
    from airground_drake.verify import verify_all

    class Told(Progress):
        """Prints a line for each claim that is judged."""

        def advance(self, amount: float, what: str = "") -> None:
            print(json.dumps({JUDGED: what}), flush=True)

    folder, limit_s = Path(arguments[0]), int(float(arguments[1])) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (limit_s, limit_s))
    try:
        for line in lines(folder, partial(verify_all, progress=Told())):
            print(json.dumps(line, allow_nan=False), flush=True)
    except (AirgroundError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.modules["pydrake"] = None  # type: ignore[assignment]  # claims are judged again without Drake
    sys.exit(main(sys.argv[1:]))
