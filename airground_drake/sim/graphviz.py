"""Graphviz pictures of diagrams, from Drake's own text.

In the picture of a scenario's diagram the paper's layers are clusters with their blocks, a wire through a port of a
layer is drawn as one, and the blocks stand in a fixed order. All else is Drake's text.
"""

import os
import re
import sys
import warnings
from collections import ChainMap
from collections.abc import Iterator, Mapping, Set
from contextlib import contextmanager
from html import escape

import pygraphviz
from pydrake.systems.framework import Diagram, System

from airground_drake.base import files

# The layers that are shown with their blocks, and their colours. Any other part of the diagram is one block.
LAYERS = {"decision_making": "#e1ebf6", "task_planning": "#e7f1e1", "optimisation": "#fbefdc"}
HIDDEN = "noise_source"  # a block without inputs that would take a column of its own
# Blocks from left to right. A wire to the left is drawn after its ends have their places.
ORDER = (
    "vehicles", "reference", "decision_noise", "decision_variable", "event_trigger", "intervention_planner",
    "all_proposals", "gatekeeper", "ugv_controller", "uav_controller",
)  # fmt: skip
COLUMNS = (ORDER[:3], ORDER[-2:])  # blocks that stand below each other
# What a system does, by the name of its class. The picture shows the class name of any other system.
REALISES = {
    "AffineSystem": "integrated noise",
    "DecisionVariable": "DDM, (15)",
    "EventTrigger": "threshold, (20)",
    "InterventionPlanner": "proposals, (12)-(14)",
    "AllProposals": "what UAVs ask",
    "MixedIntegerRoute": "MPC, (21)-(26)",
    "RelaxedRoute": "MPC, relaxed, (27)-(29)",
    "NonlinearRoute": "MPC, relaxed, (27)-(29)",
    "OutcomeGatekeepers": "by outcomes",
    "DirectAcceptance": "accepts all",
    "UgvController": "NSBC, (5)-(8), (20)",
    "WaryUgvController": "NSBC, stands without positions",
    "AsynchronousUgvController": "NSBC, by old positions",
    "ViewsUgvController": "NSBC, by own measurements",
    "UavController": "NSBC, (9)-(11)",
    "PositionSensing": "errors of positions",
    "TrajectorySource": "preset trajectories",
    "Diagram": "plants, disturbances",
}
# Colours of recorded signals, of wires, and of wires from the vehicles, which lead nearly everywhere.
RECORDED, INK, MUTED = "#0060a8", "#1a1a1a", "#666666"
# Which blocks fly and which drive. A wire between them is a radio link.
ABOARD = {
    "decision_noise": "UAV", "decision_variable": "UAV", "event_trigger": "UAV", "intervention_planner": "UAV",
    "uav_controller": "UAV", "all_proposals": "UAV", "gatekeeper": "UGVs", "ugv_controller": "UGVs",
}  # fmt: skip
LEGEND = "dashed: sent between UAV and UGVs, grey: from the vehicles, blue: recorded"
WIDTH_IN = 10.9  # maximum width of a picture: that of a landscape page of A4 with margins of 1 cm

_WIRE = re.compile(r"^(\w+:\w+):e -> (\w+:\w+):w", re.MULTILINE)
_HEAD = re.compile(r"<B>.*?</B><BR/>\nname=\w+")
_DISTURBANCE = re.compile(r'<TR>\n<TD PORT="u\d+"[^>]*>disturbance_\w+</TD>\n(<TD [^>]*></TD>\n)?</TR>\n')
_PICTURE = re.compile(r'<svg width="(\d+)pt" height="(\d+)pt".*?>\s*(<g .*</g>)\s*</svg>', re.DOTALL)
_ID = re.compile(r' id="[^"]*"')


def has_layers(diagram: Diagram) -> bool:
    return all(diagram.HasSubsystemNamed(layer) for layer in LAYERS)


def dot(diagram: Diagram) -> str:
    """Graphviz text: layers and blocks for a scenario's diagram, Drake's own text for any other diagram."""
    # The text of a scenario's diagram depends on the scenario and the method only.
    whole, name = str(diagram.GetGraphvizString(max_depth=1)), diagram.get_name()
    if not has_layers(diagram):
        return whole
    layers = {layer: diagram.GetSubsystemByName(layer) for layer in LAYERS}
    shown = {layer: {system.get_name(): system for system in parts.GetSystems()} for layer, parts in layers.items()}
    beside = {system.get_name(): system for system in diagram.GetSystems() if system.get_name() not in LAYERS}
    blocks = {n: system for n, system in ChainMap(beside, *shown.values()).items() if n != HIDDEN}
    texts = {n: "".join(system.GetGraphvizFragment(max_depth=0).fragments) for n, system in blocks.items()}
    # Drake's numbers of systems depend on what the process has built before
    wired = "".join([whole, *(str(layer.GetGraphvizString(max_depth=1)) for layer in layers.values())])
    for n, text in texts.items():
        wired = re.sub(rf"\b{text.split(' ', 1)[0]}:", f"{n}:", wired)
    wired = re.sub(r"\b(s\d+)out:", r"\1:y", re.sub(r"\b(s\d+)in:", r"\1:u", wired))  # ports of layers
    feeds = {end: start for start, end in _WIRE.findall(wired)}

    def origin(port: str) -> str:
        """The output port from which the signal at a port comes."""
        return origin(feeds[port]) if port in feeds else port

    wires = sorted((origin(end), end) for end in feeds if _block(end) in blocks and _block(origin(end)) in blocks)
    outputs = whole.split(maxsplit=2)[1].replace("_", "s") + ":y"
    recorded = {origin(end) for end in feeds if end.startswith(outputs)}
    fed_unseen = {end for end in feeds if _block(end) in blocks and _block(origin(end)) not in blocks}
    lines = [
        f'digraph "{name}" {{',
        f'graph [rankdir=LR, newrank=true, nodesep=0.15, ranksep=0.3, size="{WIDTH_IN},100", labelloc=t, '
        f"label=<<B>{name}</B><BR/>{LEGEND}>, fontname=Helvetica, fontsize=10]",
        "node [shape=none, margin=0, fontname=Helvetica, fontsize=8]",
        f'edge [arrowsize=0.6, color="{INK}"]',
        *(_node(n, system, texts[n], recorded, fed_unseen) for n, system in blocks.items()),
    ]
    for layer, color in LAYERS.items():
        look = f'style=filled; color="{color}"; label=<<B>{layer.replace("_", " ").capitalize()}</B>>'
        lines.append(f'subgraph "cluster_{layer}" {{ {look}; {"; ".join(n for n in shown[layer] if n in blocks)} }}')
    columns = [[n for sort in column for n in blocks if _sort(n) == sort] for column in COLUMNS]
    lines += [f"{{ rank=same; {'; '.join(column)} }}" for column in columns]
    return "\n".join([*lines, *(_edge(start, end, blocks) for start, end in wires), "}", ""])


def _block(port: str) -> str:
    return port.partition(":")[0]


def _sort(block: str) -> str:
    """The name of a block, without the name of its UAV."""
    return next((sort for sort in ABOARD if block.startswith(f"{sort}_")), block)


def _node(name: str, system: System, text: str, recorded: Set[str], fed_unseen: Set[str]) -> str:
    """Drake's text of a block, with its purpose and place instead of its class."""
    # Without inputs for disturbances, and without names of inputs that are fed by a hidden block.
    kind = str(getattr(system, "judges", type(system).__name__.rstrip("_")))
    aboard = ABOARD.get(_sort(name))
    says = escape(REALISES.get(kind, kind)) + (f"<BR/><I>on the {aboard}</I>" if aboard else "")
    text = _HEAD.sub(f"<B>{name}</B><BR/>{says}", _DISTURBANCE.sub("", text))
    for port in (port for port in recorded | fed_unseen if _block(port) == name):
        cell = re.compile(rf'(PORT="{port.partition(":")[2]}"[^>]*>)(\w+)')
        text = cell.sub(rf'\1<FONT COLOR="{RECORDED}">\2</FONT>' if port in recorded else r"\1", text)
    text = text.replace('COLOR="grey"', "").replace('BORDER="0"', 'BORDER="0" BGCOLOR="white"', 1)
    return f"{name} {text.partition(' ')[2]}".strip()


def _edge(start: str, end: str, blocks: Mapping[str, System]) -> str:
    """A wire from an output port of a block to an input port."""
    order = [*ORDER, *map(_sort, blocks)]
    looks = {
        "style=dashed": {ABOARD.get(_sort(_block(port))) for port in (start, end)} == {"UAV", "UGVs"},
        f'color="{MUTED}"': _block(start) == ORDER[0],
        "constraint=false": order.index(_sort(_block(end))) < order.index(_sort(_block(start))),
    }
    return f"{start}:e -> {end}:w [{', '.join(look for look, holds in looks.items() if holds)}]"


def svg(dot_text: str) -> str:
    # The same text gives the same bytes on the same machine; box sizes depend on its fonts. The picture holds the
    # digest of its text for `is_current`.
    picture = _PICTURE.search(re.sub(r"<!--.*?-->\n?", "", _laid_out(dot_text, "svg").decode(), flags=re.DOTALL))
    if picture is None:
        raise ValueError("this version of Graphviz writes SVG of another form")
    width, height, inner = picture.groups()
    return "\n".join([
        '<?xml version="1.0" encoding="UTF-8" standalone="no"?>',
        f"<!-- {_digest(dot_text)} -->",
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'width="{width}pt" height="{height}pt" viewBox="0 0 {width} {height}">',
        _ID.sub("", inner),
        "</svg>",
        "",
    ])  # fmt: skip


def drawn(dot_text: str, kind: str) -> bytes:
    """Graphviz text as a file of a kind that Graphviz knows: dot, svg, pdf, png and others."""
    if kind == "dot":
        return dot_text.encode()
    return svg(dot_text).encode() if kind == "svg" else _laid_out(dot_text, kind)


def _laid_out(dot_text: str, kind: str) -> bytes:
    with _silent_stderr(), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Graphviz and fontconfig remark on fonts; errors still raise
        picture: bytes = pygraphviz.AGraph(string=dot_text).draw(format=kind, prog="dot")
    return picture


def is_current(name: str, content: str, committed: str) -> bool:
    """Whether the file `name` with text `committed` is current: `.dot` must equal `content`, `.svg` have its digest."""
    if name.endswith(".svg"):
        mark = re.search(r"<!-- (dot sha256 \w+) -->", content)
        return mark is not None and mark[1] in committed
    return content == committed


def _digest(dot_text: str) -> str:
    return f"dot sha256 {files.sha256(dot_text.encode())}"


@contextmanager
def _silent_stderr() -> Iterator[None]:
    """Discard what C libraries write to file descriptor 2."""
    sys.stderr.flush()
    saved = os.dup(2)
    nothing = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nothing, 2)
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(nothing)
