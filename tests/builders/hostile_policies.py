"""Policies that misbehave: a table of what they do in a policy's process, and of what is to be reported."""

from __future__ import annotations

import ctypes
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
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np

from airground_drake.geometry.motion import Motion
from airground_drake.intervention.policy import Observation, Policy


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


class Kind(NamedTuple):
    """A policy's misdeed.

    Attributes:
        reported: pattern of what is to be reported; None: nothing, and nothing is proposed.
        does: what it does in `propose`.
        hangs: whether it takes too long.
        tame: whether its process can be asked again as if nothing had been.
    """

    reported: str | None
    does: Callable[[Observation], Any]
    hangs: bool = False
    tame: bool = False


def forever() -> NoReturn:
    while True:
        time.sleep(0.01)


def throw(error: BaseException) -> NoReturn:
    raise error


def recurses() -> None:
    recurses()


def then_forever(*steps: Callable[[], object]) -> Callable[[Observation], NoReturn]:
    def does(seen: Observation) -> NoReturn:
        for step in steps:
            step()
        forever()

    return does


def in_a_thread(does: Callable[[], object]) -> None:
    thread = threading.Thread(target=does)
    thread.start()
    thread.join()


# --- endings and hanging


def overflows_the_stack(seen: Observation) -> None:
    sys.setrecursionlimit(10**9)
    threading.stack_size(2**20)

    class Nested:
        def __repr__(self) -> str:
            return repr([self])

    in_a_thread(partial(repr, Nested()))
    raise RecursionError("caught by somebody else")


def takes_its_own_time_away(seen: Observation) -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (0, 0))
    while True:
        pass


def swallows_everything(seen: Observation) -> None:
    while True:
        try:
            forever()
        except BaseException:
            continue


def waits_for_a_lock(seen: Observation) -> None:
    lock = threading.Lock()
    lock.acquire()
    lock.acquire()


def forks_and_leaves_the_child_to_hang(seen: Observation) -> None:
    if os.fork():
        os._exit(0)
    forever()


def forks_out_of_its_session(seen: Observation) -> None:
    """The child keeps the channel open and is not in the group that is killed; it ends by itself."""
    if os.fork():
        forever()
    os.setsid()
    time.sleep(3.0)
    os._exit(0)


def takes_memory_bit_by_bit(seen: Observation) -> None:
    kept = []
    while True:
        kept.append(np.empty(2**27))  # never touched: address space is what is limited


def leaves_a_child_behind(seen: Observation) -> None:
    if not os.fork():
        forever()


# --- exceptions and motions with code in them


class Unusual(BaseException):
    pass


class WordyError(Exception):
    """Says what its argument returns."""

    def __str__(self) -> str:
        return self.args[0]()


class Nameless(type):
    @property
    def __name__(cls) -> str:  # type: ignore[override]
        raise ValueError


class Evil:
    """Does what its argument does wherever it is taken for an array."""

    def __init__(self, does: Callable[[], Any]) -> None:
        self.does = does

    def __array__(self, *_: Any, **__: Any) -> Any:
        return self.does()

    def __len__(self) -> int:
        return self.does()


class Endless(Mapping[str, Motion]):
    """A mapping of any number of names."""

    def __getitem__(self, name: str) -> Motion:
        return tampered()

    def __iter__(self) -> Iterator[str]:
        while True:
            yield "a" * 10**6

    def __len__(self) -> int:
        return -1


def motion(times: Any, positions: Any) -> Callable[[Observation], Motion]:
    """A policy that makes a motion of these numbers when it is asked."""
    return lambda seen: Motion(np.array(times), np.array(positions))


def tampered(**changes: Any) -> Motion:
    """A motion with other attributes than it was made with."""
    found = Motion(np.zeros(1), np.zeros((1, 3)))
    for name, value in changes.items():
        object.__setattr__(found, name, value)
    return found


def words(says: Callable[[], Any]) -> Callable[[Observation], NoReturn]:
    return lambda seen: throw(WordyError(says))


def changes_the_observation_by_force(seen: Observation) -> None:
    object.__setattr__(seen, "robot", "ghost")
    object.__setattr__(seen.preset, "positions", np.zeros((2, 3)))


# --- the channel, and other code


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


def sends(message: bytes) -> Callable[[Observation], None]:
    """A policy that writes a message to the channel, as `Connection.send_bytes` does."""
    return lambda seen: say(struct.pack("!i", len(message)) + message)


def answers(message: object) -> Callable[[Observation], None]:
    """A policy that answers in the worker's place, from the next question on."""

    def does(seen: Observation) -> None:
        import airground_drake.intervention.guest.worker as worker

        worker.answer = lambda policy, data: message  # type: ignore[assignment, return-value]

    return does


def moves(times: str, positions: str) -> dict[str, Any]:
    """A message with a motion, its arrays in base64."""
    arrays = {"times": (times, [-1]), "positions": (positions, [-1, 3])}
    packed = {name: {"@": "array", "base64": text, "shape": shape} for name, (text, shape) in arrays.items()}
    return {"motions": [["a", {"@": "Motion", **packed}]]}


def sends_its_answer_byte_by_byte(seen: Observation) -> None:
    say(struct.pack("!i", 1000))
    while True:
        time.sleep(0.01)
        say(b" ")


def shuts_the_channel(seen: Observation) -> None:
    for handle in channels():
        socket.socket(fileno=os.dup(handle)).shutdown(socket.SHUT_RDWR)


def prints_a_gigabyte(seen: Observation) -> None:
    for _ in range(10):
        sys.stdout.buffer.write(b"x" * 10**8)
        print("x" * 10**6, file=sys.stderr)


def patches_the_avoidance_layer(seen: Observation) -> None:
    from airground_drake.nsbc.avoidance import Avoidance

    Avoidance.apply = lambda self, velocity, spaces: velocity  # type: ignore[method-assign]


def patches_the_claims(seen: Observation) -> None:
    from airground_drake.verify.claim import Finding, TraceClaim

    TraceClaim.judge = lambda self, trace: Finding("holds", exercised=1)  # type: ignore[method-assign]


def empties_the_modules(seen: Observation) -> None:
    for name in [name for name in sys.modules if name.startswith("airground_drake.verify")]:
        del sys.modules[name]
    sys.stdout = sys.stderr = None  # type: ignore[assignment]


def traces_and_profiles(seen: Observation) -> None:
    sys.settrace(lambda *_: None)
    sys.setprofile(lambda *_: None)


ENDED = r"its process ended or closed its channel \("
NO_MESSAGE = "its process sent no message"
NO_PROPOSAL = "its process sent no proposal"
NO_MOTION = "TypeError: a policy proposes a Motion, .* not "
NO_WORDS = "an exception that cannot be put into words"
TOO_LARGE = "ValueError: .* at most 1e[+]09 in size"

wild, tame = Kind, partial(Kind, tame=True)
late = partial(Kind, "OutOfTime: not done after", hangs=True)

KILLS_OTHERS = "kills_its_parent"
"""Needs Landlock; on systems without it a policy can do so, and the report says that the simulation died."""

KINDS: dict[str, Kind] = {
    # endings
    "sys_exit_0": tame("SystemExit: 0", lambda seen: sys.exit(0)),
    "sys_exit_with_words": tame("SystemExit: bye", lambda seen: sys.exit("bye")),
    "os_exit_0": wild(ENDED + r"exit code 0\)", lambda seen: os._exit(0)),
    "os_exit_7": wild(ENDED + r"exit code 7\)", lambda seen: os._exit(7)),
    "os_exit_in_a_thread": wild(ENDED + r"exit code 0\)", lambda seen: in_a_thread(partial(os._exit, 0))),
    "sys_exit_in_a_thread": wild(None, lambda seen: in_a_thread(sys.exit)),
    "kills_itself": wild(ENDED + "signal 9", then_forever(lambda: os.kill(os.getpid(), signal.SIGKILL))),
    "kills_its_group": wild(ENDED + "signal 9", then_forever(lambda: os.killpg(0, signal.SIGKILL))),
    "aborts": wild(ENDED + "signal 6", lambda seen: os.abort()),
    "reads_address_0": wild(ENDED + "signal 11", lambda seen: ctypes.string_at(0)),
    "lets_an_alarm_ring": wild(
        ENDED + "signal 14",
        then_forever(
            lambda: signal.signal(signal.SIGALRM, signal.SIG_DFL),
            lambda: signal.setitimer(signal.ITIMER_REAL, 0.01),
        ),
    ),
    "takes_its_own_time_away": wild(ENDED, takes_its_own_time_away),
    "overflows_the_stack": wild(ENDED + "signal|RecursionError|MemoryError", overflows_the_stack),
    # hanging
    "becomes_another_program": late(
        lambda seen: os.execv(sys.executable, [sys.executable, "-c", "import time; time.sleep(1000)"])
    ),
    "sleeps": late(lambda seen: time.sleep(1e6)),
    "loops_and_swallows_everything": late(swallows_everything),
    "clears_the_timer": late(then_forever(lambda: signal.setitimer(signal.ITIMER_REAL, 0.0))),
    "blocks_every_signal": late(then_forever(lambda: signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals()))),
    "ignores_the_request_to_end": late(then_forever(lambda: signal.signal(signal.SIGTERM, signal.SIG_IGN))),
    "never_returns_to_the_interpreter": late(lambda seen: pow(7, 10**9)),
    "stops_itself": late(then_forever(lambda: os.kill(os.getpid(), signal.SIGSTOP))),
    "waits_for_a_lock": late(waits_for_a_lock),
    "forks_and_leaves_the_child_to_hang": late(forks_and_leaves_the_child_to_hang),
    "forks_out_of_its_session": late(forks_out_of_its_session),
    "sends_its_answer_byte_by_byte": late(sends_its_answer_byte_by_byte),
    # exceptions
    "raises": tame("RuntimeError: no plan", lambda seen: throw(RuntimeError("no plan"))),
    "raises_keyboard_interrupt": tame("KeyboardInterrupt", lambda seen: throw(KeyboardInterrupt())),
    "raises_generator_exit": tame("GeneratorExit", lambda seen: throw(GeneratorExit())),
    "raises_what_is_no_exception": tame("Unusual: .*odd", lambda seen: throw(Unusual("odd"))),
    "recurses": tame("RecursionError", lambda seen: recurses()),
    "text_raises": tame(NO_WORDS, words(lambda: 1 / 0)),
    "text_exits": tame(NO_WORDS, words(sys.exit)),
    "text_ends_the_process": tame(ENDED + r"exit code 0\)", words(lambda: os._exit(0))),
    "text_sleeps": late(words(forever), tame=True),
    "text_is_no_text": tame(NO_WORDS, words(lambda: 3)),
    "text_holds_lone_surrogates": tame(r"WordyError: \\ud800\\udfff", words(lambda: "\ud800" + "\udfff")),
    "text_is_long": tame("WordyError: x{200}", words(lambda: "x" * 10**8)),
    "text_is_for_a_terminal": tame(
        r"WordyError: \\x1b\[2J\\nerror: none\\u202e", words(lambda: "\x1b[2J\nerror: none\u202e")
    ),
    "class_has_no_name": tame(NO_WORDS, lambda seen: throw(Nameless("Nothing", (Exception,), {})("?"))),
    "raises_a_group": tame(
        "ExceptionGroup", lambda seen: throw(ExceptionGroup("many", [ValueError(str(i)) for i in range(1000)]))
    ),
    # what is no proposal
    "returns_text": tame(NO_MOTION + "str", lambda seen: "left"),
    "returns_a_number": tame(NO_MOTION + "int", lambda seen: 3),
    "returns_a_generator": tame(NO_MOTION + "generator", lambda seen: (each for each in [1])),
    "returns_nan": tame("ValueError: a motion needs finite", motion([0.0], [[np.nan] * 3])),
    "returns_infinity": tame("ValueError: a motion needs finite", motion([np.inf], [[0.0] * 3])),
    "returns_what_overflows": tame("FloatingPointError", motion([0.0, 1e-300], [[0.0] * 3, [1e300] * 3])),
    "returns_what_is_too_far": tame(TOO_LARGE, motion([0.0, 1.0], [[0.0] * 3, [-1e155] * 3])),
    "returns_what_is_too_late": tame(TOO_LARGE, motion([0.0, 1e10], [[0.0] * 3] * 2)),
    "returns_a_wrong_shape": tame("ValueError: a motion needs times", motion([0.0, 1.0, 2.0], [[0.0] * 2] * 3)),
    "returns_time_backwards": tame("ValueError: .* must increase", motion([1.0, 0.0], [[0.0] * 3] * 2)),
    "returns_a_huge_motion": tame(
        "ValueError: a proposal of [0-9]+ bytes", lambda seen: Motion(np.arange(1e6), np.zeros((10**6, 3)))
    ),
    "wants_too_much_memory": tame("MemoryError", lambda seen: np.arange(1e12)),
    "takes_memory_bit_by_bit": tame("MemoryError", takes_memory_bit_by_bit),
    "changes_a_motion_after_it_was_checked": tame(
        "ValueError: a motion needs finite", lambda seen: tampered(positions=np.full((1, 3), np.nan))
    ),
    "array_exits": tame("SystemExit", lambda seen: tampered(times=Evil(lambda: sys.exit(0)))),
    "array_ends_the_process": tame(
        ENDED + r"exit code 0\)", lambda seen: tampered(positions=Evil(lambda: os._exit(0)))
    ),
    "array_hangs": late(lambda seen: tampered(times=Evil(forever)), tame=True),
    "array_is_no_array": tame("ValueError|TypeError", lambda seen: tampered(times=Evil(lambda: -1))),
    "returns_an_endless_mapping": tame("ValueError|MemoryError|OutOfTime", lambda seen: Endless(), hangs=True),
    "names_somebody_else": tame(
        "ValueError: a policy proposes to UGVs of the team, not to 'ghost'", lambda seen: {"ghost": tampered()}
    ),
    "names_a_number": tame("ValueError: a policy proposes to UGVs of the team", lambda seen: {7: tampered()}),
    "names_a_surrogate": tame(r"ValueError: .*\\ud800", lambda seen: {"\ud800": tampered()}),
    # what it was given
    "writes_to_the_target": tame(
        "ValueError: assignment destination is read-only", lambda seen: seen.target.__setitem__(0, 0.0)
    ),
    "makes_the_obstacles_writeable": tame(
        "ValueError: cannot set WRITEABLE", lambda seen: seen.obstacles.setflags(write=True)
    ),
    "assigns_to_the_observation": tame("FrozenInstanceError", lambda seen: setattr(seen, "t", 0.0)),
    "changes_the_observation_by_force": tame(None, changes_the_observation_by_force),
    # descriptors and the channel
    "prints_a_gigabyte": wild(None, prints_a_gigabyte),
    "writes_to_descriptor_1": wild(None, lambda seen: print(os.write(1, b"all as declared\n"))),
    "writes_to_descriptor_2": wild(None, lambda seen: print(os.write(2, b"all as declared\n"))),
    "reads_standard_input": wild("EOFError", lambda seen: input()),
    "opens_the_terminal": wild("OSError|FileNotFoundError", lambda seen: Path("/dev/tty").write_text("as declared")),
    "closes_every_descriptor": wild(ENDED, lambda seen: os.closerange(0, 256)),
    "shuts_the_channel": wild(ENDED, shuts_the_channel),
    "sends_garbage": wild(NO_MESSAGE, sends(b"\x80\x04garbage.")),
    "announces_four_gigabytes": wild(
        NO_MESSAGE + ": bad message length", lambda seen: say(struct.pack("!iQ", -1, 2**32))
    ),
    "announces_less_than_nothing": wild(NO_MESSAGE, lambda seen: say(struct.pack("!i", -7))),
    "sends_deep_nesting": wild(NO_MESSAGE, sends(b"[" * 10**6)),
    "sends_a_long_number": wild(NO_MESSAGE, sends(b'{"id": ' + b"9" * 10**5 + b"}")),
    "sends_a_list": wild(NO_MESSAGE + ": not an object", sends(b"[]")),
    "sends_an_object_of_another_class": wild(NO_MESSAGE, sends(b'{"motions": {"@": "Observation"}}')),
    "sends_two_answers": wild(None, sends(b'{"motions": []}')),
    "sends_no_motions": wild(NO_PROPOSAL, answers({"motions": 3})),
    "sends_a_number_for_a_motion": wild(NO_MOTION, answers({"motions": {"a": 1}})),
    "sends_a_motion_of_three_parts": wild(NO_PROPOSAL, answers({"motions": [["a", 1, 2]]})),
    "sends_a_motion_of_half_a_number": wild(NO_MESSAGE, answers(moves("AAAA", "AAAA"))),
    "sends_a_motion_that_is_not_finite": wild(
        NO_MESSAGE + ": a motion needs finite", answers(moves("AAAAAAAA+H8=", "AAAAAAAA+H8AAAAAAAD4fwAAAAAAAPh/"))
    ),
    "sends_a_motion_that_is_too_far": wild(
        TOO_LARGE, answers({"motions": [["a", Motion(np.array([0.0]), np.full((1, 3), 1e308))]]})
    ),
    "sends_a_fault_that_is_no_text": wild(
        "its process does not say what went wrong", answers({"fault": {"no": "text"}})
    ),
    "sends_a_fault_of_a_million_characters": wild("y{300}$", answers({"fault": "y" * 10**6})),
    # other code and other processes
    "patches_the_avoidance_layer": wild(None, patches_the_avoidance_layer),
    "patches_the_claims": wild(None, patches_the_claims),
    "leaves_a_thread_behind": wild(None, lambda seen: threading.Thread(target=forever).start()),
    "leaves_a_child_behind": wild(None, leaves_a_child_behind),
    "empties_the_modules": wild(None, empties_the_modules),
    "traces_and_profiles": wild(None, traces_and_profiles),
    KILLS_OTHERS: wild("PermissionError", lambda seen: os.kill(os.getppid(), signal.SIGCONT)),  # harmless if allowed
}
