"""Events that follow from signals."""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from builders.edits import with_meta
from builders.runs import passing_by
from builders.scenarios import STILL, lone
from builders.simulation import simulate
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.model.bodies.motion import PeriodMotion
from airground_drake.model.geometry.outline import balls
from airground_drake.report.replay.scene import sent
from airground_drake.scenario.schema import Obstacle
from airground_drake.sim import events
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge

PLACES = st.lists(st.tuples(*[st.integers(-4, 4)] * 2), min_size=2, max_size=12)


def collisions(trace: Trace) -> list[dict[str, Any]]:
    return [event for event in events.extract(trace) if event["kind"] == "collision"]


@examples(200)
@given(PLACES, st.sampled_from([0.3, 0.9, 1.7]))
def test_every_visit_is_found_once(places: list[tuple[int, int]], within: float) -> None:
    """Against many points between the rows: visits begin where these come near."""
    apart = np.array([[x, y, 0.0] for x, y in places])
    fine, between = 400, np.arange(len(apart) - 1.0 + 1e-9, step=1.0 / 400)
    dense = np.stack([np.interp(between, np.arange(len(apart)), axis) for axis in apart.T], axis=1)
    near = np.linalg.norm(dense, axis=1) < within
    begins = np.flatnonzero(near & ~np.append(False, near[:-1]))
    expected = []
    for k in begins.tolist():
        ends = k + int(np.argmin(np.append(near[k:], False)))  # the first that is not near again
        row = -(-k // fine)
        expected.append(row if row * fine < ends else k // fine)
    grazing = abs(np.linalg.norm(dense, axis=1).min() - within) < 0.02
    if not grazing:
        assert events.visits(PeriodMotion(apart[:-1], apart[1:]), balls(np.zeros(3)), within, True).tolist() == expected


def test_what_is_passed_between_two_rows_is_hit() -> None:
    trace = passing_by(-1.99)  # 10 mm beside an obstacle's centre
    assert [(event["robot"], event["obstacle"]) for event in collisions(trace)] == [("ugv1", "o")]
    assert not collisions(passing_by(-1.94))


@pytest.mark.parametrize("gap_m", [-1e-6, 1e-6])
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_bodies_collide_when_their_surfaces_come_near(share: float, gap_m: float) -> None:
    trace = passing_by(-1.0)
    apart = {"o": 1.0, "uav": float(np.linalg.norm(trace.position("ugv1") - trace.position("uav"), axis=1).min())}
    assert apart["uav"] > 0.5
    for other in apart:
        radii = apart[other] - trace.scenario.safe_distance.collision_m - gap_m
        given = deepcopy(trace.meta["scenario"])
        given["ugvs"]["ugv1"]["radius_m"] = share * radii
        (given["obstacles"]["o"] if other == "o" else given["uav"])["radius_m"] = (1.0 - share) * radii
        found = collisions(replace(trace, meta={**trace.meta, "scenario": given}))
        hit = [event.get("obstacle") or event.get("other") for event in found]
        assert (other in hit) == (gap_m < 0.0)


def crossing(flight: float = 0.0, **more: Any) -> Trace:
    """A UGV at its target, which a UAV hits at 1 s if it comes at 4 m/s; both go on for 1 s at 1 m/s."""
    scenario = lone([0.0] * 3, [0.0] * 3, STILL, 2.0, **more)
    scenario["uav"] |= {"start_m": [-4.0, 0.0, 0.0], "target_m": [-4.0, 0.0, 0.0]}
    return simulate(scenario, drive=lambda t: [[float(t >= 1.0), 0.0, 0.0], [flight * (t < 1.0), 0.0, 0.0]])


def test_a_ugv_that_has_done_its_part_refuses_nothing(run: Callable[..., Trace]) -> None:
    trace = run("doorway", "d")
    kinds = [event["kind"] for event in trace.events]
    assert {"accept", "over"} <= {*kinds}
    assert "refuse" not in kinds
    of_proposals = [span for each in sent(trace) for span in each.spans]
    assert {span.outcome for span in of_proposals} == {"asked", "accepted"}
    begins = {event["robot"]: event["t_s"] for event in trace.events if event["kind"] == "over"}
    assert begins.items() <= {(each.robot, each.spans[-1].end_s) for each in sent(trace)}


def test_each_proposal_has_its_answer_and_events_of_one_time_are_by_robot(run: Callable[..., Trace]) -> None:
    trace = run("doorway", "d")
    accepted = trace.decisions[trace.decisions["decision"] == "accept"].head(1)
    (t_s,), (first, second, *_) = accepted["t_s"], trace.ugvs
    decisions = pd.concat([accepted.assign(robot=first, number=number) for number in (0, 1)])
    sent_to = trace.proposals.head(1).assign(robot=second, issued_s=t_s)
    extracted = events.extract(replace(trace, decisions=decisions, proposals=sent_to))
    told = [(event["robot"], event["kind"]) for event in extracted if event["kind"] in ("accept", "proposal")]
    assert told == [(first, "accept")] * 2 + [(second, "proposal")]


def test_nothing_after_a_collision_counts() -> None:
    """A UGV arrives, then a UAV hits it and it drives on. Without the hit it does not arrive."""
    hit, missed = crossing(4.0), crossing()
    for trace, arrivals in ((hit, {"ugv1"}), (missed, {"uav"})):
        found = events.extract(trace)
        assert {event["robot"] for event in found if event["kind"] == "arrival"} == arrivals
        (verdict,) = judge(with_meta(trace, events=found), ["LIVE-GOAL"])
        worst = verdict.counterexample or {}
        assert verdict.status == "refuted"
        assert (worst["robot"], "collided_s" in worst) == (("uav", True) if arrivals == {"ugv1"} else ("ugv1", False))


def test_an_arrival_after_a_collision_is_none_and_one_at_the_tolerance_counts() -> None:
    """Through an obstacle to its target: the collision is named, with its time."""
    scenario = lone([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], STILL, 2.0, obstacles={"rock": Obstacle([0.0] * 3)})
    trace = simulate(scenario, drive=lambda t: [[1.0, 0.0, 0.0], [0.0] * 3])
    found = events.extract(trace)
    assert [event["robot"] for event in found if event["kind"] == "arrival"] == ["uav"]
    finding = judge(with_meta(trace, events=found), ["LIVE-GOAL"])[0]
    assert finding.status == "refuted"
    assert finding.where["robot"] == "ugv1"
    assert finding.where["collided_s"] == pytest.approx(1.0 - trace.scenario.safe_distance.collision_m, abs=0.026)
    assert events.arrival_row(np.array([[2.0, 0.0, 0.0], [0.5, 0.0, 0.0]]), [0.0] * 3, 0.5) == 1
