"""Third-party code in a scenario: `module:Class` and `file.py:Class`, imported when used."""

from __future__ import annotations

import importlib
import os
import re
import sys
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from airground_drake.base.errors import ScenarioError
from airground_drake.base.files import sha256
from airground_drake.base.registry import (
    PLANTS,
    POLICIES,
    ROUTES,
    UAV_TASKS,
    UGV_CONTROLLERS,
    Registry,
    is_plugin,
    source_of,
)

if TYPE_CHECKING:  # pydantic, which the schema imports, would delay `report --list`
    from airground_drake.scenario.schema import Scenario

OPTION = "--allow-plugins"
SHOW = "--show-policy-output"
_POLICY = re.compile(r"intervention\.policies\.\d+\.name")
WANTED = f"third-party code is imported and run only with {OPTION}"


def plugins(scenario: Scenario) -> dict[str, str]:
    """Names of third-party code in a scenario, by key; entry points of installed packages are not among them."""
    named: list[tuple[str, str, Registry]] = [
        (f"{scenario.key_of(name)}.task", uav.task, UAV_TASKS) for name, uav in scenario.aerial.items()
    ]
    named.append(("gatekeeper.route", scenario.gatekeeper.route, ROUTES))
    if scenario.ugv_controller is not None:
        named.append(("ugv_controller.kind", scenario.ugv_controller.kind, UGV_CONTROLLERS))
    for name, robot in scenario.robots.items():
        named += [(f"{scenario.key_of(name)}.plant.kind", plant.kind, PLANTS) for plant in robot.plant]
    for index, policy in enumerate(scenario.intervention.policies):
        named.append((f"intervention.policies.{index}.name", policy.name, POLICIES))
    for run, spec in scenario.runs.items():
        chosen = {key: str(value) for key, value in spec.set.items()}
        named += [(f"runs.{run}.set.{key}", chosen[key], ROUTES) for key in chosen if key == "gatekeeper.route"]
        named += [(f"runs.{run}.set.{key}", chosen[key], POLICIES) for key in chosen if _POLICY.fullmatch(key)]
    named_own = {key: name for key, name, registry in named if name not in registry and is_plugin(name)}
    return named_own | {f"claims.{claim}": place for claim, place in scenario.claims.items()}


def digests(scenario: Scenario) -> dict[str, str]:
    """SHA-256 of the files of third-party code in a scenario, by its name there; nothing is imported."""
    sources = {name: source_of(name) for name in plugins(scenario).values()}
    return {name: sha256(file.read_bytes()) for name, file in sources.items() if file is not None}


def refuse(scenario: Scenario, source: str, keys: Collection[str] | None = None) -> None:
    # keys: keys to check; default: all.
    for key, name in plugins(scenario).items():
        if keys is None or key in keys:
            raise ScenarioError(source, key, name, WANTED)


@contextmanager
def admitted(scenario: Scenario, source: str, *, allow: bool, keys: Collection[str] | None = None) -> Iterator[None]:
    """In the body, third-party code is also searched for in the folder of the scenario's file, or refused."""
    # The folder comes last on Python's path, so that it cannot hide other modules. Child processes inherit the path.
    # allow: whether third-party code may be imported.
    if not allow:
        refuse(scenario, source, keys)
    with beside(source, allow=allow):
        yield


@contextmanager
def shown(show: bool) -> Iterator[None]:
    """In the body and its child processes, the output of third-party policies goes to standard error."""
    from airground_drake.uav.guest.process import SHOWN

    before = dict(os.environ)
    os.environ |= {SHOWN: "1"} if show else {}
    try:
        yield
    finally:
        if SHOWN not in before:
            os.environ.pop(SHOWN, None)


@contextmanager
def beside(source: str, *, allow: bool) -> Iterator[None]:
    """In the body, the folder of a file comes last on Python's path, if third-party code is allowed."""
    before, path = list(sys.path), Path(source)
    if allow and path.is_file():
        importlib.invalidate_caches()
        sys.path.append(str(path.resolve().parent))
    try:
        yield
    finally:
        sys.path[:] = before


def without(scenario: Scenario) -> Scenario:
    """The scenario with the package's own parts, without policies; its diagram has the same blocks."""
    plants = {name: [part for part in robot.plant if not part.is_own] for name, robot in scenario.robots.items()}
    uav = scenario.uav and replace(scenario.uav, task="formation", plant=plants[scenario.uav.name])
    return replace(
        scenario,
        ugvs={name: replace(ugv, plant=plants[name]) for name, ugv in scenario.ugvs.items()},
        uav=uav,
        uavs={name: replace(uav, task="formation", plant=plants[name]) for name, uav in scenario.uavs.items()},
        intervention=replace(scenario.intervention, policies=[]),
        ugv_controller=None,
        gatekeeper=replace(scenario.gatekeeper, route="mixed_integer", blocks=0, solver="daqp"),
        runs={name: replace(run, set={}) for name, run in scenario.runs.items()},
        choices=[],
    )
