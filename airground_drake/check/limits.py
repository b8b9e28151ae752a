"""Limits that keep a hostile report from taking for ever: sizes of a scenario, and CPU time."""

from __future__ import annotations

import math
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

from .files import Json
from .rules import NotEstablished

LARGEST = 1e12
"""Size of a number in a scenario."""
MOST = {
    "samples": 10_000_000,
    "stages": 10_000,
    "robots and obstacles": 2_000,
}
"""Counts that follow from a scenario."""


def is_of_a_size(scenario: Json) -> None:
    """Refuse a scenario whose numbers would make the check endless.

    The rules that use a value find out whether it is missing or of another type.

    Raises:
        NotEstablished: if one is not.
    """
    for path, value in _numbers(scenario):
        if not abs(value) <= LARGEST:
            raise NotEstablished("the scenario is of a size", f"{value!r:.40}, {LARGEST:g} at most", path)
    counts = {
        "samples": max(_samples(scenario), default=0.0),
        "stages": _number(scenario, "gatekeeper", "stages") or 0.0,
        "robots and obstacles": sum(len(scenario.get(key) or ()) for key in ("ugvs", "obstacles")),
    }
    for name, count in counts.items():
        if not count <= MOST[name]:
            raise NotEstablished("the scenario is of a size", f"{count:.6g}, {MOST[name]} at most", name)


def _numbers(value: Any, path: str = "") -> Iterator[tuple[str, float]]:
    if isinstance(value, (dict, list)):
        for key, part in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _numbers(part, f"{path}.{key}".strip("."))
    elif isinstance(value, (int, float)):
        yield path, value


def _number(scenario: Json, part: str, name: str) -> float | None:
    given = scenario.get(part)
    value = given.get(name) if isinstance(given, dict) else None
    return value if isinstance(value, (int, float)) else None


def _samples(scenario: Json) -> Iterator[float]:
    """Number of instants in the duration of a scenario, for each of its periods; infinite if a period is 0."""
    duration = scenario.get("duration_s")
    looked_ahead = [_number(scenario, "gatekeeper", name) or 0.0 for name in ("horizon_s", "longest_s", "settling_s")]
    time = sum(looked_ahead) + (duration if isinstance(duration, (int, float)) else 0.0)
    for part in ("control", "intervention", "gatekeeper"):
        period = _number(scenario, part, "period_s")
        if period is not None:
            yield time / period if period > 0.0 else math.inf


@contextmanager
def at_most_s(limit_s: float) -> Iterator[None]:
    """Stop the block after so much CPU time. This works in the main thread, and not on Windows.

    Raises:
        NotEstablished: if the block takes longer.
    """

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
