"""Look for examples that break a property of the test suite: new ones in each round, many per property.

    python benchmarks/fuzz.py --minutes 60
    python benchmarks/fuzz.py --rounds 1 -k segments

A round runs every file with properties once, each with a seed of its own (`--hypothesis-profile=fuzz`). Failures are
printed with the command that reproduces them; exit code 1 if there is any.
"""

from __future__ import annotations

import argparse
import itertools
import math
import random
import re
import shlex
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]

NOTHING_TO_RUN = 5
"""pytest's exit code."""

PYTEST = ("-m", "pytest", "-n", "0", "-q", "-m", "hypothesis", "--hypothesis-profile=fuzz")


def files(among: list[str], chosen: list[str]) -> list[str]:
    """Files with properties, in the suite's order."""
    found = run(["--collect-only", *chosen, *among], None).stdout
    return list(dict.fromkeys(re.findall(r"^(\S+\.py)::", found, flags=re.MULTILINE)))


def run(arguments: list[str], timeout_s: float | None) -> subprocess.CompletedProcess[str]:
    """pytest, in a process of its own."""
    command = [sys.executable, *PYTEST, *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=timeout_s, check=False)


def attempt(file: str, seed: int, chosen: list[str], timeout_s: float | None) -> tuple[bool, str]:
    """Whether a file's properties all held, and a line that says so; on failure, all of pytest's output."""
    begin = time.monotonic()
    arguments = [f"--hypothesis-seed={seed}", *chosen, file]
    try:
        done = run(arguments, timeout_s)
    except subprocess.TimeoutExpired:
        return True, f"{file}: out of time, unfinished"
    said = f"{file}: {done.stdout.strip().rpartition(chr(10))[2]}, {time.monotonic() - begin:.0f} s"
    if done.returncode in (0, NOTHING_TO_RUN):
        return True, said
    again = shlex.join(["python", *PYTEST, *arguments])
    return False, f"{done.stdout}{done.stderr}\n{said}\nAgain: {again}"


def main() -> int:
    """Rounds, until the number or the time is up."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="*", default=["tests"], help="files or folders of tests")
    parser.add_argument("-k", help="as pytest's: only tests whose names match")
    parser.add_argument("--rounds", type=int, help="default: one, or as many as the time allows")
    parser.add_argument("--minutes", type=float, help="stop then")
    parser.add_argument("--seed", type=int, default=random.randrange(2**32), help="of the first file (default: random)")
    options = parser.parse_args()
    chosen = ["-k", options.k] if options.k else []
    rounds = options.rounds or (1 if options.minutes is None else None)
    end = math.inf if options.minutes is None else time.monotonic() + 60.0 * options.minutes
    found = files(options.paths, chosen)
    if not found:
        parser.error("no property matches")
    seeds, failures = itertools.count(options.seed), []
    for _ in range(rounds) if rounds else itertools.count():
        for file in found:
            left = end - time.monotonic()
            if left <= 0.0:
                break
            held, said = attempt(file, next(seeds), chosen, None if math.isinf(left) else left)
            print(said, flush=True)
            if not held:
                failures.append(said.rpartition("\n")[2])
        if time.monotonic() >= end:
            break
    print("\n".join([f"{len(failures)} failures", *failures]))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
