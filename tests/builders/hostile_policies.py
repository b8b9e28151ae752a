"""One policy for each kind of attack on a policy's process, its protocol and the run, with what is to be reported."""

import os
import resource
import signal
import stat
import struct
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np

from airground_drake.model.geometry.motion import Motion
from airground_drake.uav.guest import worker
from airground_drake.uav.policy import Observation, Policy


class Hostile(Policy):
    """Does the kind with this number; -1: the one whose number is that of the refusals; beyond the last: stays."""

    def __init__(self, *, kind: float = -1.0) -> None:
        self.kind = int(kind)

    def propose(self, seen: Observation) -> Any:
        number = seen.refusals if self.kind < 0 else self.kind
        if number >= len(KINDS):
            return Motion(np.array([seen.start]), seen.position[None])
        return [*KINDS.values()][number].does(seen)


class Kind(NamedTuple):
    """Pattern of what is to be reported (None: nothing), and what the policy does in `propose`.

    `hangs`: it takes too long. `tame`: its process can be asked again as if nothing had happened.
    """

    reported: str | None
    does: Callable[[Observation], Any]
    hangs: bool = False
    tame: bool = False


def forever(*_: object) -> NoReturn:
    while True:
        time.sleep(0.01)


def throw(error: BaseException) -> NoReturn:
    raise error


def swallow(seen: Observation) -> None:
    while True:
        try:
            forever()
        except BaseException:
            continue


def fork(parent: Callable[[], object], child: Callable[[], object]) -> None:
    parent() if os.fork() else child()


def out_of_its_session() -> None:
    os.setsid()
    time.sleep(3.0)
    os._exit(0)


def hoard(kept: list[Any]) -> None:
    while True:
        kept.append(np.empty(2**27))  # never touched: address space is what is limited


def words(says: Callable[[], Any]) -> Callable[[Observation], NoReturn]:
    return lambda seen: throw(type("WordyError", (Exception,), {"__str__": lambda self: says()})())


class Nameless(type):
    @property
    def __name__(cls) -> str:  # type: ignore[override]
        raise ValueError


class Endless(Mapping[str, Motion]):
    def __getitem__(self, name: str) -> Motion:
        return tampered()

    def __iter__(self) -> Iterator[str]:
        while True:
            yield "a" * 10**6

    def __len__(self) -> int:
        return -1


def tampered(**changes: Any) -> Motion:
    """A motion with other attributes than it was made with."""
    found = Motion(np.zeros(1), np.zeros((1, 3)))
    for name, value in changes.items():
        object.__setattr__(found, name, value)
    return found


def change_by_force(seen: Observation) -> None:
    object.__setattr__(seen, "robot", "ghost")
    object.__setattr__(seen.preset, "positions", np.zeros((2, 3)))


def channels() -> list[int]:
    opened = [int(each.name) for each in Path("/proc/self/fd").iterdir() if each.exists()]
    return [each for each in opened if stat.S_ISSOCK(os.fstat(each).st_mode)]


def say(data: bytes) -> None:
    for handle in channels():
        os.write(handle, data)


def send(message: bytes) -> Callable[[Observation], None]:
    return lambda seen: say(struct.pack("!i", len(message)) + message)


def drip(seen: Observation) -> None:
    say(struct.pack("!i", 1000))
    while True:
        time.sleep(0.01)
        say(b" ")


def answer(message: object) -> Callable[[Observation], None]:
    return lambda seen: setattr(worker, "answer", lambda policy, data: message)


def moves(times: str, positions: str) -> dict[str, Any]:
    arrays = {"times": (times, [-1]), "positions": (positions, [-1, 3])}
    packed = {name: {"@": "array", "base64": text, "shape": shape} for name, (text, shape) in arrays.items()}
    return {"motions": [["a", {"@": "Motion", **packed}]]}


def print_a_gigabyte(seen: Observation) -> None:
    for _ in range(10):
        sys.stdout.buffer.write(b"x" * 10**8)


def patch(module: str, kind: str, method: str) -> Callable[[Observation], None]:
    return lambda seen: setattr(getattr(import_module(f"airground_drake.{module}"), kind), method, lambda *_: None)


ENDED = r"its process ended or closed its channel \("
NO_MESSAGE = "its process sent no message"
NO_WORDS = "an exception that cannot be put into words"

wild, tame = Kind, partial(Kind, tame=True)
late = partial(Kind, "OutOfTime: not done after", hangs=True)

TO_PARENT: dict[str, Callable[[int], object]] = {
    "signals_its_parent": lambda pid: os.kill(pid, signal.SIGCONT),
    "takes_limits_from_its_parent": lambda pid: resource.prlimit(pid, resource.RLIMIT_CORE, (0, 0)),
    "changes_the_priority_of_its_parent": lambda pid: os.setpriority(os.PRIO_PROCESS, pid, 0),
    "changes_the_priority_of_all_processes": lambda pid: os.setpriority(os.PRIO_USER, os.getuid(), 0),
    "takes_processors_from_its_parent": lambda pid: os.sched_setaffinity(pid, os.sched_getaffinity(pid)),
    "gives_its_parent_away_when_memory_is_short": lambda pid: Path(f"/proc/{pid}/oom_score_adj").write_text("0"),
}
"""What a policy may not do to the process that has started it, where the system can keep it from that; all of it is
harmless if it works."""

KINDS: dict[str, Kind] = {
    # ends
    "sys_exit_0": tame("SystemExit: 0", lambda seen: sys.exit(0)),
    "os_exit_0": wild(ENDED + r"exit code 0\)", lambda seen: os._exit(0)),
    "kills_its_group": wild(ENDED + "signal 9", lambda seen: forever(os.killpg(0, signal.SIGKILL))),
    # hangs
    "becomes_another_program": late(lambda seen: os.execv("/bin/sleep", ["sleep", "1000"])),
    "loops_and_swallows_everything": late(swallow),
    "never_returns_to_the_interpreter": late(lambda seen: pow(7, 10**9)),
    "stops_itself": late(lambda seen: forever(os.kill(os.getpid(), signal.SIGSTOP))),
    "forks_and_leaves_the_child_to_hang": late(lambda seen: fork(lambda: os._exit(0), forever)),
    "forks_out_of_its_session": late(lambda seen: fork(forever, out_of_its_session)),
    "sends_its_answer_byte_by_byte": late(drip),
    # raises
    "raises": tame("RuntimeError: no plan", lambda seen: throw(RuntimeError("no plan"))),
    "raises_keyboard_interrupt": tame("KeyboardInterrupt", lambda seen: throw(KeyboardInterrupt())),
    "text_raises": tame(NO_WORDS, words(lambda: 1 / 0)),
    "text_sleeps": late(words(forever), tame=True),
    "text_holds_lone_surrogates": tame(r"WordyError: \\ud800\\udfff", words(lambda: "\ud800" + "\udfff")),
    "text_is_long": tame("WordyError: x{200}", words(lambda: "x" * 10**8)),
    "text_is_for_a_terminal": tame(r"WordyError: \\x1b\[2J\\nerror\\u202e", words(lambda: "\x1b[2J\nerror\u202e")),
    "class_has_no_name": tame(NO_WORDS, lambda seen: throw(Nameless("Nothing", (Exception,), {})("?"))),
    # proposes nonsense
    "returns_text": tame("TypeError: a policy proposes a Motion, .* not str", lambda seen: "left"),
    "returns_none_for_a_ugv": tame("TypeError: .* not NoneType for ", lambda seen: {seen.robot: None}),
    "returns_a_huge_motion": tame(
        "ValueError: a proposal of [0-9]+ bytes", lambda seen: Motion(np.arange(1e6), np.zeros((10**6, 3)))
    ),
    "takes_memory_bit_by_bit": tame("MemoryError", lambda seen: hoard([])),
    "changes_a_motion_after_it_was_checked": tame(
        "ValueError: a motion needs finite", lambda seen: tampered(positions=np.full((1, 3), np.nan))
    ),
    "array_ends_the_process": tame(
        ENDED + r"exit code 0\)",
        lambda seen: tampered(positions=type("Evil", (), {"__array__": lambda *_, **__: os._exit(0)})()),
    ),
    "returns_an_endless_mapping": tame("ValueError|MemoryError|OutOfTime", lambda seen: Endless(), hangs=True),
    "names_a_surrogate": tame(r"ValueError: .*\\ud800", lambda seen: {"\ud800": tampered()}),
    # abuses what it was given
    "writes_to_the_target": tame("destination is read-only", lambda seen: seen.target.__setitem__(0, 0.0)),
    "changes_the_observation_by_force": tame(None, change_by_force),
    # abuses descriptors and the channel
    "prints_a_gigabyte": wild(None, print_a_gigabyte),
    "opens_the_terminal": wild("OSError|FileNotFoundError", lambda seen: Path("/dev/tty").write_text("as declared")),
    "closes_every_descriptor": wild(ENDED, lambda seen: os.closerange(0, 256)),
    "sends_garbage": wild(NO_MESSAGE, send(b"\x80\x04garbage.")),
    "announces_four_gigabytes": wild(
        NO_MESSAGE + ": bad message length", lambda seen: say(struct.pack("!iQ", -1, 2**32))
    ),
    "sends_deep_nesting": wild(NO_MESSAGE, send(b"[" * 10**6)),
    "sends_a_list": wild(NO_MESSAGE + ": not an object", send(b"[]")),
    "sends_an_object_of_another_class": wild(NO_MESSAGE, send(b'{"motions": {"@": "Observation"}}')),
    "sends_two_answers": wild(None, send(b'{"motions": []}')),
    "sends_no_motions": wild("its process sent no proposal", answer({"motions": 3})),
    "sends_a_motion_of_half_a_number": wild(NO_MESSAGE, answer(moves("AAAA", "AAAA"))),
    "sends_a_motion_that_is_not_finite": wild(
        NO_MESSAGE + ": a motion needs finite", answer(moves("AAAAAAAA+H8=", "AAAAAAAA+H8AAAAAAAD4fwAAAAAAAPh/"))
    ),
    "sends_a_motion_that_is_too_far": wild(
        "ValueError: .* at most 1e[+]09", answer({"motions": [["a", Motion(np.zeros(1), np.full((1, 3), 1e308))]]})
    ),
    "sends_a_fault_that_is_no_text": wild("its process does not say what went", answer({"fault": {"no": "text"}})),
    "sends_a_fault_of_a_million_characters": wild("y{300}$", answer({"fault": "y" * 10**6})),
    # changes other code, outlives its process, attacks another one
    "patches_the_claims": wild(None, patch("verify.claim", "TraceClaim", "judge")),
    "leaves_a_child_behind": wild(None, lambda seen: fork(lambda: None, forever)),
    **{name: wild("PermissionError", lambda seen, does=does: does(os.getppid())) for name, does in TO_PARENT.items()},
}


class CountedRaises(Policy):
    @property
    def counted(self) -> bool:  # type: ignore[override]
        raise RuntimeError("not counted")

    def propose(self, seen: Observation) -> None:
        """Nothing."""
