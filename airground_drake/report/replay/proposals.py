"""The state of each proposal of a run over time, from the trace."""

from collections.abc import Iterator, Mapping
from typing import Any, Literal, NamedTuple

from airground_drake.base.arrays import Array
from airground_drake.report.interventions import interventions
from airground_drake.sim.trace import Trace
from airground_drake.verify.runs.proposals import proposal_of

Outcome = Literal["asked", "accepted", "refused"]

LINGER_S = 1.0  # time for which a refused or unanswered proposal is shown, s


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
    """All proposals of a run, by time."""
    return tuple(
        Sent(became["robot"], became["policy"], proposal_of(trace, became["number"]).positions_m, tuple(_spans(became)))
        for became in interventions(trace)
    )


def _spans(became: Mapping[str, Any]) -> Iterator[Span]:
    """Asked until it is accepted or ends; accepted until it ends; refused for a while, if that was the end."""
    accepted_s, end_s, how = became["accepted_s"], became["ended"]["t_s"], became["ended"]["how"]
    refused = how in ("refused", "given up")
    if accepted_s is not None:
        yield Span(became["sent_s"], accepted_s, "asked")
        yield Span(accepted_s, end_s, "accepted")
    else:
        yield Span(became["sent_s"], end_s if refused else min(end_s, became["sent_s"] + LINGER_S), "asked")
    if refused:
        yield Span(end_s, end_s + LINGER_S, "refused")
