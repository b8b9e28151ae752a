"""Messages over a channel: what UGVs held and the UAV had heard, from the table of messages; who repeated what."""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.runs.proposals import ProposalRecord
from oracles.fault import Fault

MOST_REPEATS = 5
"""Of a refusal that nobody asks for."""
Row = dict[str, Any]


def has_channel(trace: Trace) -> bool:
    return trace.scenario.channel is not None


def rows_of(trace: Trace) -> list[Row]:
    return trace.derived(
        "message rows", lambda: trace.messages.sort_values("received_s", kind="stable").to_dict("records")
    )


def held(trace: Trace, sent: ProposalRecord) -> tuple[float, float]:
    """From when on a UGV has a proposal in front of it, and until when, s; infinite if never.

    The highest number that has arrived is in force, unless it is withdrawn; what comes later under a lower one is not
    read.
    """
    begin, newest = np.inf, -1
    for row in rows_of(trace):
        if row["receiver"] != sent.ugv or not np.isfinite(row["received_s"]):
            continue
        about, over = int(row["about"]), begin < np.inf
        if over and (about > sent.number or (about == sent.number and row["kind"] == "withdrawal")):
            return begin, float(row["received_s"])
        if about == sent.number and about > newest and row["kind"] == "proposal":
            begin = float(row["received_s"])
        newest = max(newest, about)
    return begin, np.inf


def heard(trace: Trace, ugv: str, now: float) -> Row | None:
    """The last answer of a UGV that the UAV has at a planning instant, s: of those that arrived, the one sent last."""
    sent = (row for row in rows_of(trace) if row["sender"] == ugv and row["sent_s"] < now - TIME_TOLERANCE_S)
    there = [row for row in sent if row["received_s"] <= now + TIME_TOLERANCE_S]
    return max(there, key=lambda row: (row["number"], row["attempt"]), default=None)


def wrong_carriage(trace: Trace) -> list[Fault]:
    """Messages that a channel cannot have carried so, and repetitions out of turn; [] without a channel."""
    if trace.scenario.channel is None:
        return []
    return [*_carried_otherwise(trace), *_repeated_otherwise(trace)]


def _ways(trace: Trace) -> dict[bool, Row]:
    """What the scenario says of the way there, and of the way back (True)."""
    channel = trace.scenario.channel
    assert channel is not None
    names = ("delay_s", "jitter_s", "loss", "duplicate", "reorder")
    there = {name: getattr(channel, name) for name in names}
    back = {name: getattr(channel.up, name) for name in names if channel.up is not None}
    return {False: there, True: there | {name: value for name, value in back.items() if value is not None}}


def _carried_otherwise(trace: Trace) -> Iterator[Fault]:
    ways, ends = _ways(trace), trace.t[-1]
    reading = trace.scenario.gatekeeper.period_s + trace.scenario.control.period_s + TIME_TOLERANCE_S
    arrived = dict[tuple[str, str], tuple[float, float]]()
    for row in sorted(rows_of(trace), key=lambda row: row["sent_s"]):
        way, link = ways[row["kind"] == "answer"], (row["sender"], row["receiver"])
        at = str(row["sender"]), float(row["sent_s"]), dict(row)
        late, latest = row["received_s"] - row["sent_s"], way["delay_s"] + way["jitter_s"] + TIME_TOLERANCE_S
        if not np.isfinite(late):
            if way["loss"] == 0.0 and row["sent_s"] + latest < ends:
                yield Fault("lost without loss", *at)
            continue
        if late < way["delay_s"] - TIME_TOLERANCE_S or (way["reorder"] and late > latest):
            yield Fault("arrives at another time", *at)
        if row["copy"] and not way["duplicate"]:
            yield Fault("doubled", *at)
        before = arrived.get(link, (0.0, 0.0))
        if not way["reorder"] and row["sent_s"] > before[0] and row["received_s"] < before[1] - TIME_TOLERANCE_S:
            yield Fault("overtakes another", *at)
        arrived[link] = max(before, (row["sent_s"], row["received_s"]))
        waits = min(row["read_s"], np.inf) - row["received_s"]
        if waits < -TIME_TOLERANCE_S or (waits > reading and row["received_s"] + reading < ends):
            yield Fault("is not read at the next sample", *at)


def retry_s(trace: Trace) -> float:
    """After how long a message is sent again."""
    ways, given = _ways(trace), trace.scenario
    answering = max(0.15, given.gatekeeper.period_s + given.control.period_s + given.intervention.period_s)
    return sum(way["delay_s"] for way in ways.values()) + max(way["jitter_s"] for way in ways.values()) + answering


def _repeated_otherwise(trace: Trace) -> Iterator[Fault]:
    """A UAV repeats a message until it was read or replaced, or the UAV is lost; a UGV, no more often than it may."""
    period, told = trace.scenario.control.period_s, {*trace.decisions["answer"]}
    copies = [row for row in rows_of(trace) if row["copy"] == 0]
    for ugv in trace.ugvs:
        mine = sorted((row for row in copies if row["receiver"] == ugv), key=lambda row: row["sent_s"])
        lost_s = min([trace.scenario.aerial[row["sender"]].lost_at_s or np.inf for row in mine], default=np.inf)
        if mine and mine[-1]["sent_s"] > lost_s - TIME_TOLERANCE_S:
            yield Fault("repeated by a UAV that is lost", ugv, float(mine[-1]["sent_s"]), lost_s)
        for row, later in pairwise([*mine, {"sent_s": trace.t[-1], "about": -1, "kind": ""}]):
            again = (later["kind"], later["about"]) == (row["kind"], row["about"])
            answered = _read_s(trace, ugv, row, told)
            due = row["sent_s"] + retry_s(trace)
            if again and not (due - TIME_TOLERANCE_S <= later["sent_s"] <= due + period + TIME_TOLERANCE_S):
                yield Fault("repeated at another time", ugv, float(later["sent_s"]), due)
            if again and answered < later["sent_s"] - TIME_TOLERANCE_S:
                yield Fault("repeated though it was read", ugv, float(later["sent_s"]), answered)
            if not again and due + period < min(answered, float(later["sent_s"]), lost_s) - TIME_TOLERANCE_S:
                yield Fault("not repeated", ugv, float(row["sent_s"]), due)
        read = sum(np.isfinite(row["read_s"]) for row in rows_of(trace) if row["receiver"] == ugv)
        answers = [row for row in copies if row["sender"] == ugv]
        numbers = {row["number"] for row in answers}
        if len(answers) > read + (1 + MOST_REPEATS) * len(numbers):
            yield Fault("answers too often", ugv, more=len(answers))
        said = {float(row["sent_s"]) for row in answers}
        for row in rows_of(trace):
            if row["receiver"] == ugv and np.isfinite(row["read_s"]) and row["read_s"] not in said:
                yield Fault("does not answer what it reads", ugv, float(row["read_s"]), dict(row))


def _read_s(trace: Trace, ugv: str, row: Row, told: set[int]) -> float:
    """When the UAV read that a UGV had read a message, s; infinite if never."""
    newest = (-1, -1)
    for answer in rows_of(trace):
        order = (int(answer["number"]), int(answer["attempt"]))
        if answer["sender"] != ugv or not np.isfinite(answer["read_s"]) or order <= newest:
            continue
        newest = order
        obeys = trace.meta["method"] == "b" and answer["sent_s"] < _dropped_s(trace, ugv, row) - TIME_TOLERANCE_S
        holds = answer["about"] == row["about"] and (order[0] in told or obeys)
        if answer["about"] >= row["about"] and not (row["kind"] == "withdrawal" and holds):
            return float(answer["read_s"])
    return np.inf


def _dropped_s(trace: Trace, ugv: str, row: Row) -> float:
    """When a UGV read that the proposal of a message is withdrawn, s; infinite if never."""
    mine = [m for m in rows_of(trace) if (m["kind"], m["receiver"], m["about"]) == ("withdrawal", ugv, row["about"])]
    return float(np.nanmin([np.inf, *(message["read_s"] for message in mine)]))
