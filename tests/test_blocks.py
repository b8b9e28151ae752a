"""Block diagrams: every wire is told, data go from left to right, and the pictures fit a page."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise

import pytest
from pydrake.systems.framework import Diagram, DiagramBuilder, PortDataType, System
from pydrake.systems.primitives import Adder, ConstantVectorSource, Gain, PassThrough

from airground_drake.geometry.motion import Motion
from airground_drake.registry import METHODS
from airground_drake.scenarios.load import load, shipped
from airground_drake.systems import DecisionBlock, blocks, graphviz, schematic
from airground_drake.systems.diagram import build_diagram, make_monitor
from airground_drake.world.world import World

PAGE_PT = 785
"""Width of a landscape page of A4 with margins of 1 cm."""
FLOW = (
    "decision_variable", "event_trigger", "intervention_planner", "gatekeeper", "ugv_controller", "ugv1_plant",
)  # fmt: skip
"""How the picture is read."""


@pytest.fixture(scope="module")
def diagram() -> Diagram:
    return build_diagram(load("case_a")[0], "d")


def leaves(system: System, name: str = "") -> Iterator[tuple[str, System]]:
    if not isinstance(system, Diagram):
        yield name, system
        return
    for inner in system.GetSystems():
        yield from leaves(inner, f"{name}/{inner.get_name()}")


@pytest.mark.parametrize("method", METHODS)
def test_opened_wholly_every_input_is_fed_once_or_from_the_outside(method: str) -> None:
    diagram = build_diagram(load("case_a")[0], method)
    fed = [target for _, target in blocks.wires(diagram, 9)]
    assert len(fed) == len(set(fed))
    names = [diagram.get_input_port(i).get_name() for i in range(diagram.num_input_ports())]
    for name, system in leaves(diagram):
        for i in range(system.num_input_ports()):
            outside = system.get_input_port(i).get_name() in names
            assert (blocks.End(name, i) in fed) != outside, f"{name}, port {i}"


def test_a_wire_through_two_diagrams() -> None:
    """source -> (pass -> (gain)) -> adder, which is also fed by itself from the gain's other copy."""
    inner = DiagramBuilder()
    gain = inner.AddNamedSystem("gain", Gain(2.0, 1))
    inner.ExportInput(gain.get_input_port(), "u")
    inner.ExportOutput(gain.get_output_port(), "y")
    middle = DiagramBuilder()
    passing = middle.AddNamedSystem("pass", PassThrough(1))
    nested = middle.AddNamedSystem("nested", inner.Build())
    middle.Connect(passing.get_output_port(), nested.get_input_port())
    middle.ExportInput(passing.get_input_port(), "u")
    middle.ExportOutput(nested.get_output_port(), "y")
    outer = DiagramBuilder()
    source = outer.AddNamedSystem("source", ConstantVectorSource([1.0]))
    part = outer.AddNamedSystem("part", middle.Build())
    adder = outer.AddNamedSystem("adder", Adder(2, 1))
    outer.Connect(source.get_output_port(), part.get_input_port())
    for i in range(2):
        outer.Connect(part.get_output_port(), adder.get_input_port(i))
    whole = outer.Build()

    def told(depth: int) -> set[tuple[str, str, int]]:
        return {(source.block, target.block, target.port) for source, target in blocks.wires(whole, depth)}

    assert told(1) == {("/source", "/part", 0), ("/part", "/adder", 0), ("/part", "/adder", 1)}
    opened = {("/source", "/part/pass", 0), ("/part/pass", "/part/nested", 0)}
    assert told(2) == opened | {("/part/nested", "/adder", i) for i in range(2)}
    gain_path = "/part/nested/gain"
    assert told(3) == {("/source", "/part/pass", 0), ("/part/pass", gain_path, 0)} | {
        (gain_path, "/adder", i) for i in range(2)
    }


def test_wires_go_to_the_right_and_what_is_fed_back_is_told(diagram: Diagram) -> None:
    for part in diagram.GetSystems():
        text = blocks.graph(part)
        order = list(blocks.blocks(part, 1))
        drawn = re.findall(r'^"([^"]*)":o\d+:e -> "([^"]*)":i\d+:w', text, re.MULTILINE)
        assert all(order.index(source) < order.index(target) for source, target in drawn)
        back = text.count(blocks.BACK) - 1  # one is the legend's
        assert len(drawn) + back == len(list(blocks.wires(part, 1)))


def edges(text: str) -> set[tuple[str, str]]:
    """The wires of a picture, those from and to the vehicles as if these were one block."""
    found = re.findall(r'^"([^"]*)" -> "([^"]*)"', text, re.MULTILINE)
    told = [["vehicles" if end.endswith("_plant") or end == "bodies" else end for end in each] for each in found]
    return {(source, target) for source, target in told if source != target}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["minimal", "case_a", "doorway"])
def test_the_picture_has_every_block_and_every_wire_between_them(name: str, method: str) -> None:
    diagram = build_diagram(load(name)[0], method)
    text = graphviz.dot(diagram)
    nodes = re.findall(r'^"([^"]*)" \[', text, re.MULTILINE)
    systems = {path.rpartition("/")[2] for path in blocks.blocks(diagram, 2)}
    assert systems - set(nodes) == {"noise_source", "team_command", "velocity_disturbance", "team_velocity"}
    assert edges(text) == set(schematic.signals(diagram))


def test_the_picture_names_the_layers_of_the_paper_and_the_messages(diagram: Diagram) -> None:
    text = graphviz.dot(diagram)
    for layer in ("Task planning", "Decision making", "Optimisation", "Vehicles"):
        assert f"<B>{layer}</B>" in text
    dashed = set(re.findall(r'^"([^"]*)" -> "([^"]*)" \[style=dashed', text, re.MULTILINE))
    assert dashed == {
        ("intervention_planner", "gatekeeper"), ("intervention_planner", "ugv_controller"),
        ("gatekeeper", "intervention_planner"),
    }  # fmt: skip
    order = [text.index(f'"{source}" -> "{target}"') for source, target in pairwise(FLOW)]
    assert len(order) == len(FLOW) - 1


def test_a_block_of_ones_own_is_drawn_with_what_feeds_it() -> None:
    class Model(DecisionBlock):
        """Also sees what the UGVs are commanded."""

        def __init__(self, world: World, presets: Sequence[Motion]) -> None:
            super().__init__(world, presets)
            self.DeclareVectorInputPort("uav_command", 3)

    scenario = load("case_a")[0]
    text = graphviz.dot(build_diagram(scenario, "d", decision_block=Model, monitor=make_monitor(scenario)))
    assert ">Model<" in text
    assert ("uav_controller", "decision_variable") in edges(text)
    assert "beside it: monitor" in text


def test_every_vector_of_one_unit_has_it(diagram: Diagram) -> None:
    known = {"status", "accepted", "answers"}  # of several units, or none
    for part in diagram.GetSystems():
        for port in (part.get_output_port(i) for i in range(part.num_output_ports())):
            if port.get_data_type() == PortDataType.kVectorValued:
                assert (port.get_name() in blocks.UNITS) != (port.get_name() in known), port.get_name()


@pytest.mark.parametrize("name", shipped())
def test_the_picture_fits_a_landscape_page_at_ten_points(name: str) -> None:
    text = graphviz.dot(build_diagram(load(name)[0], "d"))
    assert "fontsize=10]" in text
    width = re.search(r'<svg [^>]*width="(\d+)pt"', graphviz.svg(text))
    assert width
    assert int(width[1]) <= PAGE_PT
