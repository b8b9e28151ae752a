"""The UAV's planner: joint plans, who is asked for whom, and what a refusal changes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from oracles import faults_of
from verify.judging import decided

from airground_drake import load, simulate
from airground_drake.base.registry import METHODS
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.geometry.outline import as_tuple, balls, stacked
from airground_drake.sim.components import make_planner
from airground_drake.uav.database import BehaviourDatabase
from airground_drake.uav.messages import ACCEPT, DONE, REFUSE, SILENT, Report, accepted_proposals, answer_to
from airground_drake.uav.planner import Instant, Planner, PlannerState, Sender, sent_after
from airground_drake.uav.policy import Observation, Policy

PLACES = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 0.0, 3.0]])
UGVS = ("one", "two", "three")
NOBODY = (Report(),) * 3


def wait(seconds: float) -> Motion:
    return Motion(np.array([0.0, seconds]), np.zeros((2, 3)))


class Scripted(Policy):
    def __init__(self, *answers: Any) -> None:
        self.answers = list(answers)
        self.seen: list[Observation] = []

    def propose(self, seen: Observation) -> Mapping[str, Motion] | None:
        self.seen.append(seen)
        return self.answers.pop(0) if self.answers else None


def planner(policy: Policy) -> Planner:
    presets = tuple(Motion(np.zeros(1), place[None]) for place in PLACES[:3])
    database = BehaviourDatabase([("scripted", policy)], retry=1.0, ranking="listed")
    return Planner(UGVS, database, 0.1, presets, PLACES[:3], stacked([]), 1.0, np.ones(3), trails=(True, True, False))


def step(
    uav: Planner,
    memory: PlannerState,
    t: float,
    intervening: str,
    answers: Mapping[str, float] | None = None,
    report: Report = NOBODY[0],
    reasons: Sequence[str] = ("",) * 3,
) -> PlannerState:
    reports = tuple(report._replace(reason=reason) for reason in reasons)
    given = []
    for name, talk in zip(UGVS, memory.talks, strict=True):
        number = talk.proposal.number if talk.proposal else -1
        given += [(answers or {}).get(name, SILENT), number]
    called = [name in intervening.split() for name in UGVS]
    return sent_after(memory, uav.plan(memory, Instant(t, PLACES, called, np.array(given), reports)), t, uav.sender)


def in_force(memory: PlannerState) -> dict[str, tuple[float, str]]:
    pairs = zip(UGVS, memory.proposals, strict=True)
    return {name: (proposal.issued, proposal.cause) for name, proposal in pairs if proposal is not None}


def test_one_plan_for_all_with_the_cause_of_each() -> None:
    policy = Scripted({"one": wait(9.0), "two": wait(9.0), "three": wait(9.0)})
    uav = planner(policy)
    memory = step(uav, uav.start(), 1.0, "one three")
    assert in_force(memory) == {"one": (1.0, "one"), "two": (1.0, "one"), "three": (1.0, "three")}
    assert [UGVS[i] for i, _ in memory.sent] == ["one", "two", "three"]
    assert len(policy.seen) == 1  # a joint plan answers for all that are in it


def test_a_joint_plan_stands_as_long_as_one_party_needs_it() -> None:
    uav = planner(Scripted({"one": wait(9.0), "two": wait(9.0)}))
    memory = step(uav, uav.start(), 1.0, "one")
    memory = step(uav, memory, 1.1, "one two", {"two": ACCEPT})  # it is far from its own preset now
    memory = step(uav, memory, 1.2, "two", {"two": ACCEPT})  # "one" passes its preset on its way
    assert in_force(memory) == {"one": (1.0, "one"), "two": (1.0, "one")}
    assert in_force(step(uav, memory, 1.3, "")) == {}
    memory = step(uav, uav.start(), 1.0, "one")
    assert in_force(step(uav, memory, 1.1, "")) == {}


def test_a_proposal_that_stands_alone_is_withdrawn_when_its_ugv_is_released() -> None:
    uav = planner(Scripted({"one": wait(9.0)}, {"three": wait(9.0)}))
    memory = step(uav, step(uav, uav.start(), 1.0, "one"), 1.1, "one three")
    assert in_force(step(uav, memory, 1.2, "three")) == {"three": (1.1, "three")}


def test_one_refusal_withdraws_a_joint_plan_for_all() -> None:
    policy = Scripted({"one": wait(9.0), "two": wait(9.0), "three": wait(9.0)})
    uav = planner(policy)
    memory = step(uav, uav.start(), 1.0, "one three")
    assert [sent.party for _, sent in memory.sent] == [("one", "three", "two")] * 3
    memory = step(uav, memory, 1.1, "one three", {"one": ACCEPT, "two": REFUSE, "three": ACCEPT})
    assert in_force(memory) == {}
    one, two, three = policy.seen[1].team  # the policies are asked at once for those that did not refuse
    assert (two.proposal, two.refusals, two.resting) == (None, 1, True)
    assert (one.proposal, one.resting, three.proposal, three.resting) == (None, False, None, False)
    assert not step(uav, memory, 2.2, "one three").talks[1].proposal  # nobody asks it for itself


@pytest.mark.parametrize(("end", "too_fast"), [(0.0, 0), (0.9, 0), (1.1, 1)])
def test_a_motion_that_leaves_its_ugv_behind_was_too_fast(end: float, too_fast: int) -> None:
    """It is at (0, 0) at a limit of 1 m/s."""
    motion = Motion(np.array([0.0, 2.0]), np.array([[0.0, 0.0, 0.0], [end, 0.0, 0.0]]))
    uav = planner(Scripted({"one": motion}))
    memory = step(uav, uav.start(), 1.0, "one")
    assert step(uav, memory, 1.9, "one", {"one": ACCEPT}).talks[0].too_fast == 0
    assert step(uav, memory, 2.1, "one", {"one": DONE}).talks[0].too_fast == too_fast
    assert step(uav, memory, 2.1, "", {"one": DONE}).talks[0].too_fast == 0


def test_no_motion_is_too_fast_for_a_ugv_that_follows_at_once() -> None:
    away = Motion(np.array([0.0, 2.0]), np.array([[0.0, 0.0, 0.0], [0.0, 5.0, 0.0]]))
    uav = planner(Scripted({"three": away}, {"three": away}))
    memory = step(uav, uav.start(), 1.0, "three")
    assert step(uav, memory, 2.1, "three", {"three": DONE}).talks[2].too_fast == 0
    assert step(uav, memory, 1.1, "three", {"three": REFUSE}, reasons=["stalls"] * 3).talks[2].too_fast == 0


def test_another_plan_stays_in_force_when_a_joint_plan_is_refused() -> None:
    uav = planner(Scripted({"three": wait(9.0)}, {"one": wait(9.0), "two": wait(9.0)}))
    memory = step(uav, uav.start(), 1.0, "three")
    memory = step(uav, memory, 1.0, "one three")
    memory = step(uav, memory, 1.1, "one three", {"two": REFUSE, "three": ACCEPT})
    assert in_force(memory) == {"three": (1.0, "three")}


def drive(start_s: float) -> Motion:
    return Motion(start_s + np.array([0.0, 9.0]), np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]]))


@pytest.mark.parametrize(("t", "place", "answer", "anew"), [
    (1.9, 0.0, SILENT, True), (1.9, 0.0, ACCEPT, False),  # a copy would leave at 2.0
    (1.8, 0.0, SILENT, False),  # none leaves before it is asked again
    (1.9, 0.5, SILENT, False),  # it is on its way
])  # fmt: skip
def test_a_proposal_that_its_ugv_missed_is_planned_anew(t: float, place: float, answer: float, anew: bool) -> None:
    policy = Scripted({"one": drive(1.3)}, {"one": drive(2.3)})
    uav = replace(planner(policy), lead=0.2, retry=1.0)
    memory = step(uav, uav.start(), 1.0, "one")
    at = PLACES + np.array([[place, 0.0, 0.0], *np.zeros((3, 3))])
    answers = np.array([answer, 0.0, *[SILENT, -1.0] * 2])
    after = sent_after(memory, uav.plan(memory, Instant(t, at, [True, False, False], answers, NOBODY)), t, uav.sender)
    assert [proposal.issued for _, proposal in after.sent] == [1.0, *([t] if anew else [])]


@pytest.mark.parametrize(
    ("lead", "motions"), [(0.0, {"one": drive(1.6)}), (9.0, {"one": drive(1.3), "two": wait(9.0)})]
)
def test_a_proposal_in_time_and_a_part_of_a_joint_plan_are_repeated(lead: float, motions: dict[str, Motion]) -> None:
    uav = replace(planner(Scripted(motions)), lead=lead, retry=1.0)
    memory = step(uav, uav.start(), 1.0, "one")
    assert in_force(step(uav, memory, 2.0, "one")) == in_force(memory)


@pytest.mark.parametrize(("t", "two"), [(1.9, DONE), (2.0, SILENT)], ids=["executed", "run out"])
def test_a_part_that_is_over_leaves_the_others_in_force(t: float, two: float) -> None:
    uav = planner(Scripted({"one": wait(9.0), "two": wait(2.0)}))
    memory = step(uav, uav.start(), 1.0, "one")
    memory = step(uav, memory, t, "one", {"one": ACCEPT, "two": two})
    assert in_force(memory) == {"one": (1.0, "one")}
    alone = [number for p in memory.proposals for number in ((ACCEPT, p.number) if p else (SILENT, -1.0))]
    assert accepted_proposals(memory.proposals, np.array(alone))[0] is memory.proposals[0]


@pytest.mark.parametrize(
    ("answers", "executed"),
    [((ACCEPT, ACCEPT, SILENT), "one two"), ((ACCEPT, SILENT, REFUSE), "one"), ((DONE, ACCEPT, ACCEPT), "two three")],
)
def test_a_part_of_a_joint_plan_is_executed_when_its_ugv_accepts(answers: tuple[float, ...], executed: str) -> None:
    uav = planner(Scripted({"one": wait(9.0), "two": wait(9.0)}, {"three": wait(9.0)}))
    proposals = step(uav, uav.start(), 1.0, "one three").proposals
    given = np.array([number for p, said in zip(proposals, answers, strict=True) for number in (said, p.number)])
    found = accepted_proposals(proposals, given)
    assert [name for name, proposal in zip(UGVS, found, strict=True) if proposal] == executed.split()


def test_proposals_are_numbered_as_they_are_sent() -> None:
    uav = planner(Scripted({"one": wait(2.0), "three": wait(9.0)}, {"one": wait(9.0), "two": wait(9.0)}))
    memory = step(uav, uav.start(), 1.0, "one")
    memory = step(uav, memory, 2.0, "one")
    assert [(UGVS[i], sent.number, sent.issued) for i, sent in memory.sent] == [
        ("one", 0, 1.0), ("three", 1, 1.0), ("one", 2, 2.0), ("two", 3, 2.0),
    ]  # fmt: skip
    assert [sent.number for sent in memory.proposals if sent] == [2, 3, 1]


def test_numbers_are_unique_over_uavs_and_say_who_sent_them() -> None:
    numbers = []
    for k, name in enumerate(("north", "south", "west")):
        uav = planner(Scripted({"one": wait(2.0), "three": wait(9.0)}, {"one": wait(9.0)}))
        uav = replace(uav, sender=Sender(name, first=k, step=3))
        memory = step(uav, step(uav, uav.start(), 1.0, "one"), 2.0, "one")
        assert {sent.sender for _, sent in memory.sent} == {name}
        numbers += [sent.number for _, sent in memory.sent]
    assert sorted(numbers) == [*range(9)]


def test_no_motion_is_executed_that_was_not_decided_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Though the planner changes an accepted motion, under the same number and time of issue."""

    def swapping(self: Planner, memory: PlannerState, now: Instant) -> PlannerState:
        planned = honest(self, memory, now)
        talks = list(planned.talks)
        for i, talk in enumerate(talks):
            if talk.proposal is not None and answer_to(talk.proposal, now.answers, i) == ACCEPT:
                motion = Motion(talk.proposal.motion.times, talk.proposal.motion.positions + np.array([0.0, 0.2, 0.0]))
                talks[i] = replace(talk, proposal=replace(talk.proposal, motion=motion))
        return replace(planned, talks=tuple(talks))

    honest = Planner.plan
    monkeypatch.setattr(Planner, "plan", swapping)
    trace = simulate(load("case_a", ["duration_s=17"]), "d")
    assert len(trace.proposals) > 2
    assert (trace.executing("ugv1") >= 0).any()
    assert set(faults_of(trace)) <= {"protocol", "records"}  # which say that they are replaced
    assert decided("GATE-PLAN", trace).status == "holds"


def test_who_refuses_its_own_rests_before_the_next() -> None:
    policy = Scripted({"one": wait(9.0)}, {"one": wait(9.0)})
    uav = planner(policy)
    memory = step(uav, uav.start(), 1.0, "one")
    memory = step(uav, memory, 1.1, "one", {"one": REFUSE})
    assert in_force(memory) == {}
    assert len(policy.seen) == 1
    assert in_force(step(uav, memory, 2.1, "one")) == {"one": (2.1, "one")}
    assert policy.seen[-1].refusals == 1


def test_who_refuses_to_make_way_is_asked_again_after_a_rest() -> None:
    class Asks(Policy):
        def propose(self, seen: Observation) -> Mapping[str, Motion] | None:
            return None if seen.team[1].resting else {"two": wait(1e4)}

    uav = planner(Asks())
    memory = uav.start()
    for k in range(10, 100):
        memory = step(uav, memory, 0.1 * k, "one", {"two": REFUSE})
    asked = [sent.issued for _, sent in memory.sent]
    assert len(asked) > 3
    assert memory.talks[1].refusals == len(asked)


def test_the_rest_doubles_while_no_policy_has_a_proposal() -> None:
    policy = Scripted(*[None] * 5, {"one": wait(60.0)}, None)
    uav, asked = planner(policy), list[float]()
    memory = uav.start()
    for k in range(10, 800):
        before = len(policy.seen)
        memory = step(uav, memory, 0.1 * k, "one")
        asked += [0.1 * k] * (len(policy.seen) - before)
    assert np.diff(asked) == pytest.approx([1.0, 2.0, 4.0, 8.0, 16.0, 28.0, 1.0, 2.0, 4.0, 8.0], abs=0.11)
    assert not any(mate.resting for seen in policy.seen for mate in seen.team)  # others may still include it


def test_a_motion_that_was_executed_to_its_end_was_not_refused() -> None:
    """The UAV may plan less often than UGVs decide: it sees that the UGV has given it back when it was over."""
    uav = planner(Scripted({"one": wait(3.0)}, {"one": wait(9.0)}))
    memory = step(uav, uav.start(), 1.0, "one")
    memory = step(uav, memory, 1.1, "one", {"one": ACCEPT})
    memory = step(uav, memory, 3.1, "one", {"one": DONE}, Report(reason="over"))
    assert in_force(memory) == {"one": (3.1, "one")}
    assert memory.talks[0].refusals == 0


@pytest.mark.parametrize(
    ("proposed", "said"),
    [
        ({"four": wait(1.0)}, "not to 'four'"),
        ({"one": "left"}, "not str"),
        ({1: wait(1.0)}, "not to 1"),
        ({"one": wait(1.0), "two": wait(1.0)}, "proposal of this instant"),
    ],
)
def test_nonsense_is_no_intervention(proposed: object, said: str) -> None:
    uav = planner(Scripted({"one": wait(9.0)}, proposed))
    memory = step(uav, uav.start(), 1.0, "one two")
    assert in_force(memory) == {"one": (1.0, "one")}
    (fault,) = (asked for asked in memory.asked if asked.what)
    assert fault.robot == "two"
    assert said in fault.what


def test_radii_come_with_a_refusal_and_go_out_with_a_proposal() -> None:
    policy = Scripted({"one": wait(9.0)}, {"one": wait(9.0)})
    uav = replace(
        planner(policy),
        mapped=balls([2.0, 9.0, 0.0], 3.0, 1.0),
        radius=np.array([0.5, 0.1, 0.0]),
    )
    memory = step(uav, uav.start(), 1.0, "one")
    known, unknown = map(as_tuple, balls([[2.0, 9.0, 0.0], [5.0, 5.0, 0.0]], [3.0, 0.7], 1.0))
    sensed = Report(sensed=(known, unknown))
    answers = np.array([REFUSE, 0.0, SILENT, -1.0, SILENT, -1.0])
    memory = uav.plan(memory, Instant(1.1, PLACES, [True, False, False], answers, (sensed, *NOBODY[1:])))
    assert memory.learnt == (unknown,)  # the other one is on the map
    memory = step(uav, memory, 3.0, "one")
    first, second = policy.seen
    assert (first.radius, [each.radius for each in first.team]) == (0.5, [0.5, 0.1, 0.0])
    assert first.obstacle_distances.tolist() == [1.0 + (0.5 + 3.0)]
    assert second.obstacle_distances.tolist() == [1.0 + (0.5 + 3.0), 1.0 + (0.5 + 0.7)]
    assert second.distance_to(second.team[1]) == 1.0 + (0.5 + 0.1)
    sent = memory.proposals[0]
    assert sent is not None
    assert list(map(as_tuple, sent.mapped)) == [known, unknown]


def test_an_old_report_of_what_has_left_the_map_teaches_nothing() -> None:
    """A new one does: another obstacle has come in its place."""
    (rock,) = map(as_tuple, balls([2.0, 9.0, 0.0], 3.0, 1.0))
    uav = replace(planner(Scripted({"one": wait(9.0)})), mapped=stacked([rock]), mapped_until=5.0)
    memory = step(uav, uav.start(), 1.0, "one")
    for t, number, learnt in ((1.1, 0, ()), (5.0, 0, ()), (5.0, 1, (rock,))):
        memory = step(uav, memory, t, "one", {"one": ACCEPT}, Report(number, (rock,)))
        assert memory.learnt == learnt


def test_a_policy_sees_each_robot_as_it_is() -> None:
    """Positions, speed limits, and who stands: of that very robot, whichever UGV it is asked about."""
    policy = Scripted()
    uav = replace(planner(policy), max_speed=np.array([1.0, 2.0, 3.0]))
    moved = PLACES + np.array([[0.0], [1.0], [0.0], [0.0]])
    standing = [True, False, True]
    uav.plan(uav.start(), Instant(1.0, moved, [True] * 3, np.array([SILENT, -1.0] * 3), NOBODY, standing))
    assert [seen.robot for seen in policy.seen] == list(UGVS)
    for i, seen in enumerate(policy.seen):
        np.testing.assert_array_equal(seen.position, moved[i])
        np.testing.assert_array_equal(seen.others, [place for k, place in enumerate(moved) if k != i])
        assert [each.max_speed for each in seen.team] == [1.0, 2.0, 3.0]
        assert [each.standing for each in seen.team] == [True, False, True]
        np.testing.assert_array_equal([each.position for each in seen.team], moved[:3])


def test_the_planner_has_each_ugv_s_own_limits() -> None:
    scenario = load("case_a", ["ugvs.ugv1.max_speed_m_s=2.5", "ugvs.ugv2.radius_m=0.1", "safe_distance.ugv_m=1.0"])
    made = make_planner(scenario, METHODS["d"], "uav")
    assert made.max_speed.tolist() == [2.5, scenario.ugvs["ugv2"].max_speed_m_s] != [2.5, 2.5]
    assert made.radii.tolist() == [0.0, 0.1]


@pytest.mark.parametrize(
    ("plant", "behind"),
    [
        ("{}", False),
        ("{kind: lag, time_constant_s: 0.1}", True),
        ("{kind: unicycle, hand_point_m: 0.2}", False),  # no turning limit
        ("{kind: unicycle, hand_point_m: 0.2, max_turn_rad_s: 4.0}", True),
        ("{kind: unicycle, hand_point_m: 0.2, max_turn_rad_s: 20.0}", False),  # 4 m/s at the hand point, limit 3 m/s
        ("{kind: unicycle, hand_point_m: 0.2, wheel_base_m: 0.3, max_wheel_speed_m_s: 3.7}", True),
        ("{kind: unicycle, hand_point_m: 0.2, wheel_base_m: 0.3, max_wheel_speed_m_s: 3.8}", False),  # 3 hypot(1, 0.75)
    ],
)
def test_who_may_fall_behind_a_motion(plant: str, behind: bool) -> None:
    scenario = load("minimal", [f"ugvs.ugv1.plant={plant}", "ugvs.ugv1.max_speed_m_s=3.0"])
    assert make_planner(scenario, METHODS["d"], "uav").trails == (behind,)
