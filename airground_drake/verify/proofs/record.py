"""The record of the last check by Coq, and whether the theories are unchanged since then."""

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from airground_drake.base import files
from airground_drake.verify.proofs.theorems import FOLDER, THEOREMS

RECORD = "record.json"

# Axioms of Coq's real numbers, and of classical logic: a theorem may rest on these alone.
ALLOWED_AXIOMS = frozenset(
    {
        "ClassicalDedekindReals.sig_forall_dec",
        "ClassicalDedekindReals.sig_not_dec",
        "FunctionalExtensionality.functional_extensionality_dep",
        "Classical_Prop.classic",
    }
)


@dataclass(frozen=True)
class Standing:
    """Whether theorems count as proved."""

    checked: bool  # whether Coq has checked exactly the files that are here, on allowed axioms only
    words: str  # the same in words, for a report
    theory: Mapping[str, str]  # SHA-256 of each file that the theorems rest on


def standing(*names: str, folder: Path = FOLDER) -> Standing:
    """Whether the named theorems (default: all) count as proved. Coq is not needed."""
    # The SHA-256 of each file that they rest on is compared with the record of the last check.
    unknown = [name for name in names if name not in THEOREMS]
    if unknown:
        raise ValueError(f"no theorem {unknown[0]!r}; there are {', '.join(THEOREMS)}")
    chosen = names or tuple(THEOREMS)
    try:
        theory = {file: digest(folder / file) for file in closure([file_of(name) for name in chosen], folder)}
    except OSError as error:
        return Standing(False, f"not checked: {Path(error.filename).name} cannot be read", {})
    record = read_record(folder)
    if record is None:
        return Standing(False, f"not checked: {RECORD} cannot be read: run `airground prove --record`", theory)
    if why := _doubt(record, chosen, theory):
        return Standing(False, f"not checked: {why}", theory)
    return Standing(True, f"checked by Coq {record['coq']} for this release; hypotheses checked now", theory)


def read_record(folder: Path = FOLDER) -> dict[str, Any] | None:
    """The record of the last check: `coq`, `sha256` by file, `axioms` by theorem; None if it cannot be read."""
    try:
        record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        whole = isinstance(record["coq"], str) and all(isinstance(record[part], dict) for part in ("sha256", "axioms"))
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return record if whole else None


def _doubt(record: Mapping[str, Any], names: tuple[str, ...], theory: Mapping[str, str]) -> str:
    """The reason why the record does not cover the theorems; empty if it does."""
    for file, sha256 in theory.items():
        if record["sha256"].get(file) != sha256:
            return f"{file} differs from its record: run `airground prove`"
    for name in names:
        if name not in record["axioms"]:
            return f"{name} is not in the record: run `airground prove`"
        other = sorted(set(record["axioms"][name]) - ALLOWED_AXIOMS)
        if other:
            return f"{name} rests on the axiom {other[0]}"
    return ""


def file_of(theorem: str) -> str:
    return theorem.partition(".")[0] + ".v"


def digest(file: Path) -> str:
    return files.sha256(file.read_bytes())


def closure(names: Iterable[str], folder: Path = FOLDER) -> list[str]:
    """Theories and everything that they require, in an order in which Coq can compile them."""
    order: list[str] = []
    for name in names:
        order += [file for file in (*closure(required(folder / name), folder), name) if file not in order]
    return order


def required(file: Path) -> list[str]:
    words = re.findall(r"^Require Import ([^.]*)\.", file.read_text(encoding="utf-8"), re.MULTILINE)
    modules = [f"{word}.v" for line in words for word in line.split()]
    return [module for module in modules if (file.parent / module).exists()]
