"""Structure: names, pictures, and which module may import which."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest
from pydrake.systems.framework import LeafSystem

import airground_drake
from airground_drake.geometry.motion import Motion
from airground_drake.registry import METHODS
from airground_drake.scenarios.load import load
from airground_drake.systems import graphviz
from airground_drake.systems.components import stack_presets
from airground_drake.systems.diagram import RECORDED, build_diagram

PACKAGE = Path(airground_drake.__file__).parent
LAYERS = (
    ("base", "check"),
    ("registry",),
    ("geometry",),
    ("world",),
    ("nsbc",),
    ("decision", "intervention"),
    ("gatekeeper",),
    ("scenarios",),
    ("systems",),
    ("run", "view"),
    ("proofs",),
    ("verify",),
    ("testing",),
    ("report", "replay", "audit"),
    ("campaign", "export"),
    ("commands", "__main__"),
)
"""Rooms, from left to right: a module imports from its own layer or from those before it."""


def test_every_system_and_port_has_a_name() -> None:
    diagram = build_diagram(load("case_a")[0], "d")
    inside = {part.get_name(): [system.get_name() for system in part.GetSystems()] for part in diagram.GetSystems()}
    assert inside == {
        "decision_making": ["noise_source", "decision_noise", "decision_variable", "event_trigger"],
        "task_planning": ["reference", "intervention_planner", "ugv_controller", "uav_controller"],
        "optimisation": ["gatekeeper"],
        "vehicles": [
            "team_command", "velocity_disturbance", "team_velocity", "ugv1_plant", "ugv2_plant", "uav_plant",
            "bodies",
        ],
    }  # fmt: skip
    assert [diagram.get_output_port(i).get_name() for i in range(diagram.num_output_ports())] == list(RECORDED)
    inputs = [diagram.get_input_port(i).get_name() for i in range(diagram.num_input_ports())]
    assert inputs == [f"disturbance_{robot}" for robot in ("ugv1", "ugv2", "uav")]
    for system in (system for part in diagram.GetSystems() for system in part.GetSystems()):
        if isinstance(system, LeafSystem) and type(system).__module__.startswith("airground_drake"):
            for i in range(system.num_input_ports()):
                assert not system.get_input_port(i).get_name().startswith("u0")
            assert type(system).__doc__


def test_corners_of_two_presets_that_rounding_keeps_apart_are_one() -> None:
    """At 24 s, between the ends of the two, a velocity over four units in the last place would be one of rounding."""
    ends = [24.0, 24.0 - 4e-15, 24.0 + 4e-15]
    presets = [Motion(np.array([0.0, end]), np.array([[9.7, 7.0, 0.0], [-9.7, -7.1, 0.0]])) for end in ends]
    together = stack_presets(presets)
    rates = together.EvalDerivative(24.0, 1).reshape(-1, 3)
    assert all(min(np.abs(rate - side).max() for side in (presets[0].at(1.0)[1], 0.0)) < 1e-9 for rate in rates)
    assert together.value(24.0).ravel() == pytest.approx(np.tile([-9.7, -7.1, 0.0], 3), abs=1e-12)
    assert together.start_time() == 0.0


@pytest.mark.parametrize("method", METHODS)
def test_pictures_are_the_same_each_time(method: str) -> None:
    scenario = load("case_a")[0]
    one, two = (graphviz.dot(build_diagram(scenario, method)) for _ in range(2))
    assert one == two
    assert graphviz.svg(one) == graphviz.svg(two)


def test_shipped_pictures_are_current() -> None:
    folder = Path(__file__).parent.parent / "diagrams"
    pictures = graphviz.pictures()
    assert {path.name for path in folder.glob("*.*") if path.suffix in (".dot", ".svg")} == set(pictures)
    for name, content in pictures.items():
        assert graphviz.is_current(name, content, (folder / name).read_text(encoding="utf-8")), name


def test_an_outdated_picture_is_noticed() -> None:
    pictures = graphviz.pictures()
    assert not graphviz.is_current("case_a.dot", pictures["case_a.dot"], pictures["case_b.dot"])
    assert not graphviz.is_current("case_a.svg", pictures["case_a.svg"], pictures["case_b.svg"])


def test_gatekeepers_know_of_interventions_only_what_is_sent() -> None:
    """Proposals and messages; neither planner nor policies, and those know no gatekeeper."""
    found = {
        node.module
        for path in (PACKAGE / "gatekeeper").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("airground_drake.intervention")
    }
    assert found == {"airground_drake.intervention.messages", "airground_drake.intervention.policy"}


def test_data_flows_one_way() -> None:
    rank = {name: i for i, layer in enumerate(LAYERS) for name in layer}
    for path in PACKAGE.rglob("*.py"):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        if parts == ("__init__",):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("airground_drake"):
                tail = (node.module or "").split(".")[1:]
                for target in [tail[0]] if tail else [alias.name for alias in node.names]:
                    assert rank[target] <= rank[parts[0]], f"{path.name} imports {target}"
