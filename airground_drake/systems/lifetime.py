"""How Python systems and their diagrams are freed, which pydrake by itself never does.

Two ties keep them: Drake holds the methods that a system declares, and they hold the system; and pydrake ties systems,
ports, builders and diagrams to each other, so that a user who keeps one of them keeps all, in a way which the garbage
collector cannot see through where a class is derived in Python.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from weakref import ref

from pydrake.systems.framework import Diagram, DiagramBuilder, InputPort, OutputPort

PEERS = "_pydrake_internal_ref_cycle_peers"
"""Attribute with which pydrake ties one object to others. Without it `untie` does nothing, and nothing is freed."""


def weakly(method: Any) -> Callable[..., Any]:
    """A bound method that does not keep its object: for what a system declares about itself."""
    of, function = ref(method.__self__), method.__func__
    return lambda *arguments: function(of(), *arguments)


def untie(diagram: Diagram) -> None:
    """Let a diagram be freed with the last reference to it: its systems no longer keep it, it keeps its systems.

    Code that keeps one of its systems or ports must then keep the diagram, too.
    """
    for system in diagram.GetSystems():
        if isinstance(system, Diagram):
            untie(system)
            continue
        ties = vars(system).get(PEERS, set())
        ties -= {tied for tied in ties if isinstance(tied, DiagramBuilder)}
        for tied in ties:
            if isinstance(tied, InputPort | OutputPort):
                vars(tied).pop(PEERS, None)
