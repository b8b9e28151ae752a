"""Graphviz picture of a scenario's diagram: the layers of the paper's Figure 2, read from left to right.

Systems and wires are read from the Drake diagram; this module only knows their places. Task planning is above, decision
making and optimisation are below, and the vehicles are on the right. One bold wire carries the positions back.
The picture leaves out the source of the noise and all of `vehicles` except the plants.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from html import escape
from itertools import pairwise
from typing import NamedTuple

from pydrake.systems.framework import Diagram, PortDataType, System

LAYERS = {
    "task_planning": "#e7f1e1",
    "decision_making": "#e1ebf6",
    "optimisation": "#fbefdc",
    "vehicles": "#ececec",
}
"""The layers, which are diagrams themselves, and their colours."""
UNITS = {
    "bodies": "m",
    "ugv_command": "m/s",
    "uav_command": "m/s",
    "reference": "m, m/s",
    "noise": "m",
    "decision_variable": "m",
    "decision_range": "m",
    "gains": "1/s",
}
"""Units of signals by name. Other signals have several units or no unit."""
REALISES = {
    "AffineSystem": "integrated noise",
    "DecisionVariable": "DDM, (15)",
    "EventTrigger": "threshold, (19), (20)",
    "InterventionPlanner": "proposals, (12)-(14)",
    "PaperGatekeepers": "MPC, (21)-(29)",
    "OutcomeGatekeepers": "by outcomes",
    "DirectAcceptance": "accepts all",
    "UgvController": "NSBC, (5)-(8), (20)",
    "UavController": "NSBC, (9)-(11)",
    "TrajectorySource": "preset trajectories",
}
"""What a system does, by the name of its class. The picture shows the class name of any other system."""
MOST_PLANTS = 6
"""Larger teams are drawn with their first UGVs and the UAV only."""

FONT_PT, SMALL_PT = 10, 8
OUTSIDE, PLAIN = "#0060a8", "#444444"
HEIGHT_PT, PLANT_PT, MARGIN_PT = 34.0, 20.0, 9.0
"""Heights of a block and of a vehicle; distance from a block to the frame of its layer."""
LETTER_PT, TITLE_PT, BUS_PT = 5.7, 18.0, 18.0
"""Width of a letter; height of a layer's title; distance from a layer to the wire of the positions."""
ARROW_PT = 6.0

Point = tuple[float, float]


class Box(NamedTuple):
    """A rectangle: its left, lower, right and upper side, pt."""

    left: float
    low: float
    right: float
    up: float

    @property
    def x(self) -> float:
        """Middle across."""
        return (self.left + self.right) / 2

    @property
    def y(self) -> float:
        """Middle up."""
        return (self.low + self.up) / 2


class Route(NamedTuple):
    """Corners of a wire, from its source on; the middle of its label, if it has one."""

    corners: Sequence[Point]
    label: Point | None = None


class End(NamedTuple):
    """An end of a wire: a system, its layer ('' beside the layers), and the index of the port."""

    layer: str
    system: str
    port: int


Signals = dict[tuple[str, str], list[tuple[str, bool]]]
"""Names of the signals from one system to another, and whether each is a message."""


def graph(diagram: Diagram) -> str:
    """Graphviz text of a diagram of `build_diagram`, with a fixed place for everything (layout `nop2`)."""
    systems = _systems(diagram)
    layers = {layer: [each.get_name() for each in diagram.GetSubsystemByName(layer).GetSystems()] for layer in LAYERS}
    plants = [name for name in layers["vehicles"] if name.endswith("_plant")]  # the last is the UAV's
    shown = plants if len(plants) <= MOST_PLANTS else [*plants[: MOST_PLANTS - 2], plants[-1]]
    boxes = _places(systems, shown)
    frames = _frames(boxes, shown)
    width, height = frames["vehicles"].right, frames["vehicles"].up + 30.0
    lines = [
        f'digraph "{diagram.get_name()}" {{',
        f'graph [layout=nop2, bb="0,0,{width:g},{height:g}", lp="{width / 2:g},{height - 12:g}", '
        f"label={_title(diagram, plants, shown)}, fontname=Helvetica, fontsize={FONT_PT}]",
        f'node [shape=box, style=filled, fillcolor=white, color="{PLAIN}", fixedsize=true, margin=0, '
        f"fontname=Helvetica, fontsize={FONT_PT}]",
        f'edge [arrowsize=0.6, color="{PLAIN}", fontname=Helvetica, fontsize={SMALL_PT}]',
    ]
    for layer, frame in frames.items():
        words = layer.replace("_", " ").capitalize()
        lines.append(f'subgraph "cluster_{layer}" {{')
        lines.append(
            f'bb="{",".join(f"{side:g}" for side in frame)}"; style=filled; color="{LAYERS[layer]}"; '
            f'label=<<B>{words}</B>>; lp="{_lettered(layer, frame, words, boxes)}"'
        )
        lines += [_node(name, systems[name], boxes[name]) for name in layers[layer] if name in boxes]
        lines.append("}")
    recorded = {diagram.get_output_port(i).get_name() for i in range(diagram.num_output_ports())}
    lines += _edges(signals(diagram), boxes, frames, shown, recorded)
    return "\n".join([*lines, "}", ""])


def signals(diagram: Diagram) -> Signals:
    """The signals between the systems of the layers; all of `vehicles` counts as one system."""
    found: Signals = {}
    systems = _systems(diagram)
    for start, end in sorted(_wires(diagram)):
        source, target = ("vehicles" if each.layer == "vehicles" else each.system for each in (start, end))
        if source in (target, "noise_source"):
            continue
        port = systems[start.system].get_output_port(start.port)
        name = systems[end.system].get_input_port(end.port).get_name()  # inputs are fed by name
        name = f"{source.partition('_')[0]}_command" if target == "vehicles" else name
        found.setdefault((source, target), []).append((name, port.get_data_type() == PortDataType.kAbstractValued))
    return found


def _systems(diagram: Diagram) -> dict[str, System]:
    """The systems in the layers and beside them, by name."""
    parts = diagram.GetSystems()
    return {each.get_name(): each for part in parts for each in (part.GetSystems() if _is_layer(part) else [part])}


def _is_layer(system: System) -> bool:
    return system.get_name() in LAYERS


def _wires(diagram: Diagram) -> Iterator[tuple[End, End]]:
    """Each wire between two of `_systems` once: within layers, and through the ports of layers."""
    for layer in ("", *LAYERS):
        within = diagram.GetSubsystemByName(layer) if layer else diagram
        for (target, i), (source, k) in within.connection_map().items():
            start, ends = End(layer, source.get_name(), int(k)), [End(layer, target.get_name(), int(i))]
            if _is_layer(source):
                inner, port = source.get_output_port_locator(k)
                start = End(source.get_name(), inner.get_name(), int(port))
            if _is_layer(target):
                inside = target.GetInputPortLocators(i)
                ends = [End(target.get_name(), each.get_name(), int(port)) for each, port in inside]
            yield from ((start, end) for end in ends)


def _lettered(layer: str, frame: Box, words: str, boxes: Mapping[str, Box]) -> str:
    """Place of a layer's title: at its top, or at its bottom if wires enter from above."""
    beside = {"decision_making": "event_trigger", "optimisation": "gatekeeper"}.get(layer)
    left = frame.left + MARGIN_PT if beside is None else boxes[beside].left
    y = frame.up - TITLE_PT / 2 if beside is None else frame.low + TITLE_PT / 2
    return f"{left + LETTER_PT * len(words) / 2:g},{y:g}"


def _title(diagram: Diagram, plants: Sequence[str], shown: Sequence[str]) -> str:
    """Name of the diagram, and below it how to read the picture."""
    told = ["solid: numbers, dashed: messages, bold: positions (to the gatekeeper: commands, too), blue: recorded"]
    if len(shown) < len(plants):
        told.append(f"{len(plants)} vehicles, {len(shown)} of them shown")
    told += [f"beside it: {each.get_name()}" for each in diagram.GetSystems() if not _is_layer(each)]
    return f'<<B>{escape(diagram.get_name())}</B><BR/><FONT POINT-SIZE="{SMALL_PT}">{escape("; ".join(told))}</FONT>>'


def _does(system: System) -> str:
    """What a system does, in a few words."""
    kind = str(getattr(system, "judges", type(system).__name__.rstrip("_")))
    return REALISES.get(kind, kind)


def _width(name: str, small: str) -> float:
    return max(LETTER_PT * len(name), LETTER_PT * SMALL_PT / FONT_PT * len(small)) + 8.0


def _places(systems: Mapping[str, System], plants: Sequence[str]) -> dict[str, Box]:
    """Places of the blocks: five columns; two rows below the wire of the positions and two above it."""
    columns = (
        ("reference", "decision_variable", "decision_noise"),
        ("intervention_planner", "event_trigger"),
        ("gatekeeper",),
        ("ugv_controller", "uav_controller"),
        plants,
    )
    gaps = (96.0, 50.0, 46.0, 76.0, 0.0)
    noise = MARGIN_PT + HEIGHT_PT / 2
    below = noise + HEIGHT_PT + 18.0
    uav = below + HEIGHT_PT / 2 + TITLE_PT + 2 * BUS_PT + MARGIN_PT + HEIGHT_PT / 2
    stack = (PLANT_PT + 6.0) * (len(plants) - 1)
    ugv = uav + max(HEIGHT_PT + 22.0, HEIGHT_PT / 2 + 6.0 + stack / 2)
    rows = {
        "reference": ugv, "ugv_controller": ugv, "intervention_planner": uav, "uav_controller": uav,
        "decision_variable": below, "event_trigger": below, "gatekeeper": below, "decision_noise": noise,
    }  # fmt: skip
    found, left = {}, MARGIN_PT
    for names, gap in zip(columns, gaps, strict=True):
        widest = max(_width(name, "" if name in plants else _does(systems[name])) for name in names)
        for k, name in enumerate(names):
            if name in plants:
                y = uav if name == plants[-1] else ugv + stack / 2 - (PLANT_PT + 6.0) * (k + 0.5)
            else:
                y = rows[name]
            half = (PLANT_PT if name in plants else HEIGHT_PT) / 2
            begin = left + (22.0 if name == "uav_controller" else 0.0)  # the wire to the one above passes beside it
            found[name] = Box(begin, y - half, left + widest + (22.0 if "_controller" in name else 0.0), y + half)
        left = max(found[name].right for name in names) + gap
    return found


def _frames(boxes: Mapping[str, Box], plants: Sequence[str]) -> dict[str, Box]:
    """Places of the layers."""
    first, last = boxes[plants[0]], boxes[plants[-1]]
    top = max(boxes["reference"].up, first.up) + TITLE_PT + MARGIN_PT / 2
    below, planner, gate = boxes["decision_variable"], boxes["intervention_planner"], boxes["gatekeeper"]
    right = boxes["uav_controller"].right + MARGIN_PT
    return {
        "task_planning": Box(0.0, planner.low - MARGIN_PT, right, top),
        "decision_making": Box(0.0, 0.0, planner.right + MARGIN_PT, below.up + TITLE_PT),
        "optimisation": Box(gate.left - 44.0, 0.0, right, below.up + TITLE_PT),
        "vehicles": Box(last.left - 20.0, below.up + TITLE_PT, last.right + 20.0, top),
    }


def _routes(boxes: Mapping[str, Box], frames: Mapping[str, Box], plants: Sequence[str]) -> dict[tuple[str, str], Route]:
    """Corners of the wires by the systems at their ends. Wires of positions begin at a junction."""
    ddm, noise, trigger = (boxes[name] for name in ("decision_variable", "decision_noise", "event_trigger"))
    reference, planner, gate = (boxes[name] for name in ("reference", "intervention_planner", "gatekeeper"))
    ugv, uav = boxes["ugv_controller"], boxes["uav_controller"]
    above, below, beside = planner.y + 7, planner.y - 7, ddm.left + 24
    # where bent wires go up or down: answers to the planner, proposals, answers to the controller, commands
    judged, asked, answered, fanned = gate.left - 22, ugv.left - 28, ugv.left - 14, boxes[plants[0]].left - 12
    start = _junction(boxes, frames, plants)
    bus = start[1]
    found = {
        ("decision_noise", "decision_variable"): Route(
            [(noise.x, noise.up), (noise.x, ddm.low)], (noise.x + 24, noise.up + 9)
        ),
        ("decision_variable", "event_trigger"): Route(
            [(ddm.right, ddm.y), (trigger.left, ddm.y)], ((ddm.right + trigger.left) / 2 - 3, ddm.y + 1)
        ),
        ("reference", "decision_variable"): Route([(beside, reference.low), (beside, ddm.up)]),
        ("reference", "ugv_controller"): Route(
            [(reference.right, ugv.y + 9), (ugv.left, ugv.y + 9)], (planner.x, ugv.y + 15)
        ),
        ("event_trigger", "intervention_planner"): Route(
            [(trigger.x, trigger.up), (trigger.x, planner.low)], (trigger.x + 16, planner.low - 16)
        ),
        ("intervention_planner", "gatekeeper"): Route(
            [(planner.right, above), (gate.left + 20, above), (gate.left + 20, gate.up)], (gate.x, above + 6)
        ),
        ("intervention_planner", "ugv_controller"): Route(_bent((planner.right, above), asked, (ugv.left, ugv.y))),
        ("gatekeeper", "intervention_planner"): Route(
            _bent((gate.left, gate.y), judged, (planner.right, below)), (judged + 20, planner.low)
        ),
        ("gatekeeper", "ugv_controller"): Route(
            _bent((gate.right, gate.y + 8), answered, (ugv.left, ugv.y - 9)), (answered + 20, gate.up - 4)
        ),
        ("ugv_controller", "uav_controller"): Route([(uav.x, ugv.low), (uav.x, uav.up)]),
        ("uav_controller", plants[-1]): Route(
            [(uav.right, uav.y), (boxes[plants[-1]].left, uav.y)], ((uav.right + fanned) / 2, uav.y + 11)
        ),
    }
    for name, x, y in (
        ("decision_variable", ddm.right - 24, ddm.up), ("intervention_planner", planner.left + 16, planner.low),
        ("gatekeeper", gate.right - 20, gate.up), ("ugv_controller", ugv.left + 10, ugv.low),
        ("uav_controller", uav.x, uav.low),
    ):  # fmt: skip
        label = ((ddm.right + planner.left) / 2 - 2, bus + 7) if name == "decision_variable" else None
        found["vehicles", name] = Route([start, (x, bus), (x, y)], label)
    for plant in plants[:-1]:
        label = ((ugv.right + fanned) / 2, ugv.y + 11) if plant == plants[0] else None
        found["ugv_controller", plant] = Route(
            _bent((ugv.right, ugv.y), fanned, (boxes[plant].left, boxes[plant].y)), label
        )
    return found


def _junction(boxes: Mapping[str, Box], frames: Mapping[str, Box], plants: Sequence[str]) -> Point:
    """Where the positions of all vehicles join."""
    return boxes[plants[-1]].right + 10, frames["task_planning"].low - BUS_PT


def _bent(start: Point, x: float, end: Point) -> list[Point]:
    """Corners of a wire that goes across to x, up or down, and across to its end."""
    return [start, (x, start[1]), (x, end[1]), end]


def _node(name: str, system: System, box: Box) -> str:
    small = "" if name.endswith("_plant") else f'<BR/><FONT POINT-SIZE="{SMALL_PT}">{escape(_does(system))}</FONT>'
    return (
        f'"{name}" [pos="{box.x:g},{box.y:g}", width={(box.right - box.left) / 72:.4f}, '
        f"height={(box.up - box.low) / 72:.4f}, label=<<B>{escape(name)}</B>{small}>]"
    )


def _edges(
    joined: Signals, boxes: Mapping[str, Box], frames: Mapping[str, Box], plants: Sequence[str], recorded: Set[str]
) -> list[str]:
    """Graphviz text of the wires and of the junction of the positions."""
    routes = _routes(boxes, frames, plants)
    junction = _junction(boxes, frames, plants)
    bold = "penwidth=2.5, "
    lines = [f'"bodies" [pos="{junction[0]:g},{junction[1]:g}", shape=point, width=0.05, label=""]']
    for plant in plants:
        box = boxes[plant]
        corners = [(box.right, box.y), (junction[0], box.y), junction]
        lines.append(f'"{plant}" -> "bodies" [{bold}dir=none, pos="{_spline(corners, arrow=False)}"]')
    for (source, target), given in joined.items():
        if not {source, target} <= {"vehicles", *boxes}:
            continue
        heads: Sequence[str] = [target]
        if target == "vehicles":
            heads = plants[-1:] if source == "uav_controller" else plants[:-1]
        for head in heads:
            route = routes.get((source, head)) or _straight(boxes[source], boxes[head])
            look = bold if source == "vehicles" else ""
            look += "style=dashed, " if any(message for _, message in given) else ""
            if route.label is not None:
                words = "<BR/>".join(_told(name, recorded, narrow=target == "vehicles") for name, _ in given)
                look += f'label=<{words}>, lp="{route.label[0]:g},{route.label[1]:g}", '
            tail = "bodies" if source == "vehicles" else source
            lines.append(f'"{tail}" -> "{head}" [{look}pos="{_spline(route.corners)}"]')
    return lines


def _straight(begin: Box, end: Box) -> Route:
    """A straight wire, for signals that only a user's own block has."""
    return Route([(begin.x, begin.y), (end.x, end.y)], ((begin.x + end.x) / 2, (begin.y + end.y) / 2))


def _told(name: str, recorded: Set[str], *, narrow: bool) -> str:
    """Name and unit of a signal, in two lines if `narrow`."""
    text = f"{name}{'<BR/>' if narrow else ' '}<I>{UNITS[name]}</I>" if name in UNITS else name
    kept = name in recorded or name.endswith("_command")  # the two commands are recorded together
    return f'<FONT COLOR="{OUTSIDE}">{text}</FONT>' if kept else text


def _spline(corners: Sequence[Point], *, arrow: bool = True) -> str:
    """Straight lines through corners as Bezier curves of Graphviz, where the arrow's head begins at their end."""
    ends = list(corners)
    (x, y), (x0, y0) = ends[-1], ends[-2]
    if arrow:
        length = ((x - x0) ** 2 + (y - y0) ** 2) ** 0.5
        ends[-1] = (x - ARROW_PT * (x - x0) / length, y - ARROW_PT * (y - y0) / length)
    points = [ends[0], *(point for a, b in pairwise(ends) for point in (a, b, b))]
    return (f"e,{x:g},{y:g} " if arrow else "") + " ".join(f"{a:g},{b:g}" for a, b in points)
