"""Writing files whole or not at all; reading what somebody else may have made; temporary folders."""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from airground_drake.errors import FolderError, one_line

_PARTIAL = re.compile(r"\..*\.(?P<pid>\d+)\.[a-z0-9_]+\.partial")
"""Name of a temporary file: the process that writes it is in it."""

_TEMPORARY = "airground_drake."
"""What the names of temporary folders begin with."""

_open: set[str] = set()
"""Temporary files and folders of this process."""


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file atomically: to a temporary file beside it, on the disk, then rename. Creates parent folders.

    Raises:
        OSError: as the system reports it, with the path; the old file, if any, is then still there.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.{os.getpid()}.", suffix=".partial")
        _open.add(name)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            os.chmod(name, 0o644)
            os.replace(name, path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
        finally:
            _open.discard(name)
        _sync(path.parent)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error


def _sync(folder: Path) -> None:
    """See to it that what was renamed in a folder outlives a loss of power."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def discard_partial() -> None:
    """Remove the temporary files and folders of this process, because it ends at once."""
    for name in tuple(_open):
        if os.path.isdir(name):
            shutil.rmtree(name, ignore_errors=True)
        else:
            Path(name).unlink(missing_ok=True)


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """A folder that is removed in the end, also where this process ends at once; if it is killed, by a later one.

    Raises:
        OSError: if it cannot be made.
    """
    sweep_temporary()
    made = Path(tempfile.mkdtemp(prefix=f".{_TEMPORARY}"))
    folder = made.with_name(made.name[1:])
    _open.update((str(made), str(folder)))
    lock = os.open(made, os.O_RDONLY)
    try:
        with suppress(OSError):  # a file system without such locks: no process will remove it
            fcntl.flock(lock, fcntl.LOCK_EX)
        made.rename(folder)  # `sweep_temporary` does not see it before it is locked
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        _open.difference_update((str(made), str(folder)))
        os.close(lock)


def sweep_temporary() -> None:
    """Remove the temporary folders of this user's processes that were killed: nobody holds a lock on them any more."""
    for path in Path(tempfile.gettempdir()).glob(f"{_TEMPORARY}*"):
        with suppress(OSError):
            lock = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if os.fstat(lock).st_uid == os.geteuid():
                    shutil.rmtree(path, ignore_errors=True)
            finally:
                os.close(lock)


def is_partial(path: Path) -> bool:
    """Whether a path is a temporary file of `write_bytes`, by its name."""
    return _PARTIAL.fullmatch(path.name) is not None


def try_to_write(folder: Path) -> None:
    """Write a file to a folder and remove it.

    Raises:
        OSError: as `write_bytes`.
    """
    probe = folder / f".{os.getpid()}.probe"
    write_bytes(probe, b"\n")
    probe.unlink()


@contextmanager
def wanted(path: Path, what: str) -> Iterator[None]:
    """While something is written to a path; `what` is wanted there.

    Raises:
        FolderError: if the system refuses; says where, why, and what is wanted.
    """
    try:
        yield
    except OSError as error:
        why = f"{error.filename or path} cannot be written: {error.strerror or error}"
        raise FolderError(one_line(f"{why}; wanted: {what}")) from None


def make_folder(folder: Path, what: str) -> None:
    """Create a folder for `what` if need be, and try to write to it.

    Raises:
        FolderError: if it cannot be created or written.
    """
    with wanted(folder, f"a folder for {what}"):
        folder.mkdir(parents=True, exist_ok=True)
        try_to_write(folder)


def try_to_create(path: Path) -> None:
    """Write a file that is not there yet, and remove it; its folder is created.

    Raises:
        FolderError: if it is there, or cannot be written.
    """
    if os.path.lexists(path):
        raise FolderError(one_line(f"{path} exists; name a file that does not"))
    with wanted(path, "a file that can be written"):
        write_bytes(path, b"")
        path.unlink()


def sweep(folder: Path) -> None:
    """Remove the temporary files in a folder, and below, of processes that were killed while they wrote."""
    for path in folder.rglob(".*.partial"):
        found = _PARTIAL.fullmatch(path.name)
        if found and not _runs(int(found["pid"])):
            path.unlink(missing_ok=True)


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        pass
    return pid > 0


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text atomically."""
    write_bytes(path, text.encode())


def write_json(path: Path, value: Any) -> None:
    """Write strict JSON (no NaN or infinity) atomically.

    Raises:
        ValueError: if the value holds a number that is not finite.
    """
    write_text(path, json.dumps(value, indent=1, allow_nan=False, ensure_ascii=False) + "\n")


def sha256(data: bytes) -> str:
    """Hexadecimal SHA-256 of the data."""
    return hashlib.sha256(data).hexdigest()
