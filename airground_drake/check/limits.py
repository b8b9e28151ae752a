"""Limits of the work that a hostile report can cause: sizes of a scenario, and CPU time."""

import math
import signal
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

from .files import Json
from .rules import NotEstablished

LARGEST = 1e12  # size of a number in a scenario
# Counts that follow from a scenario.
MOST = {
    "samples": 10_000_000,
    "stages": 10_000,
    "robots and obstacles": 2_000,
    "numbers of a shape": 5_000,
}


def is_of_a_size(scenario: Json) -> None:
    """Refuse a scenario that is too large to be checked."""
    numbers = dict(_numbers(scenario))
    for path, value in numbers.items():
        if not abs(value) <= LARGEST:
            raise NotEstablished("the scenario is of a size", f"{value!r:.40}, {LARGEST:g} at most", ".".join(path))
    looked_ahead = [numbers.get(("gatekeeper", name), 0.0) for name in ("horizon_s", "longest_s", "settling_s")]
    time_s = numbers.get(("duration_s",), 0.0) + sum(looked_ahead)
    periods_s = [value for path, value in numbers.items() if path[1:] == ("period_s",)]
    bodies = [scenario.get(key) for key in ("ugvs", "obstacles")]
    shapes = Counter(path[:3] for path in numbers if path[0] == "obstacles")
    counts = {
        "samples": max((time_s / period_s if period_s > 0.0 else math.inf for period_s in periods_s), default=0.0),
        "stages": numbers.get(("gatekeeper", "stages"), 0.0),
        "robots and obstacles": sum(len(of_kind) for of_kind in bodies if isinstance(of_kind, dict)),
        "numbers of a shape": max(shapes.values(), default=0),
    }
    for name, count in counts.items():
        if not count <= MOST[name]:
            raise NotEstablished("the scenario is of a size", f"{count:.6g}, {MOST[name]} at most", name)


def _numbers(value: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], float]]:
    if isinstance(value, (dict, list)):
        for key, part in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _numbers(part, (*path, str(key)))
    elif isinstance(value, (int, float)):
        yield path, value


@contextmanager
def at_most_s(limit_s: float) -> Iterator[None]:
    """Stop the block after this CPU time (main thread only, not on Windows)."""

    def over(_signal: int, _frame: FrameType | None) -> None:
        raise NotEstablished("the check comes to an end", f"not within {limit_s:g} s")

    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGVTALRM, over)
    signal.setitimer(signal.ITIMER_VIRTUAL, limit_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)
