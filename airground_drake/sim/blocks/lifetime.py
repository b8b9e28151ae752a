"""Frees Python systems and their diagrams, which pydrake never does.

Two kinds of references keep them alive. Drake holds the methods that a system declares, and these hold the system. And
pydrake makes systems, ports, builders and diagrams refer to each other, so that keeping one of them keeps all; the
garbage collector cannot break this cycle for classes derived in Python.
"""

from collections.abc import Callable
from typing import Any, TypeVar
from weakref import ref

from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, InputPort, LeafSystem, OutputPort, ValueProducer

S = TypeVar("S", bound=LeafSystem)

# Attribute in which pydrake keeps these references. Under another name `untie` would free nothing.
PEERS = "_pydrake_internal_ref_cycle_peers"


def weakly(method: Any) -> Callable[..., Any]:
    """A bound method that does not keep its object alive, for a system's declarations."""
    return kept_apart(method.__self__, method.__func__)


def kept_apart(of: object, function: Callable[..., Any]) -> Callable[..., Any]:
    """A function bound to an object, without keeping the object alive."""
    held = ref(of)
    return lambda *arguments: function(held(), *arguments)


def declare_output(
    system: S, name: str, like: int | AbstractValue, value: Callable[[S, Context], Any], needs: set[Any] | None = None
) -> OutputPort:
    """Declare an output port, a vector of a size or a value like another, that a function of the system computes."""
    # needs: prerequisites, by default all sources.
    compute = kept_apart(system, value)
    more = {} if needs is None else {"prerequisites_of_calc": needs}
    if isinstance(like, int):
        return system.DeclareVectorOutputPort(name, like, lambda at, to: to.SetFromVector(compute(at)), **more)
    return system.DeclareAbstractOutputPort(name, like.Clone, lambda at, to: to.set_value(compute(at)), **more)


def declare_cached(system: S, name: str, like: Any, value: Callable[[S, Context], Any], needs: set[Any]) -> Any:
    """Declare a value that a function of the system computes only when one of `needs` changed. Returns its index."""
    compute = kept_apart(system, value)
    producer = ValueProducer(allocate=lambda: Value(like), calc=lambda at, to: to.set_value(compute(at)))
    return system.DeclareCacheEntry(name, producer, needs).cache_index()


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
