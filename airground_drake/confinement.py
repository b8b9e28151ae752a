"""What a child process gives up before it runs code of others, as far as the system has it.

Memory and core files are limited by `resource` (POSIX; macOS does not enforce the limit of the address space). By
Landlock (Linux 6.12 and later) the process can neither send a signal to a process that it has not started, nor look
into its memory, nor gain privileges. Nothing here keeps it from files or the network.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import struct
import sys

PR_SET_NO_NEW_PRIVS = 38
LANDLOCK_CREATE_RULESET, LANDLOCK_RESTRICT_SELF = 444, 446
LANDLOCK_SCOPES = 0b11
"""Abstract Unix sockets and signals."""
RULESET = struct.pack("=QQQ", 0, 0, LANDLOCK_SCOPES)
"""`struct landlock_ruleset_attr`: no file and no port is restricted, the scopes are."""


def limit_memory(bytes_: int) -> None:
    """Let allocations beyond so many bytes of address space fail (MemoryError), and write no core files."""
    try:
        import resource
    except ImportError:
        return
    for kind, most in ((resource.RLIMIT_AS, bytes_), (resource.RLIMIT_CORE, 0)):
        _, hard = resource.getrlimit(kind)
        most = most if hard == resource.RLIM_INFINITY else min(most, hard)
        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(kind, (most, most))


def restrict_signals() -> bool:
    """Give up signals to, and the memory of, processes that this one has not started, for good.

    Returns:
        Whether the kernel has it (Landlock, ABI 6).
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
