"""The runs of a report as theorems: Coq decides a file for each; without Coq the files are compared with traces."""

import json
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from airground_drake.base import files
from airground_drake.base.errors import TraceError, UnknownNameError
from airground_drake.base.registry import DISTANCES
from airground_drake.base.statuses import NOTHING, declared
from airground_drake.sim.trace import Trace, load
from airground_drake.verify.proofs import coq, readback
from airground_drake.verify.proofs.export import (
    Demand,
    Recorded,
    demands_of,
    distances_file,
    recorded,
    refuse_unknown,
    without_vectors,
)
from airground_drake.verify.proofs.record import ALLOWED_AXIOMS, closure, digest, standing
from airground_drake.verify.proofs.table import Entry, Missed, TooNear, entries, law_file, lawful, missed, too_near
from airground_drake.verify.proofs.theorems import FOLDER

SCHEMA = "airground_drake.proofs/1"
PLACE = "proofs"  # folder of a report for its proofs
FOUND = "proofs.json"  # file in that folder with the results
# Part of Coq's message if a checker has computed `false` where the proof says `true`.
COMPUTED = "is expected to have type"
CHECKERS = ("DistanceChecker.v", "LawChecker.v")
# Theorems and theories whose hypotheses the files of a run meet.
THEOREMS = (
    "DistanceChecker", "LawChecker", "Run", "Mixed.first_order", "Mixed.entry_keeps", "Mixed.run_all",
    "Mixed.from_rest",
)  # fmt: skip


@dataclass(frozen=True)
class CoqReply:
    """Coq's answer about one theorem."""

    proved: bool  # whether it accepts it
    theorem: str  # its name
    file: str
    why: str = ""  # the reason if it is not proved
    refused: Demand | None = None  # the first pair that Coq refuses
    too_near: Sequence[TooNear] = ()  # pairs that do not keep their distance
    axioms: Sequence[str] = ()  # of the proof
    seconds: float = 0.0  # how long Coq took, s
    entries: int = 0  # of the run's table that it accepts; 0 in an answer about distances
    missed: Sequence[Missed] = ()  # pairs with periods without an entry


@dataclass(frozen=True)
class Proved:
    """The result for one run."""

    run: str  # its identifier
    about: Mapping[str, Any]  # see `_about_run`
    distances: CoqReply  # every pair keeps its full distance at all times
    law: CoqReply  # the lawful pairs obey the avoidance law, without error


@dataclass(frozen=True)
class Workshop:
    """A folder in which the checkers are compiled."""

    folder: Path  # temporary
    coq: str  # version of Coq
    theory: Mapping[str, str] = field(default_factory=dict)  # SHA-256 of each theory used


@contextmanager
def workshop(limit_s: float = coq.LIMIT_S) -> Iterator[Workshop]:
    """Compile the theories that the files of runs require, in a temporary folder."""
    # They must be those of the record: the file of a run does not show what its words mean.
    about = standing("DistanceChecker.sound", "LawChecker.sound")
    if not about.checked:
        raise coq.CoqError(f"the theories are {about.words}")
    version = coq.version()
    with files.temporary_folder() as folder:
        used = coq.install(CHECKERS, folder, limit_s=limit_s)
        yield Workshop(folder, version, {name: digest(FOLDER / name) for name in used})


def prove(place: Workshop, run: Trace, limit_s: float = coq.LIMIT_S) -> tuple[CoqReply, CoqReply, readback.RereadError]:
    """Have Coq decide whether a run keeps its distances, and when it obeys the law."""
    with _usable(run):
        exact = recorded(run)
        text = distances_file(exact)
    rounded = readback.compare(text, run)
    distances = decide(place, exact, f"{exact.name}.v", text, f"{exact.name}_keeps_its_distances", limit_s)
    if distances.refused and (near := too_near(exact)):
        words = f"Coq refuses {_pair(distances.refused)}. In exact arithmetic {'; '.join(map(str, near))}"
        distances = replace(distances, why=words, too_near=near)
    lawfully, table, text = _law(run, exact, proved=distances.proved)
    if table and not (distances.proved and lawfully is exact):
        readback.compare_positions(text, run, steered=lawfully is not exact)
    return distances, _decide_law(place, lawfully, table, text, limit_s), rounded


def _law(run: Trace, exact: Recorded, *, proved: bool) -> tuple[Recorded, list[Entry], str]:
    """The record of the steered points, its table, and the file about it; '' without an entry."""
    # proved: whether Coq accepts the file about distances; the file about the law may then use its positions.
    lawfully = recorded(run, steered=True) if exact.off_m else exact
    table = entries(lawfully)
    return lawfully, table, law_file(lawfully, table, alone=not proved or lawfully is not exact) if table else ""


def _decide_law(place: Workshop, run: Recorded, table: Sequence[Entry], text: str, limit_s: float) -> CoqReply:
    """Have Coq prove the table of a run from its file; complete if it covers all pairs and periods."""
    theorem = f"{run.name}_obeys_the_law"
    name = f"{run.name}_law.v"
    gaps = missed(run, table)
    if not table:
        why = "no pair obeys it in any period" if gaps else "its table has no pair: see docs/verification.md"
        return CoqReply(False, theorem, name, why, missed=gaps)
    law = decide(place, run, name, text, theorem, limit_s)
    if not law.proved:
        return replace(law, missed=gaps)
    law = replace(law, entries=len(table), missed=gaps)
    if not gaps:
        return law
    pairs = (f"{' and '.join(gap.demand.called)}, {gap.begin_s:.6g} to {gap.end_s:.6g} s" for gap in gaps)
    return replace(law, proved=False, why=f"{'; '.join(pairs)}. Proved of the other periods, in {len(table)} entries")


@contextmanager
def _usable(run: Trace) -> Iterator[None]:
    """Refuse a damaged scenario in meta.json."""
    try:
        yield
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise TraceError(f"run {run.run}: the scenario in meta.json cannot be used: {error!r}") from None


def decide(place: Workshop, run: Recorded, name: str, text: str, theorem: str, limit_s: float) -> CoqReply:
    files.write_text(place.folder / name, text)
    started = time.perf_counter()
    try:
        axioms = coq.listed(theorem, coq.compile_file(place.folder / name, limit_s))
    except coq.CoqError as error:
        refused = _about(run, text, error.line) if COMPUTED in str(error) else None
        why = f"Coq refuses {_pair(refused)}; later pairs were not tried" if refused else str(error)
        return CoqReply(False, theorem, name, why, refused)
    return CoqReply(True, theorem, name, axioms=axioms, seconds=time.perf_counter() - started)


def _pair(demand: Demand) -> str:
    return f"{' and '.join(demand.called)}, {float(demand.required_m):g} m"


def _about(run: Recorded, text: str, line: int) -> Demand | None:
    """The pair of the lemma at a line of an exported file."""
    before = "\n".join(text.splitlines()[:line])
    lemma = before.rpartition("\nLemma ")[2].partition(" ")[0]
    return next((demand for demand in run.demands if demand.lemma == lemma), None)


def prove_report(report: Path, names: Sequence[str] = (), limit_s: float = coq.LIMIT_S) -> Iterator[Proved]:
    """Prove the runs of a report, one after the other, and write the results to its folder `proofs`."""
    # names: of the runs; default: all.
    files.refuse_links(report)
    there = sorted(path.parent.name for path in report.glob("trace/*/meta.json"))
    for name in names:
        if name not in there:
            raise UnknownNameError(f"run of {report}", name, there)
    if not there:
        raise TraceError(f"{report} has no trace/*/meta.json; wanted: the folder of a report")
    runs = {name: load(report / "trace" / name, name) for name in names or there}
    for run in runs.values():
        with _usable(run):
            refuse_unknown(run)
    answers: list[Proved] = []
    with workshop(limit_s) as place:
        for name, run in runs.items():
            distances, law, rounded = prove(place, run, limit_s)
            for answer in (distances, law):
                (report / PLACE / answer.file).unlink(missing_ok=True)
                if (place.folder / answer.file).exists():
                    files.write_bytes(report / PLACE / answer.file, (place.folder / answer.file).read_bytes())
            answers.append(Proved(name, _about_run(report, run, rounded), distances, law))
            yield answers[-1]
        files.write_json(report / PLACE / FOUND, document(place, answers))


def _about_run(report: Path, run: Trace, rounded: readback.RereadError) -> dict[str, Any]:
    """The entries of proofs.json about a run besides Coq's answers."""
    asked = demands_of(run)
    return {
        "expected": expects_kept(run),
        "meta_sha256": files.sha256(files.read_bytes(report / "trace" / run.run / "meta.json")),
        "rows": len(run.t),
        "pairs": len(asked),
        "lawful_pairs": len(lawful(asked)),  # whose law is judged
        "rounded_coordinates": rounded.coordinates,
        "rounded_by_m": rounded.most_m,
    }


def expects_kept(run: Trace) -> bool:
    """Whether the scenario expects that the run keeps its distances."""
    expected = run.scenario.runs[run.run].expected.get(DISTANCES, "holds")
    return declared(expected) != NOTHING and "refuted" not in expected


def document(place: Workshop, answers: Sequence[Proved]) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "coq": place.coq,
        "theory": dict(place.theory),
        "runs": {
            proved.run: {**proved.about, "distances": _entry(proved.distances), "law": _entry(proved.law)}
            for proved in answers
        },
    }


def _entry(answer: CoqReply) -> dict[str, Any]:
    entry: dict[str, Any] = {"proved": answer.proved, "theorem": answer.theorem, "file": answer.file}
    if answer.entries:
        entry["entries"] = answer.entries
    if answer.missed:
        entry["missed"] = listed(answer.missed)
    if answer.proved:
        return entry | {"axioms": list(answer.axioms), "seconds": round(answer.seconds, 3)}
    near = [_near(gap) for gap in answer.too_near]
    return entry | {"why": answer.why} | ({"too_near": near} if near else {})


def _near(gap: TooNear) -> dict[str, Any]:
    """A pair that came too near, as strict JSON."""
    return {
        "first": gap.demand.called[0], "second": gap.demand.called[1],
        "safe_distance_m": float(gap.demand.required_m),
        "least_m": gap.least_m, "short_m": gap.short_m, "t_s": gap.t_s,
    }  # fmt: skip


def listed(gaps: Iterable[Missed]) -> list[dict[str, Any]]:
    """Pairs with periods without an entry, as strict JSON."""
    return [
        {"first": gap.demand.called[0], "second": gap.demand.called[1], "begin_s": gap.begin_s, "end_s": gap.end_s}
        for gap in gaps
    ]


Broken = tuple[str, Any, Any]  # what is wrong, what it should be, and what is recorded

# Entries of a proved and of an unproved theorem, besides name and file.
_PROVED, _UNPROVED = ("axioms", "seconds", "entries"), ("why", "too_near", "entries", "missed")


def broken_rules(folder: Path, traces: Mapping[str, Trace]) -> tuple[dict[str, Any], list[Broken]]:
    """Compare proofs.json and the Coq files with the traces of the report."""
    # The distances are computed here in exact arithmetic, so an unsafe run cannot be called proved. Whether Coq has
    # accepted a file is taken from the record: `airground check --coq` asks Coq again.
    # traces: of the report's runs, by name; in the folder `trace` beside `folder`.
    record: dict[str, Any] = json.loads(files.read_text(folder / FOUND))
    return record, [*_broken(folder, record, traces)]


def _broken(folder: Path, record: Mapping[str, Any], traces: Mapping[str, Trace]) -> Iterator[Broken]:
    texts: dict[str, str] = {}
    yield from _unless(FOUND, SCHEMA, record["schema"])
    yield from _unless(f"keys of {FOUND}", ["coq", "runs", "schema", "theory"], sorted(record))
    yield from _unless("theory", {name: digest(FOLDER / name) for name in closure(CHECKERS)}, record["theory"])
    yield from _unless(FOUND, [], sorted({*record["runs"]} - {*traces}))
    for name, trace in traces.items():
        if name not in record["runs"]:
            continue
        exact, entry = recorded(trace), record["runs"][name]
        kept, near = entry["distances"]["proved"], too_near(exact)
        lawfully, table, law = _law(trace, exact, proved=kept)
        of_run = {f"{exact.name}.v": distances_file(exact, vectors=False), f"{lawfully.name}_law.v": law}
        texts |= of_run
        expected = _about_run(folder.parent, trace, readback.compare(texts[f"{exact.name}.v"], trace))
        yield from _unless(f"{name}: keys", sorted({*expected, "distances", "law"}), sorted(entry))
        for key, value in expected.items():
            yield from _unless(f"{name}.{key}", value, entry[key])
        yield from _unless(f"{name}.distances.proved", kept and not near, kept)
        if "too_near" in entry["distances"]:
            yield from _unless(f"{name}.distances.too_near", *_same_times(near, exact, entry["distances"]["too_near"]))
        gaps = listed(missed(lawfully, table))
        yield from _unless(f"{name}.law.proved", entry["law"]["proved"] and not gaps, entry["law"]["proved"])
        yield from _unless(f"{name}.law.missed", gaps, entry["law"].get("missed", []))
        if "entries" in entry["law"]:
            yield from _unless(f"{name}.law.entries", len(table), entry["law"]["entries"])
        theorems = f"{exact.name}_keeps_its_distances", f"{lawfully.name}_obeys_the_law"
        for answer, file, theorem in zip((entry["distances"], entry["law"]), of_run, theorems, strict=True):
            yield from _unless(f"{name}: file", file, answer["file"])
            yield from _unless(f"{name}: theorem", theorem, answer["theorem"])
            unknown = {*answer} - {"proved", "theorem", "file", *(_PROVED if answer["proved"] else _UNPROVED)}
            yield from _unless(f"{name}: unknown keys about {theorem}", [], sorted(unknown))
            if answer["proved"]:
                axioms = answer["axioms"]
                yield from _unless(f"{name}: axioms of {theorem}", sorted(ALLOWED_AXIOMS & {*axioms}) or "some", axioms)
            if (answer["proved"] or "entries" in answer) and not (folder / file).is_file():
                yield f"{name}: {file}", "a file", "nothing"
    for path in sorted(folder.iterdir()):
        if path.name != FOUND:
            known = path.name in texts and without_vectors(files.read_text(path)) == texts[path.name]
            yield from _unless(f"{path.name} is about the recorded run", True, known)


def _same_times(near: Sequence[TooNear], run: Recorded, recorded: Sequence[dict[str, Any]]) -> tuple[Any, Any]:
    """Pairs that came too near, and those recorded: their times agree to a step, where processors may find others."""
    step_s = float(max(b - a for a, b in pairwise(run.times)))
    ours = [*map(_near, near)]
    for pair, theirs in zip(ours, recorded, strict=False):
        if abs(pair["t_s"] - theirs["t_s"]) <= step_s:
            pair["t_s"] = theirs["t_s"]
    return ours, recorded


def _unless(about: str, wanted: Any, recorded: Any) -> Iterator[Broken]:
    if recorded != wanted:
        yield about, wanted, recorded
