"""`airground check DIR`: the checker, then every claim judged again by its own code, from the files alone.

The checker (`airground_drake.check`) is separate code for the most important rules. Then a process without Drake
(`airground_drake.report.rebuild`) builds the report again and compares each value. With `--coq` the safety of the runs
is proved again, too. Each line names its source among these three.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from airground_drake.base.progress import SILENT, Progress, progress_bar
from airground_drake.base.usage import refuse
from airground_drake.check import command as checker

if TYPE_CHECKING:
    import argparse

    from airground_drake.check.report import Line

NEEDED = ("report", "files", "trace")
"""Checks that must agree before claims are judged again: otherwise the files do not belong to the report."""
EXIT_UNUSABLE = 2
"""Exit code of `airground prove` without Coq, or with a report that it cannot read."""


def parser() -> argparse.ArgumentParser:
    """Make the parser: that of the checker, and `--coq`."""
    found = checker.parser()
    found.prog = "airground check"
    found.description = "Check a report from its files alone, then have its claims judged again by their own code."
    found.add_argument("--coq", action="store_true", help="prove the safety of the runs again with Coq")
    found.add_argument("-q", "--quiet", action="store_true", help="no progress")
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Check, and print a line for each check.

    Returns:
        Exit code: 0 all agree, 1 not all, 2 usage or no report, 4 a fault of the checker.
    """
    try:
        options = parser().parse_args(arguments)
        with progress_bar(quiet=options.quiet) as progress:
            progress.stage("checking")
            lines = checker.checked(options.report, options.limit_s, lambda line: progress.advance(1.0, line.claim))
            progress.stage("judging again")
            lines += judged_again(options.report, lines, options.limit_s, progress)
            if options.coq:
                progress.stage("proving with Coq")
                lines += _proved_again(options.report)
    except checker.UsageError as error:
        return refuse(error)
    except SystemExit:  # --help has been printed
        return 0
    checker.show(lines, options.report, as_json=options.json)
    return checker.verdict(lines)


def judged_again(folder: Path, lines: Sequence[Line], limit_s: float, progress: Progress = SILENT) -> Iterator[Line]:
    """Each claim and each other part of a report, judged by its own code in a process without Drake.

    Args:
        folder: of the report.
        lines: results of the checker.
        limit_s: CPU time for each process that judges, s.
        progress: is told of each claim.
    """
    from airground_drake.check.report import AGREES, OPEN, Line
    from airground_drake.report.rebuild import JUDGED

    line = partial(Line, by="judged again")
    if any(each.outcome != AGREES for each in lines if each.claim in NEEDED):
        yield line("report", "", OPEN, "not judged again, since a check above failed", "the files are the report's")
        return
    command = [sys.executable, "-P", "-m", "airground_drake.report.rebuild", str(folder), str(limit_s)]
    with (
        tempfile.TemporaryFile("w+") as said,
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=said, text=True) as process,
    ):
        for found in map(json.loads, process.stdout or ()):
            if JUDGED in found:
                progress.advance(1.0, found[JUDGED])
            else:
                yield line(**found)
        if process.wait():
            said.seek(0)
            why = said.read().strip().splitlines()[-1:] or [f"its process ended with {process.returncode}"]
            yield line("report", "", OPEN, f"not all was judged again: {why[0]}", "the files can be judged")


def _proved_again(folder: Path) -> Iterator[Line]:
    """Have Coq prove each run, from positions written anew."""
    from airground_drake.check.files import read_json
    from airground_drake.check.report import AGREES, DISAGREES, OPEN, Line
    from airground_drake.check.rules import Disagreement, NotEstablished

    line = partial(Line, "proofs", by="Coq")
    command = [sys.executable, "-P", "-m", "airground_drake", "prove", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    try:
        found = read_json(folder / "proofs" / "proofs.json") if done.returncode < EXIT_UNUSABLE else {"runs": {}}
    except (Disagreement, NotEstablished) as error:
        yield line("", OPEN, f"what Coq found cannot be read: {error}", "what Coq found can be read")
        return
    for run, entry in found["runs"].items():
        kept, law = entry["distances"]["proved"], entry["law"]["proved"]
        outcome = AGREES if kept or not entry["expected"] else DISAGREES
        words = "machine-checked for this run: " if kept else "not proved: "
        says = f"{words}every distance is kept; the law {'is obeyed without error' if law else 'is not proved'}"
        yield line(run, outcome, says, "" if outcome == AGREES else "expected distances are kept")
    if not found["runs"]:
        yield line("", OPEN, (done.stderr.strip().splitlines() or ["Coq said nothing"])[-1], "Coq can be asked")
