"""Runs with bodies: radii are part of every distance that is kept, predicted or judged."""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from builders import logs
from builders.misbuilt import neighbours
from oracles import faults_of
from report.cases import built
from sim.blocks.both_programs import found as statuses

from airground_drake.model.bodies.world import World
from airground_drake.model.geometry.outline import GAP
from airground_drake.report import attention
from airground_drake.report.export import recording
from airground_drake.report.figures.draw import draw
from airground_drake.report.html import page
from airground_drake.report.metrics import closest_obstacle
from airground_drake.report.model import of
from airground_drake.report.screen import first_screen
from airground_drake.scenario.load import load, validated
from airground_drake.scenario.schema import Policy, Run, Scenario
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.ugv.answer import Basis
from airground_drake.ugv.outcome_gatekeeper import OutcomeGatekeepers
from airground_drake.ugv.rollout import View
from airground_drake.verify import judge
from airground_drake.verify.engines.outlines import unpacked
from airground_drake.verify.proofs.export import recorded
from airground_drake.verify.proofs.table import too_near
from airground_drake.verify.runs.encounters import encounters

ROCK, OWN, FLIER = 0.5, 0.25, 0.25
"""Radii, m, whose sums are exact."""


def scenario(*, points: bool = False) -> Scenario:
    found = load("minimal", ["duration_s=11"])
    safe = found.safe_distance
    safe.obstacle_m, safe.air_ground_m, safe.ugv_m = 1.25, 0.75, 1.75
    found.ugvs["ugv1"].radius_m, found.uav.radius_m, found.obstacles["rock"].radius_m = OWN, FLIER, ROCK
    if points:
        safe.obstacle_m, safe.air_ground_m, safe.ugv_m = 1.25 + OWN + ROCK, 0.75 + OWN + FLIER, 1.75 + OWN
        found.ugvs["ugv1"].radius_m = found.uav.radius_m = found.obstacles["rock"].radius_m = 0.0
    return validated(found)


@pytest.fixture(scope="module")
def bodies() -> Trace:
    return simulate(scenario(), "d")


def test_bodies_move_as_points_that_keep_as_much_more(bodies: Trace) -> None:
    points = simulate(scenario(points=True), "d")
    assert bodies.states.equals(points.states)
    assert bodies.decisions.equals(points.decisions)
    assert bodies.events == points.events
    assert "accept" in set(bodies.decisions["decision"])
    for one, other in zip(judge(bodies), judge(points), strict=True):
        assert (one.status, one.margin) == (other.status, other.margin)
        assert one.status in ("holds", "refuted" if one.claim.id == "LIVE-GOAL" else "holds")


@pytest.mark.parametrize(("kind", "name"), [("ugvs", "ugv1"), ("obstacles", "rock")])
def test_larger_bodies_were_too_near(bodies: Trace, kind: str, name: str) -> None:
    meta = deepcopy(bodies.meta)
    meta["scenario"][kind][name]["radius_m"] += 0.01
    larger = replace(bodies, meta=meta)
    found = statuses(larger)
    assert (found["SAFE-TRACE"], found["SAFE-HYP"]) == ("refuted", "refuted")
    assert {"commands", "predictions"} <= faults_of(larger).keys()


@pytest.mark.parametrize(
    ("ends_at", "gap_m", "told"), [(5.0, -ROCK - OWN, "-0.750 m (overlap)"), (4.0, 0.225, "0.225 m")]
)
def test_a_pair_has_one_distance_wherever_users_see_it(ends_at: float, gap_m: float, told: str, tmp_path: Path) -> None:
    """A wrong intervention leads into the rock, or near it; the gap at its end follows from the radii."""
    given, pair = scenario(), {"first": "ugv1", "second": "rock"}
    given.runs = {"b": Run("b")}
    given.intervention.policies = [Policy("towards", {"x_m": ends_at, "y_m": 0.0, "speed_m_s": 1.0})]
    given = validated(given)
    trace, required_m = simulate(given, "b"), given.safe_distance.obstacle_m
    traces, found = {"b": trace}, judge(trace)
    report = built(given, traces, found)
    evidence = {verdict.claim.id: asdict(verdict)["evidence"] for verdict in found}
    places = [pd.DataFrame(trace.position(name), columns=["x_m", "y_m", "z_m"]) for name in trace.robots]
    table = pd.concat([each.assign(t_s=trace.t, body=name) for each, name in zip(places, trace.robots, strict=True)])
    judged = next(
        one for one in logs.judged(table, asdict(given), tmp_path).pairs if (one.first, one.second) == ("ugv1", "rock")
    )
    listed = next(each for each in evidence["SAFE-TRACE"]["pairs"] if pair.items() <= each.items())
    metric = report["runs"]["b"]["metrics"]["min_distance_m"]["ugv1"]["rock"]
    exported = (
        pd.read_csv([*recording.write(trace, tmp_path)][-1]).query("first == 'ugv1' and second == 'rock'").iloc[0]
    )
    (exact,) = (one for one in too_near(recorded(trace)) if one.demand.second == "rock" and one.demand.first == "ugv1")
    for distance, required in (
        (listed["min_distance_m"], listed["safe_distance_m"]),
        (metric["value"], metric["safe_distance_m"]),
        (judged.least_m, judged.safe_m),
        (exported["min_distance_m"], exported["safe_distance_m"]),
        (exact.least_m, float(exact.demand.required_m)),
    ):
        assert (distance, required) == (pytest.approx(gap_m, abs=1e-6), required_m)
    promised = next(each for each in evidence["SAFE-HYP"]["pairs"] if pair.items() <= each.items())
    assert (promised["safe_distance_m"], promised["guarantee_m"] <= gap_m + 1e-6) == (required_m, True)
    words = [item.words for item in attention.items(of(report)) if item.claim == "SAFE-TRACE"]
    assert words[0].startswith(f"ugv1 and rock at {told}, 1.25 m required")
    first = first_screen(of(report)).rows[0].safe.lines[1]
    assert first.startswith("ugv1\N{EN DASH}rock at" if gap_m < 0.0 else f"ugv1\N{EN DASH}rock {gap_m:.3f} < 1.25 m")
    drawn = page(of(report), draw(given, traces), None)
    assert f"{told.removesuffix(' (overlap)')}, not 1.25 m, from rock at" in drawn
    cells = (f'<td class="n">{gap_m:.4f}</td>', '<td class="n">1.25</td>')
    rows = [row for row in drawn.split("<tr") if "<td>ugv1</td><td>rock</td>" in row]
    assert rows
    assert all(cell in rows[0] for cell in cells)
    assert "2.00 m needed" not in drawn


def points_in_mind(self: OutcomeGatekeepers, *args: Any) -> tuple[View, Basis]:
    seen, basis = VIEW(self, *args)
    return replace(seen, distances=np.append(seen.still[:, GAP], seen.distances[len(seen.still) :])), basis


VIEW = OutcomeGatekeepers._view_of

FORGETFUL: dict[str, tuple[Callable[[pytest.MonkeyPatch], None], set[str]]] = {
    "an obstacle's radius": (
        neighbours(lambda near: near._replace(distance=near.distance - ROCK * (near.share == 1.0))),
        {"SAFE-TRACE", "SAFE-HYP", "commands"},
    ),
    "the other robot's radius": (
        neighbours(lambda near: near._replace(distance=near.distance - FLIER * (near.share == 0.5))),
        {"SAFE-TRACE", "SAFE-HYP", "commands"},
    ),
    "radii in the gatekeeper only": (
        lambda patch: patch.setattr(OutcomeGatekeepers, "_view_of", points_in_mind),
        {"predictions"},
    ),
}


@pytest.mark.parametrize("name", FORGETFUL)
def test_running_code_that_forgets_radii_is_refuted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    edit, refuting = FORGETFUL[name]
    given = scenario()
    if name == "the other robot's radius":
        given.uav.start_m, given.uav.altitude_m, given.duration_s = [1.3, 0.0, 0.1], 1.3, 2.0  # the UGV is in its way
    if name == "radii in the gatekeeper only":  # a gap that is wide enough for points
        given.obstacles = {
            f"rock_{k}": replace(given.obstacles["rock"], position_m=[5.0, k - 1.5, 0.0]) for k in (0, 3)
        }
    edit(monkeypatch)
    trace = simulate(given, "d")
    found = {claim for claim, status in statuses(trace).items() if status == "refuted"} | faults_of(trace).keys()
    assert refuting <= found
    if name == "radii in the gatekeeper only":
        assert not found & {"SAFE-TRACE", "SAFE-HYP", "commands"}


def sudden(appears_s: float, *more: str) -> Scenario:
    """The minimal scenario, in which the rock appears under way; ugv1 tracks its preset, to 5 m at 5 s, until then."""
    return load("minimal", [f"obstacles.rock.appears_s={appears_s}", "duration_s=11", *more])


def test_an_obstacle_is_there_from_the_control_sample_at_which_it_appears() -> None:
    """Until then the motion is that without it, nobody knows of it, and no claim is about it."""
    late, never = simulate(sudden(2.01), "d"), simulate(sudden(99.0), "d")
    row = late.there_from("rock")
    assert late.t[row] == pytest.approx(2.025)
    assert never.there_from("rock") == len(never.t)
    np.testing.assert_array_equal(late.position("ugv1")[: row + 1], never.position("ugv1")[: row + 1])
    assert statuses(late) | {"LIVE-GOAL": ""} == {**dict.fromkeys(statuses(late), "holds"), "LIVE-GOAL": ""}
    assert closest_obstacle(never, "ugv1") is None
    assert {**statuses(never)}["SAFE-HYP"] == "holds"
    there = simulate(sudden(0.0), "d")
    assert late.position("ugv1")[-1] == pytest.approx(there.position("ugv1")[-1], abs=0.1)


def test_where_it_appears_too_near_is_nobodys_doing() -> None:
    """It appears 0.8 m ahead, where 2 m are required: refuted with this reason, and the robot makes way at its gain."""
    trace = simulate(sudden(4.2), "d")
    found = {verdict.claim.id: verdict for verdict in judge(trace, ("SAFE-TRACE", "SAFE-HYP"))}
    seen = found["SAFE-TRACE"].counterexample or {}
    assert (seen["t_s"], seen["min_distance_m"]) == pytest.approx((4.2, 0.8))
    assert seen["why"] == "rock appeared at 4.2 s too near to ugv1: not caused by motion"
    broken = found["SAFE-HYP"].counterexample or {}
    assert (broken["hypothesis"], broken["t_s"]) == ("safe start", pytest.approx(4.2))
    assert not faults_of(trace)


def test_what_errors_of_positions_take_beyond_the_distance_is_not_the_robots_doing() -> None:
    errors = "sensing={position_error_m: 0.05, errors: adversarial, correlation_s: 0.2}"
    trace = simulate(sudden(3.02, errors, "control.avoidance_gain_1_s=9", "duration_s=6"), "a")
    assert [encounter.doing for encounter in encounters(trace)] == ["nobody"]


def test_it_collides_with_nobody_before_it_appears() -> None:
    passed, hit = (simulate(sudden(t, "runs={d: {method: d}}"), "d") for t in (8.0, 5.0))
    assert [event["kind"] for event in passed.events if event["kind"] == "collision"] == []
    assert [event["t_s"] for event in hit.events if event["kind"] == "collision"] == pytest.approx([5.0])


def test_the_uav_knows_it_from_then_on() -> None:
    for appears_s, known in ((2.0, 1), (8.0, 0)):
        changes = (
            "obstacles.wall={position_m: [2.5, 0.5, 0.0]}", "obstacles.gate={position_m: [2.5, -0.5, 0.0]}",
            "ugvs.ugv1.preset.speed_m_s=1.5",
        )  # fmt: skip
        sent = simulate(sudden(appears_s, *changes), "d").proposals
        assert len(sent)
        assert len(unpacked(sent.iloc[0]["mapped"])) == 2 + known


def test_a_controller_that_knows_of_it_too_early_or_late_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    ahead = "obstacles.rock.position_m=[3.0, 0.0, 0.0]"
    for shift, noticed in ((-1.0, "commands"), (0.5, "SAFE-HYP")):
        with monkeypatch.context() as patched:
            at = World.at
            patched.setattr(World, "at", lambda self, near, t, at=at, shift=shift: at(self, near, t - shift))
            trace = simulate(sudden(1.0 if shift > 0.0 else 2.0, ahead), "a")
        assert noticed in faults_of(trace) or statuses(trace)[noticed] == "refuted"
