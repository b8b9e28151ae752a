"""The folder of a report: whose it is, and whether it can be written, asked before the work; what is of an old report.

What belongs to a report is told by its path. Nothing else is ever removed, and nothing else may be there unless a
report of ours is there, too.
"""

from __future__ import annotations

import fcntl
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from airground_drake.base import files
from airground_drake.base.errors import FolderError, one_line

PAGES = {"html": "report.html", "json": "report.json", "junit": "junit.xml"}
"""The formats of a report, and the file of each."""
RULE = "allowed: a folder that is new or empty, has a report.json of ours, or nothing but files of a report"

_CLAIM = r"[A-Z][A-Z0-9-]*"
_FILES = re.compile(
    r"report\.html|report\.json|junit\.xml|diagram\.dot|diagram\.svg"
    r"|trace/\w+/(\w+\.parquet|timings\.json|meta\.json)"
    rf"|certificates/{_CLAIM}/\w[\w.-]*|proofs/(proofs\.json|run_\w+\.v|index\.json|{_CLAIM}/\w[\w.-]*)"
)
_FOLDERS = re.compile(rf"trace(/\w+)?|(certificates|proofs)(/{_CLAIM})?")
_OURS = re.compile(rb'\s*\{\s*"schema":\s*"airground_drake\.report/')


@contextmanager
def held(folder: Path) -> Iterator[None]:
    """Prepare the folder, and keep other reports out of it; no file says so, and it ends with this process.

    Raises:
        FolderError: as `prepare`, and if another report is being written to it.
    """
    with files.wanted(folder, "a folder for the report"):
        folder.mkdir(parents=True, exist_ok=True)
        handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise FolderError(one_line(f"{folder} is in use by another report; name another folder")) from None
        except OSError:  # the file system has no such locks
            pass
        prepare(folder)
        yield
    finally:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_UN)  # also where a process that was forked meanwhile still lives
        os.close(handle)


def prepare(folder: Path) -> None:
    """Create the folder if need be, look whose it is, try to write to it, and sweep what killed runs have left in it.

    Raises:
        FolderError: if it holds something that is no report, or cannot be created or written.
    """
    with files.wanted(folder, "a folder for the report"):
        folder.mkdir(parents=True, exist_ok=True)
        if why := _refused(folder):
            raise FolderError(one_line(why))
        files.sweep(folder)
        for each in (folder, *_parts(folder)):
            files.try_to_write(each)


def clear(folder: Path) -> None:
    """Remove what is of an earlier report: pages of all formats first, then traces, certificates and what came later.

    Raises:
        OSError: if something cannot be removed.
    """
    for name in PAGES.values():
        (folder / name).unlink(missing_ok=True)
    for path in list(_within(folder)):
        if not path.is_dir() and _FILES.fullmatch(path.relative_to(folder).as_posix()):
            path.unlink()
    for path in reversed(_parts(folder)):
        if not any(path.iterdir()):
            path.rmdir()


def is_report(folder: Path) -> bool:
    """Whether there is a report.json of ours in a folder."""
    try:
        with files.open_regular(folder / PAGES["json"]) as file:
            beginning = min(100, os.fstat(file.fileno()).st_size)  # a file of the kernel's has none, and may wait
            return _OURS.match(file.read(beginning)) is not None
    except OSError:
        return False


def _refused(folder: Path) -> str:
    """Why the folder may not be written to; '' if it may."""
    ours = is_report(folder)
    for path in _within(folder):
        name = path.relative_to(folder).as_posix()
        if _blocks(path, name):
            return f"{folder} holds {name!r}, which is in the way; {RULE}"
        if not (ours or _belongs(name) or files.is_partial(path)):
            return f"{folder} holds {name!r} and no report; {RULE}"
    return ""


def _within(folder: Path) -> Iterator[Path]:
    """What is in the folder, each folder before what is in it; of folders in it only those that a report has."""
    for path in sorted(folder.iterdir()):
        yield path
        if path.is_dir() and _FOLDERS.fullmatch(path.name):
            yield from sorted(path.rglob("*"))


def _belongs(name: str) -> bool:
    return bool(_FILES.fullmatch(name) or _FOLDERS.fullmatch(name))


def _blocks(path: Path, name: str) -> bool:
    """Whether there is a file where a report has a folder, or the other way round, or a folder that is elsewhere."""
    there = path.is_dir()
    return _belongs(name) and ((there and path.is_symlink()) or not (_FOLDERS if there else _FILES).fullmatch(name))


def _parts(folder: Path) -> list[Path]:
    """The folders of a report that there are, each before those in it."""
    return [each for each in _within(folder) if each.is_dir() and _FOLDERS.fullmatch(str(each.relative_to(folder)))]
