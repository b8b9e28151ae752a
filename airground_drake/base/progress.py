"""Progress of long work: its stages, how much of each is done, and how long its parts took."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

SHOWN_S = 0.01
"""What took less is not worth a line, s."""
_FORMAT = "{desc} {percentage:3.0f}% |{bar}| {n:.4g}/{total:.4g} {unit}, {elapsed}, {remaining} left{postfix}"
_WITHOUT_AMOUNT = "{desc} {elapsed}"


class Progress:
    """Receives the progress of long work. This class shows nothing. Several threads may call it."""

    def stage(self, name: str, amount: float = 0.0, unit: str = "") -> None:
        """A stage begins, the one before is over.

        Args:
            name: what is done in it.
            amount: how much is to be done; 0: unknown.
            unit: of the amount.
        """

    def advance(self, amount: float, what: str = "") -> None:
        """So much more of the stage is done, the last of it on `what`."""

    def elapsed_s(self, what: str, seconds: float) -> None:
        """A part of the stage is over."""

    @contextmanager
    def item(self, what: str) -> Iterator[None]:
        """One of the things that the stage counts."""
        started = time.perf_counter()
        yield
        self.elapsed_s(what, time.perf_counter() - started)
        self.advance(1.0, what)


SILENT = Progress()


class ProgressBar(Progress):
    """Shows progress on standard error: a bar for the stage, a line for each part that took time, or both."""

    def __init__(self, *, bar: bool, lines: bool) -> None:
        """A bar for the stage that is under way; lines for everything that took time."""
        self._shows_bar, self._shows_lines = bar, lines
        self._bar: Any = None
        self._stage, self._since = "", 0.0
        self._lock = threading.RLock()

    def stage(self, name: str, amount: float = 0.0, unit: str = "") -> None:
        """Close the bar of the stage before, open the one of this."""
        self.close()
        self._stage, self._since = name, time.perf_counter()
        if self._shows_bar:
            self._bar = _bar(name, amount, unit)

    def advance(self, amount: float, what: str = "") -> None:
        """Move the bar."""
        with self._lock:
            if self._bar is not None:
                self._bar.set_postfix_str(what, refresh=False)
                self._bar.update(amount)

    def elapsed_s(self, what: str, seconds: float) -> None:
        """A line, if lines are wanted and it is worth one."""
        if self._shows_lines and seconds >= SHOWN_S:
            with self._lock:
                if self._bar is not None:
                    self._bar.clear()
                print(f"{seconds:8.2f} s  {what}", file=sys.stderr, flush=True)

    def close(self) -> None:
        """End the stage that is under way."""
        with self._lock:
            if self._bar is not None:
                self._bar.close()
                self._bar = None
        if self._stage:
            self.elapsed_s(self._stage, time.perf_counter() - self._since)
            self._stage = ""


@contextmanager
def progress_bar(*, quiet: bool = False, verbose: bool = False) -> Iterator[Progress]:
    """A bar if standard error is a terminal and `quiet` is not set; with `verbose`, a line for each part."""
    progress = ProgressBar(bar=not quiet and sys.stderr.isatty(), lines=verbose)
    try:
        yield progress
    finally:
        progress.close()


def _bar(name: str, amount: float, unit: str) -> Any:
    """A bar of tqdm in one line that leaves nothing behind, without a thread of its own."""
    from tqdm import tqdm

    tqdm.monitor_interval = 0
    tqdm.set_lock(threading.RLock())
    return tqdm(
        desc=name, total=amount or None, unit=unit, bar_format=_FORMAT if amount else _WITHOUT_AMOUNT,
        file=sys.stderr, leave=False, dynamic_ncols=True, mininterval=0.1,
    )  # fmt: skip
