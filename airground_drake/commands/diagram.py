"""`airground diagram SCENARIO`: draw the diagram that a scenario's runs simulate."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from airground_drake import files
from airground_drake.errors import AirgroundError
from airground_drake.registry import METHODS
from airground_drake.scenarios import plugins

EXIT_USAGE = 2
FORMATS = ("dot", "svg", "pdf", "png")


def parser() -> argparse.ArgumentParser:
    """What the command line takes."""
    parser = argparse.ArgumentParser(prog="airground diagram", description="Draw the diagram of a scenario.")
    parser.add_argument("scenario", help="name of a shipped scenario, or path to a YAML file")
    parser.add_argument("--method", choices=tuple(METHODS), help="default: that of the scenario's last run")
    parser.add_argument("--depth", type=int, default=1, metavar="N", help="levels of nested diagrams (default: 1)")
    parser.add_argument("--format", action="append", choices=FORMATS, help="may be repeated (default: dot and svg)")
    parser.add_argument("-o", "--output", type=Path, default=Path(), metavar="DIR", help="default: this folder")
    parser.add_argument(plugins.OPTION, action="store_true", help=plugins.HELP)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the pictures.

    Returns:
        Exit code: 0, or 2 if the scenario or the folder cannot be used.
    """
    options = parser().parse_args(arguments)
    from airground_drake import graphviz
    from airground_drake.diagram import build_diagram
    from airground_drake.scenarios.load import load

    try:
        scenario, _ = load(options.scenario)
        with plugins.admitted(scenario, options.scenario, allow=options.allow_plugins):
            text = graphviz.dot(build_diagram(scenario, method=options.method), options.depth)
        for kind in options.format or ("dot", "svg"):
            path = options.output / f"{scenario.name}.{kind}"
            files.write_bytes(path, text.encode() if kind == "dot" else graphviz.drawn(text, kind))
            print(path)
    except (AirgroundError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return EXIT_USAGE
    return 0
