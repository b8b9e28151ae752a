"""A third-party policy in a process of its own, which is killed when it takes too long.

The process is a fresh interpreter (`worker.py`), started once and kept. It shares no memory with the simulation. It
sends JSON of bounded length, which is decoded and checked here.
"""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import weakref
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any

from airground_drake.base.errors import FAULT_WIDTH, PluginError, PolicyError, one_line, printable
from airground_drake.base.interruption import ended_how
from airground_drake.model.geometry.motion import Motion
from airground_drake.uav.guest.codec import LONGEST, decoded, encoded
from airground_drake.uav.policy import Observation, Policy

# Time limit for the interpreter, the policy's imports and its construction, s. A policy that is silent for so long
# hangs: it is not asked again in this run.
START_S = 30.0
COUNTED_S = 60.0  # time limit for a proposal of a policy that bounds its effort by counts, s; at least its budget
LIVES = 3  # a policy's process is started at most this many times in a run; then the policy is not asked again
# Environment variable: if it is set, what a policy prints goes to the standard error of this process.
SHOWN = "AIRGROUND_SHOW_POLICY_OUTPUT"
STDERR = 2
MEMORY = 4 * 2**30  # address space of the process, bytes

_PROGRAM = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from airground_drake.uav.guest.confinement import confine; confine(int(sys.argv[3]), int(sys.argv[4])); "
    "from airground_drake.uav.guest.worker import main; main(int(sys.argv[2]))"
)
# With a fixed hash seed, a proposal that depends on the order of a set is the same in every run. Without threads,
# numerical libraries need less memory.
_ENVIRONMENT = {"PYTHONHASHSEED": "0", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


class GuestPolicy(Policy):
    """Stands in for a policy that runs in a process of its own."""

    # A fault of the policy is raised as `PolicyError`. If its process ends or is killed, the next question starts a new
    # one, which remembers nothing. After a hang, and after `LIVES` processes, the policy proposes nothing any more.

    counted = True  # the time limit is enforced here, by killing the process

    def __init__(self, name: str, parameters: Mapping[str, float], budget: float) -> None:
        """Start the process; `budget` in s."""
        self._order = {"name": name, "parameters": list(parameters.items())}
        self._budget, self._used = budget, 0
        try:
            self._start()
        except PolicyError as fault:
            raise PluginError(f"policy {name!r}: {fault}") from None

    def propose(self, seen: Observation) -> dict[str, Motion] | None:
        """The policy's proposal; `motions_of` checks names and numbers afterwards."""
        if not self._end.alive and self._used >= LIVES:
            return None
        try:
            if not self._end.alive:
                self._start()
            answer = self._ask(seen, self._limit)
            if "fault" not in answer:
                return dict(answer["motions"])
        except (PolicyError, PluginError, KeyError, TypeError, ValueError) as error:
            self._end()
            what = str(error) if isinstance(error, PolicyError | PluginError) else "its process sent no proposal"
            after = "; not asked again in this run" if self._used >= LIVES else ""
            raise PolicyError(what + after) from None
        traceback = answer.get("traceback")
        raise PolicyError(_words(answer["fault"]), printable(traceback) if isinstance(traceback, str) else "")

    def close(self) -> None:
        """End the process and its process group. A later question belongs to a new run."""
        self._end()
        self._used = 0

    def _start(self) -> None:
        """Start a process, in a session of its own, and let it make the policy."""
        # The process inherits only its ends of the channel and of a pipe. This process alone holds the other end of the
        # pipe. When this process ends, the pipe closes and the policy's process is killed.
        self._used += 1
        self._channel, theirs = Pipe()
        reader, writer = Pipe(duplex=False)
        path = json.dumps([entry for entry in sys.path if isinstance(entry, str)])
        handles = [theirs.fileno(), reader.fileno()]
        output = STDERR if os.environ.get(SHOWN) else subprocess.DEVNULL
        with theirs, reader:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", _PROGRAM, path, *map(str, handles), str(MEMORY)],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                pass_fds=handles,
                start_new_session=True,
                env={**_ENVIRONMENT, **os.environ},
            )
        self._end = weakref.finalize(self, _kill, self._process, self._channel, writer, os.getpid())
        _GUESTS.add(self)
        answer = self._ask(self._order, START_S)
        if "fault" in answer:
            self._end()
            raise PluginError(_words(answer["fault"]))
        self._limit = max(self._budget, COUNTED_S) if answer.get("counted") is True else self._budget

    def _ask(self, question: object, limit_s: float) -> dict[str, Any]:
        """The process's answer, an object. Without one, the process is ended."""
        try:
            with _hung_up_after(limit_s, self._channel) as late:
                self._channel.send_bytes(encoded(question))
                data = self._channel.recv_bytes(LONGEST)
            answer = decoded(data, (Motion,))
            if isinstance(answer, dict) and not late.is_set():
                return answer
            fault = "not an object"
        except (EOFError, ConnectionError):
            fault = ""
        except Exception as error:  # the sender is not trusted
            fault = str(error)[:FAULT_WIDTH]
        except BaseException:
            self._end()
            raise
        self._end()
        if late.is_set():
            self._used = LIVES if limit_s >= START_S else self._used
            raise PolicyError(f"OutOfTime: not done after {limit_s:g} s")
        if fault:
            raise PolicyError(f"its process sent no message: {fault}"[:FAULT_WIDTH])
        raise PolicyError(f"its process ended or closed its channel ({ended_how(self._process.returncode)})")


_GUESTS: weakref.WeakSet[GuestPolicy] = weakref.WeakSet()


def end_all() -> None:
    for guest in list(_GUESTS):
        guest.close()


@contextmanager
def _hung_up_after(seconds: float, channel: Connection) -> Iterator[threading.Event]:
    """Shut down a channel after some seconds, so that the body stops waiting, even within a message."""
    late = threading.Event()

    def hang_up() -> None:
        late.set()
        with socket.socket(fileno=os.dup(channel.fileno())) as ours, suppress(OSError):
            ours.shutdown(socket.SHUT_RDWR)

    timer = threading.Timer(seconds, hang_up)
    timer.daemon = True
    timer.start()
    try:
        yield late
    finally:
        timer.cancel()
        timer.join()


def _kill(process: subprocess.Popen[bytes], channel: Connection, alive: Connection, owner: int) -> None:
    channel.close()
    alive.close()
    if os.getpid() != owner:  # this is a fork of the process that started it
        return
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _words(fault: object) -> str:
    """The policy's error message, as one printable line."""
    return one_line(fault[:FAULT_WIDTH]) if isinstance(fault, str) else "its process does not say what went wrong"
