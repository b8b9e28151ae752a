"""Diagrams and their pictures; which module may import which."""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import airground_drake
from airground_drake.geometry.motion import Motion
from airground_drake.scenarios.load import load, shipped
from airground_drake.systems import DecisionBlock, graphviz, schematic
from airground_drake.systems.components import stack_presets
from airground_drake.systems.diagram import build_diagram, make_monitor
from airground_drake.world.world import World

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
"""Rooms: a module imports from its own layer or from those above it."""
PAGE_PT = 785
"""Width of a landscape page of A4 with margins of 1 cm."""


def test_corners_of_two_presets_that_rounding_keeps_apart_are_one() -> None:
    """At 24 s, between the ends of the two, a velocity over four units in the last place would be one of rounding."""
    ends = [24.0, 24.0 - 4e-15, 24.0 + 4e-15]
    presets = [Motion(np.array([0.0, end]), np.array([[9.7, 7.0, 0.0], [-9.7, -7.1, 0.0]])) for end in ends]
    together = stack_presets(presets)
    rates = together.EvalDerivative(24.0, 1).reshape(-1, 3)
    assert all(min(np.abs(rate - side).max() for side in (presets[0].at(1.0)[1], 0.0)) < 1e-9 for rate in rates)
    assert together.value(24.0).ravel() == pytest.approx(np.tile([-9.7, -7.1, 0.0], 3), abs=1e-12)
    assert together.start_time() == 0.0


def edges(text: str) -> set[tuple[str, str]]:
    """The wires of a picture, those from and to the vehicles as if these were one block."""
    found = re.findall(r'^"([^"]*)" -> "([^"]*)"', text, re.MULTILINE)
    told = [["vehicles" if end.endswith("_plant") or end == "bodies" else end for end in each] for each in found]
    return {(source, target) for source, target in told if source != target}


@pytest.mark.parametrize(("name", "method"), [("minimal", "a"), ("case_a", "b"), ("doorway", "c"), ("case_a", "d")])
def test_the_picture_has_every_block_and_every_wire(name: str, method: str) -> None:
    diagram = build_diagram(load(name)[0], method)
    text, systems = graphviz.dot(diagram), schematic._systems(diagram)
    unseen = {"noise_source", "team_command", "velocity_disturbance", "team_velocity"}
    assert set(systems) - set(re.findall(r'^"([^"]*)" \[', text, re.MULTILINE)) == unseen
    assert edges(text) == set(schematic.signals(diagram))
    fed = [(end.system, end.port) for _, end in schematic._wires(diagram)]
    outside = {diagram.get_input_port(i).get_name() for i in range(diagram.num_input_ports())}
    inputs = [(each, i) for each, system in systems.items() for i in range(system.num_input_ports())]
    assert sorted(fed) == sorted((e, i) for e, i in inputs if systems[e].get_input_port(i).get_name() not in outside)


def test_a_block_of_ones_own_is_drawn_with_what_feeds_it() -> None:
    class Model(DecisionBlock):
        def __init__(self, world: World, presets: Sequence[Motion]) -> None:
            super().__init__(world, presets)
            self.DeclareVectorInputPort("uav_command", 3)

    scenario = load("case_a")[0]
    text = graphviz.dot(build_diagram(scenario, "d", decision_block=Model, monitor=make_monitor(scenario)))
    assert ">Model<" in text
    assert ("uav_controller", "decision_variable") in edges(text)
    assert "beside it: monitor" in text


def test_pictures_fit_a_landscape_page() -> None:
    for name in shipped():
        width = re.search(r'bb="0,0,([\d.]+),', graphviz.dot(build_diagram(load(name)[0], "d")))
        assert width, name
        assert float(width[1]) <= PAGE_PT, name


def test_shipped_pictures_are_current_and_an_outdated_one_is_noticed() -> None:
    folder = Path(__file__).parent.parent / "diagrams"
    pictures = graphviz.pictures()
    assert {path.name for path in folder.glob("*.*") if path.suffix in (".dot", ".svg")} == set(pictures)
    for name, content in pictures.items():
        assert graphviz.is_current(name, content, (folder / name).read_text(encoding="utf-8")), name
        other = f"case_{'b' if 'case_a' in name else 'a'}{Path(name).suffix}"
        assert not graphviz.is_current(name, content, pictures[other])


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
