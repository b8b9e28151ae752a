"""`airground list [KIND [NAME]]`: names that a scenario or the command line can use, or details of one."""

import inspect
import textwrap
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from airground_drake.base.errors import UnknownNameError
from airground_drake.base.registry import (
    METHODS,
    MODEL_CLAIMS,
    POLICIES,
    ROUTES,
    RUN_CLAIMS,
    SAMPLERS,
    UAV_TASKS,
    Registry,
    parameters,
)
from airground_drake.scenario.options import Parser, option, parser_of
from airground_drake.scenario.shipped import shipped, title

Lines = Iterator[tuple[str, str]]  # names and their descriptions


def parser() -> Parser:
    return parser_of("list", f"List {__doc__.partition(': ')[2]}", {
        "kind": option("default: all kinds except keys", nargs="?", choices=(*KINDS, KEYS)),
        "name": option("print all about this name, or about keys that begin with it", "NAME", nargs="?"),
        "--schema": "print the JSON Schema of scenario files, for editors",
    })  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    if options.schema:
        from airground_drake.scenario import json_schema

        print(json_schema.text(), end="")
        return 0
    if options.kind == KEYS:
        return _print_keys(options.name or "")
    if options.name is not None:
        return _print_one(options.kind, options.name)
    for kind in KINDS if options.kind is None else (options.kind,):
        entries = list(KINDS[kind]())
        width = max(len(name) for name, _ in entries)
        print("\n".join([f"{kind}:", *(f"  {name:{width}}  {says}".rstrip() for name, says in entries)]))
    return 0


def _print_one(kind: str, name: str) -> int:
    names = dict(KINDS[kind]())
    if name not in names:
        raise UnknownNameError(f"name among the {kind}", name, names)
    registry = next((registry for registry in REGISTRIES.get(kind, ()) if name in registry), None)
    lines = [f"{name}: {names[name]}"] if registry is None else _about(registry.load(name, of=object), name)
    print("\n".join(line for text in lines for line in (textwrap.wrap(text, WIDTH, subsequent_indent="  ") or [""])))
    return 0


def _about(kind: type, name: str) -> list[str]:
    """Paragraphs about a class: its docstring and parameters, or a claim's statement."""
    if statement := getattr(kind, "statement", ""):
        claim: Any = kind
        return [
            f"{name}: {claim.summary}", statement, f"Decided by: {claim.method}", "Assumes:",
            *(f"- {assumption}" for assumption in claim.assumptions), f"Does not establish: {claim.does_not_establish}",
        ]  # fmt: skip
    summary, _, more = (inspect.getdoc(kind) or "").partition("\n\n")
    given = ", ".join(parameters(kind)) or "none"
    return [f"{name}: {' '.join(summary.split())}", f"Parameters: {given}.", *more.splitlines()]


def _print_keys(beginning: str) -> int:
    from airground_drake.scenario.json_schema import scenario_schema
    from airground_drake.scenario.keys import sections

    entries = [
        (f"{section.path}.{entry.key}".lstrip("."), entry)
        for section in sections(scenario_schema())
        for entry in section.entries
    ]
    shown = [(key, entry) for key, entry in entries if f"{key}.".startswith(f"{beginning}." if beginning else "")]
    shown = shown or [(key, entry) for key, entry in entries if key.rpartition(".")[2].startswith(beginning)]
    if not shown:
        raise UnknownNameError("key", beginning, [key for key, _ in entries])
    for key, entry in shown:
        allowed = entry.allowed.replace("`", "")
        print(textwrap.fill(f"{key} ({allowed}): {entry.says.replace('`', '')}", WIDTH, subsequent_indent="  "))
    return 0


def _registered(*registries: Registry) -> Callable[[], Lines]:
    return lambda: ((name, registry.says(name)) for registry in registries for name in registry)


REGISTRIES = {
    "policies": (POLICIES,), "routes": (ROUTES,), "tasks": (UAV_TASKS,), "samplers": (SAMPLERS,),
    "claims": (RUN_CLAIMS, MODEL_CLAIMS),
}  # fmt: skip

KEYS = "keys"
WIDTH = 100

KINDS: dict[str, Callable[[], Lines]] = {
    "scenarios": lambda: ((name, title(name)) for name in shipped()),
    "methods": lambda: ((name, method.says) for name, method in METHODS.items()),
    **{kind: _registered(*registries) for kind, registries in REGISTRIES.items()},
}
