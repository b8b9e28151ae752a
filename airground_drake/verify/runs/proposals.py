"""What was proposed to each UGV, and which proposal was accepted at each control sample, by the messages of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airground_drake.arrays import Array
from airground_drake.errors import TraceError
from airground_drake.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.segments import interpolate
from airground_drake.verify.runs.control_law import selected
from airground_drake.verify.runs.control_samples import control_samples
from airground_drake.verify.runs.interventions import GATED_METHODS

Answer = tuple[float, int, bool]
"""Time of a decision, s, number of the proposal that it is on, and whether it accepts."""


@dataclass(frozen=True, eq=False)
class Sent:
    """A proposal: a row of `Trace.proposals`.

    Attributes:
        number: identifies it.
        ugv: to whom.
        policy: by which.
        issued_s: when.
        times_s: vertices of the motion that it asks for, (M,).
        positions_m: where they are, (M, 3).
        chosen: J_int^+ J_int, (3, 3).
        mapped_m: obstacles that the UAV says it knows, (k, 3).
        mapped_radius_m: their radii, (k,).
        cause: UGV whose trigger it is for: this one, or another one that it is to make way for.
    """

    number: int
    ugv: str
    policy: str
    issued_s: float
    times_s: Array
    positions_m: Array
    chosen: Array
    mapped_m: Array
    mapped_radius_m: Array
    cause: str

    def place(self, t: float | Array) -> Array:
        """Where the UGV is to be at times: (3,) or (K, 3), m; at rest before the first vertex and after the last."""
        return interpolate(self.times_s, self.positions_m, t)

    def rates(self, t: float) -> list[Array]:
        """Velocity of that place at a time, (3,), m/s: one, or two at a vertex, which rounding may put on its side."""
        begin, end = (int(np.searchsorted(self.times_s, t + shift)) for shift in (-TIME_TOLERANCE_S, TIME_TOLERANCE_S))
        return [self._slope(leg) for leg in sorted({begin, end})]

    def _slope(self, leg: int) -> Array:
        """On the way to vertex `leg`."""
        if not 0 < leg < len(self.times_s):
            return np.zeros(3)
        slope: Array = (self.positions_m[leg] - self.positions_m[leg - 1]) / (self.times_s[leg] - self.times_s[leg - 1])
        return slope


def proposals_of(trace: Trace) -> list[Sent]:
    """All of them, as recorded.

    Raises:
        TraceError: if one is none, two have the same number, they are not those of the events, or a decision is on
            none of them.
    """
    return trace.derived("proposals", lambda: _proposals_of(trace))


def _proposals_of(trace: Trace) -> list[Sent]:
    found = []
    for row in trace.proposals.to_dict("records"):
        times, places, selection, mapped, radii = (
            np.asarray(row[name], dtype=np.float64).ravel()
            for name in ("times_s", "positions_m", "selection", "mapped_m", "mapped_radius_m")
        )
        label = f"proposal to {row['robot']} at t = {row['issued_s']} s"
        numbers = np.concatenate([times, places, selection, mapped, radii, [row["issued_s"]]])
        if not np.isfinite(numbers).all() or not len(times) or not (np.diff(times) > 0.0).all():
            raise TraceError(f"{label}: numbers that are not finite, or times that do not increase")
        shaped = len(places) == 3 * len(times) and len(selection) and not len(selection) % 3
        shaped = shaped and len(mapped) == 3 * len(radii)
        if not shaped or row["robot"] not in trace.ugvs:
            raise TraceError(f"{label}: no motion of a UGV of the trace")
        if row["cause"] not in trace.ugvs or not _is_cause(trace, row["robot"], row["cause"], row["issued_s"]):
            raise TraceError(f"{label}: its cause {row['cause']!r} is no UGV whose trigger it can have been sent for")
        found.append(
            Sent(
                int(row["number"]), str(row["robot"]), str(row["policy"]), float(row["issued_s"]), times,
                places.reshape(-1, 3), selected(selection), mapped.reshape(-1, 3), radii, str(row["cause"]),
            )
        )  # fmt: skip
    recorded = sorted((s.ugv, s.issued_s, s.policy) for s in found)
    events = sorted((e["robot"], float(e["t_s"]), e["policy"]) for e in trace.events if e["kind"] == "proposal")
    if recorded != events:
        raise TraceError(f"the proposals recorded are {recorded}, those of the events {events}")
    known = {sent.number: (sent.ugv, sent.issued_s) for sent in found}
    if len(known) != len(found):
        raise TraceError("two proposals have the same number")
    columns = (trace.decisions[name].tolist() for name in ("number", "robot", "issued_s"))
    for number, ugv, issued in zip(*columns, strict=True):
        if known and known.get(number) != (ugv, issued):  # decisions without any proposal are COMM's to refuse
            raise TraceError(f"a decision of {ugv} is on proposal {number}, issued at {issued} s, which it never got")
    return sorted(found, key=lambda sent: sent.issued_s)


def _is_cause(trace: Trace, ugv: str, cause: str, issued_s: float) -> bool:
    """Whether a UGV's own trigger is the cause if it is intervened on, and that of another one that is if not.

    The mode of a row is in force up to it, so that of the next row counts, too: a trigger may be at that very instant.
    """
    row = min(int(np.searchsorted(trace.t, issued_s - TIME_TOLERANCE_S)), len(trace.t) - 1)
    called = {name: trace.column(f"{name}.mode")[row : row + 2] == 1.0 for name in (ugv, cause)}
    return bool(called[cause].any()) and (cause == ugv or not called[ugv].all())


def accepted_at(trace: Trace, ugv: str) -> list[Sent | None]:
    """The proposal that a UGV has accepted, at each control sample of the run, or None.

    A proposal is in force from when it is sent until, at a planning instant, neither the UGV nor the one that it is to
    make way for is being intervened on, the motion has run out, the UGV's last answer was a refusal, or another one is
    sent. Under method (b) it is accepted all the while; under (c) and (d) while the decision of the last sample of the
    gatekeeper accepts it.
    """
    return trace.derived(("accepted", ugv), lambda: _accepted_at(trace, ugv))


def _accepted_at(trace: Trace, ugv: str) -> list[Sent | None]:
    t = trace.t[control_samples(trace.t, trace.scenario["control"]["period_s"])]
    mine = [sent for sent in proposals_of(trace) if sent.ugv == ugv]
    if not mine:
        return [None] * len(t)
    gated = trace.meta["method"] in GATED_METHODS
    answers = answers_of(trace, ugv)
    times = np.array([answer[0] for answer in answers])
    gate_s = trace.scenario["gatekeeper"]["period_s"]
    plan_s = trace.scenario["intervention"]["period_s"]
    ends = [withdrawn_s(trace, ugv, sent, mine, answers) for sent in mine]
    found: list[Sent | None] = []
    for now in t:
        planned = plan_s * np.floor(now / plan_s + 1e-6)
        here = [
            sent
            for sent, end in zip(mine, ends, strict=True)
            if sent.issued_s <= planned + TIME_TOLERANCE_S and end > planned + TIME_TOLERANCE_S
        ]
        if here and gated:
            asked = gate_s * np.floor(now / gate_s + 1e-6)
            k = int(np.searchsorted(times, asked - TIME_TOLERANCE_S))
            given = answers[k] if k < len(answers) and abs(times[k] - asked) <= TIME_TOLERANCE_S else None
            here = [sent for sent in here if given is not None and given[2] and given[1] == sent.number]
        found.append(here[-1] if here else None)
    return found


def answers_of(trace: Trace, ugv: str) -> list[Answer]:
    """Every decision of a UGV, by time."""
    table = trace.decisions[trace.decisions["robot"] == ugv]
    columns = (table[name].tolist() for name in ("t_s", "number", "decision"))
    return sorted((float(t_s), int(number), answer == "accept") for t_s, number, answer in zip(*columns, strict=True))


def withdrawn_s(trace: Trace, ugv: str, sent: Sent, mine: Sequence[Sent], answers: Sequence[Answer]) -> float:
    """The planning instant at which a proposal is taken back, s; infinite if it never is."""
    period = trace.scenario["intervention"]["period_s"]
    called = (trace.column(f"{ugv}.mode") == 1.0) | (trace.column(f"{sent.cause}.mode") == 1.0)
    t = trace.t
    later = [other.issued_s for other in mine if other.issued_s > sent.issued_s]
    refused = [(when, yes) for when, number, yes in answers if number == sent.number]
    first = round(sent.issued_s / period) + 1
    for k in range(first, int(t[-1] / period + 1e-6) + 1):
        now = k * period
        row = min(int(np.searchsorted(t, now - TIME_TOLERANCE_S)), len(t) - 1)
        before = [yes for when, yes in refused if when < now - TIME_TOLERANCE_S]
        # whether a motion that ends at this very instant has run out is a matter of the clock's own rounding
        out = not called[row] or t[row] >= sent.times_s[-1] or (before and not before[-1])
        if out or (later and later[0] <= now + TIME_TOLERANCE_S):
            return now
    return np.inf
