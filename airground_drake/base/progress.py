"""Progress of long work: its stages, their finished shares, and the times of their parts."""

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

SHOWN_S = 0.01  # shorter parts get no line, s
_FORMAT = "{desc} {percentage:3.0f}% |{bar}| {n:,.7g}/{total:,.7g} {unit}, {elapsed}, {remaining} left{postfix}"
_WITHOUT_AMOUNT = "{desc} {elapsed}{postfix}"
TOLD_S = 3.0  # where standard error is no terminal, a stage that lasts longer gets one line, s


class Progress:
    """Interface for progress reports of long work; thread-safe. This base class shows nothing."""

    def stage(self, name: str, amount: float = 0.0, unit: str = "") -> None:
        """Begin a stage with an amount of work (0: unknown), and end the previous one."""

    def advance(self, amount: float, what: str = "") -> None:
        """Add an amount of finished work, most recently on `what`."""

    def elapsed_s(self, what: str, seconds: float) -> None:
        """Report the time of a part, s."""

    @contextmanager
    def item(self, what: str) -> Iterator[None]:
        """Count and time the block as one unit of the stage."""
        started = time.perf_counter()
        yield
        self.elapsed_s(what, time.perf_counter() - started)
        self.advance(1.0, what)


SILENT = Progress()


class ProgressBar(Progress):
    """Shows progress on standard error: a bar or a line for the stage, a line for each part that took time."""

    def __init__(self, *, bar: bool, lines: bool, stages: bool = False) -> None:
        """Choose a bar for the current stage, lines for finished parts, and a line for a long stage."""
        self._shows_bar, self._shows_lines, self._shows_stages = bar, lines, stages
        self._bar: Any = None
        self._stage = self._of = ""
        self._since = self._done = 0.0
        self._waits_for_line = False
        self._lock = threading.RLock()

    def stage(self, name: str, amount: float = 0.0, unit: str = "") -> None:
        self.close()
        self._stage, self._since, self._done = name, time.perf_counter(), 0.0
        self._of = f" of {amount:,.7g} {unit}" if amount else ""
        self._waits_for_line = self._shows_stages
        if self._shows_bar:
            self._bar = _bar(name, amount, unit)

    def advance(self, amount: float, what: str = "") -> None:
        """Move the bar, or print the line of the stage once it is due."""
        with self._lock:
            self._done += amount
            if self._waits_for_line and time.perf_counter() - self._since >= TOLD_S:
                self._waits_for_line = False
                print(f"{self._stage}: {self._done:,.7g}{self._of} done", file=sys.stderr, flush=True)
            if self._bar is not None:
                self._bar.set_postfix_str(what, refresh=False)
                self._bar.update(amount)

    def elapsed_s(self, what: str, seconds: float) -> None:
        """Print a line, if lines are enabled and the part was not too short."""
        if self._shows_lines and seconds >= SHOWN_S:
            with self._lock:
                if self._bar is not None:
                    self._bar.clear()
                print(f"{seconds:8.2f} s  {what}", file=sys.stderr, flush=True)

    def close(self) -> None:
        with self._lock:
            if self._bar is not None:
                self._bar.close()
                self._bar = None
        if self._stage:
            self.elapsed_s(self._stage, time.perf_counter() - self._since)
            self._stage = ""


@contextmanager
def progress_bar(*, quiet: bool = False, verbose: bool = False) -> Iterator[Progress]:
    # On a terminal it is a bar, elsewhere one line for each stage that lasts longer than `TOLD_S`; with `quiet`
    # neither. With `verbose` it is a line for each part, beside the bar.
    terminal = sys.stderr.isatty()
    progress = ProgressBar(bar=terminal and not quiet, lines=verbose, stages=not (terminal or quiet or verbose))
    try:
        yield progress
    finally:
        progress.close()


def _bar(name: str, amount: float, unit: str) -> Any:
    """A tqdm bar, erased at its end, without a monitor thread."""
    from tqdm import tqdm

    tqdm.monitor_interval = 0
    tqdm.set_lock(threading.RLock())
    return tqdm(
        desc=name, total=amount or None, unit=unit, bar_format=_FORMAT if amount else _WITHOUT_AMOUNT,
        file=sys.stderr, leave=False, dynamic_ncols=True, mininterval=0.1,
    )  # fmt: skip
