"""`airground init FILE`: write a scenario to start from: a small one, a copy of a shipped one, or a fleet."""

import re
from collections.abc import Sequence
from pathlib import Path

from airground_drake.base import files
from airground_drake.base.errors import one_line
from airground_drake.base.limits import MAX_SEED, MAX_UGVS
from airground_drake.base.usage import output_file, refuse, whole
from airground_drake.scenario.fleet import fleet
from airground_drake.scenario.options import Parser, option, parser_of
from airground_drake.scenario.shipped import argument, json_schema_file, scenario_name, shipped_files

MOST_OBSTACLES = 2000 - MAX_UGVS  # with the largest number of UGVs, as many bodies as the checker accepts
MODEL = "minimal"  # the shipped scenario that is copied by default


def parser() -> Parser:
    return parser_of("init", "Write a small scenario that runs: a UGV, an obstacle in its way, a UAV.", {
        "file": option("default: %(default)s", kind=output_file, nargs="?", default=Path("scenario.yaml")),
        "--like": option("copy this shipped scenario instead", "NAME", choices=shipped_files()),
        "--fleet": option("N UGVs that cross a field of obstacles instead", "N", whole(1, MAX_UGVS)),
        "--obstacles": option("with --fleet: number of obstacles (default: 5 per UGV)", "M", whole(1, MOST_OBSTACLES)),
        "--seed": option("with --fleet: seed (default: 1)", "S", whole(0, MAX_SEED)),
    })  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    if options.fleet is None and (options.obstacles, options.seed) != (None, None):
        return refuse("--obstacles and --seed need --fleet")
    if None not in (options.fleet, options.like):
        return refuse("--like and --fleet exclude each other")
    path: Path = options.file
    files.try_to_create(path)
    name = scenario_name(path.stem, MODEL)
    if options.fleet is None:
        model = options.like or MODEL
        text = shipped_files()[model].read_text(encoding="utf-8")
        # the lines before the name are about the shipped file
        text = re.sub(r"name:.*", f'name: "{name}"', text[text.index("name:") :], count=1)
    else:
        seed = 1 if options.seed is None else options.seed
        text = fleet(options.fleet, options.obstacles or 5 * options.fleet, seed, name)
    schema = f"# yaml-language-server: $schema={json_schema_file()}\n"
    files.write_text(path, schema + text)
    print(f"{one_line(str(path))}\nnext: airground report {argument(path)}")
    return 0
