"""The changes between two reports, read from their report.json alone.

A verdict is worse if it stands further down in `ORDER` than before, if it was as expected and no longer is, or if it
is gone. A row of the reproduction table is worse by `ROWS`, a finding about the paper if it is no longer demonstrated,
and a run with another seed if it no longer keeps distances or brings all robots home. Numbers are compared to the
last digit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, TypeVar

from airground_drake.base.errors import ReportError
from airground_drake.base.statuses import UNDECIDED, outcome
from airground_drake.report.sentences import grouped

if TYPE_CHECKING:  # slow to import
    from airground_drake.report.model import Claim, Entry, Report

SCHEMA = "airground_drake.comparison/1"

# Verdicts from the best to the worst, as `statuses.outcome` names them; `gone`: no verdict any more.
ORDER = (("proved",), ("holds", "supported"), ("not_exercised",), (*UNDECIDED, "gone"), ("refuted",))
# Statuses of rows of the reproduction table, from the best to the worst.
ROWS = (("reproduced",), ("calibrated",), ("by_construction",), ("ambiguous",), ("not_reproduced", "gone"))
OVERALL = (("as_expected",), ("inconclusive",), ("not_as_expected",))  # overall statuses, from the best to the worst
WITHIN = 1e-8  # numbers agree to this times 1 plus their size: versions of numpy, scipy and solvers round differently

VERSIONS = ("package", "drake", "python", "packages", "git")  # what the provenance says about the code
NO_INPUTS = ("title", "description")  # keys of a scenario that nothing depends on
KEPT = ("kept", "home")  # about a run with another seed: distances were kept, and all robots arrived
# Of a run: compared by `_events`, or measured by the clock.
_CLOCK: Any = {"wall_s": True, "realtime_factor": True, "gatekeeper": {"time_s": True, "late": True}}
NOT_COMPARED: Any = {"events": True, "metrics": _CLOCK}

Change = dict[str, Any]
E = TypeVar("E", bound="Entry")


def compared(before: Report, after: Report) -> dict[str, Any]:
    # Returns strict JSON: `regressions`, a count; a list of changes for each of the `PARTS`. A change has `before` and
    # `after` (None if missing), whether it is `worse`, and what it is about: `claim` and `run`; `id`; or `run`,
    # `robot`, `kind` and `n`, the number of the event among those of its kind, from 1. Margins have their `relative`
    # change.
    changes_of = {part: list(changes_in(before, after)) for part, changes_in in PARTS.items()}
    for change in (changes := [change for part in changes_of.values() for change in part]):
        change.setdefault("worse", False)
    return {"regressions": sum(change["worse"] for change in changes), **changes_of}


def differences(
    recorded: Any, rebuilt: Any, path: str = "", *, within: float = WITHIN
) -> Iterator[tuple[str, Any, Any]]:
    """Each value of two JSON documents that differs, with its dotted path: numbers by more than `within`."""
    pairs: list[tuple[Any, Any, Any]] = []
    if isinstance(recorded, dict) and isinstance(rebuilt, dict):
        pairs = [(key, recorded.get(key, "nothing"), rebuilt.get(key, "nothing")) for key in {**rebuilt, **recorded}]
    elif isinstance(recorded, list) and isinstance(rebuilt, list):
        pairs = [(k, *both) for k, both in enumerate(zip(recorded, rebuilt, strict=False))]
    elif _is_number(recorded) and _is_number(rebuilt):
        if not abs(recorded - rebuilt) <= within * (1.0 + abs(rebuilt)):
            yield path, recorded, rebuilt
    elif type(recorded) is not type(rebuilt) or recorded != rebuilt:
        yield path, recorded, rebuilt
    for key, theirs, ours in pairs:
        yield from differences(theirs, ours, f"{path}.{key}".strip("."), within=within)
    if isinstance(recorded, list) and isinstance(rebuilt, list) and len(recorded) != len(rebuilt):
        yield f"{path}: number of entries", len(recorded), len(rebuilt)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def parted(changes_of: Mapping[str, Any], part: str) -> tuple[list[Change], list[Change]]:
    """The changes of a part beyond rounding, and those within; changes of the inputs always count."""
    large, small = list[Change](), list[Change]()
    for change in changes_of[part]:
        counts = part == "inputs" or change["worse"] or any(differences(change["before"], change["after"]))
        (large if counts else small).append(change)
    return large, small


def _inputs(before: Report, after: Report) -> Iterator[Change]:
    """Differences of the inputs: keys of the scenario, versions and third-party files."""
    old, new = (
        {key: value for key, value in report.scenario.resolved.data().items() if key not in NO_INPUTS}
        | {f"version of {key}": value for key, value in report.provenance.items() if key in VERSIONS}
        | {f"SHA-256 of {name}": digest for name, digest in report.provenance.get("third_party", {}).items()}
        for report in (before, after)
    )
    yield from _differing(old, new, "")


def _differing(was: Any, now: Any, key: str) -> Iterator[Change]:
    """What differs in nested dicts, and in lists of dicts, by dotted key."""
    if all(isinstance(side, list) and any(isinstance(item, Mapping) for item in side) for side in (was, now)):
        was, now = ({str(index): item for index, item in enumerate(side)} for side in (was, now))
    if isinstance(was, Mapping) and isinstance(now, Mapping):
        for name in dict.fromkeys([*was, *now]):
            yield from _differing(was.get(name), now.get(name), f"{key}.{name}" if key else str(name))
    elif was != now:
        yield {"id": key, "before": was, "after": now}


def _overall(before: Report, after: Report) -> Iterator[Change]:
    """Changes of the overall verdict, which may change without any claim, if one is missing."""
    was, now = before.overall.status, after.overall.status
    worse = _rank(OVERALL, now) > _rank(OVERALL, was)
    if was != now:
        yield {"id": "overall", "before": was, "after": now, "worse": worse}


def _verdicts(before: Report, after: Report) -> Iterator[Change]:
    for (claim, run), old, new in _paired(before.claims, after.claims, "id", "run"):
        was, now = _outcome(old), _outcome(new)
        lost = bool(old and old.as_expected and (not new or new.as_expected is False))
        if was != now or lost:
            worse = old is not None and (lost or _rank(ORDER, now) > _rank(ORDER, was))
            change = {"claim": claim, "run": run, "before": was if old else None, "after": now if new else None}
            yield {**change, "worse": worse, "as_expected": bool(new and new.as_expected is not False)}


def _seeds(before: Report, after: Report) -> Iterator[Change]:
    """Changes of the outcomes of runs with other seeds."""
    for (run, seed), old, new in _paired(before.seeds, after.seeds, "run", "seed"):
        was, now = (
            row and {"kept": row.kept, "home": row.home, **row.model_dump(by_alias=True, exclude={"run", "seed"})}
            for row in (old, new)
        )
        if was != now:
            worse = old is not None and any(getattr(old, key) and not getattr(new, key, False) for key in KEPT)
            yield {"id": f"{run}, seed {seed}", "before": was, "after": now, "worse": worse}


def _metrics(before: Report, after: Report) -> Iterator[Change]:
    """Differences of other records of the runs, by dotted key."""
    old, new = ({name: run.model_dump(exclude=NOT_COMPARED) for name, run in of.runs.items()} for of in (before, after))
    yield from _differing(old, new, "")


def _of_claims(before: Report, after: Report, field: str) -> Iterator[Change]:
    for (claim, run), old, new in _paired(before.claims, after.claims, "id", "run"):
        was, now = getattr(old, field, None), getattr(new, field, None)
        if old and new and was != now:
            of_margin = {"unit": new.unit, "relative": _relative(was, now)} if field == "margin" else {}
            yield {"claim": claim, "run": run, "before": was, "after": now, **of_margin}


def _rows(before: Report, after: Report) -> Iterator[Change]:
    for (name,), old, new in _paired(before.reproduction, after.reproduction, "id"):
        was, now = (row and {"status": row.status, "ours": row.ours} for row in (old, new))
        if was != now:
            worse = old is not None and _rank(ROWS, new.status if new else "gone") > _rank(ROWS, old.status)
            yield {"id": name, "before": was, "after": now, "worse": worse}


def _findings(before: Report, after: Report) -> Iterator[Change]:
    for (number,), old, new in _paired(before.audit, after.audit, "id"):
        was, now = (finding and finding.model_dump(include={"demonstrated", "paper", "ours"}) for finding in (old, new))
        if was != now:
            worse = bool(old and old.demonstrated and not (new and new.demonstrated))
            yield {"id": number, "before": was, "after": now, "worse": worse}


def _events(before: Report, after: Report) -> Iterator[Change]:
    for run in dict.fromkeys([*before.runs, *after.runs]):
        happened = (of.runs[run].events if run in of.runs else () for of in (before, after))
        old, new = (grouped(((event.robot, event.kind), event.t_s) for event in events) for events in happened)
        for robot, kind in dict.fromkeys([*old, *new]):
            pairs = zip_longest(old.get((robot, kind), ()), new.get((robot, kind), ()))
            for n, (was, now) in enumerate(pairs, start=1):
                if was != now:
                    about = {"run": run, "robot": robot, "kind": kind, "n": n}
                    yield {**about, "before": was, "after": now, "unit": "s"}


def _paired(
    before: Sequence[E], after: Sequence[E], *keys: str
) -> Iterator[tuple[tuple[str, ...], E | None, E | None]]:
    """Entries with the same key in both lists, and those in only one of them."""
    old, new = ({tuple(str(getattr(entry, key)) for key in keys): entry for entry in part} for part in (before, after))
    for side, of, part in (("before", old, before), ("after", new, after)):
        if len(of) < len(part):
            raise ReportError(f"the report {side} has several entries of the same {' and '.join(keys)}; wanted: one")
    for key in dict.fromkeys([*old, *new]):
        yield key, old.get(key), new.get(key)


def _outcome(claim: Claim | None) -> str:
    return outcome(claim.status, claim.exercised) if claim else "gone"


def _rank(order: Sequence[Sequence[str]], name: str) -> int:
    return [name in alike for alike in order].index(True)


def _relative(was: float | None, now: float | None) -> float | None:
    """The change of a number relative to what it was; None if it was 0 or is gone."""
    relative = (now - was) / abs(was) if was and now is not None else math.nan
    return relative if math.isfinite(relative) else None


# The parts of a comparison, and what finds the changes in each of them; `overall` has one at most.
PARTS: dict[str, Callable[[Report, Report], Iterator[Change]]] = {
    "inputs": _inputs,
    "overall": _overall,
    "verdicts": _verdicts,
    "seeds": _seeds,
    "margins": partial(_of_claims, field="margin"),
    "exercised": partial(_of_claims, field="exercised"),
    "expectations": partial(_of_claims, field="expected"),
    "reproduction": _rows,
    "audit": _findings,
    "events": _events,
    "metrics": _metrics,
}
