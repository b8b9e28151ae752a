"""Run the proof checker Coq: compile theories, list the axioms of theorems, check compiled files with `coqchk`."""

import re
import shutil
import subprocess
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from airground_drake.base import files
from airground_drake.base.errors import AirgroundError
from airground_drake.verify.proofs.record import ALLOWED_AXIOMS, RECORD, closure, digest, file_of, read_record
from airground_drake.verify.proofs.theorems import FOLDER, THEOREMS

LIMIT_S = 600.0  # Wall-clock time for one call of Coq, s. The longest, `coqchk`, takes some 30 s.
# Words with which a file could assume a statement instead of a proof, or turn off Coq's own checks.
UNSOUND = re.compile(
    r"\b(Admitted|admit|give_up|Axioms?|Parameters?|Conjecture|Declare\s+ML\s+Module|bypass_check|Unset\s+\w+\s+Checking"
    r"|Type\s+In\s+Type|Load|Extract\s+\w+|Drop)\b"
)


class CoqError(AirgroundError):
    """Coq does not accept a file, or a theorem rests on more than is allowed."""

    def __init__(self, message: str, line: int = 0) -> None:
        super().__init__(message)
        self.line = line  # of the file, from 1; 0 if unknown


class NoCoqError(AirgroundError):
    """Coq is not installed, or does not run."""


def version() -> str:
    """The version of the installed Coq, such as "8.16.1"."""
    for tool in ("coqc", "coqchk"):
        if shutil.which(tool) is None:
            raise NoCoqError(f"{tool} is not on the PATH: install Coq (Debian, Ubuntu: apt-get install coq)")
    run = _run(["coqc", "--print-version"], Path.cwd(), 60.0)
    if run.returncode or not run.stdout.split():
        raise NoCoqError(f"coqc does not run: {run.stderr.strip() or run.returncode}")
    return run.stdout.split()[0]


def screen(text: str, name: str) -> None:
    """Refuse a file that assumes something, or turns off a check of Coq."""
    unsound = UNSOUND.search(without_comments(text))
    if unsound:
        raise CoqError(f"{name} has the word {unsound[0]!r}: a theory may assume nothing")


def without_comments(text: str) -> str:
    """The text without comments, and without strings, also those in comments: there `(*` opens none."""
    depth, kept = 0, []
    for part in re.split(r"(\(\*|\*\))", re.sub(r'"[^"]*"', '""', text)):
        if part == "(*":
            depth += 1
        elif part == "*)":
            depth -= 1
        elif depth == 0:
            kept.append(part)
    return " ".join(kept)


def install(names: Iterable[str], folder: Path, source: Path = FOLDER, limit_s: float = LIMIT_S) -> list[str]:
    """Copy theories, and those that they require, to a folder, and compile them there."""
    # Returns the files, in the order in which they were compiled.
    order = closure(names, source)
    for name in order:
        shutil.copyfile(source / name, folder / name)
        compile_file(folder / name, limit_s)
    return order


def compile_file(file: Path, limit_s: float = LIMIT_S) -> str:
    """Screen a file and compile it, in its folder; what it requires must be compiled there."""
    screen(file.read_text(encoding="utf-8"), file.name)
    run = _run(["coqc", "-q", file.name], file.parent, limit_s)
    if run.returncode:
        where = re.search(r"line (\d+)", run.stderr)
        why = " ".join(run.stderr.partition("Error:")[2].split()) or run.stderr or f"exit code {run.returncode}"
        line = int(where[1]) if where else 0
        raise CoqError(f"Coq does not accept {file.name}, line {line}: {why[:300]}", line)
    return run.stdout


def axioms_of(theorems: Sequence[str], folder: Path, limit_s: float = LIMIT_S) -> dict[str, list[str]]:
    """The axioms of each theorem ("File.name"), from compiled files in a folder."""
    modules = dict.fromkeys(theorem.partition(".")[0] for theorem in theorems)
    lines = [f"Require {' '.join(modules)}.", *(f"Print Assumptions {theorem}." for theorem in theorems)]
    file = folder / "Assumptions_of_theorems.v"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    output = compile_file(file, limit_s)
    answers = re.split(r"^(?=Axioms:|Closed under)", output, flags=re.MULTILINE)[1:]
    return {theorem: listed(theorem, answer) for theorem, answer in zip(theorems, answers, strict=True)}


def listed(theorem: str, answer: str) -> list[str]:
    """The axioms in an answer of `Print Assumptions`: each begins a line, and its type is indented."""
    if answer.startswith("Closed under"):
        return []
    names = [re.split(r"[\s:]", line, maxsplit=1)[0] for line in answer.splitlines()[1:] if line[:1].strip()]
    other = sorted(set(names) - ALLOWED_AXIOMS)
    if other or not names:
        raise CoqError(f"{theorem} rests on {other[0] if other else 'something unknown'}, which is not allowed")
    return sorted(set(names))


def check_again(modules: Sequence[str], folder: Path, limit_s: float = LIMIT_S) -> None:
    """Have `coqchk` check compiled files and everything that they require."""
    run = _run(["coqchk", "-silent", "-o", "-R", ".", "", *modules], folder, limit_s)
    if run.returncode:
        raise CoqError(f"coqchk does not accept the theories: {(run.stderr or run.stdout)[-300:]}")
    summary = (run.stdout + run.stderr).partition("CONTEXT SUMMARY")[2]
    parts = dict(re.findall(r"^\* ([^:]+):\s*(.*?)\s*(?=^\*|\Z)", summary, re.MULTILINE | re.DOTALL))
    axioms = parts.pop("Axioms", None)
    if axioms is None or parts.pop("Theory", "") != "Set is predicative" or len(parts) != 3:
        raise CoqError("coqchk printed no list of what the theories rest on")
    for part, answer in parts.items():
        if answer != "<none>":
            raise CoqError(f"coqchk: {part}: {answer}")
    for axiom in [] if axioms == "<none>" else axioms.split():
        if not any(re.fullmatch(rf"(Coq|Stdlib)\.\w+\.{re.escape(allowed)}", axiom) for allowed in ALLOWED_AXIOMS):
            raise CoqError(f"coqchk finds the axiom {axiom}, which is not allowed")


def _run(command: list[str], folder: Path, limit_s: float) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=limit_s, check=False)
    except subprocess.TimeoutExpired:
        raise CoqError(f"{command[0]} {command[-1]} took longer than {limit_s:g} s") from None
    except OSError as error:
        raise NoCoqError(f"{command[0]} does not start: {error.strerror}") from None


@dataclass(frozen=True)
class Checked:
    """What Coq found."""

    coq: str  # its version
    sha256: dict[str, str]  # of each theory
    axioms: dict[str, list[str]]  # of each theorem
    compile_s: float  # how long `coqc` took, s
    again_s: float  # how long `coqchk` took, s


def check(source: Path = FOLDER, limit_s: float = LIMIT_S) -> Checked:
    """Compile all theories, list the axioms of all theorems, and have `coqchk` check everything again."""
    installed = version()
    with files.temporary_folder() as folder:
        started = time.perf_counter()
        theories = sorted(install(dict.fromkeys(map(file_of, THEOREMS)), folder, source, limit_s))
        axioms = axioms_of(list(THEOREMS), folder, limit_s)
        compiled = time.perf_counter()
        check_again([name.removesuffix(".v") for name in theories], folder, limit_s)
        done = time.perf_counter()
    sha256 = {name: digest(source / name) for name in theories}
    return Checked(installed, sha256, axioms, compiled - started, done - compiled)


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
    files.write_json(source / RECORD, {"coq": checked.coq, "sha256": checked.sha256, "axioms": checked.axioms})
    return source / RECORD
