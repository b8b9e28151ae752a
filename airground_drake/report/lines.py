"""Output of programs that recompute a report: lines of JSON, which `airground check` shows."""

import json
import os
import resource
import sys
from collections.abc import Callable, Iterator
from typing import Any

from airground_drake.base.errors import AirgroundError, short
from airground_drake.base.progress import Progress
from airground_drake.check.line import DISAGREES

JUDGED = "judged"  # key of a line about progress
# Keys `claim`, `run`, `outcome` and `text`; a difference has `rule`, `about`, `recorded` and `recomputed` besides.
Line = dict[str, Any]


def line_of(claim: str, run: str, outcome: str, text: str, rule: str = "") -> Line:
    return {"claim": claim, "run": run, "outcome": outcome, "text": text, "rule": rule}


def different(claim: str, run: str, about: str, theirs: Any, ours: Any) -> Line:
    text = f"made again, {about or 'it'} is {short(repr(ours))}; recorded {short(repr(theirs))}"
    values = {"about": about, "recorded": theirs, "recomputed": ours}
    return line_of(claim, run, DISAGREES, text, "the files give what is recorded") | values


def print_lines(lines: Callable[[Progress], Iterator[Line]], limit_s: str) -> int:
    """Print lines, one JSON object each; before them, one with the key `JUDGED` for each step of the progress."""
    # What other code prints meanwhile goes to standard error, so that it is not taken for a line.
    # limit_s: CPU time that this process and each of its children may take, s.
    # Exit code: 0, or 2 if a file cannot be used.
    own = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())

    class Told(Progress):
        """Prints a line for each finished part."""

        def advance(self, amount: float, what: str = "") -> None:
            print(json.dumps({JUDGED: what}), file=own, flush=True)

    most = int(float(limit_s)) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (most, most))
    try:
        for line in lines(Told()):
            print(json.dumps(line, allow_nan=False), file=own, flush=True)
    except (AirgroundError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0
