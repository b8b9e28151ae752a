"""Systems and wires of Drake diagrams, and Graphviz text with a block per system: its ports with their units."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from html import escape
from typing import NamedTuple

from pydrake.systems.framework import Diagram, InputPortIndex, OutputPortIndex, PortDataType, System

UNITS = {
    "bodies": "m",
    "team_command": "m/s",
    "ugv_command": "m/s",
    "uav_command": "m/s",
    "command": "m/s",
    "velocity": "m/s",
    "disturbance": "m/s",
    "reference": "m, m/s",
    "noise": "m",
    "decision_variable": "m",
    "decision_range": "m",
    "gains": "1/s",
}
"""Units of ports, by the port's name or by its part before a robot's name. Other ports have several units or none."""

FONT_PT = 10
SHADE, OUTSIDE, PLAIN = "#dfe8f1", "#0060a8", "#444444"
BACK = "↩"
LEGEND = (
    f'<FONT COLOR="{OUTSIDE}">» blue »</FONT>: from or to the outside; {BACK} fed back from a later block',
    "solid wires: numbers; dashed: messages; shaded: has a diagram inside",
)
_NUMBERED = re.compile(r"[uy]\d+|output")
"""Names that Drake gives to ports without a name."""


class End(NamedTuple):
    """An end of a wire: a block, by its names from the outermost diagram on, and a port of it, by index."""

    block: str
    port: int


class Ports(NamedTuple):
    """What a picture says about ports beside their names.

    Attributes:
        outside: names of those (side, 'i' or 'o', and end) that are ports of the whole diagram.
        back: of input ports that a later block feeds, which block and port; '' if it goes by the same name.
    """

    outside: Mapping[tuple[str, End], str]
    back: Mapping[End, str]


class Wire(NamedTuple):
    """From an output port of a block to an input port of one."""

    source: End
    target: End


def graph(diagram: Diagram) -> str:
    """One graph, its blocks in the order of the diagram; what a later one feeds is told by name, without a wire."""
    drawn = blocks(diagram, 1)
    rank = {block: i for i, block in enumerate(drawn)}
    outside: dict[tuple[str, End], str] = {}
    for i in range(diagram.num_input_ports()):
        outside |= {("i", end): diagram.get_input_port(i).get_name() for end in _targets(End("", i), diagram, 1)}
    for i in range(diagram.num_output_ports()):
        outside["o", _source(End("", i), diagram, 1)] = diagram.get_output_port(i).get_name()
    order = sorted(wires(diagram, 1), key=lambda wire: [(rank[end.block], end.port) for end in wire])
    back = {target: source for source, target in order if rank[target.block] <= rank[source.block]}
    ports = Ports(outside, {target: _told(drawn, source, target) for target, source in back.items()})
    title = "<BR/>".join([f"<B>{escape(diagram.get_name())}</B>", *LEGEND])
    lines = [
        f'digraph "{diagram.get_name()}" {{',
        f"graph [rankdir=LR, nodesep=0.2, ranksep=0.3, labelloc=t, fontname=Helvetica, fontsize={FONT_PT}]",
        f"node [shape=plain, fontname=Helvetica, fontsize={FONT_PT}]",
        f'edge [arrowsize=0.6, color="{PLAIN}"]',
        f"label=<{title}>",
        *(_node(system, block, ports) for block, system in drawn.items()),
    ]
    for source, target in order:
        if target not in back:
            port = drawn[source.block].get_output_port(source.port)
            look = " [style=dashed]" if port.get_data_type() == PortDataType.kAbstractValued else ""
            lines.append(f'"{source.block}":o{source.port}:e -> "{target.block}":i{target.port}:w{look}')
    return "\n".join([*lines, "}", ""])


def _told(drawn: Mapping[str, System], source: End, target: End) -> str:
    """Where an input port is fed from, if that has another name."""
    system = drawn[source.block]
    name = system.get_output_port(source.port).get_name()
    if name == drawn[target.block].get_input_port(target.port).get_name():
        return ""
    return f"{system.get_name()} {'' if _NUMBERED.fullmatch(name) else name}".strip()


def blocks(diagram: Diagram, depth: int, within: str = "") -> dict[str, System]:
    """The systems of a diagram by their names, from the outermost on; diagrams below that depth are closed."""
    found: dict[str, System] = {}
    for system in diagram.GetSystems():
        name = f"{within}/{system.get_name()}"
        found |= blocks(system, depth - 1, name) if _is_open(system, depth - 1) else {name: system}
    return found


def wires(diagram: Diagram, depth: int, within: str = "") -> Iterator[Wire]:
    """The wires between `blocks`, each once, in the order of memory addresses."""
    for (target, i), (source, k) in diagram.connection_map().items():
        start = _source(End(f"{within}/{source.get_name()}", int(k)), source, depth - 1)
        for end in _targets(End(f"{within}/{target.get_name()}", int(i)), target, depth - 1):
            yield Wire(start, end)
    for system in diagram.GetSystems():
        if _is_open(system, depth - 1):
            yield from wires(system, depth - 1, f"{within}/{system.get_name()}")


def _is_open(system: System, depth: int) -> bool:
    return isinstance(system, Diagram) and depth > 0


def _source(end: End, system: System, depth: int) -> End:
    """The output port of a block that is an output port of a system in which it is."""
    if not _is_open(system, depth):
        return end
    inner, k = system.get_output_port_locator(OutputPortIndex(end.port))
    return _source(End(f"{end.block}/{inner.get_name()}", int(k)), inner, depth - 1)


def _targets(end: End, system: System, depth: int) -> Iterator[End]:
    """The input ports of blocks that an input port of a system in which they are stands for."""
    if not _is_open(system, depth):
        yield end
        return
    for inner, i in system.GetInputPortLocators(InputPortIndex(end.port)):
        yield from _targets(End(f"{end.block}/{inner.get_name()}", int(i)), inner, depth - 1)


def _node(system: System, block: str, ports: Ports) -> str:
    """A table: name and kind, then the input ports, to the left, and the output ports, to the right."""
    inside = isinstance(system, Diagram)
    kind = f"{len(system.GetSystems())} systems" if inside else type(system).__name__.rstrip("_")
    shade = f' BGCOLOR="{SHADE}"' if inside else ""
    rows = [f"<TR><TD{shade}><B>{escape(system.get_name())}</B><BR/>{escape(kind)}</TD></TR>"]
    rows += [
        _row("i", End(block, i), system.get_input_port(i).get_name(), ports) for i in range(system.num_input_ports())
    ]
    rows += [
        _row("o", End(block, k), system.get_output_port(k).get_name(), ports) for k in range(system.num_output_ports())
    ]
    table = "\n".join(['<TABLE BORDER="0" CELLBORDER="1" CELLSPACING="0" CELLPADDING="2">', *rows, "</TABLE>"])
    return f'"{block}" [tooltip="{system.get_name()}", label=<{table}>]'


def _row(side: str, end: End, name: str, ports: Ports) -> str:
    outer = ports.outside.get((side, end))
    if outer is not None and _NUMBERED.fullmatch(name):
        name = outer
    unit = UNITS.get(name, UNITS.get(name.partition("_")[0], ""))
    text = f"{escape(name)}{f' <I>{unit}</I>' if unit else ''}"
    if outer is not None:
        other = "" if outer == name else f" ({escape(outer)})"
        text = f"» {text}{other}" if side == "i" else f"{text}{other} »"
        text = f'<FONT COLOR="{OUTSIDE}">{text}</FONT>'
    elif side == "i" and end in ports.back:
        text = f"{text} {BACK} {escape(ports.back[end])}".rstrip()
    return f'<TR><TD PORT="{side}{end.port}" ALIGN="{"LEFT" if side == "i" else "RIGHT"}">{text}</TD></TR>'
