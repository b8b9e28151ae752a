"""What a file of a log is, by its content; its streams."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from airground_drake.base import files
from airground_drake.base.errors import LogError, one_line
from airground_drake.logs import bags, tables
from airground_drake.logs.stream import Log
from airground_drake.logs.tables import Wanted

ROS1, SQLITE, GZIP = b"#ROSBAG V2.0", b"SQLite format 3\0", b"\x1f\x8b"
"""How files of these kinds begin."""
ABOUT = "metadata.yaml"
"""A folder with it is a ROS 2 bag."""
MOST_FILES = 1_000
"""Of a log."""


def opened(paths: Sequence[Path], wanted: Wanted) -> Log:
    """The streams of the files and folders of a log. A folder may have other files, too: these are named as not used.

    Raises:
        LogError: if a file cannot be used, or no file of the folders; names it.
        OSError: if one cannot be opened.
    """
    log = Log()
    for outer in paths:
        for path in _files(outer):
            try:
                log.add(_read(path, wanted))
            except LogError as error:
                told = one_line(f"{path}: {error}")
                if not outer.is_dir():
                    raise LogError(told) from None
                log.unusable.append(told)
    if log.unusable and not log.streams:
        raise LogError(log.unusable[0])
    log.ignored += log.unusable
    return log


def _files(path: Path) -> list[Path]:
    """A file, a ROS 2 bag, or the files in a folder."""
    if not path.is_dir():
        return [path]
    inside = sorted(each for each in path.iterdir() if each.is_file() and not each.name.startswith("."))
    if not inside:
        inner = "; folders in it are not read" if any(path.iterdir()) else ""
        raise LogError(one_line(f"{path}: the folder has no files{inner}"))
    if len(inside) > MOST_FILES:
        raise LogError(one_line(f"{path}: the folder has {len(inside)} files; allowed: {MOST_FILES}"))
    if any(each.name == ABOUT for each in inside):
        recordings = [each for each in inside if each.suffix == ".mcap"]
        return recordings or [path]  # `mcap` reads more kinds of messages than `rosbags` does
    return inside


def _read(path: Path, wanted: Wanted) -> Log:
    if path.is_dir():
        return bags.read_ros(path, wanted.bodies)
    with open(files.open_regular(path, links=True), "rb") as file:
        start = file.read(64)
    if start.startswith(bags.MCAP):
        return bags.read_mcap(path, wanted.bodies)
    if start.startswith((ROS1, SQLITE)):
        return bags.read_ros(path, wanted.bodies)
    if start.startswith(GZIP):
        raise LogError("it is compressed; wanted: unpack it first (gunzip)")
    if not start:
        raise LogError("it is empty")
    return tables.read(path, files.read_bytes(path, links=True), wanted)
