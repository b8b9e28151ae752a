"""The folder of a report: a check before the work that it may be written, and removal of an old report.

Files of a report are recognised by their paths. Other files are never removed, and are only allowed beside a report.
"""

import fcntl
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from airground_drake.base import files
from airground_drake.base.errors import FolderError

# The formats of a report, and the file of each.
PAGES = {"html": "report.html", "json": "report.json", "junit": "junit.xml"}
RULE = "it must be new, empty, or hold an earlier report, which is replaced"

_FILES = re.compile(
    r"report\.html|report\.json|junit\.xml|diagram\.dot|diagram\.svg"
    r"|trace/\w+/(\w+\.parquet|timings\.json|meta\.json)|proofs/(proofs\.json|run_\w+\.v)"
    r"|map/[^/]+\.(ya?ml|p[bgp]m|png|bmp)"
)
_FOLDERS = re.compile(r"trace(/\w+)?|proofs|map")
_OURS = re.compile(rb'\s*\{\s*"schema":\s*"airground_drake\.report/')


@contextmanager
def held(folder: Path) -> Iterator[None]:
    """Prepare the folder, and keep other reports out of it by a lock that ends with this process."""
    with files.wanted(folder, "a folder for the report"):
        folder.mkdir(parents=True, exist_ok=True)
        handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise FolderError(f"{folder} is in use by another report; name another folder") from None
        except OSError:  # a file system without locks
            pass
        prepare(folder)
        yield
    finally:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_UN)  # a process forked meanwhile may still hold the handle
        os.close(handle)


def prepare(folder: Path) -> None:
    with files.wanted(folder, "a folder for the report"):
        folder.mkdir(parents=True, exist_ok=True)
        if why := _refused(folder):
            raise FolderError(f"{folder} holds {why}; {RULE}")
        files.sweep(folder)
        for part in (folder, *_parts(folder)):
            files.try_to_write(part)


def clear(folder: Path) -> None:
    """Remove an earlier report: the pages first, so that none is ever beside other traces."""
    for name in PAGES.values():
        (folder / name).unlink(missing_ok=True)
    for path in list(_within(folder)):
        if not path.is_dir() and _FILES.fullmatch(path.relative_to(folder).as_posix()):
            path.unlink()
    for path in reversed(_parts(folder)):
        if not any(path.iterdir()):
            path.rmdir()


def of_map(name: str) -> str:
    """The path in a report of a file of a map, from its name; a name with another ending gets `.pgm`."""
    path = f"map/{Path(name).name}"  # the name may come from a stranger
    return path if _FILES.fullmatch(path) else f"{path}.pgm"


def is_report(folder: Path) -> bool:
    try:
        with open(files.open_regular(folder / PAGES["json"]), "rb") as file:
            # Files of the kernel have size 0, and reading may block.
            beginning = min(100, os.fstat(file.fileno()).st_size)
            return _OURS.match(file.read(beginning)) is not None
    except OSError:
        return False


def _refused(folder: Path) -> str:
    """Why no report can be written to the folder; '' if one can."""
    ours = is_report(folder)
    for path in _within(folder):
        name = path.relative_to(folder).as_posix()
        is_folder = path.is_dir()
        if (_FOLDERS if is_folder else _FILES).fullmatch(name) and not (is_folder and path.is_symlink()):
            continue
        if _FILES.fullmatch(name) or _FOLDERS.fullmatch(name):
            return f"{name!r}, which is in the way"
        if not (ours or files.is_partial(path)):
            return f"{name!r} and no report"
    return ""


def _within(folder: Path) -> Iterator[Path]:
    """The entries of the folder, and of the folders in it that a report has; each folder before its entries."""
    for path in sorted(folder.iterdir()):
        yield path
        if path.is_dir() and _FOLDERS.fullmatch(path.name):
            yield from sorted(path.rglob("*"))


def _parts(folder: Path) -> list[Path]:
    """The folders of a report in the folder, each before those in it."""
    return [path for path in _within(folder) if path.is_dir() and _FOLDERS.fullmatch(str(path.relative_to(folder)))]
