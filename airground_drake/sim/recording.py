"""The tables of a trace, from a log of the diagram's outputs and the memories of planner and gatekeepers."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain, repeat
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from airground_drake.base.arrays import Array, Indices
from airground_drake.base.errors import PluginError
from airground_drake.model.bodies.world import World
from airground_drake.model.geometry import outline
from airground_drake.model.trigger.automaton import FIELDS
from airground_drake.scenario.load import own, resolved
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.blocks.signals import Status
from airground_drake.sim.events import extract, unheard
from airground_drake.sim.tables import (
    DECISION_COLUMNS,
    DECISION_LISTS,
    MESSAGE_COLUMNS,
    PLAN_COLUMNS,
    PROBLEM_ARRAYS,
    PROBLEM_SCALARS,
    PROPOSAL_COLUMNS,
    SCHEMA,
    listed,
    typed,
)
from airground_drake.sim.trace import Trace
from airground_drake.uav.channel import Delivery, Kind, Message, Transit
from airground_drake.uav.database import Asked
from airground_drake.uav.planner import PlannerState
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.answer import GatekeeperDecision


class Done(NamedTuple):
    """The results of a run; T rows were logged."""

    t: Array  # times, (T,), s
    logged: Mapping[str, Array]  # the signals of a trace by name, see `sim.diagram`, (k, T)
    memories: Mapping[str, PlannerState]  # what each UAV's planner remembers
    decided: Sequence[GatekeeperDecision]
    seed: int
    until_s: float
    wall_s: float  # duration by the clock
    meta: Mapping[str, Any]  # known to the simulation only
    carried: Sequence[tuple[Transit, Sequence[float]]] = ()  # by each link, and when what arrived was read, s


MERGE_S = 1e-9  # rows closer than this are merged, s: periods that are not binary fractions give steps of about 1e-17 s
SAME_S = 1e-6  # a row this near to a multiple of the control period is at that control sample, s


def trace_of(
    scenario: Scenario, name: str, world: World, done: Done, signals: Sequence[str], own_plants: Collection[str] = ()
) -> Trace:
    """The trace of a run of a scenario; `signals` as of `states`, `own_plants` are robots with users' plants."""
    run, ugvs = scenario.runs[name], world.names("ugv")
    given = replace(own(scenario, name), duration_s=done.until_s)
    keep = distinct(done.t, done.logged["team_command"])
    t, logged = done.t[keep], {port: rows[:, keep] for port, rows in done.logged.items()}
    rows = states(t, logged, ugvs, [body.name for body in world.moving], signals)
    sampled = samples(t, scenario.control.period_s, logged, ugvs, world.robots)
    meta: dict[str, Any] = {
        "schema": SCHEMA,
        "run": name,
        "method": run.method,
        "composition": run.composition,
        "seed": done.seed,
        "robots": list(world.robots),
        "ugvs": list(ugvs),
        "scenario": resolved(scenario) | {"duration_s": done.until_s},
        "events": [],
        **done.meta,
        "faults": faults(done.memories),
    }
    trace = Trace(
        meta,
        states=rows,
        samples=sampled.assign(**measured(rows, sampled, own_plants)) if own_plants else sampled,
        decisions=decisions(done.decided, ugvs, given.gatekeeper.route),
        timings={"wall_s": done.wall_s, "decision_times_s": [decision.cpu_s for decision in done.decided]},
        problems=problems(done.decided),
        proposals=proposals(ugvs, done.memories.values()),
        plans=plans(done.memories, ugvs),
    )
    memories = [*done.memories.values()]
    sent = _carried(memories, done.carried, ugvs) if done.carried else _messages(memories, trace)
    trace = replace(trace, messages=messages(sent))
    trace.derived("scenario", lambda: given)  # it need not be read from the metadata
    if given.ugv_controller is not None:
        for ugv, t_s, number in unheard(trace):
            said = f"controller {given.ugv_controller.kind!r} says that {ugv} executes {number} at t = {t_s:.9g} s"
            raise PluginError(f"{said}; allowed: numbers of proposals that have arrived, -1 for none")
    meta["events"] = extract(trace)
    return trace


def distinct(t: Array, command: Array) -> Indices:
    """Indices of rows (T,) at distinct times, for commands (3 r, T) of r robots."""
    # Among rows within MERGE_S of each other, the last row that has the command of the first is kept: the command that
    # led there.
    cluster = np.concatenate([[0], np.cumsum(np.diff(t) > MERGE_S)])
    first = np.searchsorted(cluster, cluster)
    led = (command == command[:, first]).all(axis=0)
    return np.unique(np.maximum.accumulate(np.where(led, np.arange(len(t)), 0))[np.append(np.diff(cluster) > 0, True)])


def states(
    t: Array, logged: Mapping[str, Array], ugvs: Sequence[str], bodies: Sequence[str], signals: Sequence[str] = ()
) -> pd.DataFrame:
    """`Trace.states` at times (T,), s; logs of M bodies have the shape (3 M, T), of n UGVs (n, T)."""
    # `signals` are the names of `plant_signals` and `own_headings`, (k, T).
    columns: dict[str, Array] = {"t_s": t}
    for i, body in enumerate(bodies):
        columns |= {f"{body}.{axis}_m": logged["bodies"][3 * i + a] for a, axis in enumerate("xyz")}
    for i, ugv in enumerate(ugvs):
        columns[f"{ugv}.noise_m"] = logged["noise"][i]
        columns[f"{ugv}.decision_variable_m"] = logged["decision_variable"][i]
        columns |= {f"{ugv}.{name}": logged["status"][FIELDS * i + k] for k, name in enumerate(Status.get_fields())}
    of_plants = [*logged.get("plant_signals", ()), *np.unwrap(logged.get("own_headings", np.empty((0, len(t)))))]
    columns |= dict(zip(signals, of_plants, strict=True))
    return pd.DataFrame(columns)


def measured(states: pd.DataFrame, samples: pd.DataFrame, robots: Iterable[str]) -> dict[str, Array]:
    """Drift and cover of robots with users' plants in each control period: columns of `Trace.samples`, (S,)."""
    rows, columns = np.searchsorted(states["t_s"], samples["t_s"]), dict[str, Array]()
    ends = np.append(rows, len(states) - 1)
    t = states["t_s"].to_numpy()
    for robot in robots:
        place, body = (
            states[[f"{robot}.{stem}{axis}_m" for axis in "xyz"]].to_numpy(dtype=np.float64) for stem in ("", "body_")
        )
        command = samples[[f"{robot}.v{axis}_m_s" for axis in "xyz"]].to_numpy(dtype=np.float64)
        missed = np.diff(place[ends], axis=0) / np.diff(t[ends])[:, None] - command
        line = np.stack([np.interp(t, t[ends], axis) for axis in place[ends].T], axis=1)
        off = np.linalg.norm(body - line, axis=1)
        columns[f"{robot}.drift_m_s"] = np.linalg.norm(missed, axis=1)
        columns[f"{robot}.cover_m"] = np.maximum(np.maximum.reduceat(off, rows), off[ends[1:]])
    return columns


def samples(
    t: Array, period_s: float, logged: Mapping[str, Array], ugvs: Sequence[str], robots: Sequence[str]
) -> pd.DataFrame:
    """`Trace.samples`; choices at a control sample are logged from the next row on."""
    at = sample_rows(t, period_s)
    chosen, reference = logged["team_command"][:, at + 1], logged["reference"][:, at]
    columns: dict[str, Array] = {"t_s": t[at]}
    for i, robot in enumerate(robots):
        columns |= {f"{robot}.v{axis}_m_s": chosen[3 * i + a] for a, axis in enumerate("xyz")}
        if (published := logged.get("announced", logged.get("published"))) is not None:
            columns |= {f"{robot}.seen_{axis}_m": published[3 * i + a, at] for a, axis in enumerate("xyz")}
        if (view := logged.get(f"view_of_{robot}")) is not None:
            columns |= {
                f"{robot}.saw_{other}_{axis}_m": view[3 * k + a, at]
                for k, other in enumerate(robots) if k != i for a, axis in enumerate("xyz")
            }  # fmt: skip
    for i, ugv in enumerate(ugvs):
        columns |= {f"{ugv}.ref_{axis}_m": reference[3 * i + a] for a, axis in enumerate("xyz")}
        columns |= {f"{ugv}.ref_v{axis}_m_s": reference[3 * (len(ugvs) + i) + a] for a, axis in enumerate("xyz")}
        columns[f"{ugv}.executing"] = logged["executing"][i, at + 1]
        if "seen_by_uav" in logged:
            columns |= {f"{ugv}.uav_saw_{axis}_m": logged["seen_by_uav"][3 * i + a, at] for a, axis in enumerate("xyz")}
        if "command_share" in logged:
            columns[f"{ugv}.command_share"] = logged["command_share"][i, at + 1]
        if "heard_s" in logged:
            columns |= {
                f"{ugv}.heard_{other}_s": logged["heard_s"][len(ugvs) * i + k, at]
                for k, other in enumerate(ugvs)
                if k != i
            }
    return pd.DataFrame(columns)


def sample_rows(t: Array, period_s: float) -> Indices:
    """Rows at the control samples before the last row, (S,): the nearest to each multiple of the period, s."""
    instants = np.arange(int((t[-1] - MERGE_S) / period_s) + 1) * period_s
    right = np.searchsorted(t, instants).clip(1, len(t) - 1)
    nearest = right - (instants - t[right - 1] < t[right] - instants)
    return np.asarray(nearest[(np.abs(t[nearest] - instants) <= SAME_S) & (nearest < len(t) - 1)])


def decisions(decided: Sequence[GatekeeperDecision], ugvs: Sequence[str], route: str) -> pd.DataFrame:
    """`Trace.decisions`; the route is the name of method (c)'s."""
    return typed([_decision(made, ugvs[made.robot], route) for made in decided], DECISION_COLUMNS, *DECISION_LISTS)


_BLANK: dict[str, Any] = {name: "" if kind == "str" else -1.0 for name, kind in DECISION_COLUMNS.items()}


def _decision(decision: GatekeeperDecision, robot: str, route: str) -> dict[str, Any]:
    rested_on = decision.basis
    row: dict[str, Any] = _BLANK | {
        "t_s": decision.t,
        "robot": robot,
        "policy": decision.proposal.policy,
        "number": decision.proposal.number,
        "answer": decision.answer,
        "issued_s": decision.proposal.issued,
        "decision": _word(decision.accepted),
        "reason": decision.reason,
        "sensed": list(rested_on.sensed),
        "known": list(rested_on.known),
        "new": list(rested_on.new),
        "told": list(rested_on.told),
    }
    solution = decision.solution
    if solution is None:
        row |= {"tries": decision.tries}
        for choice, outcome in (("refuse", decision.refuse), ("accept", decision.accept)):
            if outcome is not None:
                row |= {
                    f"{choice}_outcome_m2_s": outcome.cost,
                    f"{choice}_stalls": float(outcome.stalls),
                    f"{choice}_left_m": outcome.left,
                }
        return row
    return row | {
        "status": solution.status,
        "route": route,
        "plan_first_stage": _word(solution.accept_first),
        "relaxed_first_stage": solution.relaxed_first_stage,
        "rounded_first_stage": "" if solution.rounded is None else _word(bool(solution.rounded[0])),
        "objective": solution.objective,
        "route_bound": solution.route_bound,
        "gap": solution.gap,
        "objective_accept": solution.objective_accept,
        "objective_refuse": solution.objective_refuse,
        "accept_throughout": decision.throughout[0],
        "refuse_throughout": decision.throughout[1],
        "rounding_deviation_s": solution.rounding_deviation,
        "predicted_clearance_m": solution.clearance,
    }


def _word(accepts: bool) -> str:
    return "accept" if accepts else "refuse"


def problems(decided: Sequence[GatekeeperDecision]) -> pd.DataFrame:

    def flat(array: Array | None) -> list[float]:
        return [] if array is None else array.ravel().tolist()

    planned = [(r.problem, r.solution) for r in decided if r.problem is not None and r.solution is not None]
    rows = [
        (
            p.dt, p.error_weight, p.slack_weight, p.terminal_weight,
            *map(flat, (
                p.initial, p.accept, p.refuse, p.reference, p.centres, p.distances,
                s.plan, s.positions, s.relaxed, s.rounded, s.normals,
            )),
        )
        for p, s in planned
    ]  # fmt: skip
    return listed(rows, (*PROBLEM_SCALARS, *PROBLEM_ARRAYS))


def _sent(memories: Iterable[PlannerState]) -> list[tuple[int, Proposal]]:
    """All proposals with the index of their UGV, by time of sending."""
    return sorted((sent for memory in memories for sent in memory.sent), key=lambda sent: sent[1].issued)


def proposals(ugvs: Sequence[str], memories: Iterable[PlannerState]) -> pd.DataFrame:
    rows = [
        (
            proposal.number, ugvs[i], proposal.policy, float(proposal.issued), proposal.motion.times.tolist(),
            proposal.motion.positions.ravel().tolist(),
            np.asarray(proposal.selection, dtype=np.float64).ravel().tolist(),
            [number for row in proposal.mapped for number in outline.as_tuple(row)], proposal.cause or ugvs[i],
            [float(ugvs.index(name)) for name in proposal.party], proposal.sender,
        )
        for i, proposal in _sent(memories)
    ]  # fmt: skip
    return listed(rows, PROPOSAL_COLUMNS)


def plans(memories: Mapping[str, PlannerState], ugvs: Sequence[str]) -> pd.DataFrame:
    numbers = {(proposal.issued, ugvs[i]): proposal.number for i, proposal in _sent(memories.values())}
    rows = [
        {
            "t_s": asking.t, "uav": uav, "ugv": asking.robot, "policy": asking.policy, "outcome": _outcome(asking),
            "reason": asking.reason,
            "sent": [numbers[asking.t, ugv] for ugv in asking.party if asking.chosen and (asking.t, ugv) in numbers],
        }
        for uav, asking in _asked(memories)
    ]  # fmt: skip
    return typed(rows, PLAN_COLUMNS, "sent")


def _asked(memories: Mapping[str, PlannerState]) -> list[tuple[str, Asked]]:
    """The policies that were asked, each with its UAV, by time."""
    asked = [(uav, asking) for uav, memory in memories.items() for asking in memory.asked]
    return sorted(asked, key=lambda entry: entry[1].t)


def _outcome(asking: Asked) -> str:
    if asking.what:
        return "failed"
    return "proposed" if asking.chosen else "passed over" if asking.party else "nothing"


def messages(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    kinds = ("answer", "withdrawal", "proposal")  # of one instant, in the order of the table
    return typed(sorted(rows, key=lambda row: (row["sent_s"], kinds.index(row["kind"]))), MESSAGE_COLUMNS)


NEVER_S = float("nan")


def _messages(memories: Sequence[PlannerState], trace: Trace) -> Iterator[dict[str, Any]]:
    """Rows of a run without a channel, from the UAVs' memories and the trace's decisions and samples."""
    sent = _sent(memories)
    parties = {proposal.number: (proposal.sender, i) for i, proposal in sent}

    def row(kind: Kind, number: int, about: int, sent_s: float, read_s: float) -> dict[str, Any]:
        uav, ugv = parties[about]
        return _row(Delivery(sent_s, 0, 0, Message(kind, number, about, ugv, sent_s)), read_s, uav, trace.ugvs)

    read = dict(read for memory in memories for read in memory.read)
    latest_first = (trace.decisions[name].tolist()[::-1] for name in ("number", "t_s"))
    decided = dict(zip(*latest_first, strict=True))  # when each was decided on first
    for i, proposal in sent:
        number, issued = proposal.number, proposal.issued
        if trace.meta["method"] == "b":  # accepted at once
            executing = trace.sampled(f"{trace.ugvs[i]}.executing") == number
            begun = trace.sampled("t_s")[executing]
            yield row("proposal", number, number, issued, float(begun[0]) if len(begun) else NEVER_S)
        else:
            yield row("proposal", number, number, issued, decided.get(number, NEVER_S))
    withdrawn = sorted((gone for memory in memories for gone in memory.withdrawn), key=lambda gone: gone[1])
    for count, (number, t) in enumerate(withdrawn):
        yield row("withdrawal", count, number, t, t)
    answers = trace.decisions[trace.decisions["answer"] >= 0]
    for t, answer, number in zip(*(answers[c].tolist() for c in ("t_s", "answer", "number")), strict=True):
        yield row("answer", answer, number, t, read.get(answer, NEVER_S))


def _carried(
    memories: Sequence[PlannerState], links: Sequence[tuple[Transit, Sequence[float]]], ugvs: Sequence[str]
) -> Iterator[dict[str, Any]]:
    """Rows of a run with a channel, from the links' records."""
    uavs = {proposal.number: proposal.sender for _, proposal in _sent(memories)}
    for transit, read in links:
        for delivery, read_s in _deliveries(transit, read):
            yield _row(delivery, read_s, uavs[delivery.message.about], ugvs)


def _deliveries(transit: Transit, read: Sequence[float]) -> Iterator[tuple[Delivery, float]]:
    """Messages that a link delivered or lost, with the time of reading, s."""
    yield from zip(transit.arrived, chain(read, repeat(NEVER_S)), strict=False)
    yield from ((delivery._replace(received_s=NEVER_S), NEVER_S) for delivery in transit.under_way)
    yield from ((Delivery(NEVER_S, -1, 0, message), NEVER_S) for message in transit.lost)


def _row(delivery: Delivery, read_s: float, uav: str, ugvs: Sequence[str]) -> dict[str, Any]:
    message = delivery.message
    ugv = ugvs[message.ugv]
    sender, receiver = (ugv, uav) if message.kind == "answer" else (uav, ugv)
    return {
        "kind": message.kind, "number": message.number, "attempt": message.attempt, "copy": delivery.copy,
        "sender": sender, "receiver": receiver, "about": message.about, "sent_s": message.sent_s,
        "received_s": delivery.received_s, "read_s": read_s,
    }  # fmt: skip


def faults(memories: Mapping[str, PlannerState]) -> list[dict[str, Any]]:
    """Entries of `Trace.meta["faults"]`; the first fault of each policy has a traceback, if it is known."""
    shown, entries = set[str](), []
    for fault in (asking for _, asking in _asked(memories) if asking.what):
        entry = {"t_s": fault.t, "robot": fault.robot, "policy": fault.policy, "what": fault.what}
        if fault.traceback and fault.policy not in shown:
            entry["traceback"] = fault.traceback
            shown.add(fault.policy)
        entries.append(entry)
    return entries
