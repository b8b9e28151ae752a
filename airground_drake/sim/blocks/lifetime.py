"""Frees Python systems and their diagrams, which pydrake by itself never does.

Two kinds of references keep them alive. Drake holds the methods that a system declares, and these hold the system. And
pydrake makes systems, ports, builders and diagrams refer to each other, so that keeping one of them keeps all; the
garbage collector cannot break this cycle for classes derived in Python.
"""

from collections.abc import Callable
from typing import Any
from weakref import ref

from pydrake.systems.framework import Diagram, DiagramBuilder, InputPort, OutputPort

# Attribute in which pydrake keeps these references. Under another name `untie` would free nothing.
PEERS = "_pydrake_internal_ref_cycle_peers"


def weakly(method: Any) -> Callable[..., Any]:
    """A bound method that does not keep its object alive, for what a system declares about itself."""
    of, function = ref(method.__self__), method.__func__
    return lambda *arguments: function(of(), *arguments)


def untie(diagram: Diagram) -> None:
    """Let a diagram be freed with the last reference to it."""
    # It still keeps its systems, but they no longer keep it: code that uses one of its systems or ports must keep the
    # diagram, too.
    for system in diagram.GetSystems():
        if isinstance(system, Diagram):
            untie(system)
            continue
        ties = vars(system).get(PEERS, set())
        ties -= {tied for tied in ties if isinstance(tied, DiagramBuilder)}
        for tied in ties:
            if isinstance(tied, InputPort | OutputPort):
                vars(tied).pop(PEERS, None)
