"""Writing files whole or not at all, reading untrusted files, temporary folders."""

from __future__ import annotations

import errno
import fcntl
import hashlib
import io
import json
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from airground_drake.base.errors import FolderError, one_line

if TYPE_CHECKING:
    import pandas as pd

_PARTIAL = re.compile(r"\..*\.(?P<pid>\d+)\.[a-z0-9_]+\.partial")
"""Name of a temporary file: the process that writes it is in it."""

_TEMPORARY = "airground_drake."
"""What the names of temporary folders begin with."""

_open: set[str] = set()
"""Temporary files and folders of this process."""


LARGEST_FILE = 256_000_000
"""Bytes of a file that is read: a run of an hour with ten robots has less."""
LARGEST_TEXT = 64_000_000
"""Bytes of a text that is read, JSON among others."""
MOST_CELLS = 50_000_000
"""Rows times columns of a table that is read, and numbers in its lists."""
MOST_UNPACKED = 1_000_000_000
"""Bytes of a table once it is unpacked, and of its texts."""


def open_regular(path: Path) -> BinaryIO:
    """Open a regular file, or a link to one, for reading.

    Raises:
        OSError: if it cannot be opened, or is something else: a pipe may wait for ever, a device may never end.
    """
    if not stat.S_ISREG(os.stat(path).st_mode):  # not opened to find out: opening a device may do something
        raise OSError(errno.EINVAL, "not a regular file", str(path))
    return open(path, "rb")


def open_pipe(path: Path) -> BinaryIO:
    """Open a file for reading, or a pipe such as `<(command)`; a pipe without a writer is empty.

    Raises:
        OSError: if it cannot be opened.
    """
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)  # does not wait for a writer
    os.set_blocking(handle, True)
    return open(handle, "rb")


def read_bytes(path: Path, most: int = LARGEST_FILE) -> bytes:
    """The content of a regular file that may be hostile.

    Raises:
        OSError: as `open_regular`, or if it has more than `most` bytes.
    """
    with open_regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size > most:
            raise OSError(errno.EFBIG, f"it has {size} bytes, allowed: {most}", str(path))
        return file.read(size)


def read_text(path: Path) -> str:
    """The UTF-8 text of a regular file.

    Raises:
        OSError: as `read_bytes`.
        UnicodeDecodeError: if it is no such text.
    """
    return read_bytes(path, LARGEST_TEXT).decode()


def read_table(content: bytes) -> pd.DataFrame:
    """The table in a Parquet file that may be hostile: numbers, texts and lists of numbers.

    Types and sizes that the file declares are checked before it is unpacked. A few bytes may stand for a long text in a
    million rows: texts are counted before they are copied into their rows.

    Raises:
        ValueError: if it cannot be read, has values of other types, or is larger than the limits.
    """
    import pandas as pd
    import pyarrow as pa
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    def is_number(kind: pa.DataType) -> bool:
        of = (pa.types.is_floating, pa.types.is_integer, pa.types.is_boolean, pa.types.is_null)
        return any(each(kind) for each in of)

    try:
        file = pq.ParquetFile(io.BytesIO(content))
        schema, about = file.schema_arrow, file.metadata
        texts = [field.name for field in schema if field.type in (pa.string(), pa.large_string())]
        for field in schema:
            kind = field.type.value_type if pa.types.is_list(field.type) else field.type
            if not (is_number(kind) or field.name in texts):
                raise ValueError(f"column {field.name!r} is of type {field.type}")
        chunks = [about.row_group(i).column(j) for i in range(about.num_row_groups) for j in range(about.num_columns)]
        _within("cells", max(about.num_rows * about.num_columns, sum(c.num_values for c in chunks)), MOST_CELLS)
        _within("bytes", sum(c.total_uncompressed_size for c in chunks), MOST_UNPACKED)
        if texts:
            coded = pq.read_table(io.BytesIO(content), columns=texts, read_dictionary=texts)
            parts = [part for column in coded.columns for part in column.chunks]
            sizes = (pc.sum(pc.binary_length(part.dictionary).take(part.indices)).as_py() or 0 for part in parts)
            _within("bytes of text", sum(sizes), MOST_UNPACKED)
        return pd.read_parquet(io.BytesIO(content))
    except Exception as error:  # pyarrow raises many kinds
        raise ValueError(f"no table that can be used: {error}") from error


def _within(what: str, count: int, most: int) -> None:
    if count > most:
        raise ValueError(f"it has {count} {what}, allowed: {most}")


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file atomically: to a temporary file beside it, on the disk, then rename. Creates parent folders.

    Raises:
        OSError: as the system reports it, with the path; the old file, if any, is then still there.
    """
    try:
        if path.exists() and not path.is_file():  # the system would replace a device, too
            raise OSError(errno.EINVAL, "not a regular file")
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
    """Make renames in a folder outlive a loss of power."""
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
    """A folder that is removed with the block or this process; after a kill, by a later process.

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
    """Remove the temporary folders of this user's killed processes: those that no process holds a lock on."""
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
    """Remove temporary files in and below a folder that killed processes have left."""
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
