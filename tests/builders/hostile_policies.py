"""Policies that misbehave, one function each: run in a policy's process, chosen by the number of refusals observed."""

from __future__ import annotations

import ctypes
import json
import os
import resource
import signal
import socket
import stat
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any, NamedTuple, NoReturn

import numpy as np

from airground_drake.intervention.codec import packed_motions
from airground_drake.intervention.policy import Observation, Policy
from airground_drake.nsbc.motion import Motion


class Kind(NamedTuple):
    """A policy's misdeed.

    Attributes:
        does: what it does in `propose`.
        reported: pattern of what is to be reported; None: nothing, and nothing is proposed.
        hangs: whether it takes too long.
        tame: whether its process can be asked again as if nothing had been.
    """

    does: Callable[[Observation], Any]
    reported: str | None
    hangs: bool
    tame: bool


KINDS: dict[str, Kind] = {}


def kind(
    reported: str | None, *, hangs: bool = False, tame: bool = False
) -> Callable[[Callable[[Observation], Any]], None]:
    return lambda does: KINDS.update({does.__name__: Kind(does, reported, hangs, tame)})


tame = partial(kind, tame=True)


class Hostile(Policy):
    """One kind, or the one whose number is that of the refusals observed; beyond them, stands still."""

    def __init__(self, *, kind: float = -1.0) -> None:
        """Set the number of the kind; -1: as observed."""
        self.kind = int(kind)

    def propose(self, seen: Observation) -> Any:
        number = seen.refusals if self.kind < 0 else self.kind
        if number >= len(KINDS):
            return Motion(np.array([seen.start]), seen.position[None])
        return list(KINDS.values())[number].does(seen)


ENDED = r"its process ended \("
KILLED = r"its process ended \(killed, or its channel closed\)"
NO_MESSAGE = "its process sent no message"
NO_PROPOSAL = "its process sent no proposal"
LATE = "OutOfTime: not done after"


def forever() -> NoReturn:
    while True:
        time.sleep(0.01)


def channels() -> list[int]:
    """Every open socket of this process."""
    found = []
    for handle in range(3, 64):
        try:
            if stat.S_ISSOCK(os.fstat(handle).st_mode):
                found.append(handle)
        except OSError:
            continue
    return found


def say(data: bytes) -> None:
    for handle in channels():
        os.write(handle, data)


def frame(message: bytes) -> bytes:
    return struct.pack("!I", len(message)) + message


def answers(message: object) -> None:
    """Answer in the worker's place whatever is asked: numbers of questions are tried in turn from the next on."""
    import airground_drake.intervention.worker as worker

    worker.answer = lambda policy, seen: message  # type: ignore[assignment, return-value]


# --- endings


@tame("SystemExit: 0")
def sys_exit_0(seen: Observation) -> None:
    sys.exit(0)


@kind(ENDED + r"exit code 0\)")
def os_exit_0(seen: Observation) -> None:
    os._exit(0)


@kind(ENDED + r"exit code 0\)")
def os_exit_in_a_thread(seen: Observation) -> None:
    threading.Thread(target=os._exit, args=(0,)).start()
    forever()


@kind(KILLED)
def kills_itself(seen: Observation) -> None:
    os.kill(os.getpid(), signal.SIGKILL)
    forever()


@kind(ENDED + "signal 11")
def reads_address_0(seen: Observation) -> None:
    ctypes.string_at(0)


@kind(ENDED)
def takes_its_own_time_away(seen: Observation) -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (0, 0))
    while True:
        pass


@kind(ENDED + "signal|RecursionError|MemoryError")
def overflows_the_stack(seen: Observation) -> None:
    sys.setrecursionlimit(10**9)
    threading.stack_size(2**20)

    class Nested:
        def __repr__(self) -> str:
            return repr([self])

    thread = threading.Thread(target=repr, args=(Nested(),))
    thread.start()
    thread.join()
    raise RecursionError("caught by somebody else")


# --- hanging


@kind(LATE, hangs=True)
def loops_and_swallows_everything(seen: Observation) -> None:
    while True:
        try:
            forever()
        except BaseException:
            continue


@kind(LATE, hangs=True)
def blocks_every_signal(seen: Observation) -> None:
    signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
    forever()


@kind(LATE, hangs=True)
def never_returns_to_the_interpreter(seen: Observation) -> None:
    pow(7, 10**9)


@kind(LATE, hangs=True)
def stops_itself(seen: Observation) -> None:
    os.kill(os.getpid(), signal.SIGSTOP)
    forever()


@kind(LATE, hangs=True)
def forks_and_leaves_the_child_to_hang(seen: Observation) -> None:
    if os.fork():
        os._exit(0)
    forever()


@kind(LATE, hangs=True)
def sends_its_answer_byte_by_byte(seen: Observation) -> None:
    say(struct.pack("!I", 1000))
    while True:
        time.sleep(0.01)
        say(b" ")


# --- exceptions


@tame("RuntimeError: no plan")
def raises(seen: Observation) -> None:
    raise RuntimeError("no plan")


@tame("KeyboardInterrupt")
def raises_keyboard_interrupt(seen: Observation) -> None:
    raise KeyboardInterrupt


class Unusual(BaseException):
    pass


@tame("Unusual: .*odd")
def raises_what_is_no_exception(seen: Observation) -> None:
    raise Unusual("odd")


class WordyError(Exception):
    """Says what its argument returns."""

    def __str__(self) -> str:
        return self.args[0]()


@tame("an exception that cannot be put into words")
def text_raises(seen: Observation) -> None:
    raise WordyError(lambda: 1 / 0)


@tame(ENDED + r"exit code 0\)")
def text_ends_the_process(seen: Observation) -> None:
    raise WordyError(lambda: os._exit(0))


@tame(LATE, hangs=True)
def text_sleeps(seen: Observation) -> None:
    raise WordyError(forever)


@tame(r"WordyError: \\ud800\\udfff")
def text_holds_lone_surrogates(seen: Observation) -> None:
    raise WordyError(lambda: "\ud800" + "\udfff")


@tame("WordyError: x{200}")
def text_is_long(seen: Observation) -> None:
    raise WordyError(lambda: "x" * 10**8)


@tame(r"WordyError: \\x1b\[2J\\nerror: none\\u202e")
def text_is_for_a_terminal(seen: Observation) -> None:
    raise WordyError(lambda: "\x1b[2J\nerror: none\u202e")


class Nameless(type):
    @property
    def __name__(cls) -> str:  # type: ignore[override]
        raise ValueError


@tame("an exception that cannot be put into words")
def class_has_no_name(seen: Observation) -> None:
    raise Nameless("Nothing", (Exception,), {})("?")


# --- what is no proposal


@tame("TypeError: a policy proposes a Motion, .* not str")
def returns_text(seen: Observation) -> str:
    return "left"


@tame("ValueError: a motion needs finite")
def returns_nan(seen: Observation) -> Motion:
    return Motion(np.array([seen.start]), np.full((1, 3), np.nan))


@tame("FloatingPointError")
def returns_what_overflows(seen: Observation) -> Motion:
    return Motion(np.array([0.0, 1e-300]), np.array([[0.0] * 3, [1e300] * 3]))


@tame("ValueError: .* at most 1e[+]09 in size")
def returns_what_is_too_far(seen: Observation) -> Motion:
    return Motion(np.array([0.0, 1.0]), np.array([[0.0] * 3, [-1e155] * 3]))


@tame("ValueError: a proposal of [0-9]+ characters")
def returns_a_huge_motion(seen: Observation) -> Motion:
    return Motion(np.arange(1e6), np.zeros((10**6, 3)))


@tame("MemoryError")
def wants_too_much_memory(seen: Observation) -> Motion:
    return Motion(np.arange(1e12), np.zeros((1, 3)))


@tame("MemoryError")
def takes_memory_bit_by_bit(seen: Observation) -> None:
    kept = []
    while True:
        kept.append(np.empty(2**27))  # never touched: address space is what is limited


def tampered(**changes: Any) -> Motion:
    """A motion with other attributes than it was made with."""
    motion = Motion(np.zeros(1), np.zeros((1, 3)))
    for name, value in changes.items():
        object.__setattr__(motion, name, value)
    return motion


@tame("ValueError: a motion needs finite")
def changes_a_motion_after_it_was_checked(seen: Observation) -> Motion:
    return tampered(positions=np.full((1, 3), np.nan))


class Evil:
    """Does what its argument does wherever it is taken for an array."""

    def __init__(self, does: Callable[[], Any]) -> None:
        self.does = does

    def __array__(self, *_: Any, **__: Any) -> Any:
        return self.does()

    def __len__(self) -> int:
        return self.does()


@tame(ENDED + r"exit code 0\)")
def array_ends_the_process(seen: Observation) -> Motion:
    return tampered(positions=Evil(lambda: os._exit(0)))


@tame(LATE, hangs=True)
def array_hangs(seen: Observation) -> Motion:
    return tampered(times=Evil(forever))


@tame("ValueError|TypeError")
def array_is_no_array(seen: Observation) -> Motion:
    return tampered(times=Evil(lambda: -1))


class Endless(Mapping[str, Motion]):
    """A mapping of any number of names."""

    def __getitem__(self, name: str) -> Motion:
        return tampered()

    def __iter__(self) -> Iterator[str]:
        while True:
            yield "a" * 10**6

    def __len__(self) -> int:
        return -1


@tame("ValueError|MemoryError|OutOfTime", hangs=True)
def returns_an_endless_mapping(seen: Observation) -> Mapping[str, Motion]:
    return Endless()


@tame("ValueError: a policy proposes to UGVs of the team, not to 'ghost'")
def names_somebody_else(seen: Observation) -> dict[str, Motion]:
    return {"ghost": tampered()}


@tame(r"ValueError: .*\\ud800")
def names_a_surrogate(seen: Observation) -> dict[str, Motion]:
    return {"\ud800": tampered()}


# --- what it was given


@tame("ValueError: assignment destination is read-only")
def writes_to_the_target(seen: Observation) -> None:
    seen.target[:] = 0.0


@tame(None)
def changes_the_observation_by_force(seen: Observation) -> None:
    object.__setattr__(seen, "robot", "ghost")
    object.__setattr__(seen.preset, "positions", np.zeros((2, 3)))


# --- the process, its channel, and others


@kind(None)
def prints_a_gigabyte(seen: Observation) -> None:
    for _ in range(10):
        sys.stdout.buffer.write(b"x" * 10**8)
        print("x" * 10**6, file=sys.stderr)


@kind(None)
def writes_to_descriptors_1_and_2(seen: Observation) -> None:
    os.write(1, b"all as declared\n")
    os.write(2, b"all as declared\n")


@kind("EOFError")
def reads_standard_input(seen: Observation) -> None:
    input()


@kind("OSError|FileNotFoundError")
def opens_the_terminal(seen: Observation) -> None:
    with open("/dev/tty", "w") as terminal:
        terminal.write("all as declared")


@kind(ENDED)
def closes_every_descriptor(seen: Observation) -> None:
    os.closerange(0, 256)


@kind(ENDED)
def shuts_the_channel(seen: Observation) -> None:
    for handle in channels():
        socket.socket(fileno=os.dup(handle)).shutdown(socket.SHUT_RDWR)


@kind(NO_MESSAGE)
def sends_garbage(seen: Observation) -> None:
    say(frame(b"\x80\x04garbage."))


@kind(NO_MESSAGE + ": [0-9]+ bytes where at most")
def announces_four_gigabytes(seen: Observation) -> None:
    say(struct.pack("!I", 2**32 - 1))


@kind(NO_MESSAGE)
def sends_deep_nesting(seen: Observation) -> None:
    say(frame(b"[" * 10**6))


@kind(NO_MESSAGE)
def sends_a_long_number(seen: Observation) -> None:
    say(frame(b'{"id": ' + b"9" * 10**5 + b"}"))


@kind("its process sent an answer to another question")
def answers_another_question(seen: Observation) -> None:
    say(frame(json.dumps({"id": -1, "motions": []}).encode()))


@kind(NO_PROPOSAL)
def sends_no_motions(seen: Observation) -> None:
    answers({"motions": {"a": 1}})


@kind(NO_PROPOSAL)
def sends_a_motion_that_is_no_text(seen: Observation) -> None:
    answers({"motions": [["a", 1, 2]]})


@kind(NO_PROPOSAL)
def sends_a_motion_that_is_not_finite(seen: Observation) -> None:
    answers({"motions": [["a", "AAAAAAAA+H8=", "AAAAAAAA+H8AAAAAAAD4fwAAAAAAAPh/"]]})


@kind("ValueError: .* at most 1e[+]09 in size")
def sends_a_motion_that_is_too_far(seen: Observation) -> None:
    motion = Motion(np.array([0.0]), np.full((1, 3), 1e308))
    answers({"motions": packed_motions({"a": motion})})


@kind("its process does not say what went wrong")
def sends_a_fault_that_is_no_text(seen: Observation) -> None:
    answers({"fault": {"no": "text"}})


@kind("y{300}$")
def sends_a_fault_of_a_million_characters(seen: Observation) -> None:
    answers({"fault": "y" * 10**6})


@kind(None)
def patches_the_avoidance_layer(seen: Observation) -> None:
    from airground_drake.nsbc.avoidance import Avoidance

    Avoidance.apply = lambda self, velocity, spaces: velocity  # type: ignore[method-assign]


@kind(None)
def patches_the_claims(seen: Observation) -> None:
    from airground_drake.verify.claim import Finding, TraceClaim

    TraceClaim.judge = lambda self, trace: Finding("holds", exercised=1)  # type: ignore[method-assign]


@kind(None)
def leaves_a_child_behind(seen: Observation) -> None:
    if not os.fork():
        forever()


@kind(None)
def empties_the_modules(seen: Observation) -> None:
    for name in [name for name in sys.modules if name.startswith("airground_drake.verify")]:
        del sys.modules[name]
    sys.stdout = sys.stderr = None  # type: ignore[assignment]


@kind(None)
def traces_and_profiles(seen: Observation) -> None:
    sys.settrace(lambda *_: None)
    sys.setprofile(lambda *_: None)


KILLS_OTHERS = "kills_its_parent"
"""Needs Landlock; on systems without it a policy can do so, and the report says that the simulation died."""


@kind("PermissionError")
def kills_its_parent(seen: Observation) -> None:
    os.kill(os.getppid(), signal.SIGCONT)  # harmless where it is not refused
