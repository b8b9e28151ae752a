"""Time limits, and limits within limits."""

import signal
import time
import weakref
from contextlib import suppress

import numpy as np
import pytest

from airground_drake.base.compiling import njit
from airground_drake.uav.guest.time_limit import OutOfTime, time_limit


def test_a_limit_within_another_leaves_it_as_it_was() -> None:
    with time_limit(1000.0):
        with pytest.raises(OutOfTime, match=r"after 0\.01 s"), time_limit(0.01):
            time.sleep(10.0)
        assert 0.0 < signal.getitimer(signal.ITIMER_REAL)[0] <= 1000.0
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0.0


@time_limit(0.05, KeyError)
def _for_ever() -> None:
    while True:
        with suppress(OutOfTime), time_limit(1000.0):
            time.sleep(0.01)


def test_the_outer_limit_holds_within_the_inner_too() -> None:
    before = signal.getsignal(signal.SIGALRM)
    with pytest.raises(KeyError, match=r"after 0\.05 s"):
        _for_ever()
    assert signal.getsignal(signal.SIGALRM) is before
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0.0


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_limit_that_python_ignores_in_a_callback_comes_again() -> None:
    things = [{1}]
    reference = weakref.ref(things[0], lambda _: time.sleep(10.0))

    def forget_and_wait() -> None:
        things.clear()  # the callback begins, and is interrupted
        time.sleep(10.0)

    with pytest.raises(OutOfTime), time_limit(0.05):
        forget_and_wait()
    assert reference() is None


def test_compilation_does_not_count() -> None:
    """Else a slow machine would interrupt it each time, and never have the compiled function."""

    def total(numbers: np.ndarray) -> float:
        return float(np.sort(numbers).cumsum()[-1])

    with time_limit(0.2):  # beside compilation, an idle machine needs 0.01 s
        assert njit(cache=False)(total)(np.ones(3)) == 3.0
    with pytest.raises(OutOfTime), time_limit(0.2):
        _waits_for_ever(njit(cache=False)(lambda numbers: numbers[0])(np.ones(4)))


def _waits_for_ever(_: float) -> None:
    while True:
        time.sleep(1.0)
