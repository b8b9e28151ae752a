"""`airground replay DIR [RUN]`: show what happened in the runs of a report, from their saved traces."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from airground_drake.base import files
from airground_drake.base.errors import AirgroundError, FolderError, UnknownNameError, one_line
from airground_drake.base.usage import Parser, refuse
from airground_drake.report.folder import is_report

if TYPE_CHECKING:
    from airground_drake.replay.scene import Scene

ELSEWHERE = "it is left alone; name another place, with -o"
SLOWEST, SPEED, FASTEST = 0.1, 4.0, 100.0
"""Limits and default of a video's speed."""


def parser() -> argparse.ArgumentParser:
    """What the command line takes."""
    parser = Parser(
        prog="airground replay",
        description="Write replay_RUN.html for the runs of a report: one file each, which works offline.",
    )
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of a report")
    parser.add_argument("run", nargs="?", metavar="RUN", help="default: all runs, a file each")
    to = parser.add_mutually_exclusive_group()
    to.add_argument(
        "-o", "--output", type=Path, metavar="PLACE", help="folder for the pages, or a name.html for RUN (default: .)"
    )
    to.add_argument("--live", action="store_true", help="write nothing; serve the pages on this machine")
    to.add_argument("--video", type=Path, metavar="FILE", help="write RUN as a video instead: .webp or .mp4")
    parser.add_argument("--speed", type=_speed, metavar="X", help=f"with --video: its speed (default: {SPEED:g})")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Write or serve the replays.

    Returns:
        Exit code: 0, or 2 if the folder, the run or the output cannot be used.
    """
    of_command = parser()
    options = of_command.parse_args(arguments)
    if options.video and not options.run:
        of_command.error("--video needs a RUN")
    if options.speed and not options.video:
        of_command.error("--speed needs --video")
    from airground_drake.replay import live, video
    from airground_drake.replay.page import page

    try:
        runs = runs_of(options.folder)
        if options.run not in (None, *runs):
            raise UnknownNameError("run", options.run, runs)
        chosen = [options.run] if options.run else runs
        if options.live:
            live.serve(chosen, lambda name: page(_scene(options.folder, name)))
        elif options.video:
            outside_reports(options.video.parent, "the video")
            video.write(_scene(options.folder, options.run), options.video, options.speed or SPEED)
            print(options.video)
        else:
            for name, path in _paths(options.output or Path(), chosen).items():
                outside_reports(path.parent, "the pages")
                mark = _mark(options.folder, name)
                if path.exists() and not _has(path, mark):
                    raise FolderError(one_line(f"{path} is not a replay of this run of {options.folder}; {ELSEWHERE}"))
                files.write_text(path, f"{page(_scene(options.folder, name))}{mark}\n")
                print(path)
    except (AirgroundError, OSError) as error:
        return refuse(error)
    return 0


def _paths(output: Path, runs: Sequence[str]) -> dict[str, Path]:
    """Where the page of each run goes: to a file of this name, or to a folder.

    Raises:
        FolderError: if it is one file for several runs.
    """
    if output.suffix != ".html":
        return {name: output / f"replay_{name}.html" for name in runs}
    if len(runs) > 1:
        raise FolderError(one_line(f"{output} is one file for the runs {', '.join(runs)}; name a RUN, or a folder"))
    return {runs[0]: output}


def _mark(folder: Path, run: str) -> str:
    """What the page of a run ends with: by it the page is known, also when the report has been made again."""
    return f"<!-- airground replay {files.sha256(f'{folder.resolve()}/{run}'.encode())} -->"


def _has(path: Path, mark: str) -> bool:
    """Whether a path is a plain file that ends with a mark."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - 2 * len(mark)))
        return mark.encode() in file.read(2 * len(mark))


def _speed(text: str) -> float:
    try:
        speed = float(text)
    except ValueError:
        speed = 0.0
    if not SLOWEST <= speed <= FASTEST:
        raise argparse.ArgumentTypeError(f"{text!r} is not allowed; wanted: a number from {SLOWEST:g} to {FASTEST:g}")
    return speed


def runs_of(folder: Path) -> list[str]:
    """Names of the runs of a report that have left a trace.

    Raises:
        FolderError: if it is no report, or one without runs.
    """
    found = sorted(path.parent.name for path in folder.glob("trace/*/meta.json"))
    if not is_report(folder):
        raise FolderError(one_line(f"{folder} is no report; allowed: a folder that `airground report` has written"))
    if not found:
        raise FolderError(one_line(f"{folder} has no runs to replay; allowed: a report with trace/RUN/meta.json"))
    return found


def outside_reports(folder: Path, what: str) -> None:
    """Create a folder for `what`. Reports are left as they are: the checker refuses files that are not theirs.

    Raises:
        FolderError: if the folder is one of a report, or cannot be written.
    """
    for each in (folder.resolve(), *folder.resolve().parents):
        if is_report(each):
            raise FolderError(one_line(f"{folder} is in the report {each}, which is complete; name another, with -o"))
    files.make_folder(folder, what)


def _scene(folder: Path, run: str) -> Scene:
    from airground_drake.replay.scene import scene
    from airground_drake.run import trace
    from airground_drake.scenarios.load import from_data

    saved = trace.load(folder / "trace" / run)
    return scene(saved, from_data(saved.meta["scenario"], str(folder / "trace" / run)))
