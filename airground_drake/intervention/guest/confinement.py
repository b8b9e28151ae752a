"""Limits that a policy's process sets itself before it runs third-party code, as far as the system supports them.

`resource` limits memory and core files (macOS does not enforce the limit of the address space). Landlock (Linux 6.12
and later) forbids three things: signals to processes that this one has not started, access to their memory, and new
privileges. Files and the network stay open to the policy.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import resource
import struct
import sys

from airground_drake.base import interruption

PR_SET_NO_NEW_PRIVS = 38
LANDLOCK_CREATE_RULESET, LANDLOCK_RESTRICT_SELF = 444, 446
LANDLOCK_SCOPES = 0b11
"""Abstract Unix sockets and signals."""
RULESET = struct.pack("=QQQ", 0, 0, LANDLOCK_SCOPES)
"""`struct landlock_ruleset_attr`: no file and no port is restricted, the scopes are."""


def confine(alive: int, memory: int) -> None:
    """Set all limits. Call this before any import that may start a thread.

    Args:
        alive: descriptor of a pipe's reading end; this process is killed when the pipe has no writer left.
        memory: limit of the address space, bytes.
    """
    interruption.end_with_pipe(alive)
    limit_memory(memory)
    restrict_signals()


def limit_memory(bytes_: int) -> None:
    """Limit the address space, so that larger allocations fail (MemoryError), and write no core files."""
    for kind, most in ((resource.RLIMIT_AS, bytes_), (resource.RLIMIT_CORE, 0)):
        _, hard = resource.getrlimit(kind)
        most = most if hard == resource.RLIM_INFINITY else min(most, hard)
        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(kind, (most, most))


def restrict_signals() -> bool:
    """Give up for good the right to signal processes that this one has not started, and to access their memory.

    Returns:
        Whether the kernel supports it (Landlock, ABI 6).
    """
    if sys.platform != "linux":
        return False
    libc = ctypes.CDLL(None, use_errno=True)
    ruleset = libc.syscall(LANDLOCK_CREATE_RULESET, RULESET, ctypes.c_size_t(len(RULESET)), 0)
    if ruleset < 0:
        return False
    try:
        return (
            libc.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 and libc.syscall(LANDLOCK_RESTRICT_SELF, ruleset, 0) == 0
        )
    finally:
        os.close(ruleset)
