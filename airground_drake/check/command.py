"""The command line of the checker. It imports what checks need only when there is something to check."""

from __future__ import annotations

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
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from .report import Line

SCHEMA = "airground_drake.check/2"
TAKEN_AS_RECORDED = (
    "that a run was simulated as the scenario says (nothing is simulated again)",
    "seed, noise, policies and their parameters, faults, what the scenario expects, values that no check uses",
    "provenance, the SHA-256 of the scenario's file, measured times",
    "motions of refused proposals, the block diagram, findings of `report audit` that rest on other runs",
)
"""What no check can find out: a forger may change it in all its places, unnoticed."""
EPILOG = f"""\
Each line says what was checked, on which run, and
  agrees              the files bear out what the report says
  DISAGREES           the files contradict the report or each other: the rule, the time, both values
  cannot be checked   a file cannot be read, or the report itself decides nothing
Taken as recorded, so that a forger may change it in all its places, unnoticed:
{"".join(f"  - {each}{chr(10)}" for each in TAKEN_AS_RECORDED)}
Exit codes: 0 all agree; 1 not all; 2 usage, or no report; 4 a fault of the checker."""
LIMIT_S = 300.0
"""CPU time that a check may take, s. Checks of a run of minutes take seconds."""
MOST_S = 1e6
"""Largest limit of the CPU time, s: far more does not fit a timer."""


class UsageError(Exception):
    """The arguments cannot be used."""


class _Parser(argparse.ArgumentParser):
    """Raises instead of printing and exiting."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(message)


def parser() -> argparse.ArgumentParser:
    """What the command line takes; it raises `UsageError`."""
    parser = _Parser(
        prog="python -m airground_drake.check",
        description="Check a report from its files alone: distances, hypotheses, triggers, events, and its verdict.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("report", metavar="DIR", type=Path, help="folder with report.json and trace/")
    parser.add_argument(
        "--limit-s",
        type=_limit_s,
        default=LIMIT_S,
        metavar="S",
        help="CPU time for each check (default: %(default)g)",
    )
    parser.add_argument("--json", action="store_true", help="write strict JSON to standard output")
    return parser


def _limit_s(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value <= MOST_S:
        raise argparse.ArgumentTypeError(f"{text!r} is not allowed; wanted: a number above 0, at most {MOST_S:g}")
    return value


def main(arguments: Sequence[str] | None = None) -> int:
    """Check a report and print what was found.

    Args:
        arguments: of the command line; default: those of the process.

    Returns:
        The exit code: 0 all agree, 1 not all, 2 usage or no report.
    """
    try:
        options = parser().parse_args(arguments)
    except UsageError as error:
        return _refuse(f"{error}; usage: airground check [--json] DIR")
    except SystemExit:  # --help has been printed
        return 0
    try:
        lines = checked(options.report, options.limit_s)
    except UsageError as error:
        return _refuse(str(error))
    show(lines, options.report, as_json=options.json)
    return verdict(lines)


def checked(folder: Path, limit_s: float, told: Callable[[Line], object] = bool) -> list[Line]:
    """All checks of a report, without warnings of numpy; `told` is called with each when it is done.

    Raises:
        UsageError: if the folder is no report.
    """
    import numpy as np

    from .report import check_report
    from .rules import Disagreement, NotEstablished

    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # numbers out of all proportion are refused by the rules, not by numpy
            return check_report(folder, limit_s, told)
    except Disagreement as broken:
        raise UsageError(f"{folder} is no report: {broken.rule}: {broken.about} is {broken.recorded}") from None
    except NotEstablished as error:
        raise UsageError(f"{folder} is no report: {error.rule}: {error.about}: {error.why}") from None


def show(lines: Sequence[Line], folder: Path, *, as_json: bool) -> None:
    """Print the checks, a line each, or as strict JSON."""
    if as_json:
        print(json.dumps(_document(folder, lines), indent=1, allow_nan=False))
    else:
        _print(lines)


def verdict(lines: Sequence[Line]) -> int:
    """The exit code: 0 if all agree, else 1."""
    from .report import AGREES

    return int(any(line.outcome != AGREES for line in lines))


def _refuse(why: str) -> int:
    with suppress(OSError):
        print("error:", _printable(why), file=sys.stderr)
    return 2


def _printable(text: str) -> str:
    """Make one line without control characters, whatever names are in it."""
    return "".join(c if c.isprintable() else " " if c.isspace() else c.encode("unicode_escape").decode() for c in text)


def _print(lines: Sequence[Line]) -> None:
    for line in lines:
        print(_printable(f"{line.claim:<12}{line.run or '-':<8} {line.outcome} ({line.by}): {line.text}"))
    print(f"Taken as recorded: {'; '.join(TAKEN_AS_RECORDED)}.")
    counts = _counts(lines)
    print(f"{len(lines)} checks: {', '.join(f'{count} {outcome}' for outcome, count in counts.items())}")


def _counts(lines: Sequence[Line]) -> dict[str, int]:
    from .report import AGREES, DISAGREES, OPEN

    found = Counter(line.outcome for line in lines)
    return {outcome: found[outcome] for outcome in (AGREES, DISAGREES, OPEN)}


def _document(folder: Path, lines: Sequence[Line]) -> dict[str, Any]:
    checks = [_strict(asdict(line)) for line in lines]
    taken = list(TAKEN_AS_RECORDED)
    return {
        "schema": SCHEMA, "report": str(folder), "checks": checks, "taken_as_recorded": taken, "summary": _counts(lines)
    }  # fmt: skip


def _strict(value: Any) -> Any:
    """Plain JSON; numbers that are not finite, and values that JSON does not have, become text."""
    if isinstance(value, dict):
        return {str(key): _strict(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_strict(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if value is None or isinstance(value, (str, int, float)):
        return value
    return str(value)
