"""Time limits, and limits within limits."""

from __future__ import annotations

import signal
import time
from contextlib import suppress

import pytest

from airground_drake.intervention.guest.time_limit import OutOfTime, time_limit


def _forever() -> None:
    while True:
        time.sleep(0.01)


def test_a_limit_within_another_leaves_it_as_it_was() -> None:
    with time_limit(1000.0):
        with pytest.raises(OutOfTime, match=r"after 0\.01 s"), time_limit(0.01):
            _forever()
        assert 0.0 < signal.getitimer(signal.ITIMER_REAL)[0] <= 1000.0
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0.0


class Over(BaseException):
    """Of the outer limit."""


@time_limit(0.05, Over)
def _policies_for_ever() -> None:
    while True:
        with suppress(OutOfTime), time_limit(1000.0):
            _forever()


def test_the_outer_limit_holds_within_the_inner_too() -> None:
    with pytest.raises(Over, match=r"after 0\.05 s"):
        _policies_for_ever()
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0.0
