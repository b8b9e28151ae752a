"""Kill reports at random moments, and check their folders.

    python benchmarks/interrupt.py --kills 100

Each trial makes a report of a short scenario, always into the same folder, and sends it SIGINT (to all its processes,
as a terminal does), SIGTERM or SIGKILL (to it alone): at a random moment; every third time, while it writes.
Then the exit code must be the signal's, with one line on standard error for the first two; no process may be left; the
folder must hold no report or one that the independent checker agrees with; and once a last report is complete there
must be no temporary file. Prints what failed, and a table; exit code 1 if anything did.
"""

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from airground_drake.check.command import LIMIT_S
from airground_drake.check.line import AGREES
from airground_drake.check.report import check_report

SHORT = {"duration_s": "1", "runs": "{a: {method: a}, d: {method: d}}", "reproduction": "[]", "choices": "[]"}
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGKILL: -signal.SIGKILL}
GRACE_S = 5.0
"""Time within which orphans must have ended."""


def report(folder: Path) -> subprocess.Popen[str]:
    """A report that is being made, in a session of its own."""
    settings = [part for key, value in SHORT.items() for part in ("--set", f"{key}={value}")]
    command = [sys.executable, "-m", "airground_drake.report", "dwell", *settings, "-q", "-o", str(folder)]
    streams = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    return subprocess.Popen(command, text=True, start_new_session=True, **streams)


def of_session(leader: int) -> list[int]:
    """Living processes of a session, other than its leader."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, session = entry.read_text(errors="replace").rpartition(")")[2].split()[:4]
        except OSError:
            continue
        if int(session) == leader and state not in "ZX" and int(entry.parent.name) != leader:
            found.append(int(entry.parent.name))
    return found


def listens(pid: int) -> bool:
    """Whether a process handles SIGTERM, as a report does from a tenth of a second after its start."""
    caught = Path(f"/proc/{pid}/status").read_text(encoding="utf-8").partition("SigCgt:")[2].split()[0]
    return bool(int(caught, 16) >> (signal.SIGTERM - 1) & 1)


def wait_until(true: Callable[[], bool], limit_s: float) -> bool:
    """Whether something becomes true within a time."""
    end = time.monotonic() + limit_s
    while not true():
        if time.monotonic() > end:
            return False
        time.sleep(0.005)
    return True


def trial(folder: Path, number: signal.Signals, delay_s: float, *, writing: bool) -> tuple[str, list[str]]:
    """One kill: whether there is a report then, and all faults."""
    page = folder / "report.json"
    before = page.exists() and page.stat().st_mtime_ns
    process = report(folder)
    wait_until(lambda: process.poll() is not None or listens(process.pid), 600.0)
    if writing:  # an earlier report's page goes first
        wait_until(lambda: process.poll() is not None or not page.exists(), 600.0)
    wait_until(lambda: process.poll() is not None, delay_s)
    if process.poll() is None:
        (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
    said = process.communicate(timeout=60.0)[1]
    wrong = []
    if process.returncode not in (CODES[number], 0, 1):
        wrong.append(f"exit code {process.returncode}")
    if process.returncode > 1 and (said.count("\n") != 1 or "interrupted" not in said):
        wrong.append(f"says {said!r}")
    if not wait_until(lambda: not of_session(process.pid), GRACE_S):
        wrong.append(f"processes left: {of_session(process.pid)}")
    if number != signal.SIGKILL and any(folder.rglob(f".*.{process.pid}.*.partial")):
        wrong.append("temporary files left")
    if not page.exists():
        return "none", wrong
    wrong += [str(line) for line in check_report(folder, LIMIT_S) if line.outcome != AGREES]
    return "new" if page.stat().st_mtime_ns != before else "earlier", wrong


def main() -> int:
    """Run the trials and print their results."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    draw = random.Random(options.seed)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs, and theirs, do not heed it
    with tempfile.TemporaryDirectory() as place:
        os.environ["AIRGROUND_DRAKE_CACHE"] = f"{place}/cache"
        folder = Path(place) / "report"
        durations = []
        for _ in range(2):  # the first one proves, those to be killed do not
            started = time.monotonic()
            report(folder).communicate()
            durations.append(time.monotonic() - started)
        counts: Counter[tuple[str, str]] = Counter()
        failures = 0
        for k in range(options.kills):
            number, writing = draw.choice(list(CODES)), k % 3 == 2 and (folder / "report.json").exists()
            delay = draw.uniform(0.0, 1.0 if writing else durations[1])
            became, wrong = trial(folder, number, delay, writing=writing)
            counts[number.name, became] += 1
            failures += bool(wrong)
            for each in wrong:
                print(f"kill {k}, {number.name} after {delay:.2f} s{' of writing' if writing else ''}: {each}")
        report(folder).communicate()
        left = [str(path) for path in folder.rglob(".*") if path.is_file()]
        last = [line for line in check_report(folder, LIMIT_S) if line.outcome != AGREES]
    for (name, became), count in sorted(counts.items()):
        print(f"{name:8} {became:8} {count}")
    print(f"{options.kills} kills, {failures} failures; after a last report {len(left)} temporary files, "
          f"{len(last)} disagreements")  # fmt: skip
    return int(bool(failures or left or last))


if __name__ == "__main__":
    sys.exit(main())
