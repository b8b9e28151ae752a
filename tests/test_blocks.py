"""Block diagrams: every wire is told, data go from left to right, and the pictures fit a page."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from pydrake.systems.framework import Diagram, DiagramBuilder, PortDataType, System
from pydrake.systems.primitives import Adder, ConstantVectorSource, Gain, PassThrough

from airground_drake import blocks, graphviz
from airground_drake.diagram import build_diagram
from airground_drake.registry import METHODS
from airground_drake.report.figures import svg
from airground_drake.scenarios.load import load, shipped

PAGE_PT = 539
"""Width of a page of A4 with margins of 1 cm."""


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
    assert [text.split('"')[1] for text in blocks.overview(whole)] == [whole.get_name(), part.get_name()]


@pytest.mark.parametrize("depth", [1, 2])
def test_wires_go_to_the_right_and_what_is_fed_back_is_told(diagram: Diagram, depth: int) -> None:
    text = blocks.graph(diagram, depth)
    order = list(blocks.blocks(diagram, depth))
    drawn = re.findall(r'^"([^"]*)":o\d+:e -> "([^"]*)":i\d+:w', text, re.MULTILINE)
    assert drawn
    assert all(order.index(source) < order.index(target) for source, target in drawn)
    assert len(drawn) + text.count(blocks.BACK) - 1 == len(list(blocks.wires(diagram, depth)))  # one is the legend's


def test_messages_are_dashed(diagram: Diagram) -> None:
    text = blocks.graph(diagram)
    ugvs, uav = (diagram.GetSubsystemByName(name) for name in ("ugvs", "uav"))
    dashed = re.findall(r'"/uav":o(\d+):e -> "/ugvs":i(\d+):w \[style=dashed\]', text)
    assert [(uav.get_output_port(int(o)).get_name(), ugvs.get_input_port(int(i)).get_name()) for o, i in dashed] == [
        ("proposals", "proposals")
    ]


def test_every_vector_of_one_unit_has_it(diagram: Diagram) -> None:
    known = {"status", "accepted", "answers"}  # of several units, or none
    for part in diagram.GetSystems():
        for port in (part.get_output_port(i) for i in range(part.num_output_ports())):
            if port.get_data_type() == PortDataType.kVectorValued:
                assert (port.get_name() in blocks.UNITS) != (port.get_name() in known), port.get_name()


@pytest.mark.parametrize("name", shipped())
def test_the_overview_fits_a_page_at_ten_points(name: str) -> None:
    text = blocks.graph(build_diagram(load(name)[0], "d"))
    assert "fontsize=10]" in text
    width = re.search(r'<svg [^>]*width="(\d+)pt"', graphviz.svg(text))
    assert width
    assert int(width[1]) <= PAGE_PT


def test_blocks_lead_to_their_diagrams_also_on_a_page(diagram: Diagram) -> None:
    picture = graphviz.svg(graphviz.dot(diagram))
    ids = re.findall(r'\bid="([^"]*)"', picture)
    assert ids == ["case_a_method_d", "decision", "uav", "ugvs", "world"]
    assert re.findall(r'xlink:href="#([^"]*)"', picture) == ids[1:]
    inlined = svg.inline(picture, "diagram", "Diagram", "of blocks", natural_size=True)
    assert re.findall(r'[ :]href="#([^"]*)"', inlined) == [f"diagram-{each}" for each in ids[1:]]
    assert all(f'id="diagram-{each}"' in inlined for each in ids[1:])
    assert 'role="group"' in inlined  # what is an image has no links, for who hears it
