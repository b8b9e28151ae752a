"""A time limit for code in this process."""

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_LONGEST_S = 1e9  # thirty years; the system's timer takes at most three hundred
_AT_ONCE_S = 1e-6  # 0 would turn the timer off
_AGAIN_S = 0.5  # Python ignores an error in a callback of the garbage collector, so it is raised again


class OutOfTime(BaseException):
    """Raised inside code that exceeds its time limit. `except Exception` does not catch it."""


@contextmanager
def time_limit(seconds: float, error: type[BaseException] = OutOfTime) -> Iterator[None]:
    """Raise an error in the body after some wall-clock seconds, not counting compilation by numba."""
    # The limit works in the main thread only. Compiled code is interrupted when it returns to the interpreter. Limits
    # can be nested: an inner limit lasts no longer than the rest of the outer one, which then raises its own error.
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        if _compiles(frame):  # once for ever, and from the beginning if it is interrupted: it does not count
            signal.setitimer(signal.ITIMER_REAL, min(seconds, _LONGEST_S), _AGAIN_S)
            return
        raise error(f"not done after {seconds:g} s")

    outer, started = signal.getitimer(signal.ITIMER_REAL)[0], time.monotonic()
    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, min(seconds, outer or _LONGEST_S, _LONGEST_S), _AGAIN_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
        if outer:
            signal.setitimer(signal.ITIMER_REAL, max(outer - (time.monotonic() - started), _AT_ONCE_S), _AGAIN_S)


def _compiles(frame: FrameType | None) -> bool:
    """Whether numba compiles a function in this frame."""
    while frame is not None:
        if frame.f_code.co_name == "_compile_for_args":
            return True
        frame = frame.f_back
    return False
