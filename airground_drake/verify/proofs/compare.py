"""Compare the folder `proofs` of a report with its traces, without Coq: the proofs must be about the recorded runs."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from airground_drake.base import files
from airground_drake.sim.trace import Trace
from airground_drake.verify.proofs.export import distances_file, recorded, without_vectors
from airground_drake.verify.proofs.readback import compare
from airground_drake.verify.proofs.record import ALLOWED_AXIOMS, FOLDER, closure, digest
from airground_drake.verify.proofs.runs import CHECKERS, FOUND, SCHEMA, expects_kept, listed
from airground_drake.verify.proofs.table import entries, law_file, lawful, missed, too_near

Broken = tuple[str, Any, Any]  # what is wrong, what it should be, and what is recorded

# What is said of a theorem that is proved, and of one that is not, besides name and file.
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
        lawfully = recorded(trace, steered=True) if exact.off_m else exact
        table, near = entries(lawfully), too_near(exact)
        alone = not entry["distances"]["proved"] or lawfully is not exact
        law = law_file(lawfully, table, alone=alone) if table else ""
        of_run = {f"{exact.name}.v": distances_file(exact, vectors=False), f"{lawfully.name}_law.v": law}
        texts |= of_run
        meta = files.sha256(files.read_bytes(folder.parent / "trace" / name / "meta.json"))
        kept = entry["distances"]["proved"]
        rounding = compare(distances_file(exact), trace)
        expected = {
            "meta_sha256": meta, "expected": expects_kept(trace), "rows": len(trace.t), "pairs": len(exact.demands),
            "lawful_pairs": len(lawful(exact.demands)), "rounded_coordinates": rounding.coordinates,
            "rounded_by_m": rounding.most_m,
        }  # fmt: skip
        yield from _unless(f"{name}: keys", sorted({*expected, "distances", "law"}), sorted(entry))
        for key, value in expected.items():
            yield from _unless(f"{name}.{key}", value, entry[key])
        yield from _unless(f"{name}.distances.proved", kept and not near, kept)
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


def _unless(about: str, wanted: Any, recorded: Any) -> Iterator[Broken]:
    """A broken rule, unless both are equal."""
    if recorded != wanted:
        yield about, wanted, recorded
