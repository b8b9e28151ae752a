"""The state of each proposal of a run over time, from the trace."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.sim.trace import Trace
from airground_drake.ugv.reasons import OVER

Outcome = Literal["asked", "accepted", "refused"]

LINGER_S = 1.0  # time for which a refused or unanswered proposal is shown, s

_ANSWERS: dict[str, Outcome] = {"accept": "accepted", "refuse": "refused"}


class Span(NamedTuple):
    """A time interval, s, in which a proposal has one outcome."""

    start_s: float
    end_s: float
    outcome: Outcome


class Sent(NamedTuple):
    """A proposal: its UGV, its policy, the corners of its motion (M, 3), m, and its outcomes over time."""

    robot: str
    policy: str
    path: Array
    spans: tuple[Span, ...]


def sent(trace: Trace) -> tuple[Sent, ...]:
    """All proposals of a run, in the order of the trace."""
    # A gatekeeper's latest decision on a proposal counts, up to its last one, or until it says that the proposal is
    # over. Without a gatekeeper (method (b)), a proposal is accepted while the UGV executes it. The next proposal to
    # the same UGV replaces it.
    return tuple(
        Sent(str(row["robot"]), str(row["policy"]), np.reshape(row["positions_m"], (-1, 3)), tuple(_spans(trace, row)))
        for row in trace.proposals.to_dict("records")
    )


def _spans(trace: Trace, row: Mapping[Any, Any]) -> Iterator[Span]:
    robot, issued = row["robot"], float(row["issued_s"])
    issues = trace.proposals["issued_s"][trace.proposals["robot"] == robot].to_numpy(dtype=np.float64)
    until = float(min(issues[issues > issued], default=trace.t[-1]))
    changes, last_s = _answers(trace, row)
    ends = [change for change, _ in changes[1:]]
    ends.append(last_s if changes[-1][1] == "accepted" else max(last_s, changes[-1][0] + LINGER_S))
    for (start, outcome), end in zip(changes, ends, strict=True):
        if start < min(end, until):
            yield Span(start, min(end, until), outcome)


def _answers(trace: Trace, row: Mapping[Any, Any]) -> tuple[list[tuple[float, Outcome]], float]:
    """Times, s, at which the outcome of a proposal changed, with the new outcome; and the last time known, s."""
    issued = float(row["issued_s"])
    changes: list[tuple[float, Outcome]] = [(issued, "asked")]
    decided = trace.decisions[trace.decisions["number"] == row["number"]]
    for t, decision, reason in zip(decided["t_s"], decided["decision"], decided["reason"], strict=True):
        if reason == OVER:
            return changes, float(t)
        if changes[-1][1] != _ANSWERS[decision]:
            changes.append((float(t), _ANSWERS[decision]))
    if len(decided):
        return changes, float(decided["t_s"].iloc[-1])
    rows = np.flatnonzero(trace.executing(row["robot"]) == row["number"])
    if not len(rows):
        return changes, issued
    return [*changes, (float(trace.t[rows[0] - 1]), "accepted")], float(trace.t[rows[-1]])
