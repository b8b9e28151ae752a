"""`airground list [KIND]`: every name that a scenario or the command line can use, a line each."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence

from airground_drake.base.usage import Parser
from airground_drake.registry import METHODS, MODEL_CLAIMS, POLICIES, ROUTES, RUN_CLAIMS, SAMPLERS, UAV_TASKS, Registry
from airground_drake.scenarios.shipped import shipped, title

Lines = Iterator[tuple[str, str]]
"""Names and their descriptions."""


def parser() -> argparse.ArgumentParser:
    """Make the parser."""
    parser = Parser(prog="airground list", description=f"List {__doc__.partition(': ')[2]}")
    parser.add_argument("kind", nargs="?", choices=tuple(KINDS), help="default: all of them")
    parser.add_argument("--schema", action="store_true", help="the JSON Schema of scenario files instead, for editors")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the kinds that were asked for."""
    options = parser().parse_args(arguments)
    if options.schema:
        from airground_drake.scenarios import json_schema

        print(json_schema.text(), end="")
        return 0
    for kind in KINDS if options.kind is None else (options.kind,):
        found = list(KINDS[kind]())
        width = max(len(name) for name, _ in found)
        print("\n".join([f"{kind}:", *(f"  {name:{width}}  {says}".rstrip() for name, says in found)]))
    return 0


def _registered(*registries: Registry) -> Callable[[], Lines]:
    return lambda: ((name, registry.says(name)) for registry in registries for name in registry)


KINDS: dict[str, Callable[[], Lines]] = {
    "scenarios": lambda: ((name, title(name)) for name in shipped()),
    "methods": lambda: ((name, method.says) for name, method in METHODS.items()),
    "policies": _registered(POLICIES),
    "routes": _registered(ROUTES),
    "tasks": _registered(UAV_TASKS),
    "samplers": _registered(SAMPLERS),
    "claims": _registered(RUN_CLAIMS, MODEL_CLAIMS),
}
