"""The package's theories, checked by the installed Coq and compared with their record."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from airground_drake.base import files
from airground_drake.verify.proofs import coq
from airground_drake.verify.proofs.record import FOLDER, RECORD, digest, file_of, read_record
from airground_drake.verify.proofs.theorems import THEOREMS


@dataclass(frozen=True)
class Checked:
    """What Coq found."""

    coq: str  # its version
    sha256: dict[str, str]  # of each theory
    axioms: dict[str, list[str]]  # of each theorem
    compile_s: float  # how long `coqc` took, s
    again_s: float  # how long `coqchk` took, s

    @property
    def record(self) -> dict[str, Any]:
        """The content of the record."""
        return {"coq": self.coq, "sha256": self.sha256, "axioms": self.axioms}


def check(source: Path = FOLDER, limit_s: float = coq.LIMIT_S) -> Checked:
    """Compile all theories, list the axioms of all theorems, and have `coqchk` check everything again."""
    version = coq.version()
    with files.temporary_folder() as folder:
        started = time.perf_counter()
        theories = sorted(coq.install(dict.fromkeys(map(file_of, THEOREMS)), folder, source, limit_s))
        axioms = coq.axioms_of(list(THEOREMS), folder, limit_s)
        compiled = time.perf_counter()
        coq.check_again([name.removesuffix(".v") for name in theories], folder, limit_s)
        done = time.perf_counter()
    sha256 = {name: digest(source / name) for name in theories}
    return Checked(version, sha256, axioms, compiled - started, done - compiled)


def differences(checked: Checked, source: Path = FOLDER) -> list[str]:
    """Differences from the record, a line each. Another version of Coq does not count."""
    record = read_record(source)
    if record is None:
        return [f"{RECORD} cannot be read"]
    return [
        f"{name} differs from its record"
        for part, now in (("sha256", checked.sha256), ("axioms", checked.axioms))
        for name in sorted({*record[part], *now})
        if record[part].get(name) != now.get(name)
    ]


def write_record(checked: Checked, source: Path = FOLDER) -> Path:
    files.write_json(source / RECORD, checked.record)
    return source / RECORD
