"""The folder of a report: whose it is, and whether it can be written, asked before the work."""

from __future__ import annotations

import re
from pathlib import Path

from airground_drake import files
from airground_drake.errors import FolderError, one_line

PAGES = {"html": "report.html", "json": "report.json", "junit": "junit.xml"}
"""The formats of a report, and the file of each."""
ENTRIES = (*PAGES.values(), "diagram.dot", "diagram.svg", "trace", "certificates")
"""What a report consists of."""
RULE = "allowed: a folder that is new or empty, has a report.json of ours, or nothing but files of a report"

_OURS = re.compile(rb'\s*\{\s*"schema":\s*"airground_drake\.report/')


def prepare(folder: Path) -> None:
    """Create the folder if need be, look whose it is, try to write to it, and sweep what killed runs have left in it.

    Raises:
        FolderError: if it holds something that is no report.
        OSError: if it cannot be created or written, with the path.
    """
    folder.mkdir(parents=True, exist_ok=True)
    strange = sorted(path.name for path in folder.iterdir() if not (path.name in ENTRIES or files.is_partial(path)))
    if strange and not _has_report(folder):
        raise FolderError(one_line(f"{folder} holds {strange[0]!r} and no report; {RULE}"))
    files.sweep(folder)
    files.try_to_write(folder)


def _has_report(folder: Path) -> bool:
    path = folder / "report.json"
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return _OURS.match(file.read(100)) is not None
