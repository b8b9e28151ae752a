"""Messages between a run and a policy's process: strict JSON behind its length, over a socket."""

from __future__ import annotations

import json
import socket
import struct
import time
from typing import Any

LONGEST = 4 * 2**20
"""A policy's answer has at most so many bytes: some 90,000 vertices."""
_LENGTH = struct.Struct("!I")


class FrameError(Exception):
    """Something that is no message."""


def send(channel: socket.socket, message: object, limit_s: float | None = None) -> None:
    """Send a message.

    Raises:
        OSError: if the other side is gone, or has not read it all after so many seconds (TimeoutError).
    """
    data = json.dumps(message, separators=(",", ":")).encode("ascii")
    channel.settimeout(limit_s)
    channel.sendall(_LENGTH.pack(len(data)) + data)


def receive(channel: socket.socket, limit_s: float | None = None, longest: int | None = None) -> dict[str, Any]:
    """The next message.

    Args:
        channel: to read from.
        limit_s: time for all of it, s; None: no limit.
        longest: its bytes at most; more are not read, let alone kept; None: no limit.

    Raises:
        EOFError: if the other side has closed the channel.
        OSError: if the time is over (TimeoutError), or the channel cannot be read.
        FrameError: if it is no JSON object, or too long.
    """
    end = None if limit_s is None else time.monotonic() + limit_s
    (length,) = _LENGTH.unpack(_read(channel, _LENGTH.size, end))
    if longest is not None and length > longest:
        raise FrameError(f"{length} bytes where at most {longest} are allowed")
    try:
        message = json.loads(_read(channel, length, end))
    except (ValueError, RecursionError):
        raise FrameError("not JSON") from None
    if not isinstance(message, dict):
        raise FrameError("not an object")
    return message


def _read(channel: socket.socket, count: int, end: float | None) -> bytes:
    """So many bytes; to be read by the time `end` of the monotonic clock."""
    found = bytearray()
    while len(found) < count:
        left = None if end is None else end - time.monotonic()
        if left is not None and left <= 0.0:
            raise TimeoutError
        channel.settimeout(left)
        part = channel.recv(min(count - len(found), 2**20))
        if not part:
            raise EOFError
        found += part
    return bytes(found)
