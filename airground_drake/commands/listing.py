"""`airground list [KIND]`: what a scenario or the command line can name, a line each."""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Callable, Iterator, Sequence

from airground_drake.registry import METHODS, POLICIES, ROUTES, UAV_TASKS, Registry

Lines = Iterator[tuple[str, str]]
"""Names, and what each is."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the kinds that were asked for."""
    parser = argparse.ArgumentParser(prog="airground list", description=__doc__.partition(": ")[2])
    parser.add_argument("kind", nargs="?", choices=KINDS, help="default: all of them")
    wanted = parser.parse_args(arguments).kind
    for kind in KINDS if wanted is None else (wanted,):
        found = list(KINDS[kind]())
        width = max(len(name) for name, _ in found)
        print("\n".join([f"{kind}:", *(f"  {name:{width}}  {says}".rstrip() for name, says in found)]))
    return 0


def _scenarios() -> Lines:
    from airground_drake.scenarios.load import load, shipped

    for name in shipped():
        yield name, load(name)[0].title


def _methods() -> Lines:
    for name, method in METHODS.items():
        yield name, method.says


def _claims() -> Lines:
    from airground_drake.verify.registry import model_claims, run_claims

    for claim in (*run_claims(), *model_claims()):
        yield claim.id, claim.statement


def _classes(registry: Registry) -> Callable[[], Lines]:
    """First lines of the docstrings of what is registered."""

    def lines() -> Lines:
        for name in registry:
            says = inspect.getdoc(registry.load(name, of=object)) or ""
            yield name, says.partition("\n")[0]

    return lines


KINDS: dict[str, Callable[[], Lines]] = {
    "scenarios": _scenarios,
    "methods": _methods,
    "policies": _classes(POLICIES),
    "routes": _classes(ROUTES),
    "tasks": _classes(UAV_TASKS),
    "claims": _claims,
}
