"""The command line of the checker. The checks' dependencies are imported only when needed."""

import argparse
import json
import math
import sys
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, NoReturn

from .line import DISAGREES, NOT_HERE, OPEN, CheckLine

SCHEMA = "airground_drake.check/3"
# Parts that the checker alone takes as recorded: a consistent change of these is not detected.
ALONE = ("policies, seeds and faults", "every part of the report that no line above names")
CODES = "Exit codes: 0 all agree; 1 not all; 2 usage, or no report; 4 a fault of the checker."
LIMIT_S = 300.0  # CPU time that a check may take, s. Checks of a run of minutes take seconds.
MOST_S = 1e6  # largest limit of the CPU time, s: far more does not fit a timer


class UsageError(Exception):
    """The arguments cannot be used."""


class _Parser(argparse.ArgumentParser):
    """Raises instead of printing and exiting."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message}; usage: {self.prog} [options] DIR")


def parser(prog: str, description: str, epilog: str) -> argparse.ArgumentParser:
    """The parser of the command line, which raises `UsageError`."""
    parser = _Parser(
        prog=prog, description=description, epilog=epilog, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("report", metavar="DIR", type=Path, help="folder with report.json and trace/")
    says = "CPU time for each check and each process (default: %(default)g)"
    parser.add_argument("--limit-s", type=_limit_s, default=LIMIT_S, metavar="S", help=says)
    parser.add_argument("--json", action="store_true", help="write strict JSON to standard output")
    return parser


def _limit_s(text: str) -> float:
    with suppress(ValueError):
        if 0.0 < (value := float(text)) <= MOST_S:
            return value
    raise argparse.ArgumentTypeError(f"{text!r} is not allowed; wanted: a number above 0, at most {MOST_S:g}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Check a report and print the results. Returns the exit code: 0 all agree, 1 not all, 2 usage or no report."""
    # arguments: of the command line; default: those of the process.
    says = "Judge distances, hypotheses, triggers, dwell, arrivals and collisions of a report again, from its files."
    try:
        options = parser("python -m airground_drake.check", says, CODES).parse_args(arguments)
        lines = checked(options.report, options.limit_s)
    except UsageError as error:
        with suppress(OSError):
            print("error:", _printable(str(error)), file=sys.stderr)
        return 2
    except SystemExit:  # --help has been printed
        return 0
    show(lines, options.report, ALONE, as_json=options.json)
    return verdict(lines)


def checked(folder: Path, limit_s: float, told: Callable[[CheckLine], object] = bool) -> list[CheckLine]:
    """All checks of a report, without numpy's warnings; `told` is called with each result."""
    import numpy as np

    from .report import check_report
    from .rules import Disagreement, NotEstablished

    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # extreme numbers are refused by the rules, without warnings of numpy
            return check_report(folder, limit_s, told)
    except Disagreement as broken:
        fault, wanted = f"{broken.about} is {broken.recorded}", broken.rule
    except NotEstablished as error:
        fault, wanted = f"{error.about}: {error.why}", error.rule
    raise UsageError(f"{folder} is not a report: {fault}; wanted: {wanted}")


def verdict(lines: Sequence[CheckLine]) -> int:
    """The exit code: 1 if a line disagrees or cannot be checked, else 3 if one is not reproduced here, else 0."""
    outcomes = {line.outcome for line in lines}
    return 1 if outcomes & {DISAGREES, OPEN} else 3 if NOT_HERE in outcomes else 0


def show(lines: Sequence[CheckLine], folder: Path, taken: Sequence[str], *, as_json: bool) -> None:
    """Print the checks, a line each or as strict JSON, and the parts that are taken as recorded."""
    counts = Counter(line.outcome for line in lines)
    if as_json:
        checks = [_strict(asdict(line)) for line in lines]
        about = {"schema": SCHEMA, "report": str(folder), "taken_as_recorded": taken, "summary": counts}
        print(json.dumps(about | {"checks": checks}, indent=1, allow_nan=False))
        return
    for line in lines:
        print(_printable(f"{line.claim:<12}{line.run or '-':<8} {line.outcome} ({line.by}): {line.text}"))
    print(f"{len(lines)} checks: {', '.join(f'{count} {outcome}' for outcome, count in counts.items())}")
    print(f"Taken as recorded: {'; '.join(taken)}.")


def _printable(text: str) -> str:
    """The text as one line without control characters."""
    return "".join(c if c.isprintable() else " " if c.isspace() else c.encode("unicode_escape").decode() for c in text)


def _strict(value: Any) -> Any:
    """Strict JSON; non-finite numbers and other types become text."""
    if isinstance(value, dict):
        return {str(key): _strict(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_strict(item) for item in value]
    if value is None or isinstance(value, (str, int)) or (isinstance(value, float) and math.isfinite(value)):
        return value
    return str(value)
