"""Each rule of an oracle finds a record that was edited against it."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from builders.edits import bumped, moved, with_cells, with_meta, with_scenario
from verify.judging import decided
from verify.runs.cases import (
    A_D,
    B_C,
    B_D,
    JOINT,
    Edit,
    accepted,
    at,
    executing,
    first,
    problem,
    proposals,
    refused,
    scenario,
)

from airground_drake.base.arrays import Array
from airground_drake.base.errors import TraceError
from airground_drake.base.registry import method_of
from airground_drake.model.geometry import outline
from airground_drake.scenario.schema import Obstacle, Scenario
from airground_drake.scenario.world import make_world
from airground_drake.sim.blocks import UgvController
from airground_drake.sim.components import make_law
from airground_drake.sim.simulation import simulate
from airground_drake.sim.tables import SEEN_COLUMNS, typed
from airground_drake.sim.trace import Trace
from airground_drake.verify.engines.outlines import RADIUS, unpacked
from airground_drake.verify.runs.proposals import proposals_of
from oracles import ORACLES, commands, predictions
from oracles.communication import SENSED_M
from oracles.outcome_rolls import foreseen
from oracles.protocol import answers_to

Base = Callable[[str], Trace]


def each_value(**changes: Callable[[Any], Any]) -> Edit:
    return proposals(
        lambda table: table.assign(**{k: [f(np.asarray(v)) for v in table[k]] for k, f in changes.items()})
    )


def packed(outlines: Array) -> list[float]:
    return [number for row in outlines for number in outline.as_tuple(row)]


def told(row: int, some: slice = slice(None), by: float = 0.0, wider: float = 0.0) -> Edit:
    """The map of the last proposal, or a part of it, in another proposal."""

    def edit(table: pd.DataFrame) -> pd.DataFrame:
        column = table["mapped"].tolist()
        outlines = outline.moved(unpacked(column[-1])[some], np.array([by, 0.0, 0.0]))
        outlines[:, RADIUS] += wider
        column[row] = packed(outlines)
        return table.assign(mapped=column)

    return proposals(edit)


def sent_again(trace: Trace) -> Trace:
    last = trace.proposals.iloc[[-1]]
    more = last.assign(number=90, issued_s=last["issued_s"] + 0.2)
    event = {"kind": "proposal", "t_s": float(more["issued_s"].iloc[0])} | more.iloc[0][["robot", "policy"]].to_dict()
    table = pd.concat([trace.proposals, more], ignore_index=True)
    return replace(with_meta(trace, events=[*trace.events, event]), proposals=table)


def cut_short(trace: Trace) -> Trace:
    last = int(np.flatnonzero(executing(trace.decisions))[-1])
    return replace(trace, decisions=trace.decisions.iloc[: last - 3])


def messages(edit: Callable[[pd.DataFrame], pd.DataFrame]) -> Edit:
    return lambda trace: replace(trace, messages=edit(trace.messages))


def later(kind: str, by_s: float) -> Edit:
    return messages(lambda table: table.assign(sent_s=table["sent_s"] + by_s * (table["kind"] == kind)))


def other_map(trace: Trace) -> Trace:
    """What a UGV believes is a part of the map in the message."""
    rocks = packed(outline.balls([[3.3, 9.5, 0.0], [5.0, 9.0, 0.0], [6.5, 7.5, 0.0]], gap=2.0))
    return each_value(mapped=lambda _: rocks)(trace)


RECORDS: dict[str, tuple[tuple[str, str, Edit, str], ...]] = {
    "commands": (
        ("other times", B_D, each_value(times_s=lambda v: v + 1e-3), "command"),
        ("other places", B_D, each_value(positions_m=lambda v: v + 1e-4), "command"),
        ("other directions", B_D, each_value(selection=lambda v: v[:3]), "command"),
    ),
    "protocol": (
        ("accepted without a message", B_D, bumped("ugv2.executing", 1.0, 101), "executes another proposal"),
        ("acceptance hidden", B_D, lambda t: bumped("ugv1.executing", -1.0, acting(t))(t), "executes another proposal"),
        ("sent again", B_D, sent_again, "replaced while in force"),
        ("not withdrawn", B_D, messages(lambda table: table[table["kind"] != "withdrawal"]), "withdrawn at another"),
        ("withdrawn later", B_D, later("withdrawal", 0.05), "withdrawn at another time"),
        ("read too late", B_D, messages(lambda table: table.assign(read_s=table["read_s"] + 1)), "answers are not"),
    ),
    "communication": (
        ("kept and told", B_D, lambda t: replace(t, decisions=t.decisions.assign(answer=7)), "answers out of turn"),
        ("another answer, not told", B_D, first(refused, answer=-1), "answers out of turn"),
        ("map before the answer", B_D, told(0), "map of a proposal"),
        ("map forgotten", B_D, told(-1, slice(-1)), "map of a proposal"),
        ("map displaced", B_D, told(-1, by=1e-3), "map of a proposal"),
        ("map inflated", B_D, told(-1, wider=1e-3), "map of a proposal"),
    ),
    "predictions": (
        ("another law", B_C, scenario(control__intervention_gain_1_s=1.6), "velocity of mode"),
        ("stalls", B_D, first(refused, refuse_stalls=0.0), "refuse: stalls"),
        ("way left", B_D, first(refused, accept_left_m=lambda v: 0.5 * v), "accept: outcome"),
    ),
    "progress": (
        ("reason", B_D, first(refused, reason="not_cheaper"), "answer or reason"),
        ("accepted", B_D, first(refused, decision="accept"), "answer or reason"),
        ("outcome", B_D, first(refused, accept_stalls=0.0), "answer or reason"),
        ("makes way for nobody", B_D, first(accepted, reason="makes_way"), "answer or reason"),
        ("kept at first", B_D, first(accepted, reason="kept"), "answer or reason"),
        ("no try", B_D, first(accepted, tries=0.0), "tries"),
        ("another try", B_D, first(executing, tries=2.0), "tries"),
        ("over too early", B_D, first(executing, decision="refuse", reason="over"), "answer or reason"),
        ("just ends", B_D, cut_short, "an acceptance just ends"),
    ),
    "inputs": (
        ("out of sight", B_D, first(accepted, sensed=[]), "recorded as sensed"),
        ("forgotten", B_D, first(accepted, known=[]), "recorded as known"),
        ("news", B_D, first(executing, new=[0]), "recorded as new"),
        ("another map", B_D, other_map, "recorded as told"),
        ("told of", B_D, first(refused, told=[0]), "recorded as told"),
    ),
}  # fmt: skip
"""By oracle: what is edited, in which run, how, and what the oracle says."""


def acting(trace: Trace) -> int:
    return int(np.flatnonzero(trace.sampled("ugv1.executing") >= 0.0)[3])


@pytest.mark.parametrize(
    "oracle", [pytest.param(each, marks=[pytest.mark.slow] * (each == "predictions")) for each in ORACLES]
)
def test_a_joint_plan_that_only_some_accept_is_no_fault(base: Base, oracle: str) -> None:
    assert not ORACLES[oracle](base(JOINT))


@pytest.mark.parametrize(("oracle", "row"), [(name, row) for name, rows in RECORDS.items() for row in rows],
                         ids=lambda value: value if isinstance(value, str) else value[0])  # fmt: skip
def test_an_edited_record_is_noticed(base: Base, oracle: str, row: Any) -> None:
    _, name, edit, what = row
    assert any(fault.what.startswith(what) for fault in ORACLES[oracle](edit(base(name))))


@pytest.mark.parametrize(
    "edit",
    [
        proposals(lambda table: table.iloc[:0]),
        proposals(lambda table: table.assign(robot="ugv9")),
        proposals(lambda table: table.assign(cause="ugv9")),
        proposals(lambda table: table.assign(sender="uav9")),
        each_value(positions_m=lambda v: v[:-1]),
        each_value(times_s=lambda v: v[::-1]),
        each_value(positions_m=lambda v: np.nan * v),
        lambda trace: replace(trace, decisions=trace.decisions.assign(issued_s=9.0)),
    ],
)
def test_malformed_proposals_are_refused(base: Base, edit: Edit) -> None:
    with pytest.raises(TraceError):
        proposals_of(edit(base(B_D)))


def barely_in_sight(trace: Trace, by: float) -> Trace:
    """The sensing range does not reach what a refusal has taught the UAV."""
    (hidden,) = (o.position_m for o in trace.scenario.obstacles.values() if not o.known_to_uav)
    said = [answer for sent in proposals_of(trace) if sent.ugv == "ugv1" for answer in answers_to(trace, sent)]
    places = [trace.position("ugv1")[np.argmin(np.abs(trace.t - a.t_s))] for a in said if not a.accepted]
    farthest = max(float(np.linalg.norm(place - hidden)) for place in places)
    return with_scenario(trace, control__sensing_range_m=farthest - by)


def at_the_end(robot: str) -> Callable[[Trace, float], Trace]:
    """The last command is faster, and leads as much farther: nothing follows from it."""
    return lambda trace, by: moved(trace, robot, len(trace.t) - 1, [by * float(np.diff(trace.t)[-1]), 0.0, 0.0])


def longer_way_left(trace: Trace, by: float) -> Trace:
    """Farther from the goal than is possible, with the cost of that."""
    k = int(np.argmax(trace.decisions["accept_left_m"].to_numpy()))
    given = trace.decisions.iloc[k].to_dict()
    left = foreseen(trace)[given["t_s"], given["number"]][1].most_left_m + by
    speed = trace.scenario.ugvs[given["robot"]].preset.speed_m_s
    cost = given["accept_outcome_m2_s"] + (left**3 - given["accept_left_m"] ** 3) / (3.0 * speed)
    return with_cells(trace, "decisions", k, ["accept_left_m", "accept_outcome_m2_s"], [left, cost])


def outcome(trace: Trace, by: float) -> Trace:
    """Relative, as outcomes are compared."""
    name = "accept_outcome_m2_s"
    k = int(np.argmax(trace.decisions[name].to_numpy()))
    return with_cells(trace, "decisions", k, name, lambda cost: cost * (1.0 + by))


TOLERANCES: dict[str, tuple[str, str, float, Callable[[Trace, float], Trace]]] = {
    "command of a UGV": ("commands", A_D, commands.COMMAND_TOLERANCE_M_S, at_the_end("ugv2")),
    "command of the UAV": ("commands", A_D, commands.COMMAND_TOLERANCE_M_S, at_the_end("uav")),
    "sight of an obstacle": ("communication", B_D, SENSED_M, barely_in_sight),
    "velocity": ("predictions", B_C, predictions.VELOCITY_TOLERANCE_M_S,
                 lambda t, by: problem(-1, accept_m_s=at(0, lambda v: v + by))(t)),
    "outcome": ("predictions", B_D, predictions.OUTCOME_TOLERANCE, outcome),
    "way left": ("predictions", B_D, predictions.LEFT_TOLERANCE_M, longer_way_left),
}  # fmt: skip


@pytest.mark.parametrize("what", TOLERANCES)
def test_twice_the_tolerance_is_noticed_and_half_of_it_is_not(base: Base, what: str) -> None:
    oracle, name, tolerance, edit = TOLERANCES[what]
    assert not ORACLES[oracle](edit(base(name), 0.5 * tolerance))
    assert ORACLES[oracle](edit(base(name), 2.0 * tolerance))


@pytest.mark.parametrize(("hidden", "answer"), [((6.5, 9.0), "refuse"), ((4.5, 10.0), "accept")])
def test_an_accepted_intervention_is_reconsidered_when_an_obstacle_is_new(
    case_a: Scenario, hidden: tuple[float, float], answer: str
) -> None:
    """The obstacle is not on the UAV's map; it comes into sight after the acceptance."""
    case_a.obstacles["hidden"] = Obstacle(position_m=[*hidden, 0.0], known_to_uav=False)
    trace = simulate(case_a, "d")
    mine = trace.decisions[trace.decisions["number"] == trace.decisions["number"].iloc[0]]
    begun, again = (row for _, row in mine[mine["accept_stalls"] >= 0.0].iterrows())
    assert (begun["decision"], again["decision"], begun["tries"], again["tries"]) == ("accept", answer, 1.0, 1.0)
    assert not ORACLES["progress"](trace)
    assert not ORACLES["predictions"](trace)
    assert decided("LIVE-HYP", trace).status == "holds"
    told_before = each_value(mapped=lambda v: [*v, *packed(outline.balls([*hidden, 0.0], gap=2.0))])
    assert ORACLES["inputs"](told_before(trace))  # then it was no news
    nothing_new = trace.decisions.assign(new=[[]] * len(trace.decisions))
    found = decided("LIVE-HYP", replace(trace, decisions=nothing_new))
    assert found.status == ("refuted" if answer == "refuse" else "holds")
    assert answer == "accept" or "reversed without news" in str(found.counterexample)
    trace.decisions.loc[again.name, ["decision", "reason"]] = ["accept", "kept"]
    assert ORACLES["progress"](replace(trace))


def test_a_command_is_judged_by_what_its_robot_saw(run: Callable[[str, str], Trace]) -> None:
    """ugv1 is made to see ugv2 just ahead of it at one sample, and commanded accordingly."""
    trace, k = run("case_a", "d"), 100
    t, rows = float(trace.sampled("t_s")[k]), trace.sample_rows
    places = np.array([trace.position(robot)[rows[k]] for robot in trace.robots])
    places[1] = places[0] + [0.0, 2.01, 0.0]
    controller = UgvController(make_world(trace.scenario), make_law(trace.scenario, method_of("d"), "augmented"))
    wanted = (np.array([of(ugv)[k] for ugv in trace.ugvs]) for of in (trace.reference, trace.reference_rate))
    command = controller.velocity(t, places, *wanted, [None] * len(trace.ugvs))[0]
    blind = with_cells(trace, "samples", k, [f"ugv1.v{axis}_m_s" for axis in "xyz"], command)
    assert [(fault.robot, fault.t_s) for fault in ORACLES["commands"](blind)][:1] == [("ugv1", t)]
    row = {"t_s": t, "by": "ugv1", "of": "ugv2", **dict(zip(("x_m", "y_m", "z_m"), places[1], strict=True))}
    sighted = replace(blind, seen=typed([row | {"measured_s": t}], SEEN_COLUMNS))
    assert "ugv1" not in [fault.robot for fault in ORACLES["commands"](sighted)]
