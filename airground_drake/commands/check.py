"""`airground check DIR`: the checker; the report made again from its traces; on request the runs simulated again.

The checker (`airground_drake.check`) is a separate program for the most important rules. Then a process without Drake
(`airground_drake.report.rebuild`) makes the report again and compares each value. With `--simulate`, another process
(`airground_drake.report.simulated`) simulates the runs again, and with `--coq` the safety of the runs is proved again.
Each line names its source among these four.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from airground_drake.base.errors import short
from airground_drake.base.progress import Progress, progress_bar
from airground_drake.base.usage import refuse
from airground_drake.check import command as checker
from airground_drake.check.line import AGREES, DISAGREES, OPEN, CheckLine
from airground_drake.scenario import plugins

if TYPE_CHECKING:
    import argparse

# Checks that must agree before a report is made again: otherwise the files do not belong to the report.
NEEDED = ("files", "trace")
EXIT_UNUSABLE = 2  # exit code of `airground prove` without Coq, or with a report that it cannot read
# Parts that are taken as recorded: a consistent change of these is not detected.
ALWAYS = (
    "the scenario and its expectations; number of seeds; provenance, measured times; metadata of tables; "
    "Coq's version and messages; findings of `report audit` that rest on other runs"
)
# Parts that are taken as recorded without `--simulate`.
NOT_SIMULATED = "policies, seeds and faults; messages and decisions; other seeds, third-party claims, block diagram"
EPILOG = f"""\
Each line says what was checked, on which run, and by which program:
  (checker)           a separate program: distances, hypotheses, triggers, dwell, arrivals, collisions, digests
  (made again)        the report from its recorded traces, by its own code: claims, numbers, pages, figures
  (simulated again)   with --simulate, within the size limits of `airground report`: every run, other seeds,
                      third-party claims, the block diagram
  (Coq)               with --coq: the distances of every run, proved in a temporary copy; proofs.json beside them
and with which outcome:
  agrees              the report follows from its files
  DISAGREES           the files contradict the report or each other: the rule, the time, both values
  cannot be checked   a file cannot be read, or something is not allowed or too large
  as recorded         nothing to compare with, such as third-party claims without --simulate --allow-plugins
  not reproduced here the simulation gives another run; the first row that differs. Another processor or
                      version of a library can cause this, so it alone proves no forgery.
Not checked, so a consistent change of these is not noticed:
  always              {fill(ALWAYS, 96, subsequent_indent=" " * 22)}
  without --simulate  {NOT_SIMULATED}
Exit codes: 0 all agree; 1 not all; 2 usage, or no report; 3 not reproduced here; 4 a fault of the checker."""


def parser() -> argparse.ArgumentParser:
    says = "Check a report from its files alone; with --simulate, simulate its runs again."
    made = checker.parser("airground check", says, EPILOG)
    made.add_argument("--simulate", action="store_true", help="simulate the runs again: all tables must agree exactly")
    made.add_argument(plugins.OPTION, action="store_true", help="with --simulate: import and run third-party code")
    made.add_argument("--coq", action="store_true", help="prove the safety of the runs again with Coq")
    made.add_argument("-q", "--quiet", action="store_true", help="no progress")
    return made


def main(arguments: Sequence[str] | None = None) -> int:
    try:
        options = parser().parse_args(arguments)
        with progress_bar(quiet=options.quiet) as progress:
            progress.stage("checking")
            lines = checker.checked(options.report, options.limit_s, lambda line: progress.advance(1.0, line.claim))
            again = partial(made_again, options.report, [*lines], options.limit_s, progress)
            lines += again("made again", "airground_drake.report.rebuild")
            if options.simulate:
                allowed = [plugins.OPTION] if options.allow_plugins else []
                lines += again("simulated again", "airground_drake.report.simulated", *allowed)
            if options.coq:
                progress.stage("proving with Coq")
                lines += _proved_again(options.report, [*lines])
    except checker.UsageError as error:
        return refuse(error)
    except SystemExit:  # --help has been printed
        return 0
    taken = [ALWAYS] if options.simulate else [NOT_SIMULATED, ALWAYS]
    checker.show(lines, options.report, taken, as_json=options.json)
    return checker.verdict(lines)


def made_again(
    folder: Path, lines: Sequence[CheckLine], limit_s: float, progress: Progress, by: str, module: str, *options: str
) -> Iterator[CheckLine]:
    """The lines of a program that makes parts of the report again, in a process of its own."""
    from airground_drake.report.lines import JUDGED

    line = partial(CheckLine, by=by)
    if any(check.outcome != AGREES for check in lines if check.claim in NEEDED):
        yield line("report", "", OPEN, f"not {by}, since a check above failed", "the files are the report's")
        return
    progress.stage(by)
    command = [sys.executable, "-P", "-m", module, str(folder), str(limit_s), *options]
    with (
        tempfile.TemporaryFile("w+") as output,
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=output, text=True) as process,
    ):
        for entry in map(json.loads, process.stdout or ()):
            if JUDGED in entry:
                progress.advance(1.0, entry[JUDGED])
            else:
                yield line(**entry)
        if process.wait():
            output.seek(0)
            why = output.read().strip().splitlines()[-1:] or [f"its process ended with {process.returncode}"]
            yield line("report", "", OPEN, f"not all was {by}: {why[0]}", "the files can be used")


def _proved_again(folder: Path, lines: Sequence[CheckLine]) -> Iterator[CheckLine]:
    """Have Coq prove each run, from positions written anew in a temporary folder; compare with proofs.json, if any."""
    from airground_drake.base import files
    from airground_drake.check.files import read_json
    from airground_drake.check.rules import Disagreement, NotEstablished

    line = partial(CheckLine, "proofs", by="Coq")
    if any(check.outcome != AGREES for check in lines if check.claim in NEEDED):
        yield line("", OPEN, "not proved again, since a check above failed", "the files are the report's")
        return
    with files.temporary_folder() as copy:
        shutil.copytree(folder / "trace", copy / "trace", symlinks=True)
        command = [sys.executable, "-P", "-m", "airground_drake", "prove", str(copy)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        there = folder / "proofs" / "proofs.json"
        try:
            proofs = read_json(copy / "proofs" / "proofs.json") if done.returncode < EXIT_UNUSABLE else {"runs": {}}
            recorded = read_json(there)["runs"] if there.exists() else {}
        except (Disagreement, NotEstablished, KeyError, TypeError) as error:
            yield line("", OPEN, f"what Coq found cannot be read: {error}", "what Coq found can be read")
            return
    for run, entry in proofs["runs"].items():
        yield _compared(run, entry, recorded.get(run))
    if not proofs["runs"]:
        yield line("", OPEN, (done.stderr.strip().splitlines() or ["Coq said nothing"])[-1], "Coq can be asked")


def _compared(run: str, entry: Any, recorded: Any) -> CheckLine:
    """Compare Coq's result for a run with its entry in proofs.json, `recorded`; None without one."""
    from airground_drake.report.compare import differences

    line = partial(CheckLine, "proofs", run, by="Coq")
    kept, law = entry["distances"]["proved"], entry["law"]["proved"]
    words = "machine-checked for this run: " if kept else "not proved: "
    says = f"{words}every distance is kept; the law {'is obeyed without error' if law else 'is not proved'}"
    if recorded is None:
        says += "; the report has no proof of this run"
    elif differing := [item for item in differences(recorded, entry) if not item[0].endswith((".seconds", ".why"))]:
        about, theirs, ours = differing[0]
        says = f"Coq here: {about} is {short(repr(ours))}; recorded {short(repr(theirs))}"
        return line(DISAGREES, says, "proofs.json says what Coq finds", about, recorded=theirs, recomputed=ours)
    outcome = AGREES if kept or not entry["expected"] else DISAGREES
    return line(outcome, says, "" if outcome == AGREES else "expected distances are kept")
