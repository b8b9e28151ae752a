"""Writing files whole or not at all, reading untrusted files, temporary folders."""

from __future__ import annotations

import errno
import fcntl
import hashlib
import io
import json
import math
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from airground_drake.base.errors import FolderError

if TYPE_CHECKING:
    import pandas as pd

# Name of a temporary file, with the process that writes it.
_PARTIAL = re.compile(r"\..*\.(?P<pid>\d+)\.[a-z0-9_]+\.partial")

_TEMPORARY = "airground_drake."  # prefix of the names of temporary folders

_open: set[str] = set()  # temporary files and folders of this process


LARGEST_FILE = 256_000_000  # most bytes of a file that is read: a run of an hour with ten robots has fewer
LARGEST_TEXT = 64_000_000  # most bytes of a text that is read, such as JSON
MOST_CELLS = 50_000_000  # most cells of a table that is read, or numbers in its lists
MOST_UNPACKED = 1_000_000_000  # most bytes of an unpacked table, or of its texts


def open_regular(path: Path, flags: int = os.O_RDONLY, *, links: bool = False) -> int:
    """Open a regular file of a possibly hostile folder, without following links or blocking."""
    # links: whether the path may be a link to a regular file: for paths that the user names.
    with suppress(FileNotFoundError):  # the flags may create it
        # checked before opening, because opening a device may have effects
        _be_regular(os.stat(path, follow_symlinks=links), path)
    handle = os.open(path, flags | os.O_NONBLOCK | (0 if links else os.O_NOFOLLOW), 0o644)
    try:
        _be_regular(os.fstat(handle), path)
    except OSError:
        os.close(handle)
        raise
    return handle


def _be_regular(about: os.stat_result, path: Path) -> None:
    if not stat.S_ISREG(about.st_mode):
        what = "a link, not a regular file" if stat.S_ISLNK(about.st_mode) else "not a regular file"
        raise OSError(errno.EINVAL, what, str(path))


def refuse_links(folder: Path) -> None:
    """Refuse a possibly hostile folder that contains links to folders."""
    # For a report or saved run, before its files are opened; `open_regular` itself follows no link to a file.
    for path in chain(folder.glob("*"), folder.glob("*/*")):
        if path.is_symlink() and path.is_dir():
            raise FolderError(f"{path} is a link; wanted: a folder")


def open_pipe(path: Path) -> BinaryIO:
    """Open a file for reading, or a pipe such as `<(command)`; a pipe without a writer is empty."""
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)  # does not wait for a writer
    os.set_blocking(handle, True)
    return open(handle, "rb")


def read_bytes(path: Path, most: int = LARGEST_FILE, *, links: bool = False) -> bytes:
    """The content of a possibly hostile regular file; `links` as in `open_regular`."""
    with open(open_regular(path, links=links), "rb") as file:
        size = os.fstat(file.fileno()).st_size
        if size > most:
            raise OSError(errno.EFBIG, f"it has {size} bytes, allowed: {most}", str(path))
        return file.read(size)


def read_text(path: Path) -> str:
    """The UTF-8 text of a regular file."""
    return read_bytes(path, LARGEST_TEXT).decode()


def read_table(content: bytes, left_out: dict[str, str] | None = None) -> pd.DataFrame:
    """The table in a Parquet file that may be hostile: numbers, texts and lists of numbers."""
    # left_out: for a file of another program; gets columns that are not read, with their types. Times are read there,
    # too, and no lists; parts of structures are columns, and so is an index that was kept.
    #
    # The declared types and sizes are checked before the file is unpacked. A few bytes may stand for a long text in a
    # million rows, so texts are counted before they are copied into their rows.
    import pandas as pd
    import pyarrow as pa
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    types, is_ours = pa.types, left_out is None
    numbers = [types.is_floating, types.is_integer, types.is_boolean, types.is_null]
    numbers += [] if is_ours else [types.is_decimal, types.is_timestamp, types.is_duration]

    def columns(fields: Iterable[Any], above: str = "") -> Iterator[tuple[str, Any]]:
        for field in fields:
            name, kind = f"{above}{field.name}", field.type
            kind = kind.value_type if types.is_dictionary(kind) and not is_ours else kind
            yield from columns(kind, f"{name}.") if types.is_struct(kind) and not is_ours else [(name, kind)]

    def read(names: list[str], coded: Sequence[str] = ()) -> Any:
        table = pq.ParquetFile(io.BytesIO(content), read_dictionary=coded).read(columns=names)
        while any(map(types.is_struct, table.schema.types)):
            table = table.flatten()
        return table.select(names)

    try:
        file = pq.ParquetFile(io.BytesIO(content))
        about, kinds = file.metadata, dict(columns(file.schema_arrow))
        texts = [name for name, kind in kinds.items() if kind in (pa.string(), pa.large_string(), pa.string_view())]
        for name, kind in [*kinds.items()]:
            plain = kind.value_type if types.is_list(kind) and is_ours else kind
            if name in texts or any(is_kind(plain) for is_kind in numbers):
                continue
            if left_out is None:
                raise ValueError(f"column {name!r} is of type {kind}")
            left_out[name] = str(kinds.pop(name))
        outer = {name.split(".")[0] for name in kinds}
        chunks = [about.row_group(i).column(j) for i in range(about.num_row_groups) for j in range(about.num_columns)]
        chunks = [chunk for chunk in chunks if chunk.path_in_schema.split(".")[0] in outer]
        _within("cells", max(about.num_rows * len(kinds), sum(c.num_values for c in chunks)), MOST_CELLS)
        _within("bytes", sum(c.total_uncompressed_size for c in chunks), MOST_UNPACKED)
        parts = [part for column in read(texts, texts).columns for part in column.chunks] if texts else []
        sizes = (pc.sum(pc.binary_length(part.dictionary).take(part.indices)).as_py() or 0 for part in parts)
        _within("bytes of text", sum(sizes), MOST_UNPACKED)
        if is_ours:
            return pd.read_parquet(io.BytesIO(content))
        return read([*kinds]).to_pandas(ignore_metadata=True, integer_object_nulls=True)
    except Exception as error:  # pyarrow raises many kinds
        raise ValueError(f"no table that can be used: {error}") from error


def _within(what: str, count: int, most: int) -> None:
    if count > most:
        raise ValueError(f"it has {count} {what}, allowed: {most}")


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file atomically: a temporary file beside it is synced to the disk, then renamed."""
    # Creates parent folders.
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
    """Sync a folder, so that renames in it survive a loss of power."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def discard_partial() -> None:
    """Remove the temporary files and folders of this process before it exits."""
    for name in tuple(_open):
        if os.path.isdir(name):
            shutil.rmtree(name, ignore_errors=True)
        else:
            Path(name).unlink(missing_ok=True)


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """A temporary folder, removed at the end of the block or process; after a kill, by a later process."""
    sweep_temporary()
    made = Path(tempfile.mkdtemp(prefix=f".{_TEMPORARY}"))
    folder = made.with_name(made.name[1:])
    _open.update((str(made), str(folder)))
    lock = os.open(made, os.O_RDONLY)
    try:
        with suppress(OSError):  # a file system without such locks: no process removes it
            fcntl.flock(lock, fcntl.LOCK_EX)
        made.rename(folder)  # `sweep_temporary` does not see it before it is locked
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        _open.difference_update((str(made), str(folder)))
        os.close(lock)


def sweep_temporary() -> None:
    """Remove this user's temporary folders that no process has locked: their processes were killed."""
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
    """Check that a folder is writable, by writing and removing a file; OSError like `write_bytes`."""
    probe = folder / f".{os.getpid()}.probe"
    write_bytes(probe, b"\n")
    probe.unlink()


@contextmanager
def wanted(path: Path, what: str) -> Iterator[None]:
    """Convert an OSError of the block, which writes `what` to a path, into a FolderError."""
    try:
        yield
    except OSError as error:
        why = f"{error.filename or path} cannot be written: {error.strerror or error}"
        raise FolderError(f"{why}; wanted: {what}") from None


def make_folder(folder: Path, what: str) -> None:
    """Create a folder for `what` if needed, and check that it is writable; FolderError if not."""
    with wanted(folder, f"a folder for {what}"):
        folder.mkdir(parents=True, exist_ok=True)
        try_to_write(folder)


def try_to_create(path: Path) -> None:
    """Check that a new file can be written, creating its folder; FolderError if it exists or cannot be written."""
    if os.path.lexists(path):
        raise FolderError(f"{path} exists; name a file that does not")
    with wanted(path, "a file that can be written"):
        write_bytes(path, b"")
        path.unlink()


def sweep(folder: Path) -> None:
    """Remove temporary files that killed processes left in or below a folder."""
    for path in folder.rglob(".*.partial"):
        if partial := _PARTIAL.fullmatch(path.name):
            try:
                os.kill(int(partial["pid"]), 0)
            except (ProcessLookupError, OverflowError):
                path.unlink(missing_ok=True)
            except PermissionError:  # it runs, for another user
                pass


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text atomically; surrogates of paths that are not UTF-8 are escaped, also in JSON."""
    write_bytes(path, text.encode(errors="backslashreplace"))


def write_json(path: Path, value: Any) -> None:
    """Write strict JSON atomically; ValueError for NaN or infinity."""
    write_text(path, json.dumps(value, indent=1, allow_nan=False, ensure_ascii=False) + "\n")


def strict(value: Any, of_others: Callable[[float], Any] = lambda _: None) -> Any:
    """Plain JSON types: numpy values unwrapped, tuples as lists, non-finite numbers as None."""
    # of_others: the replacement of non-finite numbers.
    if isinstance(value, Mapping):
        return {str(key): strict(item, of_others) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [strict(item, of_others) for item in value]
    if hasattr(value, "tolist"):
        return strict(value.tolist(), of_others)
    if isinstance(value, float) and not math.isfinite(value):
        return of_others(value)
    return value if value is None or isinstance(value, str | int | float) else str(value)


def sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
