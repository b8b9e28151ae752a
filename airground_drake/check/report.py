"""All checks of a report, a line each."""

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from .events import check_events
from .files import Json, is_plain, names_in, read_bytes, read_json, sha256
from .limits import at_most_s, is_of_a_size
from .line import AGREES, DISAGREES, OPEN, CheckLine
from .rules import SMALL, Disagreement, Found, NotEstablished, close, holds, same
from .run import Run, read_run
from .safety import safe_hyp, safe_own, safe_trace
from .triggers import thr_quality, thr_trig, zeno_trace

# The claims that the checker decides by its own formulas, on every run.
DECIDED: Mapping[str, Callable[[Run], Found | None]] = {
    "SAFE-TRACE": safe_trace,
    "SAFE-OWN": safe_own,
    "SAFE-HYP": safe_hyp,
    "ZENO-TRACE": zeno_trace,
    "THR-TRIG": thr_trig,
    "THR-QUALITY": thr_quality,
}

SCHEMA = "airground_drake.report/4"
# Type of each part of report.json that is read; lists have objects.
SHAPE: Mapping[str, type] = {
    **dict.fromkeys(("scenario", "provenance", "overall", "runs", "files"), dict),
    **dict.fromkeys(("claims", "audit", "choices", "seeds"), list),
}
# Files that a report may have; the third group is a run.
OF_A_REPORT = re.compile(
    r"report\.json|report\.html|junit\.xml|diagram\.(dot|svg)|proofs/(proofs\.json|run_\w+\.v)"
    r"|trace/([^/]+)/((meta|timings)\.json|\w+\.parquet)|map/[^/]+\.(ya?ml|p[bgp]m|png|bmp)"
)
OF_THE_MAP = "map/"  # folder of the files of the map
ADDED_LATER = "proofs/"  # folder of the files that `airground prove` adds to a report
LONGEST = 120  # characters of a value in a line


def check_report(folder: Path, limit_s: float, told: Callable[[CheckLine], object] = bool) -> list[CheckLine]:
    report = read_json(folder / "report.json")
    _is_shaped_like_a_report(report)
    is_of_a_size(report["scenario"]["resolved"])
    lines = []
    for line in _lines(folder, names_in(folder), report, limit_s):
        told(line)
        lines.append(line)
    return lines


def _is_shaped_like_a_report(report: Any) -> None:
    """Refuse a document whose parts have other types than those of a report."""

    def require(held: bool, why: str, rule: str = "it is a report") -> None:
        if not held:
            raise NotEstablished(rule, why, "report.json")

    require(isinstance(report, dict), f"it is a {type(report).__name__}")
    why = f"its schema is not {SCHEMA}: make the report again (CHANGELOG.md)"
    require(report.get("schema") == SCHEMA, why, "it is a report of this version")
    for key, kind in SHAPE.items():
        part: Any = report.get(key)
        entries = part if isinstance(part, list) else []
        held = isinstance(part, kind) and all(isinstance(entry, dict) for entry in entries)
        require(held, f"its {key!r} is missing or has another type")
    scenario = report["scenario"].get("resolved")
    runs: Any = scenario.get("runs") if isinstance(scenario, dict) else None
    require(isinstance(runs, dict), "it has no resolved scenario with runs")
    require(all({"id", "run"} <= {*claim} for claim in report["claims"]), "a claim has no id or no run")
    for name in (*runs, *report["runs"], *(claim["id"] for claim in report["claims"])):
        require(is_plain(name), f"{name!r} cannot be the name of a run or a claim")


def _lines(folder: Path, there: Sequence[str], report: Json, limit_s: float) -> Iterator[CheckLine]:
    attempt = partial(_attempt, limit_s)
    yield attempt("files", "", lambda: check_files(folder, there, report))
    yield attempt("scenario", "", lambda: check_digest(report["scenario"]))
    runs: dict[str, Run] = {}

    def load(name: str) -> str:
        runs[name] = read_run(folder / "trace" / name, name, report)
        return f"{len(runs[name].t_s)} rows"

    def judge(claim: str, name: str) -> str:
        entries = [entry for entry in report["claims"] if (entry["id"], entry["run"]) == (claim, name)]
        ours = DECIDED[claim](runs[name])
        same("claims that there are", len(entries), int(ours is not None), about=claim)
        return _judged(entries[0], ours) if ours else "nothing may move"

    for name in report["scenario"]["resolved"]["runs"]:
        yield attempt("trace", name, partial(load, name))
        if name in runs:  # no claims are checked on a refused trace
            yield attempt("events", name, partial(check_events, runs[name]))
            for claim in DECIDED:
                yield attempt(claim, name, partial(judge, claim, name))


def check_digest(scenario: Json) -> str:
    """Require the SHA-256 of the resolved scenario, in strict JSON without spaces."""
    text = json.dumps(scenario["resolved"], separators=(",", ":"), allow_nan=False)
    same("SHA-256 of the scenario", scenario.get("sha256"), sha256(text.encode()))
    return "has its SHA-256"


def check_files(folder: Path, there: Sequence[str], report: Json) -> str:
    """Require the files that report.json names, and no others, with their SHA-256."""
    for name in there:
        known = OF_A_REPORT.fullmatch(name)
        held = known is not None and (known[3] is None or known[3] in report["runs"])
        holds("a report has such a file", held, "a file", "nothing", about=name)
    recorded = report["files"]
    present = {name for name in there if name != "report.json" and not name.startswith(ADDED_LATER)}
    for name in sorted({*recorded} | present):
        same("a file is named if it is there", name in recorded, name in present, about=name)
        same("SHA-256 of a file", recorded[name], sha256(read_bytes(folder / name)), about=name)
        if name.startswith(OF_THE_MAP):
            read = report["scenario"]["resolved"]["map"]["cells"]["sha256"].values()
            holds(
                "the map was read from this file", recorded[name] in read, recorded[name], ", ".join(read), about=name
            )
    return f"{len(present)} files"


def _judged(claim: Json, ours: Found) -> str:
    """Compare a recorded verdict with the checker's own."""
    status, margin, count = claim["status"], claim["margin"], claim["exercised"]
    if ours.because is not None and status == "holds":
        raise ours.because
    same("verdict", status, ours.status)
    if ours.because is not None:
        return f"{status} (broken: {ours.because.rule})"
    if status == "refuted" and ours.margin is None:
        return str(status)
    if ours.exercised is not None:
        least, most = ours.exercised
        possible = type(count) is int and least <= count <= most
        bounds = f"{least}, at most {most}"
        holds("how often the claim was exercised", possible, count, bounds)
    if ours.margin is None or margin is None:
        same("margin", margin, ours.margin)
        return str(status)
    close("margin", margin, ours.margin, within=SMALL + 1e-6 * abs(ours.margin))
    return f"{status}, margin {ours.margin:.6g} {claim['unit']}".rstrip()


def _attempt(limit_s: float, claim: str, run: str, check: Callable[[], str]) -> CheckLine:
    """The line of a check; an exception counts as no agreement."""
    line = partial(CheckLine, claim, run)
    try:
        with at_most_s(limit_s):
            return line(AGREES, check())
    except Disagreement as broken:
        when = "" if broken.t_s is None else f" at t = {broken.t_s:.9g} s"
        values = f"recorded {_short(broken.recorded)}, recomputed {_short(broken.recomputed)}"
        text = f"{broken.rule}{_in_brackets(broken.about)}{when}: {values}"
        return line(
            DISAGREES, text, broken.rule, broken.about, broken.t_s, broken.recorded, broken.recomputed
        )  # fmt: skip
    except NotEstablished as error:
        return line(OPEN, f"{error.rule}{_in_brackets(error.about)}: {error.why}", error.rule, error.about)
    except Exception as error:  # files can be wrong in more ways than can be listed
        rule, why = "the files are well formed", f"{type(error).__name__}: {error}".splitlines()[0]
        return line(OPEN, f"{rule}: {_short(why)}", rule)


def _in_brackets(about: str) -> str:
    return f" ({about})" if about else ""


def _short(value: Any) -> str:
    text = value if isinstance(value, str) else repr(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
