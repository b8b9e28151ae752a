"""What has changed from one report to another, read from their report.json alone.

A verdict is worse if it stands further down in `ORDER` than before, if it was as expected and no longer is, or if it
is gone. A row of the reproduction table is worse by `ROWS`, and a finding about the paper if it is no longer
demonstrated. Numbers are compared to the last digit.
"""

from __future__ import annotations

import json
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from airground_drake.base import files
from airground_drake.base.errors import ReportError, one_line
from airground_drake.base.statuses import UNDECIDED, outcome
from airground_drake.report.folder import PAGES

SCHEMA = "airground_drake.comparison/1"
REPORT = "airground_drake.report/4"

# Verdicts from the best to the worst, as `statuses.outcome` names them; `gone`: no verdict any more.
ORDER = (("proved",), ("holds", "supported"), ("not_exercised",), (*UNDECIDED, "gone"), ("refuted",))
# Statuses of rows of the reproduction table, from the best to the worst.
ROWS = (("reproduced",), ("calibrated",), ("by_construction",), ("ambiguous",), ("not_reproduced", "gone"))
OVERALL = (("as_expected",), ("inconclusive",), ("not_as_expected",))  # overall statuses, from the best to the worst
WITHIN = 1e-8  # numbers agree to this times 1 plus their size: versions of numpy, scipy and solvers round differently
LONGEST_INTEGER = 18  # maximum number of digits of an integer

VERSIONS = ("package", "drake", "python", "packages", "git")  # what the provenance says about the code
NO_INPUTS = ("title", "description")  # keys of a scenario that nothing depends on

Document = Mapping[str, Any]
Change = dict[str, Any]


def read(folder: Path) -> Document:
    """The report.json of a folder."""
    path = folder / PAGES["json"]
    try:
        text = files.read_text(path)
        document = json.loads(text, parse_constant=_finite, parse_float=_finite, parse_int=_short)
        json.dumps(document, ensure_ascii=False).encode()  # refuses half of a surrogate pair
        if document["schema"] != REPORT:
            raise ValueError(f"its schema is not {REPORT}")
        _require_usable(document)
    except (OSError, ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
        why = getattr(error, "strerror", None) or f"{type(error).__name__}: {error}"
        raise ReportError(one_line(f"{path} is not a report that can be used: {why}"[:300])) from None
    return dict(document)


_CLAIM = {"margin": (int, float, type(None)), "exercised": (int, type(None)), "expected": (str, type(None))}


def _require_usable(document: Document) -> None:
    """Refuse a report in which a value that the comparison reads is of another kind."""
    compared(document, document)
    overall, claims, runs = document["overall"], document["claims"], document["runs"]
    entries: list[tuple[Mapping[str, Any], Mapping[str, Any]]] = [
        (document["scenario"], {"name": str, "title": str}),
        (document["provenance"], {"started": str}),
        (overall, {"why": str, "checks": int, "as_expected": int}),
        *((claim, _CLAIM) for claim in claims),
        *((event, {"t_s": (int, float)}) for run in runs.values() for event in run["events"]),
    ]
    for entry, kinds in entries:
        for name, kind in kinds.items():
            if not isinstance(entry[name], kind):
                raise TypeError(f"{name} is {entry[name]!r}")
    for order, names in (
        (ORDER, [*overall["counts"], *map(_outcome, claims)]),
        (ROWS, [row["status"] for row in document["reproduction"]]),
    ):
        for name in names:
            _rank(order, name)


def compared(before: Document, after: Document) -> dict[str, Any]:
    """What differs."""
    # Returns strict JSON: `regressions`, a count; lists of changes `inputs`, `overall` (one at most), `verdicts`,
    # `margins`, `exercised`, `expectations`, `reproduction`, `audit`, `events`. A change has `before` and `after` (None
    # if missing), whether it is `worse`, and what it is about: `claim` and `run`; `id`; or `run`, `robot`, `kind` and
    # `n`, the number of the event among those of its kind, from 1. Margins have their `relative` change.
    found: dict[str, Any] = {
        "inputs": list(_inputs(before, after)),
        "overall": list(_overall(before, after)),
        "verdicts": list(_verdicts(before, after)),
        "margins": [{**each, "relative": _relative(each)} for each in _of_claims(before, after, "margin")],
        "exercised": list(_of_claims(before, after, "exercised")),
        "expectations": list(_of_claims(before, after, "expected")),
        "reproduction": list(_rows(before, after)),
        "audit": list(_findings(before, after)),
        "events": list(_events(before, after)),
    }
    for change in (changes := [change for part in found.values() for change in part]):
        change.setdefault("worse", False)
    return {"regressions": sum(change["worse"] for change in changes), **found}


def is_rounding(change: Change) -> bool:
    """Whether a number changed by no more than rounding differs between versions of numpy, scipy and solvers."""
    return not change["worse"] and _agree(change["before"], change["after"])


def rounded(found: Mapping[str, Any], part: str) -> list[Change]:
    """The changes of a part by no more than rounding; whatever changes in the inputs counts."""
    return [] if part == "inputs" else [change for change in found[part] if is_rounding(change)]


def _agree(was: Any, now: Any) -> bool:
    """Whether two values are the same but for the rounding of numbers in them."""
    if isinstance(was, Mapping) and isinstance(now, Mapping):
        return was.keys() == now.keys() and all(_agree(was[key], now[key]) for key in was)
    if isinstance(was, list) and isinstance(now, list):
        return len(was) == len(now) and all(map(_agree, was, now))
    if all(isinstance(side, int | float) and not isinstance(side, bool) for side in (was, now)):
        return bool(abs(now - was) <= WITHIN * (1.0 + abs(now)))
    return type(was) is type(now) and bool(was == now)


def _inputs(before: Document, after: Document) -> Iterator[Change]:
    """Keys of the scenario, versions and third-party files that differ: what the reports were made from."""
    old, new = (
        {key: value for key, value in report["scenario"]["resolved"].items() if key not in NO_INPUTS}
        | {f"version of {key}": report["provenance"][key] for key in VERSIONS if key in report["provenance"]}
        | {f"SHA-256 of {name}": digest for name, digest in report["provenance"].get("third_party", {}).items()}
        for report in (before, after)
    )
    yield from _differing(old, new, "")


def _differing(was: Any, now: Any, key: str) -> Iterator[Change]:
    """What differs in nested dicts, and in lists of dicts, by dotted key."""
    if all(isinstance(side, list) and any(isinstance(each, Mapping) for each in side) for side in (was, now)):
        was, now = ({str(index): each for index, each in enumerate(side)} for side in (was, now))
    if isinstance(was, Mapping) and isinstance(now, Mapping):
        for name in dict.fromkeys([*was, *now]):
            yield from _differing(was.get(name), now.get(name), f"{key}.{name}" if key else str(name))
    elif was != now:
        yield {"id": key, "before": was, "after": now}


def _overall(before: Document, after: Document) -> Iterator[Change]:
    """The verdict over all claims, which may change though no claim does: one may be missing."""
    was, now = before["overall"]["status"], after["overall"]["status"]
    worse = _rank(OVERALL, now) > _rank(OVERALL, was)
    if was != now:
        yield {"id": "overall", "before": was, "after": now, "worse": worse}


def _verdicts(before: Document, after: Document) -> Iterator[Change]:
    for (claim, run), old, new in _paired(before["claims"], after["claims"], "id", "run"):
        was, now = _outcome(old), _outcome(new)
        lost = bool(old and old["as_expected"] and (not new or new["as_expected"] is False))
        if was != now or lost:
            worse = old is not None and (lost or _rank(ORDER, now) > _rank(ORDER, was))
            change = {"claim": claim, "run": run, "before": was if old else None, "after": now if new else None}
            yield {**change, "worse": worse, "as_expected": bool(new and new["as_expected"] is not False)}


def _of_claims(before: Document, after: Document, field: str) -> Iterator[Change]:
    """Changes of a field of claims that are in both reports."""
    for (claim, run), old, new in _paired(before["claims"], after["claims"], "id", "run"):
        if old and new and old[field] != new[field]:
            unit = {"unit": new["unit"]} if field == "margin" else {}
            yield {"claim": claim, "run": run, "before": old[field], "after": new[field], **unit}


def _rows(before: Document, after: Document) -> Iterator[Change]:
    for (row,), old, new in _paired(before["reproduction"], after["reproduction"], "id"):
        was, now = (each and {"status": each["status"], "ours": each["ours"]} for each in (old, new))
        if was != now:
            worse = old is not None and _rank(ROWS, new["status"] if new else "gone") > _rank(ROWS, old["status"])
            yield {"id": row, "before": was, "after": now, "worse": worse}


def _findings(before: Document, after: Document) -> Iterator[Change]:
    """Findings about the paper."""
    for (number,), old, new in _paired(before["audit"], after["audit"], "id"):
        was, now = (each and {name: each[name] for name in ("demonstrated", "paper", "ours")} for each in (old, new))
        if was != now:
            worse = bool(old and old["demonstrated"] and not (new and new["demonstrated"]))
            yield {"id": number, "before": was, "after": now, "worse": worse}


def _events(before: Document, after: Document) -> Iterator[Change]:
    """Times of events, the first of a kind with the first, and so on."""
    for run in dict.fromkeys([*before["runs"], *after["runs"]]):
        old, new = (_times(report["runs"].get(run, {"events": []})["events"]) for report in (before, after))
        for robot, kind in dict.fromkeys([*old, *new]):
            was, now = old.get((robot, kind), []), new.get((robot, kind), [])
            for n in range(max(len(was), len(now))):
                times = [each[n] if n < len(each) else None for each in (was, now)]
                if times[0] != times[1]:
                    about = {"run": run, "robot": robot, "kind": kind, "n": n + 1}
                    yield {**about, "before": times[0], "after": times[1], "unit": "s"}


def _times(events: Sequence[Mapping[str, Any]]) -> dict[tuple[str, str], list[float]]:
    found = defaultdict(list)
    for event in events:
        found[str(event["robot"]), str(event["kind"])].append(float(event["t_s"]))
    return found


def _paired(
    before: Sequence[Mapping[str, Any]], after: Sequence[Mapping[str, Any]], *keys: str
) -> Iterator[tuple[tuple[str, ...], Mapping[str, Any] | None, Mapping[str, Any] | None]]:
    """Entries with the same key in both lists, and those in only one of them."""
    old, new = ({tuple(str(each[key]) for key in keys): each for each in part} for part in (before, after))
    for key in dict.fromkeys([*old, *new]):
        yield key, old.get(key), new.get(key)


def _outcome(claim: Mapping[str, Any] | None) -> str:
    return outcome(claim["status"], claim["exercised"]) if claim else "gone"


def _rank(order: Sequence[Sequence[str]], name: str) -> int:
    return [name in alike for alike in order].index(True)


def _relative(change: Change) -> float | None:
    """The change of a number relative to what it was; None if it was 0 or is gone."""
    was, now = change["before"], change["after"]
    relative = (now - was) / abs(was) if was and now is not None else math.nan
    return relative if math.isfinite(relative) else None


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text} is not finite")
    return value


def _short(text: str) -> int:
    if len(text) > LONGEST_INTEGER:
        raise ValueError(f"an integer of {len(text)} digits")
    return int(text)
