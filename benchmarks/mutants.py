"""Every mutant, and what catches it: `python benchmarks/mutants.py [--only WORD] [--jobs 1] [--json FILE]`.

A mutant is one edit of the package, made in a temporary copy. `benchmarks/mutation/chosen.py` lists the ones that
matter. `--drawn N --seed S` draws N others at random from the code that produces a run (`mutation/drawn.py`). On each
copy short runs are simulated. Those that differ from the runs of the unchanged package are judged by their claims, by
the oracles of the tests and by the independent checker. If nothing notices, the tests that concern the file run.
Prints a line for each mutant; `--json` keeps the results. Exit code 1 if one survives. Most drawn ones that survive are
equivalent, or within what is specified: a person has to look at them.
"""

from __future__ import annotations

import argparse
import json
import os
import queue
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import closing
from dataclasses import asdict, dataclass, field
from pathlib import Path

from mutation import drawn
from mutation.chosen import CHOSEN
from mutation.mutant import PACKAGE, Mutant

ROOT = Path(__file__).resolve().parents[1]
COPIED = (PACKAGE, "tests", "benchmarks", "docs", "pyproject.toml", "README.md")
LONGEST_S = 900
"""Time limit of a command, s: a mutant may run for ever."""
RUNS_STAY = ("check", "logs", "report", "verify")
"""Folders of the code that judges: an edit there changes no run."""


@dataclass
class Result:
    """The result of a mutant.

    Attributes:
        name: of the mutant.
        stage: what caught it: claim, oracle, checker, test or nothing.
        by: the claims, oracles, rules or tests that caught it.
        changed: the probes whose runs differ from those of the unchanged package.
        seconds: how long it took.
        commit: of the code; empty if unknown.
    """

    name: str
    stage: str = "nothing"
    by: list[str] = field(default_factory=list)
    changed: list[str] = field(default_factory=list)
    seconds: float = 0.0
    commit: str = ""


class Copy:
    """A copy of the package in which one file at a time is edited."""

    def __init__(self, pristine: Path, folder: Path) -> None:
        """Copy; times of files are kept, because compiled functions are found by them."""
        self.pristine, self.folder = pristine, folder
        shutil.copytree(pristine, folder)
        paths = os.pathsep.join(map(str, (folder, folder / "tests")))
        self._environment = os.environ | {"PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"}
        self._environment |= {"AIRGROUND_DRAKE_CACHE": str(folder / "cache")}
        self._errors = folder / "errors.txt"
        with self._errors.open("w", encoding="utf-8") as errors:
            self._server = subprocess.Popen(
                [sys.executable, "benchmarks/mutation/probe.py"], cwd=folder, env=self._environment, text=True,
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors,
            )  # fmt: skip

    def close(self) -> None:
        """End the process that answers."""
        self._server.kill()
        self._server.wait()

    def run(self, *command: str) -> subprocess.CompletedProcess[str]:
        """Run a command in the copy; a test that does not end in time has failed."""
        try:
            return subprocess.run(
                command, cwd=self.folder, env=self._environment, capture_output=True, text=True, check=False,
                timeout=LONGEST_S,
            )  # fmt: skip
        except subprocess.TimeoutExpired as late:
            begun = (late.stdout or b"").decode(errors="replace").rstrip().rpartition("\n")[2]
            return subprocess.CompletedProcess(command, 1, f"FAILED {begun.strip()}", "")

    def probe(self, kind: str, *what: str) -> list[list[str]]:
        """Findings of `mutation/probe.py`; a single one if its process ends with an error."""
        out = self.folder / "probe.json"
        out.unlink(missing_ok=True)
        assert self._server.stdin is not None
        assert self._server.stdout is not None
        self._server.stdin.write(json.dumps([str(out), kind, what]) + "\n")
        self._server.stdin.flush()
        code = self._server.stdout.readline().strip()
        if code == "0" and out.exists():
            found: list[list[str]] = json.loads(out.read_text(encoding="utf-8"))
            return found
        last = (self._errors.read_text(encoding="utf-8").strip().splitlines() or [f"exit code {code}"])[-1]
        return [["run", " ".join(what), "stops", last[:160]]]

    def compiled_with(self, path: str) -> list[Path]:
        """The file, and those whose compiled functions call functions of it."""
        found = [self.folder / PACKAGE / path]
        for file in found:
            module = ".".join(file.relative_to(self.folder).with_suffix("").parts)
            for other in (self.folder / PACKAGE).rglob("*.py"):
                text = other.read_text(encoding="utf-8")
                if other not in found and "@njit" in text and re.search(rf"from {re.escape(module)} import", text):
                    found.append(other)
        return found

    def forget_compiled(self, files: Sequence[Path]) -> None:
        """Delete what numba has compiled of these files."""
        for file in files:
            for kept in (file.parent / "__pycache__").glob(f"{file.stem}.*.nb*"):
                kept.unlink()

    def restore(self, files: Sequence[Path]) -> None:
        """Put back the original files and their compiled functions."""
        self.forget_compiled(files)
        for file in files:
            original = self.pristine / file.relative_to(self.folder)
            shutil.copy2(original, file)
            for kept in (original.parent / "__pycache__").glob(f"{original.stem}.*.nb*"):
                shutil.copy2(kept, file.parent / "__pycache__" / kept.name)


class Bench:
    """The unchanged package, the results of its runs, and copies to break."""

    def __init__(self, folder: Path, mutants: Sequence[Mutant], jobs: int) -> None:
        """Copy the package, and run every probe once on it.

        Raises:
            SystemExit: if a run of the unchanged package stops, or its claims and the checker disagree.
        """
        first = folder / "as_it_is"
        first.mkdir()
        for name in COPIED:
            if (ROOT / name).is_dir():
                shutil.copytree(ROOT / name, first / name)
            else:
                shutil.copy2(ROOT / name, first / name)
        here = Copy(first, folder / "baseline")
        described = ("git", "describe", "--always", "--dirty", "--exclude", "*")
        self.commit = subprocess.run(described, cwd=ROOT, capture_output=True, text=True, check=False).stdout.strip()
        probes = sorted({run for mutant in mutants for run in mutant.runs})
        found = here.probe("runs", *probes) + here.probe("ways", *probes)
        if wrong := [each for each in found if each[2] in ("stops", "fault", "disagrees", "error")]:
            sys.exit(f"the package as it is does not pass: {wrong}")
        self.baseline = {(source, where): status for source, where, status, _ in found}
        for kept in (here.folder / PACKAGE).rglob("*.nb*"):  # what was compiled meanwhile
            there = first / kept.relative_to(here.folder)
            there.parent.mkdir(exist_ok=True)
            shutil.copy2(kept, there)
        self.unbroken = here
        self.copies: queue.Queue[Copy] = queue.Queue()
        for k in range(jobs):
            self.copies.put(Copy(first, folder / f"copy{k}"))

    def close(self) -> None:
        """End all processes."""
        for copy in (self.unbroken, *self.copies.queue):
            copy.close()

    def judge(self, mutant: Mutant) -> Result:
        """Make the edit in a free copy, and find what catches it."""
        copy, started = self.copies.get(), time.perf_counter()
        result = Result(mutant.name, commit=self.commit)
        edited = copy.compiled_with(mutant.path)
        try:
            if mutant.compiled(copy.folder):
                copy.forget_compiled(edited)
            mutant.apply(copy.folder)
            result.stage, result.by = self._caught(mutant, copy, result.changed)
        finally:
            copy.restore(edited)
            self.copies.put(copy)
        result.seconds = round(time.perf_counter() - started, 1)
        return result

    def _caught(self, mutant: Mutant, copy: Copy, changed: list[str]) -> tuple[str, list[str]]:
        names = list(mutant.runs)
        if not mutant.path.startswith(RUNS_STAY):
            if by := self._differences(found := copy.probe("ways", *names), "run"):
                return "claim", by
            changed += [where for source, where, digest, _ in found if digest != self.baseline[source, where]]
            names = changed
        for name in names:
            if by := self._differences(copy.probe("runs", name)):
                stages = [each.partition(":")[0] for each in by if each.startswith(("oracle:", "checker:"))]
                return ("claim" if len(stages) < len(by) else "oracle" if "oracle" in stages else "checker"), by
        return ("test", [failed]) if mutant.tests and (failed := self._failing(mutant, copy)) else ("nothing", [])

    def _differences(self, found: list[list[str]], only: str = "") -> list[str]:
        """Differences from the unchanged package; only those of one source, if it is named."""
        by = []
        for source, where, status, rule in found:
            if only in ("", source) and status != self.baseline.get((source, where)):
                by.append(f"{source} ({where}): {status}{f', {rule}' if rule else ''}")
        return by

    def _failing(self, mutant: Mutant, copy: Copy) -> str:
        """The first test that fails on the copy and passes on the unchanged package; '' if no test does."""
        options = ("-m", "", "-n", "0", "-x", "-v", "--no-header", "-p", "no:cacheprovider")
        done = copy.run(sys.executable, "-m", "pytest", *options, *mutant.tests)
        failed = re.findall(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", done.stdout, flags=re.MULTILINE)
        if done.returncode == 0 or not failed:
            return ""
        passes = self.unbroken.run(sys.executable, "-m", "pytest", *options, failed[0]).returncode == 0
        return failed[0] if passes else ""


def main() -> int:
    """Break, judge, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", action="append", default=[], metavar="WORD", help="mutants with this in name or path")
    parser.add_argument("--jobs", type=int, default=1, help="copies that are judged side by side (default: 1)")
    parser.add_argument("--json", type=Path, help="file for the results")
    parser.add_argument("--drawn", type=int, metavar="N", help="N mutants drawn at random; --only: words in paths")
    parser.add_argument("--seed", type=int, default=0, help="of the drawing (default: 0)")
    options = parser.parse_args()
    mutants = CHOSEN if options.drawn is None else drawn.draw(ROOT, options.drawn, options.seed, options.only)
    mutants = [m for m in mutants if not options.only or any(w in f"{m.name} {m.path}" for w in options.only)]
    mutants.sort(key=lambda m: m.compiled(ROOT))  # those last whose callers are compiled again
    results = []
    with tempfile.TemporaryDirectory() as name:
        bench = Bench(Path(name), mutants, options.jobs)
        with ThreadPoolExecutor(options.jobs) as pool, closing(bench):
            for done in as_completed([pool.submit(bench.judge, mutant) for mutant in mutants]):
                results.append(result := done.result())
                says = "; ".join(result.by) or f"runs changed: {', '.join(result.changed)}"
                print(f"{result.name}: {result.stage}: {says}", flush=True)
                if options.json:
                    options.json.write_text(json.dumps([*map(asdict, results)], indent=1), encoding="utf-8")
    print(dict(Counter(each.stage for each in results)))
    return int(any(each.stage == "nothing" for each in results))


if __name__ == "__main__":
    sys.exit(main())
