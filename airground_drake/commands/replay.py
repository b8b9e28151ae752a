"""`airground replay DIR [RUN]`: replay the runs of a report from their saved traces."""

from collections.abc import Sequence
from pathlib import Path

from airground_drake.base import files
from airground_drake.base.errors import FolderError, one_line
from airground_drake.base.usage import between, output_file, refuse
from airground_drake.commands.saved import outside_reports, runs_of, trace_of
from airground_drake.scenario.options import Parser, option, parser_of

SLOWEST, SPEED, FASTEST = 0.1, 4.0, 100.0  # limits and default of a video's speed


def parser() -> Parser:
    says = "Write replay_RUN.html for the runs of a report: one file each, which works offline."
    return parser_of("replay", says, {
        "folder": None,
        "run": "default: all runs, a file each",
        "-o --output": {"help": "folder for the pages, or a name.html for RUN (default: .)", "metavar": "PLACE",
                        "default": Path()},
        "--video": option("write RUN as a video instead: .webp or .mp4", "FILE", output_file),
        "--speed": option(f"with --video: speed of the video (default: {SPEED:g})", "X", between(SLOWEST, FASTEST)),
    }, exclusive=("-o --output", "--video"))  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    if options.video and not options.run:
        return refuse("--video needs a RUN")
    if options.speed and not options.video:
        return refuse("--speed needs --video")
    from airground_drake.report.replay import video
    from airground_drake.report.replay.page import page
    from airground_drake.report.replay.scene import scene

    folder, runs = options.folder, runs_of(options.folder, options.run)
    if options.video:
        outside_reports(options.video.parent, "the video")
        video.write(scene(*trace_of(folder, options.run)), options.video, options.speed or SPEED)
        print(one_line(str(options.video)))
    else:
        for name, path in _paths(options.output, runs).items():
            outside_reports(path.parent, "the pages")
            # the last line of a run's page; it stays the same when the report is made again
            mark = f"<!-- airground replay {files.sha256(f'{folder.resolve()}/{name}'.encode())} -->"
            if path.exists() and not (path.is_file() and mark.encode() in files.read_bytes(path)[-2 * len(mark) :]):
                why = "is not a replay of this run of"
                raise FolderError(f"{path} {why} {folder}; it is left alone; name another place, with -o")
            files.write_text(path, f"{page(scene(*trace_of(folder, name)))}{mark}\n")
            print(one_line(str(path)))
    return 0


def _paths(output: Path, runs: Sequence[str]) -> dict[str, Path]:
    """The file of each run's page: `output` itself if it names a page, otherwise a file below it."""
    if output.suffix != ".html":
        return {name: output / f"replay_{name}.html" for name in runs}
    if len(runs) > 1:
        raise FolderError(f"{output} is one file for the runs {', '.join(runs)}; name a RUN, or a folder")
    return {runs[0]: output}
