"""A policy of others in a process of its own, which is killed when it takes too long, and cannot touch the run.

The process is a fresh interpreter (`worker.py`), started once and kept warm. What it sends is data: JSON of bounded
length, decoded and checked here. Nothing that it was given is shared with the simulation.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import weakref
from collections.abc import Mapping
from typing import IO, Any

from airground_drake.errors import FAULT_WIDTH, AirgroundError, PluginError, PolicyError, one_line
from airground_drake.intervention import frames
from airground_drake.intervention.codec import packed, unpacked_motions
from airground_drake.intervention.policy import Observation, Policy
from airground_drake.nsbc.motion import Motion

START_S = 30.0
"""For the interpreter, the policy's imports and its construction, s."""
COUNTED_S = 60.0
"""A policy that says that it bounds its effort by counts gets so long for a proposal, s: it may not keep its word."""
LIVES = 3
"""A policy's process is started at most so often in a run; then the policy is not asked any more."""
MEMORY = 4 * 2**30
"""Address space of the process, bytes."""

_PROGRAM = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[2]); "
    "from airground_drake import confinement, interruption; "
    "interruption.end_with_pipe(int(sys.argv[4])); "
    "confinement.limit_memory(int(sys.argv[3])); confinement.restrict_signals(); "
    "from airground_drake.intervention.worker import main; main(int(sys.argv[1]))"
)
_ENVIRONMENT = {"PYTHONHASHSEED": "0", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""Proposals that depend on the order of a set are the same in every run; threads of libraries take no memory."""


class GuestPolicy(Policy):
    """Stands in for a policy that runs in a process of its own.

    A fault of the policy is raised as `PolicyError`. When its process has ended or had to be killed, the next proposal
    is asked of a new one, which knows nothing of what was before; after `LIVES` processes nothing is proposed any more.
    """

    counted = True  # its time is limited here, by the other process's life

    def __init__(self, name: str, parameters: Mapping[str, float], budget: float) -> None:
        """Start the process.

        Args:
            name: of an installed entry point, `module:Class` or `file.py:Class`.
            parameters: of the policy.
            budget: wall-clock time for a proposal, s.

        Raises:
            PluginError: if the policy cannot be imported, is none, or does not take these parameters.
        """
        self._name, self._parameters, self._budget = name, dict(parameters), budget
        self._process: _Process | None = None
        self._used = 0
        try:
            self._start()
        except PolicyError as fault:
            raise PluginError(f"policy {name!r}: {fault}") from None

    def propose(self, seen: Observation) -> dict[str, Motion] | None:
        """What the policy proposes.

        Raises:
            PolicyError: if it fails, or proposes what is no proposal; says what became of its process.
        """
        if self._process is None and self._used >= LIVES:
            return None
        try:
            process = self._process or self._start()
            answer = process.ask({"seen": packed(seen)}, self._limit)
            if "fault" not in answer:
                return unpacked_motions(answer.get("motions"))
        except (_LostError, PluginError, ValueError, ArithmeticError) as error:
            self._end()
            last = f"; its process was started {LIVES} times: not asked again in this run"
            what = str(error) if isinstance(error, AirgroundError) else f"its process sent no proposal: {error}"
            raise PolicyError(what + last * (self._used >= LIVES)) from None
        raise PolicyError(_words(answer["fault"]))

    def close(self) -> None:
        """End the process, with all that it has started and left in its group; a later proposal is of a new run."""
        self._end()
        self._used = 0

    def _start(self) -> _Process:
        """A new process that has made the policy.

        Raises:
            PluginError, PolicyError: if there is none.
        """
        self._used += 1
        process = _Process()
        try:
            answer = process.ask({"name": self._name, "parameters": self._parameters}, START_S)
            if "fault" in answer:
                raise PluginError(_words(answer["fault"]))
        except BaseException:
            process.end()
            raise
        self._limit = max(self._budget, COUNTED_S) if answer.get("counted") is True else self._budget
        self._process = process
        return process

    def _end(self) -> None:
        if self._process is not None:
            self._process.end()
            self._process = None


def end_all() -> None:
    """End the processes of all policies that this process has started."""
    for process in list(_RUNNING):
        process.end()


class _LostError(PolicyError):
    """The process is of no use any more."""


class _Process:
    """The other process and the channel to it."""

    def __init__(self) -> None:
        """Start it, in a session of its own, with nothing open but one end of the channel."""
        ours, theirs = socket.socketpair()
        path = json.dumps([each for each in sys.path if isinstance(each, str)])
        reader, writer = map(os.fdopen, os.pipe(), ("rb", "wb"))
        arguments = [str(theirs.fileno()), path, str(MEMORY), str(reader.fileno())]
        with theirs, reader:  # the policy ends with this process, which keeps the writer
            process = subprocess.Popen(
                [sys.executable, "-P", "-c", _PROGRAM, *arguments],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                pass_fds=[theirs.fileno(), reader.fileno()],
                start_new_session=True,
                env={**_ENVIRONMENT, **os.environ},
            )
        self._process, self._channel, self._asked = process, ours, -1
        _RUNNING.add(self)
        self.end = weakref.finalize(self, _kill, process, ours, writer, os.getpid())

    def ask(self, question: Mapping[str, Any], limit_s: float) -> dict[str, Any]:
        """The answer to this very question.

        Raises:
            _LostError: if there is none in time, or it is malformed.
        """
        self._asked += 1
        try:
            frames.send(self._channel, {"id": self._asked, **question}, limit_s)
            answer = frames.receive(self._channel, limit_s, frames.LONGEST)
        except TimeoutError:
            raise _LostError(f"OutOfTime: not done after {limit_s:g} s") from None
        except frames.FrameError as error:
            raise _LostError(f"its process sent no message: {error}") from None
        except (EOFError, OSError):
            self.end()
            raise _LostError(f"its process ended ({_status(self._process.returncode)})") from None
        if answer.get("id") != self._asked:
            raise _LostError("its process sent an answer to another question")
        return answer


_RUNNING: weakref.WeakSet[_Process] = weakref.WeakSet()


def _kill(process: subprocess.Popen[bytes], channel: socket.socket, alive: IO[bytes], owner: int) -> None:
    """End a process and its group, and wait for it."""
    channel.close()
    alive.close()
    if os.getpid() != owner:  # a fork of the process that started it
        return
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _status(code: int) -> str:
    if code == -signal.SIGKILL:
        return "killed, or its channel closed"
    return f"signal {-code}" if code < 0 else f"exit code {code}"


def _words(fault: object) -> str:
    """A fault in the policy's words, as one printable line."""
    return one_line(fault[:FAULT_WIDTH]) if isinstance(fault, str) else "its process does not say what went wrong"
