"""Diagrams and their pictures."""

import re
from collections.abc import Sequence

import numpy as np
import pytest
from pydrake.trajectories import PiecewisePolynomial

from airground_drake.model.bodies.world import World
from airground_drake.model.geometry.motion import Motion
from airground_drake.scenario.load import load
from airground_drake.scenario.shipped import shipped
from airground_drake.sim import graphviz
from airground_drake.sim.blocks import DecisionBlock
from airground_drake.sim.components import stack_presets
from airground_drake.sim.diagram import build_diagram, make_monitor

PAGE_PT = 785
"""Width of a landscape page of A4 with margins of 1 cm."""


def test_corners_of_two_presets_that_rounding_keeps_apart_are_one() -> None:
    """At 24 s, between the ends of the two, a velocity over four units in the last place would be one of rounding."""
    ends = [24.0, 24.0 - 4e-15, 24.0 + 4e-15]
    presets = [Motion(np.array([0.0, end]), np.array([[9.7, 7.0, 0.0], [-9.7, -7.1, 0.0]])) for end in ends]
    times, places = stack_presets(presets)
    together = PiecewisePolynomial.FirstOrderHold(times, places.T)
    rates = together.EvalDerivative(24.0, 1).reshape(-1, 3)
    assert all(min(np.abs(rate - side).max() for side in (presets[0].at(1.0)[1], 0.0)) < 1e-9 for rate in rates)
    assert together.value(24.0).ravel() == pytest.approx(np.tile([-9.7, -7.1, 0.0], 3), abs=1e-12)
    assert together.start_time() == 0.0


def drawn(text: str) -> tuple[set[str], list[tuple[str, str]]]:
    ports = {
        f"{block}:{port}": f"{block}.{re.sub('<.*?>', '', name)}"
        for block, table in re.findall(r"^(\w+) \[shape=none, border(.*?)^>\];", text, re.MULTILINE | re.DOTALL)
        for port, name in re.findall(r'PORT="(\w+)"[^>]*>(.*?)</TD>', table)
    }
    wires = re.findall(r"^(\w+:\w+):e -> (\w+:\w+):w", text, re.MULTILINE)
    return {port.partition(":")[0] for port in ports}, [(ports[start], ports[end]) for start, end in wires]


@pytest.mark.parametrize(("name", "method"), [("minimal", "a"), ("case_a", "b"), ("doorway", "c"), ("case_a", "d")])
def test_the_picture_has_every_block_and_each_input_is_fed_by_the_signal_of_its_name(name: str, method: str) -> None:
    diagram = build_diagram(load(name), method)
    blocks, wires = drawn(graphviz.dot(diagram))
    parts = {part.get_name(): part for part in diagram.GetSystems()}
    inner = [each for layer in graphviz.LAYERS for each in parts[layer].GetSystems()]
    systems = {each.get_name(): each for each in [*inner, parts["vehicles"]] if each.get_name() != "noise_source"}
    assert blocks == set(systems)
    inputs = [
        f"{block}.{system.get_input_port(i).get_name()}"
        for block, system in systems.items()
        for i in range(system.num_input_ports())
        if not system.get_input_port(i).get_name().startswith("disturbance") and block != "decision_noise"
    ]
    assert sorted(end for _, end in wires) == sorted(inputs)
    unnamed = {"y0": ("reference", "noise"), "command": ("ugv_command", "uav_command")}
    for start, end in wires:
        (source, port), signal = start.split("."), end.partition(".")[2]
        assert signal in (port, *unnamed.get(port, ())), (start, end)
        assert port not in unnamed or source.startswith(signal.partition("_")[0]) or source == "decision_noise"


def test_the_text_does_not_depend_on_what_was_built_before() -> None:
    scenario = load("case_a")
    text, again = (graphviz.dot(build_diagram(scenario, "c")) for _ in range(2))
    assert text == again
    wires = re.findall(r"^(\w+:\w+):e -> (\w+:\w+):w", text, re.MULTILINE)
    assert wires == sorted(wires)  # Drake's order is that of addresses


def test_a_block_of_ones_own_is_drawn_with_what_feeds_it_and_a_monitor() -> None:
    class Model(DecisionBlock):
        def __init__(self, world: World, presets: Sequence[Motion]) -> None:
            super().__init__(world, presets)
            self.DeclareVectorInputPort("uav_command", 3)

    scenario = load("case_a")
    text = graphviz.dot(build_diagram(scenario, "d", decision_block=Model, monitor=make_monitor(scenario)))
    assert "<BR/>Model<BR/><I>on the UAV</I>\n" in text
    blocks, wires = drawn(text)
    assert ("uav_controller.command", "decision_variable.uav_command") in wires
    assert "monitor" in blocks


def test_pictures_fit_a_landscape_page() -> None:
    for name in shipped():
        width = re.search(r'<svg [^>]*width="(\d+)pt"', graphviz.svg(graphviz.dot(build_diagram(load(name), "d"))))
        assert width, name
        assert int(width[1]) <= PAGE_PT, name
