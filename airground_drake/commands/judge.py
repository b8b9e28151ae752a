"""`airground judge LOG... --scenario NAME`: judge the log of an experiment, or of another simulator."""

import argparse
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from airground_drake.base.errors import one_line
from airground_drake.base.usage import between, refuse
from airground_drake.scenario.options import Parser, option, parser_of

MOST_GAP_S, MOST_ERROR_M = 1e6, 1e6
EPILOG = """\
formats of LOG, detected from the content:
  CSV, TSV     a row per body and time (t_s, body, x_m, y_m, z_m), or columns for each body (tb1_x, /tb1/odom/.../x),
               or a file per body (tb1.csv); header lines, decimal commas, epoch stamps, ns, ms and mm are noticed
  TUM, Parquet
  MCAP         Foxglove (JSON, protobuf), ROS 2, ROS 1            pip install 'airground_drake[logs]'
  ROS bags     ROS 1 (.bag), ROS 2 (folder, .db3, .mcap)          pip install 'airground_drake[logs]'
  a folder     of any of these
`airground export` writes logs that can be judged, too.

the scenario gives the robots, their sizes, the obstacles and the required distances. These keys are used: ugvs and
uav (start_m, radius_m, max_speed_m_s), obstacles, arena_m, map, safe_distance, duration_s and
control.avoidance_gain_1_s. `airground init` writes one to start from.

examples:
  airground judge run3.csv --scenario lab.yaml
  airground judge tb1.csv tb2.csv uav.csv --scenario lab.yaml -o judged
  airground judge rosbag2_2026_05_04 --scenario lab.yaml --rename /tb3_1/odom=ugv1 --frame map
  airground judge log.csv --scenario lab.yaml --map-columns t=clock,body=who,x_mm=east,y_mm=north

exit codes: 0 no distance is broken where the log covers it (the first line says if it does not cover all), 1 one is
broken, or the position error leaves it open, 2 usage, or a log that cannot be used
"""


def parser() -> Parser:
    several: dict[str, Any] = {"action": "append", "default": []}
    return parser_of(
        "judge",
        "Judge the log of an experiment: which distances were kept, by which margin, which robot caused an approach, "
        "and which hypotheses of the safety theorem held.",
        {
            "logs": option("a file or folder; several are one log", "LOG", Path, nargs="+"),
            "--scenario": option("name of a shipped scenario, or path to a YAML file", "NAME", required=True),
            "--set": None,
            "--rename": option("a topic, frame, column or value in the log, and its body in the scenario",
                               "NAME=BODY", _named, **several),
            "--map-columns": option("names of the columns t, body, frame, x, y, z of a table, with a unit where needed "
                                    "(x_mm=NAME); {body} in a NAME stands for a body's name", "t=NAME,...", _mapped,
                                    default={}),
            "--frame": option("use positions in this frame only; several FRAMEs count as one", "FRAME", **several),
            "--time-unit": option("unit of times without one", choices=("s", "ms", "us", "ns"), default=""),
            "--length-unit": option("unit of lengths without one", choices=("m", "cm", "mm"), default=""),
            "--rate-hz": option("frames per second, if times are frame numbers", "HZ", between(1e-3, 1e6),
                                default=0.0),
            "--axes": option("axes of the log that are x, y and z (up) of the scenario: y,x,-z for NED, x,-z,y "
                             "if y is up (default: x,y,z, unless the log contradicts this)", "[BODY=]AXES",
                             _axes, **several),
            "--gap": option("least time between two positions of a body that counts as a gap, which the verdict does "
                            "not cover (default: 2.5 times the body's usual interval)", "S",
                            between(0.0, MOST_GAP_S), default=0.0),
            "--position-error": option("largest error of recorded positions", "[BODY=]M", _error, **several),
            "--uav": option("another UAV, like the scenario's", "NAME", **several),
            "--without": option("do not judge this body of the scenario", "BODY", **several),
            "-o --output": "also write a page with maps, judged.html, and a replay, replay.html",
            "--json": None,
        },
        EPILOG,
    )  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    from airground_drake.scenario.load import load, resolved
    from airground_drake.study.logs import judging, opening, tables, tracks, words

    scenario = load(options.scenario, options.set)
    document = resolved(scenario)
    rename = dict(options.rename)
    choice = tracks.Choice(
        rename, [frame.strip("/") for frame in options.frame], options.without, options.uav, options.gap,
        options.time_unit, options.length_unit, options.rate_hz, dict(options.axes),
    )  # fmt: skip
    bodies = tracks.bodies_of(document, options.uav)
    tracks.known(document, choice, [name for name, _ in (*options.position_error, *options.axes) if name])
    if options.rate_hz and options.time_unit:
        return refuse("--rate-hz (for frame numbers) and --time-unit exclude each other")
    log = opening.opened(options.logs, tables.Wanted(bodies, rename, options.map_columns))
    joined = tracks.joined(log, document, choice)
    error_of: dict[str, float] = dict(options.position_error)  # one without a name is of all others
    errors = {name: error_of.get(name, error_of.get("", 0.0)) for name in bodies}
    judged = judging.judge(joined, document, errors)
    if options.output is not None:
        from airground_drake.commands.saved import outside_reports
        from airground_drake.study.logs import page

        outside_reports(options.output, "the page")
        logs = [str(path) for path in options.logs]
        written = page.write(options.output, judged, joined, scenario, errors, logs)
    if options.json:
        as_json = judging.as_json(judged, joined) | {"said": [*joined.remarks, *words.remarks(judged)]}
        print(json.dumps(as_json, indent=1, allow_nan=False))
    else:
        for line in words.lines(judged, joined):
            print(one_line(line))
        if options.output is not None:
            print("".join(f"{one_line(str(path))}\n" for path in written), end="")
    return int(judged.status != judging.KEPT)


def _named(text: str) -> tuple[str, str]:
    name, is_there, body = text.rpartition("=")
    if not (is_there and name and body):
        raise argparse.ArgumentTypeError(f"{text!r} is not allowed; wanted: NAME=BODY, such as /tb3_1/odom=ugv1")
    return name, body


def _axes(text: str) -> tuple[str, str]:
    from airground_drake.study.logs.axes import parsed

    name, _, given = text.rpartition("=")
    try:
        parsed(given)
    except ValueError:
        wanted = "wanted: x, y and z in the order of the scenario's axes, with a minus where they point the other way"
        raise argparse.ArgumentTypeError(f"{text!r} is not allowed; {wanted}: x,-z,y") from None
    return name, given


def _mapped(text: str) -> dict[str, str]:
    from airground_drake.study.logs.columns import TARGETS, split_unit

    names = dict[str, str]()
    for part in text.split(","):
        target, _, name = part.partition("=")
        if split_unit(target)[0] not in TARGETS or not name:
            wanted = f"wanted: t=NAME,body=NAME,x=NAME,... of {', '.join(TARGETS)}, with a unit where needed: x_mm=NAME"
            raise argparse.ArgumentTypeError(f"{part!r} is not allowed; {wanted}")
        if any(split_unit(known)[0] == split_unit(target)[0] for known in names):
            raise argparse.ArgumentTypeError(f"{text!r} is not allowed; wanted: one name for {split_unit(target)[0]}")
        names[target] = name
    return names


def _error(text: str) -> tuple[str, float]:
    name, _, number = text.rpartition("=")
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if not 0.0 <= value <= MOST_ERROR_M:
        wanted = f"wanted: metres from 0 to {MOST_ERROR_M:g}, or BODY=metres"
        raise argparse.ArgumentTypeError(f"{text!r} is not allowed; {wanted}")
    return name, value
