"""What a run of a scenario cannot have had: messages, positions heard or measured, executions and references.

The fate of a message follows from the scenario alone, and an error of a measured position from it and true positions,
so no run is simulated for this.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import pairwise, permutations, zip_longest
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.registry import method_of
from airground_drake.model.geometry.motion import Motion
from airground_drake.report.lines import Line, different
from airground_drake.scenario.links import make_links, repeats_after
from airground_drake.scenario.schema import Channel, Scenario
from airground_drake.scenario.sensing import errors_of
from airground_drake.scenario.world import make_world
from airground_drake.sim.events import unheard
from airground_drake.sim.tables import DECISION_COLUMNS
from airground_drake.sim.trace import Trace
from airground_drake.uav.channel import Message, Transit, lost
from airground_drake.uav.messages import ACCEPT, REFUSE, SILENT
from airground_drake.ugv.answer import Rules, settle
from airground_drake.ugv.outcome import Outcome
from airground_drake.ugv.outcome_gatekeeper import ACCEPTING, reason_of
from airground_drake.ugv.patience import Commitment, Patience
from airground_drake.ugv.solution import Solution
from airground_drake.verify.claim import TIME_TOLERANCE_S as SAME_S

CORNER_S = 1e-9  # a velocity so near to a corner of its preset, s, may be that of either side
SAME_M_S = SAME_M = 1e-9  # velocities and positions agree to this
Wrong = Iterator[tuple[str, float, Any, Any]]  # what, when, s, as recorded and as it is due


def impossible(trace: Trace, scenario: Scenario) -> Iterator[Line]:
    """A line for the first thing that cannot have been so."""
    for rule in (
        _referred, _intervened, _proposed, _spoken, _read, _carried, _repeated, _heard, _measured, _executed, _decided,
        _settled,
    ):  # fmt: skip
        for about, t_s, theirs, ours in rule(trace, scenario):
            yield different("trace", trace.run, f"{about} at t = {t_s:.9g} s", theirs, ours)
            return


def _referred(trace: Trace, scenario: Scenario) -> Wrong:
    """Velocities of the preset trajectories; the checker compares their places."""
    t_s = trace.sampled("t_s")
    for name, ugv in scenario.ugvs.items():
        theirs = trace.reference_rate(name)
        preset = Motion.at_speed(np.array(ugv.preset.waypoints_m), ugv.preset.speed_m_s)
        both = [np.array([preset.at(t)[1] for t in t_s + by]) for by in (CORNER_S, -CORNER_S)]
        off = np.min([np.abs(theirs - ours).max(axis=1) for ours in both], axis=0) > SAME_M_S
        for k in np.flatnonzero(off)[:1]:
            yield f"velocity of the preset of {name}, m/s,", t_s[k], theirs[k].tolist(), both[0][k].tolist()


def _intervened(trace: Trace, scenario: Scenario) -> Wrong:
    """Some methods have no plans, no decisions, or none of a kind; no robot sees a place without measuring it."""
    method, names = method_of(trace.meta["method"]), [*DECISION_COLUMNS]
    outcomes, problem = names.index("refuse_outcome_m2_s"), names.index("status")
    unused = names[outcomes:] if method.intervention_on_top else names[problem:outcomes]
    filled = [] if method.gated else trace.decisions["t_s"].tolist()
    filled += [cell for name in unused for cell in trace.decisions[name].tolist() if cell not in ("", -1.0)]
    planned = (
        [] if method.intervenes else [*trace.plans["t_s"], *trace.proposals["issued_s"], *trace.messages["sent_s"]]
    )
    for what, theirs in (
        ("plans", planned),
        ("parts of decisions", filled),
        ("places seen", trace.seen["t_s"].tolist()),
    ):
        if theirs:
            yield f"{what} under ({method.id})", 0.0, theirs[0], "none"


def _proposed(trace: Trace, scenario: Scenario) -> Wrong:
    """A proposal is caused by an intervention on a UGV of its UAV, and all parties of a joint plan get theirs."""
    names = "number", "robot", "sender", "issued_s", "cause", "party", "policy"
    rows = [*zip(*(trace.proposals[name].tolist() for name in names), strict=True)]
    got = {(t_s, tuple(party), robot) for _, robot, _, t_s, _, party, _ in rows}
    charge, ugvs = {uav: {*scenario.in_charge(uav)} for uav in scenario.aerial}, dict(enumerate(trace.ugvs))
    for number, robot, sender, t_s, cause, numbers, _ in rows:
        party = [ugvs.get(k, k) for k in numbers]
        about, row = f"proposal {number}", int(np.searchsorted(trace.t, t_s - SAME_S))
        if not {robot, cause, *party} <= charge.get(sender, set()):
            yield f"parties of {about}", t_s, [robot, cause, *party], "UGVs of its UAV"
        elif not (trace.column(f"{cause}.mode")[row : row + 2] == 1.0).any():
            yield f"cause of {about}", t_s, cause, "a UGV that is intervened on"
        elif missing := [mate for mate in party if (t_s, tuple(numbers), mate) not in got]:
            yield f"parties of {about}", t_s, missing, "each with a part of the joint plan"
        elif _off_s(t_s, scenario.intervention.period_s) > SAME_S:
            yield f"time of {about}", t_s, t_s, "a sample of its UAV"
    plans = zip(*(trace.plans[name].tolist() for name in ("sent", "uav", "t_s", "policy")), strict=True)
    planned = {(int(number), *plan) for sent, *plan in plans for number in sent}
    theirs = sorted((number, sender, t_s, policy) for number, _, sender, t_s, *_, policy in rows)
    for one, due in zip_longest(theirs, sorted(planned)):
        if one != due:
            yield "proposal of a plan", (one or due or (0.0,) * 3)[2], one, due


def _off_s(t_s: float, period_s: float) -> float:
    """How far a time is from the samples of a period, s."""
    return abs(t_s - round(t_s / period_s) * period_s)


def _spoken(trace: Trace, scenario: Scenario) -> Wrong:
    """Messages are between a UAV and a UGV in its charge, not of a UAV that is lost, and read after they arrive."""
    first = dict[tuple[str, int], tuple[Any, ...]]()
    for row in trace.messages.to_dict("records"):
        uav, ugv = (row["receiver"], row["sender"]) if row["kind"] == "answer" else (row["sender"], row["receiver"])
        of_uav, t_s, number = scenario.aerial.get(uav), row["sent_s"], int(row["number"])
        if of_uav is None or ugv not in scenario.in_charge(uav) or not 0.0 <= t_s <= trace.t[-1]:
            robots = f"{row['sender']} to {row['receiver']}"
            yield f"who sends {row['kind']} {number}", t_s, robots, "a UAV and one of its UGVs, in the run"
            continue
        by_uav, until_s = row["read_s"] if row["kind"] == "answer" else t_s, of_uav.lost_at_s or math.inf
        if by_uav >= until_s - SAME_S:
            yield f"what {uav} sends or hears of {row['kind']} {number}", t_s, by_uav, f"before {until_s} s"
        if not (row["read_s"] >= row["received_s"] - SAME_S or math.isnan(row["read_s"])):
            yield f"reading of {row['kind']} {number}", t_s, row["read_s"], f"after {row['received_s']} s"
        original = first.setdefault((row["kind"], number), (ugv, uav, t_s, row["about"]))
        if original != (ugv, uav, original[2], row["about"]):
            yield f"number of the proposal that {row['kind']} {number} is about", t_s, row["about"], original[3]
    listed = (trace.proposals[name].tolist() for name in ("number", "robot", "sender", "issued_s", "number"))
    expected = {("proposal", number): tuple(of_proposal) for number, *of_proposal in zip(*listed, strict=True)}
    charge = {ugv: uav for uav in scenario.aerial for ugv in scenario.in_charge(uav)}
    listed = (trace.decisions[name].tolist() for name in ("answer", "robot", "t_s", "number"))
    expected |= {("answer", k): (ugv, charge.get(ugv), *rest) for k, ugv, *rest in zip(*listed, strict=True) if k >= 0}
    spoken = [key for key in first if key[0] == "proposal" or (key[0] == "answer" and scenario.channel is None)]
    for key in dict.fromkeys([*expected, *spoken]):
        theirs, ours = first.get(key), expected.get(key)
        if theirs != ours:
            yield f"sending of {key[0]} {key[1]}", float((theirs or ours or (0.0,) * 3)[2]), theirs, ours


def _read(trace: Trace, scenario: Scenario) -> Wrong:
    """Without a channel, a UGV reads a proposal when it first decides on it or executes it; a withdrawal at once."""
    if scenario.channel is not None:
        return
    gated, samples = method_of(trace.meta["method"]).gated, trace.sampled("t_s").tolist()
    latest_first = trace.decisions[["number", "t_s"]].to_numpy()[::-1].tolist() if gated else []
    for ugv in () if gated else trace.ugvs:
        latest_first += [*zip(trace.sampled(f"{ugv}.executing").tolist(), samples, strict=True)][::-1]
    first_s = dict(latest_first)
    for kind, number, sent_s, theirs in trace.messages[["kind", "number", "sent_s", "read_s"]].to_numpy():
        ours = first_s.get(number, math.nan) if kind == "proposal" else sent_s
        if not (kind == "answer" or abs(theirs - ours) <= SAME_S or (math.isnan(theirs) and math.isnan(ours))):
            read_s = ["never" if math.isnan(at) else at for at in (theirs, ours)]
            yield f"reading of {kind} {number}", sent_s, *read_s


def _carried(trace: Trace, scenario: Scenario) -> Wrong:
    """Each message arrives when its link delivers it, and as often; what would arrive at the very end may not."""
    table, ends = trace.messages, float(trace.sampled("t_s")[-1])
    for back, link in enumerate(make_links(scenario.channel or Channel())):
        rows = table[(table["kind"] == "answer") == bool(back)].to_dict("records")
        sent, recorded = dict[tuple[Any, ...], Message](), dict[tuple[Any, ...], float]()
        for row in rows:
            message, ugv = (row["kind"], row["number"], row["attempt"]), row["sender" if back else "receiver"]
            sent[message] = Message(*message[:2], row["about"], trace.ugvs.index(ugv), row["sent_s"], message[2])
            recorded[*message, row["copy"]] = row["received_s"]
        # of one instant, what is repeated leaves before what is new; in the table, a withdrawal is before a proposal
        in_order = sorted(sent.values(), key=lambda m: (m.sent_s, m.attempt == 0))
        carried = link.carry(Transit(), in_order, math.inf)
        expected = {(m.kind, m.number, m.attempt, 0): math.nan for m in carried.lost}
        for at_s, _, copy, m in carried.arrived:
            expected[m.kind, m.number, m.attempt, copy] = at_s
        if len(rows) != len(recorded):
            yield "rows of messages", 0.0, len(rows), len(recorded)
        for kind, number, attempt in sent:
            before = (kind, number, attempt - 1) if attempt else (kind, number - (kind != "proposal"), 0)
            if -1 not in before and before not in sent:
                yield f"what was sent before {kind} {number} (attempt {attempt})", 0.0, "nothing", list(before)
        for key in {**recorded, **expected}:
            theirs, ours = recorded.get(key, math.nan), expected.get(key, math.nan)
            if not (abs(ours - theirs) <= SAME_S or (math.isnan(theirs) and not ours <= ends)):
                theirs_s, ours_s = ("never" if math.isnan(at) else at for at in (theirs, ours))
                yield "arrival of {} {} (attempt {}, copy {})".format(*key), sent[key[:3]].sent_s, theirs_s, ours_s


def _repeated(trace: Trace, scenario: Scenario) -> Wrong:
    """What a UGV reads over a channel it answers at once; what no answer names the UAV says again."""
    if scenario.channel is None:
        return
    rows = trace.messages[trace.messages["copy"] == 0].sort_values("sent_s").to_dict("records")
    period_s = repeats_after(scenario) + scenario.control.period_s + SAME_S
    for ugv in trace.ugvs:
        answers = [row for row in rows if row["sender"] == ugv]
        said = {row["sent_s"] for row in answers}
        read = trace.messages[trace.messages["receiver"] == ugv].dropna(subset="read_s")
        for kind, number, read_s in read[["kind", "number", "read_s"]].to_numpy():
            if read_s not in said:
                yield f"answer of {ugv} to {kind} {number}", read_s, "nothing", "an answer"
        mine: list[Any] = [*(row for row in rows if row["receiver"] == ugv), {"sent_s": trace.t[-1]}]
        for row, later in pairwise(mine):
            known_s = [answer["read_s"] for answer in answers if answer["about"] >= row["about"]]
            silent_s = scenario.aerial[row["sender"]].lost_at_s or math.inf
            until_s = min([later["sent_s"], silent_s, *(t for t in known_s if not math.isnan(t))])
            if row["sent_s"] + period_s < until_s - SAME_S:
                yield f"repetition of {row['kind']} {row['number']}", row["sent_s"], "nothing", "after no answer"


def _heard(trace: Trace, scenario: Scenario) -> Wrong:
    """The last positions of each other that UGVs have are those that their links delivered."""
    links, channel, late = scenario.ugv_links, scenario.channel, scenario.late_samples
    if channel is None or links is None or not (links.loss or scenario.asynchronous):
        return
    n, h = len(trace.ugvs), scenario.control.period_s
    t_s, last = trace.sampled("t_s"), np.zeros((n, n))
    expected = np.empty((len(t_s), n, n))
    for k, t in enumerate(t_s):
        if k >= late:
            last[~lost(channel.seed, links.loss, n, k - late)] = t - late * h
        expected[k] = last
    for i, j in permutations(range(n), 2):
        receiver, sender = trace.ugvs[i], trace.ugvs[j]
        theirs, ours = trace.sampled(f"{receiver}.heard_{sender}_s"), expected[:, i, j]
        for k in np.flatnonzero(~(np.abs(theirs - ours) <= SAME_S))[:1]:
            yield f"last position of {sender} that {receiver} has", float(t_s[k]), float(theirs[k]), float(ours[k])


def _measured(trace: Trace, scenario: Scenario) -> Wrong:
    """What robots publish, and where UAVs see UGVs, is off by the errors that the scenario draws."""
    world, t_s = make_world(scenario), trace.sampled("t_s")
    errors = errors_of(scenario, world)
    if errors is None or (scenario.faults and scenario.faults.late):
        return
    true = np.stack([trace.position(body.name)[trace.sample_rows] for body in world.moving], axis=1)
    views = trace.robots if scenario.own_views else ()
    measure: list[Callable[[float, Array], Array]] = [errors.published, errors.seen_by_uav]
    measure += [partial(errors.view_of, robot) for robot in views]
    published, seen, *viewed = (
        np.array([measured(t, places) for t, places in zip(t_s, true, strict=True)]) for measured in measure
    )
    for i, ugv in enumerate(trace.ugvs if scenario.announces else ()):  # measured a period ago, and a step
        published[1:, i] = published[:-1, i] + scenario.control.period_s * trace.chosen(ugv)[:-1]
    columns = {f"{robot}.seen": published[:, i] for i, robot in enumerate(trace.robots)}
    columns |= {f"{ugv}.uav_saw": seen[:, i] for i, ugv in enumerate(trace.ugvs)}
    for robot, view in zip(views, viewed, strict=True):
        columns |= {f"{robot}.saw_{other}": view[:, i] for i, other in enumerate(trace.robots) if other != robot}
    for column, ours in columns.items():
        theirs = np.column_stack([trace.sampled(f"{column}_{axis}_m") for axis in "xyz"])
        for k in np.flatnonzero(~(np.abs(theirs - ours).max(axis=1) <= SAME_M))[:1]:
            yield f"measured position {column}, m,", t_s[k], theirs[k].tolist(), ours[k].tolist()


def _executed(trace: Trace, scenario: Scenario) -> Wrong:
    """A UGV executes what has arrived, and under a gatekeeper what that accepts, until news about it arrive."""
    for ugv, t, number in unheard(trace):
        yield f"number of the proposal that {ugv} executes", t, number, "one that has arrived"
    if scenario.ugv_controller is not None:
        return
    period_s, gated = scenario.gatekeeper.period_s, method_of(trace.meta["method"]).gated
    table = trace.messages[trace.messages["kind"] != "answer"].dropna(subset="received_s")
    listed = (trace.decisions[name].tolist() for name in ("robot", "t_s", "number", "decision"))
    decided = {
        (ugv, round(t / period_s)): number if answer == "accept" else -1
        for ugv, t, number, answer in zip(*listed, strict=True)
    }
    for ugv in trace.ugvs:
        rows = table[table["receiver"] == ugv].sort_values("received_s")
        arrived = [*zip(rows["received_s"].tolist(), rows["about"].tolist(), rows["kind"].tolist(), strict=True)]
        for t, number in zip(trace.sampled("t_s").tolist(), trace.sampled(f"{ugv}.executing").tolist(), strict=True):
            last = decided.get((ugv, int((t + SAME_S) / period_s)), -1) if gated else number
            news = {(about, kind) for at_s, about, kind in arrived if at_s <= t + SAME_S}
            over = number == -1 and any(about > last or (about, kind) == (last, "withdrawal") for about, kind in news)
            if number != last and not over:
                yield f"number of the proposal that {ugv} executes", t, number, last


def _decided(trace: Trace, scenario: Scenario) -> Wrong:
    """A gatekeeper decides at each of its samples on what its UGV holds, at least until its motion has run out."""
    if not method_of(trace.meta["method"]).gated:
        return
    period_s, ends_s = scenario.gatekeeper.period_s, float(trace.t[-1])
    names, before = ("robot", "number", "policy", "issued_s"), dict[str, float]()
    known = {*zip(*(trace.proposals[name].tolist() for name in names), strict=True)}
    for t, *about in zip(*(trace.decisions[name].tolist() for name in ("t_s", *names)), strict=True):
        if tuple(about) not in known:
            yield f"what {about[0]} decides on", t, about, "one of its proposals"
        if _off_s(t, period_s) > SAME_S or t <= before.get(about[0], -math.inf):
            yield f"time of a decision of {about[0]}", t, t, "its next sample"
        before[about[0]] = t
    decided = {*zip(trace.decisions["number"].tolist(), (trace.decisions["t_s"] / period_s).round(), strict=True)}
    runs_out_s = {number: times[-1] for number, times in trace.proposals[["number", "times_s"]].to_numpy()}
    arrived = trace.messages[trace.messages["kind"] != "answer"].dropna(subset="received_s")
    sent = arrived.sort_values("received_s", kind="stable")
    due, allowed = set[tuple[int, int]](), set[tuple[int, int]]()
    samples = math.ceil(ends_s / period_s - SAME_S)
    for ugv in trace.ugvs:
        news_of = sent[sent["receiver"] == ugv]
        mine = [*zip(*(news_of[name].tolist() for name in ("received_s", "about", "kind")), strict=True)]
        for k, (at_s, about, kind) in enumerate(mine):
            if kind == "withdrawal" or any(other >= about for _, other, _ in mine[:k]):
                continue
            over = (t for t, other, news in mine[k + 1 :] if other > about or (other, news) == (about, "withdrawal"))
            # what the UAV sends at a sample the UGV has at the next one; what a channel delivers then perhaps at once
            first, last = at_s / period_s, next(over, ends_s) / period_s
            may = range(int(first + SAME_S) + 1, min(samples, int(last + SAME_S) + 1))
            runs_out = min(math.ceil(runs_out_s.get(about, ends_s) / period_s - SAME_S) + 1, may.stop)
            must = range(may.start, runs_out)
            if scenario.channel is not None:
                must = range(may.start, min(runs_out, math.ceil(last - SAME_S)))
                may = range(math.ceil(first - SAME_S), may.stop)
            due |= {(about, sample) for sample in must}
            allowed |= {(about, sample) for sample in may}
    for number, sample in sorted(due - decided):
        yield f"decision on proposal {number}", sample * period_s, "nothing", "one"
    for number, sample in sorted(decided - allowed):
        yield f"decision on proposal {number}", sample * period_s, "one", "nothing"


def _by_outcomes(
    row: Mapping[Any, Any], standing: float, over: bool, exhausted: bool, favour: bool
) -> tuple[bool, str]:
    """Whether method (d) accepts, and why; see `ugv.outcome_gatekeeper`."""
    if over or (standing == SILENT and exhausted):
        return False, "over" if over else "exhausted"
    if standing == SILENT or (standing == ACCEPT and len(row["new"])):
        refuse, accept = (
            Outcome(
                np.empty((0, 3)), row[f"{choice}_stalls"] > 0.0, row[f"{choice}_left_m"], row[f"{choice}_outcome_m2_s"]
            )
            for choice in ("refuse", "accept")
        )
        reason = reason_of(refuse, accept, favour=favour)
        return reason in ACCEPTING, reason
    return standing == ACCEPT, "kept"


def _by_costs(row: Mapping[Any, Any], standing: float, stood_s: float, rules: Rules) -> tuple[bool, str]:
    """Whether method (c) accepts, and why."""
    plan, rounded = (np.array([row[f"{name}_first_stage"] == "accept"], dtype=float) for name in ("plan", "rounded"))
    solution = Solution(
        row["plan_first_stage"] == "accept", row["status"], row["objective"], plan=plan,
        rounded=rounded if row["rounded_first_stage"] else None,
    )  # fmt: skip
    return settle(solution, (row["accept_throughout"], row["refuse_throughout"]), standing, stood_s, rules)


def _settled(trace: Trace, scenario: Scenario) -> Wrong:
    """Answers and reasons of a gatekeeper follow from the outcomes, or the costs (25), that it recorded."""
    gate, instants = scenario.gatekeeper, trace.sampled("t_s")
    patience = Patience(gate.tries, gate.rest_s, gate.longest_s)
    rules = Rules(gate.switching_margin, gate.min_dwell_s, gate.rule == "first_stage")
    sent = {number: (times[-1], by) for number, times, by in trace.proposals[["number", "times_s", "cause"]].to_numpy()}
    for ugv in trace.ugvs:
        held, number, standing, since_s, before_s = Commitment(), -1, SILENT, 0.0, 0.0
        for row in trace.decisions[trace.decisions["robot"] == ugv].to_dict("records"):
            t, (ends_s, cause) = row["t_s"], sent[row["number"]]
            standing = standing if row["number"] == number else SILENT
            if method_of(trace.meta["method"]).intervention_on_top:
                ours = *_by_costs(row, standing, t - since_s, rules), row["tries"], False
            else:
                if held.executing and standing != ACCEPT:  # withdrawn, which the UGV sees at its next sample
                    noticed = int(np.searchsorted(instants[:-1], before_s + gate.period_s - SAME_S))
                    held = patience.stop(held, float(instants[noticed]))
                held = patience.rested(held, t)
                over = patience.over(held, t) if standing == ACCEPT else standing == SILENT and t >= ends_s
                accepts, reason = _by_outcomes(row, standing, over, patience.exhausted(held), cause != ugv)
                if accepts and standing == SILENT:
                    held = patience.accept(held, t, ends_s)
                elif standing == ACCEPT and not accepts:
                    held = patience.stop(held, t)
                ours = accepts, reason, float(held.tries), reason not in ("kept", "over", "exhausted")
            theirs = row["decision"] == "accept", row["reason"], row["tries"], row["refuse_outcome_m2_s"] >= 0.0
            if theirs != ours:
                yield f"answer of {ugv} to proposal {row['number']}", t, theirs, ours
            answer = ACCEPT if row["decision"] == "accept" else REFUSE
            since_s = since_s if answer == standing else t
            number, standing, before_s = row["number"], answer, t
