"""`airground diagram SCENARIO`: draw the diagram that a scenario's runs simulate."""

from collections.abc import Sequence
from pathlib import Path

from airground_drake.base import files
from airground_drake.base.errors import UnknownNameError, one_line
from airground_drake.base.registry import METHODS
from airground_drake.scenario import plugins
from airground_drake.scenario.options import Parser, option, parser_of

FORMATS = ("dot", "svg", "pdf", "png")


def parser() -> Parser:
    return parser_of("diagram", "Draw the diagram of a scenario.", {
        "scenario": None,
        "--method": option("default: c (the paper's Figure 2) if a run has it", choices=tuple(METHODS)),
        "--part": option("draw only this layer, with all ports", "NAME"),
        "--format": option("may be repeated (default: dot and svg)", action="append", choices=FORMATS),
        "-o --output": {"default": Path()},
        "--set": None,
        plugins.OPTION: None,
    })  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    from airground_drake.scenario.load import load
    from airground_drake.sim import graphviz
    from airground_drake.sim.diagram import build_diagram, method_drawn

    scenario = load(options.scenario, options.set)
    with plugins.admitted(scenario, options.scenario, allow=options.allow_plugins):
        method = method_drawn(scenario) if options.method is None else options.method
        diagram, name = build_diagram(scenario, method=method), scenario.name
    if options.part is not None:
        parts = [system.get_name() for system in diagram.GetSystems()]
        if options.part not in parts:
            raise UnknownNameError("part", options.part, parts)
        diagram, name = diagram.GetSubsystemByName(options.part), f"{name}_{options.part}"
    text = graphviz.dot(diagram)
    files.make_folder(options.output, "the pictures")
    for kind in options.format or ("dot", "svg"):
        path = options.output / f"{name}.{kind}"
        files.write_bytes(path, graphviz.drawn(text, kind))
        print(one_line(str(path)))
    return 0
