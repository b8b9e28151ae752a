"""Limits that a policy's process sets itself before it runs third-party code, as far as the system supports them.

`resource` limits memory and core files (macOS does not enforce the limit of the address space). Landlock (Linux 6.12
and later) forbids signals to processes that this one has not started, access to their memory, new privileges, and
writing to the files of the kernel, such as /proc/PID/oom_score_adj. A filter of system calls (x86-64 and ARM64) forbids
changing the limits, priority and processors of other processes. Other files and the network stay open to the policy.
"""

import contextlib
import ctypes
import os
import platform
import resource
import struct
import sys
from collections.abc import Iterator

from airground_drake.base import interruption

PR_SET_NO_NEW_PRIVS, PR_SET_SECCOMP, SECCOMP_MODE_FILTER = 38, 22, 2
LANDLOCK_CREATE_RULESET, LANDLOCK_ADD_RULE, LANDLOCK_RESTRICT_SELF = 444, 445, 446
LANDLOCK_RULE_PATH_BENEATH, LANDLOCK_WRITE_FILE = 1, 0b10
LANDLOCK_SCOPES = 0b11  # abstract Unix sockets and signals
# `struct landlock_ruleset_attr`: writing to files and the scopes are restricted, no port is.
RULESET = struct.pack("=QQQ", LANDLOCK_WRITE_FILE, 0, LANDLOCK_SCOPES)
KERNEL_FILES = ("proc", "sys")  # folders of / with files of the kernel

# Instructions of the filter (classic BPF): load a word of the call, compare it, decide.
_LOAD, _EQUAL, _AT_LEAST, _RETURN = 0x20, 0x15, 0x35, 0x06
# Where the call's number, architecture and first argument are; arguments have 8 bytes, the low ones first.
_NUMBER, _ARCHITECTURE, _ARGUMENTS = 0, 4, 16
_ALLOW, _FORBID = 0x7FFF0000, 0x00050001  # decisions; a forbidden call fails with EPERM
_X32 = 0x40000000  # calls with larger numbers are of another convention, which nothing needs
SELF = {0: 0}  # allowed values of arguments, by position, so that a call is about the process itself
# Calls that change other processes: what is allowed, and their numbers on x86-64 and on ARM64.
OTHERS: dict[str, tuple[dict[int, int], int, int]] = {
    "setpriority": ({0: 0, 1: 0}, 141, 140),  # PRIO_PROCESS, this one
    "ioprio_set": ({0: 1, 1: 0}, 251, 30),  # IOPRIO_WHO_PROCESS, this one
    "sched_setparam": (SELF, 142, 118),
    "sched_setscheduler": (SELF, 144, 119),
    "sched_setaffinity": (SELF, 203, 122),
    "sched_setattr": (SELF, 314, 274),
    "prlimit64": (SELF, 302, 261),
    "migrate_pages": (SELF, 256, 238),
    "move_pages": (SELF, 279, 239),
}
# By machine: the architecture of its calls, and the column of `OTHERS` with their numbers.
ARCHITECTURES = {"x86_64": (0xC000003E, 1), "aarch64": (0xC00000B7, 2)}


def confine(alive: int, memory: int) -> None:
    """Set all limits. Call this before any import that may start a thread; `memory` in bytes."""
    # alive: descriptor of a pipe's reading end; this process is killed when the pipe has no writer left.
    interruption.end_with_pipe(alive)
    limit_memory(memory)
    restrict_access()
    filter_calls()


def limit_memory(bytes_: int) -> None:
    """Limit the address space, so that larger allocations fail (MemoryError), and write no core files."""
    for kind, most in ((resource.RLIMIT_AS, bytes_), (resource.RLIMIT_CORE, 0)):
        _, hard = resource.getrlimit(kind)
        most = most if hard == resource.RLIM_INFINITY else min(most, hard)
        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(kind, (most, most))


def restrict_access() -> bool:
    """Give up for good the rights to signal processes that this one has not started, and to write to kernel files."""
    # Returns whether the kernel supports it (Landlock, ABI 6).
    if sys.platform != "linux":
        return False
    libc = ctypes.CDLL(None, use_errno=True)
    ruleset = libc.syscall(LANDLOCK_CREATE_RULESET, RULESET, ctypes.c_size_t(len(RULESET)), 0)
    if ruleset < 0:
        return False
    try:
        for name in {*os.listdir("/")} - {*KERNEL_FILES}:
            with contextlib.suppress(OSError):
                handle = os.open(f"/{name}", os.O_PATH)
                rule = struct.pack("=Qi", LANDLOCK_WRITE_FILE, handle)
                libc.syscall(LANDLOCK_ADD_RULE, ruleset, LANDLOCK_RULE_PATH_BENEATH, rule, 0)
                os.close(handle)
        return (
            libc.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 and libc.syscall(LANDLOCK_RESTRICT_SELF, ruleset, 0) == 0
        )
    finally:
        os.close(ruleset)


def filter_calls() -> bool:
    """Give up for good the system calls that change other processes, see `OTHERS`."""
    if sys.platform != "linux" or platform.machine() not in ARCHITECTURES:
        return False
    program = b"".join(struct.pack("=HBBI", *fields) for fields in _instructions(*ARCHITECTURES[platform.machine()]))
    libc, kept = ctypes.CDLL(None, use_errno=True), ctypes.create_string_buffer(program, len(program))
    described = ctypes.create_string_buffer(struct.pack("@HP", len(program) // 8, ctypes.addressof(kept)))
    address = ctypes.c_void_p(ctypes.addressof(described))
    return (
        libc.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0
        and libc.prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, address) == 0
    )


def _instructions(architecture: int, column: int) -> Iterator[tuple[int, int, int, int]]:
    """The filter: code, how many instructions to leave out if a comparison holds and if not, and a constant."""
    yield _LOAD, 0, 0, _ARCHITECTURE
    yield _EQUAL, 1, 0, architecture
    yield _RETURN, 0, 0, _FORBID
    yield _LOAD, 0, 0, _NUMBER
    yield _AT_LEAST, 0, 1, _X32
    yield _RETURN, 0, 0, _FORBID
    for allowed, *numbers in OTHERS.values():
        yield _EQUAL, 0, 3 * len(allowed) + 1, numbers[column - 1]
        for position, value in allowed.items():
            yield _LOAD, 0, 0, _ARGUMENTS + 8 * position
            yield _EQUAL, 1, 0, value
            yield _RETURN, 0, 0, _FORBID
        yield _RETURN, 0, 0, _ALLOW
    yield _RETURN, 0, 0, _ALLOW
