"""How SIGINT and SIGTERM end a command and its child processes at once.

The stack is not unwound: an exception in a signal handler may be lost in a callback, and `with` blocks wait for busy
pools. The handler kills all descendants of this process, removes its temporary files, prints one line, and exits.

On Linux a command works in a child of the process that was started (`begin`). The parent only waits. If the child is
killed, the parent kills its descendants, removes its temporary files, and says so. If the parent is killed, the child
gets SIGTERM.
"""

import ctypes
import fcntl
import gc
import io
import os
import select
import signal
import sys
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import NoReturn

from airground_drake.base import files
from airground_drake.base.usage import EXIT_TOOL, refuse

STOPPING = (signal.SIGINT, signal.SIGTERM)
# Waiting time for killed descendants to end, s: on a busy machine this takes a while.
PATIENCE_S = 10.0

# Environment in which nothing in the current folder is executed: child interpreters do not import from there, and
# numba's configuration file there cannot choose a cache, which numba would unpickle. The user's own settings stay.
CURRENT_FOLDER = {"PYTHONSAFEPATH": "1", "NUMBA_CACHE_DIR": "", "NUMBA_CACHE_LOCATOR_CLASSES": ""}
# Added for a user without a home: numba would keep its cache in a folder named ~ in the current folder.
NO_HOME = {"XDG_CACHE_HOME": os.devnull}

_PR_SET_PDEATHSIG, _PR_SET_CHILD_SUBREAPER = 1, 36

# Writing end of a pipe to the waiting parent, which accepts only an exit code that is also written there.
_exit_code: int | None = None


def begin() -> None:
    """Begin a command, before the slow imports; see the module."""
    gc.set_threshold(100_000)  # no garbage collection of imported modules, which took an eighth of the import time
    has_home = os.path.isabs(os.path.expanduser("~"))
    for name, value in (CURRENT_FOLDER if has_home else CURRENT_FOLDER | NO_HOME).items():
        os.environ.setdefault(name, value)
    _open_standard_streams()
    for stream in (sys.stdout, sys.stderr):  # an encoding may lack a character; a path may not be text
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    if sys.platform == "linux":
        _go_on_in_a_child()
    end_on_signals()


def _go_on_in_a_child() -> None:
    """Return in a child process. The parent waits for it, cleans up, and exits with its code."""
    # The parent adopts orphans among the child's descendants, and so finds all of them if the child is killed.
    global _exit_code
    told, _exit_code = os.pipe()
    parent = os.getpid()
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)
    child = os.fork()
    if child == 0:
        os.close(told)
        end_with_parent(signal.SIGTERM)
        if os.getppid() != parent:
            os._exit(1)
        return
    os.close(_exit_code)
    for heeded in _heeded():
        signal.signal(heeded, lambda number, _: os.kill(child, number))
    status: int | None = None
    while status is None:
        ended, reaped = os.wait()  # also for the children that this process has adopted
        status = reaped if ended == child else None
    for stopping in STOPPING:
        signal.signal(stopping, signal.SIG_IGN)
    code = os.waitstatus_to_exitcode(status)
    os.set_blocking(told, False)
    with suppress(BlockingIOError):
        if os.read(told, 1) == bytes([code % 256]) and code >= 0:
            os._exit(code)
    end_descendants()
    files.sweep_temporary()
    refuse(f"the process of this command died ({ended_how(code)})", EXIT_TOOL)
    os._exit(EXIT_TOOL)


def ended_how(code: int) -> str:
    """How a process ended, from its exit code; negative codes are signals."""
    return f"signal {-code}" if code < 0 else f"exit code {code}"


def _exit(code: int) -> NoReturn:
    """Exit at once, and tell the parent the exit code."""
    if _exit_code is not None:
        with suppress(OSError):
            os.write(_exit_code, bytes([code % 256]))
    os._exit(code)


def end_on_signals() -> None:
    """From now on SIGINT and SIGTERM end this process with exit code 130 and 143, and its descendants with it."""
    owner = os.getpid()
    stderr = os.dup(2)  # 2 itself may point elsewhere while a C library is kept silent

    def end(number: int, frame: FrameType | None) -> NoReturn:
        for stopping in STOPPING:
            signal.signal(stopping, signal.SIG_IGN)
        if os.getpid() == owner:  # forked processes have inherited this handler
            end_descendants()
            files.discard_partial()
            with suppress(OSError):
                clear = "\r\033[K" if os.isatty(stderr) else ""  # on a terminal it replaces a line of progress
                os.write(stderr, f"{clear}error: interrupted ({signal.Signals(number).name})\n".encode())
            _exit(128 + number)
        os._exit(128 + number)

    for number in _heeded():
        signal.signal(number, end)


def _heeded() -> list[signal.Signals]:
    """The signals in `STOPPING` that are not ignored (as by `nohup`)."""
    return [number for number in STOPPING if signal.getsignal(number) is not signal.SIG_IGN]


def _open_standard_streams() -> None:
    """Open closed standard streams on the null device, so that no other file gets their descriptors."""
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            nowhere = os.open(os.devnull, os.O_RDWR)  # the least descriptor that is free
            os.set_inheritable(nowhere, True)
            setattr(sys, name, os.fdopen(nowhere, "r+"))


def run(main: Callable[[], int]) -> NoReturn:
    """Run a command and exit with its code; with 141 and no message if the output pipe is closed."""
    try:
        code = main()
        sys.stdout.flush()
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else EXIT_TOOL
    except BrokenPipeError:
        code = 128 + signal.SIGPIPE
    except OSError as error:
        code = refuse(error, EXIT_TOOL)
    except MemoryError:
        code = refuse("out of memory", EXIT_TOOL)
    except Exception:
        code = EXIT_TOOL
        with suppress(OSError):
            traceback.print_exc()
    leave(code)


def leave(code: int) -> NoReturn:
    """Exit at once after the work is done, because the interpreter has no signal handlers while it shuts down."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # a closed pipe or stream
            stream.flush()
    _exit(code)


def end_descendants() -> None:
    """Kill all descendants, repeatedly until /proc shows none, because they may start others."""
    # A process keeps its locks until it has ended. Temporary folders are removed by these locks.
    until = time.monotonic() + PATIENCE_S
    while (descendants := _descendants()) and time.monotonic() < until:
        for pid in descendants:
            with suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
        time.sleep(0.001)


def _descendants() -> list[int]:
    """Living descendants of this process."""
    children: dict[int, list[int]] = {}
    for entry in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            state, parent = entry.read_text(errors="replace").rpartition(")")[2].split()[:2]
            if state not in "ZX":
                children.setdefault(int(parent), []).append(int(entry.parent.name))
    descendants, above = [], [os.getpid()]
    while above:
        below = children.get(above.pop(), [])
        descendants += below
        above += below
    return descendants


def end_with_parent(how: signal.Signals = signal.SIGKILL) -> None:
    """Have Linux send this process a signal when the thread that started it ends."""
    if sys.platform == "linux":
        _prctl(_PR_SET_PDEATHSIG, how)


def _prctl(option: int, value: int) -> None:
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(option, value, 0, 0, 0)


def end_with_pipe(reader: int) -> None:
    """Have Linux kill this process when the last writer of a pipe has closed it."""
    # Unlike in `end_with_parent`, the pipe belongs to a process, not to one of its threads.
    if sys.platform == "linux":
        fcntl.fcntl(reader, fcntl.F_SETOWN, os.getpid())
        fcntl.fcntl(reader, fcntl.F_SETSIG, signal.SIGKILL)
        fcntl.fcntl(reader, fcntl.F_SETFL, os.O_ASYNC)
        if select.select([reader], [], [], 0.0)[0]:  # it was closed before
            os._exit(1)
