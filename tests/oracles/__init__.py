"""Oracles: whether a run is what the code is designed to do, judged by other code from the trace alone.

An oracle is a function from a trace to its faults. A fault is about our code and not about the scenario: no run may
have one. So they are tests, and run on shipped and on drawn scenarios.
"""

from collections.abc import Callable

from airground_drake.report.possible import impossible
from airground_drake.sim.trace import Trace
from oracles.channel import wrong_carriage
from oracles.commands import wrong_commands
from oracles.communication import wrong_messages
from oracles.decisions import wrong_decisions
from oracles.fault import Fault
from oracles.inputs import wrong_inputs
from oracles.positions import wrong_positions
from oracles.predictions import wrong_predictions
from oracles.progress import wrong_answers
from oracles.protocol import wrong_executions

ORACLES: dict[str, Callable[[Trace], list[Fault]]] = {
    "commands": wrong_commands,
    "predictions": wrong_predictions,
    "progress": wrong_answers,
    "communication": wrong_messages,
    "protocol": wrong_executions,
    "channel": wrong_carriage,
    "positions": wrong_positions,
    "records": lambda trace: [Fault(line["about"]) for line in impossible(trace, trace.scenario)],
    "inputs": wrong_inputs,
    "decisions": wrong_decisions,
}
"""Every oracle, by name."""


def faults_of(trace: Trace) -> dict[str, list[Fault]]:
    """The faults of a run, by oracle; an oracle that cannot read the trace has one that says why."""
    found = {}
    for name, oracle in ORACLES.items():
        try:
            found[name] = oracle(trace)
        except Exception as error:
            found[name] = [Fault(f"{type(error).__name__}: {error}")]
    return {name: faults for name, faults in found.items() if faults}
