"""Detects the format of a log's file by its content, and reads its streams."""

import stat
from collections.abc import Sequence
from pathlib import Path

from airground_drake.base import files
from airground_drake.base.errors import LogError, one_line
from airground_drake.report.sentences import some
from airground_drake.study.logs import bags, tables
from airground_drake.study.logs.stream import Log
from airground_drake.study.logs.tables import Wanted

GZIP = b"\x1f\x8b"  # how files of this kind begin
# A folder with it is a ROS 2 bag, of recordings with these endings.
ABOUT, RECORDINGS = "metadata.yaml", (".mcap", ".db3", ".zstd", ".zst")
MOST_FILES = 1_000  # of a log


def opened(paths: Sequence[Path], wanted: Wanted) -> Log:
    # A folder may have other files, too: these are named as not used.
    log = Log()
    for outer in paths:
        for path in _files(outer, log):
            try:
                log.add(_read(path, wanted))
            except LogError as error:
                message = one_line(f"{path}: {error}")
                if not outer.is_dir():
                    raise LogError(message) from None
                log.unusable.append(message)
    if log.unusable and not log.streams:
        raise LogError(f"no file of the folder is a log: {some(log.unusable, most=3)}")
    log.ignored += log.unusable
    return log


def _files(path: Path, log: Log) -> list[Path]:
    """A file, or the regular files in a folder: a link may lead to somebody else's file, and a pipe may never end."""
    if not path.is_dir():
        return [path]
    inside = sorted(entry for entry in path.iterdir() if not entry.name.startswith("."))
    regular = [entry for entry in inside if stat.S_ISREG(entry.lstat().st_mode)]
    others = [entry for entry in inside if entry not in regular and (entry.is_symlink() or not entry.is_dir())]
    if any(entry.name == ABOUT for entry in regular):
        recordings = [entry for entry in regular if entry.suffix in RECORDINGS]
        regular = recordings or [entry for entry in regular if entry.name != ABOUT]
    log.ignored += [f"{entry.name}: {'a link' if entry.is_symlink() else 'no regular file'}" for entry in others]
    if not regular:
        why = "; folders in it are not read" if inside else ""
        why = f": {', '.join(log.ignored[-len(others) :][:3])}; wanted: regular files" if others else why
        raise LogError(f"{path}: the folder has no files{why}")
    if len(regular) > MOST_FILES:
        raise LogError(f"{path}: the folder has {len(regular)} files; allowed: {MOST_FILES}")
    return regular


def _read(path: Path, wanted: Wanted) -> Log:
    with open(files.open_regular(path, links=True), "rb") as file:
        start = file.read(64)
    if start.startswith(bags.ZSTD):
        return _unpacked(path, wanted)
    if wanted.columns and start.startswith((bags.MCAP, bags.ROS1, bags.SQLITE)):
        raise LogError("--map-columns is for tables, and this is a recording of messages")
    if start.startswith(bags.MCAP):
        return bags.read_mcap(path, wanted.bodies)
    if start.startswith((bags.ROS1, bags.SQLITE)):
        return bags.read_ros(path, wanted.bodies, is_ros1=start.startswith(bags.ROS1))
    if start.startswith(GZIP):
        raise LogError("it is compressed; wanted: unpack it first (gunzip)")
    if not start:
        raise LogError("it is empty")
    return tables.read(path, files.read_bytes(path, links=True), wanted)


def _unpacked(path: Path, wanted: Wanted) -> Log:
    """The streams of a file compressed by zstd, as whole ROS 2 recordings; double compression is refused."""
    with files.temporary_folder() as folder:
        inner = folder / path.stem
        with inner.open("wb") as out:
            bags.unpack(path, out)
        with inner.open("rb") as file:
            if file.read(len(bags.ZSTD)) == bags.ZSTD:
                raise LogError("it is compressed twice; wanted: unpack it first (unzstd)")
        return _read(inner, wanted)
