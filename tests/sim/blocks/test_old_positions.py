"""UGVs that act on positions of each other of any age: the asynchronous law, and what judges it."""

from dataclasses import replace
from functools import cache
from itertools import permutations
from typing import Any

import maps
import numpy as np
import pytest
from builders.edits import with_cells
from hypothesis import given
from hypothesis import strategies as st
from oracles import ORACLES, faults_of
from properties import examples
from sim.blocks.test_positions import ABOUT_D, APART_M, PERIOD_S, checked, found, least_m, team

from airground_drake.base.arrays import Array
from airground_drake.base.errors import PluginError, ScenarioError
from airground_drake.base.registry import METHODS
from airground_drake.check import safety
from airground_drake.model.geometry import outline
from airground_drake.model.law.kernels import STANDING, Layer, avoid_one, fill_half_spaces
from airground_drake.scenario.budget import budget
from airground_drake.scenario.load import from_data, load, resolved
from airground_drake.scenario.schema import Scenario
from airground_drake.scenario.world import make_world
from airground_drake.sim.blocks.positions import AsynchronousUgvController
from airground_drake.sim.components import make_planner
from airground_drake.sim.diagram import build_diagram, make_monitor
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge, judge_model
from airground_drake.verify.claims.safe_budget import SafeBudget

OLD = {"control.law": "asynchronous"}
HYPOTHESES = ("SAFE-TRACE", "SAFE-HYP")


def old_team(seed: int, delay_s: float, loss: float, changes: dict[str, Any] | None = None) -> Scenario:
    links = {"delay_s": delay_s, "loss": loss}
    return from_data(resolved(team(seed, None)) | {"channel": {"ugvs": links}}, "test", OLD | (changes or {}))


@cache
def run(seed: int, delay_s: float, loss: float, method: str = "a") -> Trace:
    return simulate(old_team(seed, delay_s, loss), method)


@pytest.mark.parametrize(
    ("method", "seed", "delay_s", "loss"),
    [("a", 0, 0.0, 0.0), ("a", 1, 0.1, 0.5), ("d", 0, 0.3, 0.1), ("d", 1, 0.5, 0.5)],
)
def test_the_distance_is_kept_whatever_the_age_of_positions(
    method: str, seed: int, delay_s: float, loss: float
) -> None:
    trace = run(seed, delay_s, loss, method)
    assert least_m(trace) >= APART_M - 1e-9
    assert set(found(trace, *(ABOUT_D if method == "d" else HYPOTHESES)).values()) == {"holds"}
    (verdict,) = judge(trace, ["SAFE-HYP"])
    assert verdict.exercised
    assert verdict.margin == pytest.approx(0.0, abs=1e-9)
    assert safety.safe_hyp(checked(trace)).status == "holds"
    assert not faults_of(trace)


@pytest.mark.slow
@examples(30, fuzz=500)
@given(
    seed=st.integers(0, 10**6), delay_s=st.floats(0.1, 0.5), loss=st.floats(0.0, 0.5),
    period_s=st.sampled_from([0.025, 0.05]),
)  # fmt: skip
def test_no_drawn_team_comes_nearer_than_promised(seed: int, delay_s: float, loss: float, period_s: float) -> None:
    trace = simulate(old_team(seed, delay_s, loss, {"control.period_s": period_s}), "a")
    assert least_m(trace) >= APART_M - 1e-9
    assert set(found(trace, *HYPOTHESES).values()) == {"holds"}
    assert safety.safe_hyp(checked(trace)).status == "holds"


class Forgetful(AsynchronousUgvController):
    """Takes every position for one of this sample."""

    def _commanded(self, context: Any, t: float, positions: Array, *about: Any) -> Array:
        class Now:
            def Eval(self, of: Any) -> Array:
                return np.full(len(about[0]) ** 2, t)

        honest, self._heard = self._heard, Now()
        velocity = super()._commanded(context, t, positions, *about)
        self._heard = honest
        return velocity


def test_who_ignores_the_age_breaks_distances_and_both_programs_say_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("airground_drake.sim.blocks.positions.AsynchronousUgvController", Forgetful)
    for seed in (0, 1):
        trace = simulate(old_team(seed, 0.3, 0.5), "a")
        assert least_m(trace) < APART_M - 1e-3
        assert found(trace, "SAFE-HYP") == {"SAFE-HYP": "refuted"}
        assert safety.safe_hyp(checked(trace)).status == "refuted"
        assert ORACLES["commands"](trace)


def test_a_position_that_is_older_than_it_was_is_found() -> None:
    trace = run(0, 0.1, 0.5)
    judged = 0
    for first, second in permutations(trace.ugvs, 2):
        heard = trace.sampled(f"{first}.heard_{second}_s")
        old = replace(
            trace, samples=trace.samples.assign(**{f"{first}.heard_{second}_s": np.maximum(heard - 1.0, 0.0)})
        )
        assert ORACLES["records"](old)
        ours, theirs = found(old, "SAFE-HYP")["SAFE-HYP"], safety.safe_hyp(checked(old)).status
        assert ours == theirs
        judged += ours == "refuted"
    assert judged >= 2


def test_a_position_of_no_sample_so_far_is_found() -> None:
    trace = run(0, 0.1, 0.5)
    for value in (1e9, 0.5 * PERIOD_S, -1.0):
        wrong = with_cells(trace, "samples", 20, "ugv1.heard_ugv2_s", value)
        assert found(wrong, "SAFE-HYP") == {"SAFE-HYP": "refuted"}
        ours = safety.safe_hyp(checked(wrong))
        assert ours.because is not None
        assert ours.because.rule == "position heard before"


def test_a_position_of_no_sample_is_found_of_far_ugvs_too() -> None:
    far = simulate(old_team(0, 0.1, 0.5, {"duration_s": 1.0}), "a")
    for first, second in permutations(far.ugvs, 2):
        wrong = with_cells(far, "samples", 10, f"{first}.heard_{second}_s", 1e9)
        assert found(wrong, "SAFE-HYP") == {"SAFE-HYP": "refuted"}


def test_inequalities_in_range_are_those_within_the_sensing_range() -> None:
    """As many as with the shared law, while UGVs are farther from each other."""
    counts = set()
    for changes in ({}, OLD):
        far = simulate(
            load("swap", {"duration_s": 0.5, "channel": {"ugvs": {}}, "runs": {"a": {"method": "a"}}} | changes), "a"
        )
        (verdict,) = judge(far, ["SAFE-HYP"])
        counts.add(verdict.evidence["inequalities_in_range"])
    assert len(counts) == 1


def towards(x: float, y: float, unsure: float, task: Array) -> Array:
    """The command of a UGV at (x, y) with a task, (3,), m/s, towards an old position at the origin; d = 0.6 m."""
    one = np.zeros(1, dtype=np.intp)
    normal, (bound, retreat) = np.empty((2, 3)), np.empty((2, 2))
    count = fill_half_spaces(
        np.array([x, y, 0.0]), np.array([1.0, 1.0, 0.0]), outline.stacked([]), outline.balls(np.zeros(3)), one, one,
        np.zeros((1, 3)), np.array([0.6]), np.array([-unsure]), Layer(8.0, PERIOD_S, 0.1, STANDING),
        np.empty(2, dtype=np.intp), normal, bound, retreat,
    )  # fmt: skip
    command: Array = avoid_one(task, normal[:count], bound[:count], STANDING, 2.0)
    return command


@examples(300)
@given(
    at=st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)), unsure=st.floats(0.01, 2.0),
    task=st.tuples(st.floats(-1.4, 1.4), st.floats(-1.4, 1.4)),
)  # fmt: skip
def test_commands_keep_off_all_places_where_the_other_one_can_be(
    at: tuple[float, float], unsure: float, task: tuple[float, float]
) -> None:
    """Beyond the sensing range, too. What is allowed is done; in the cone, beyond it and where no way leads off."""
    asked = np.array([*task, 0.0])
    command, place = towards(*at, unsure, asked), np.array([*at, 0.0])
    apart = float(np.linalg.norm(place))
    along, speed = float(place @ command) / max(apart, 1e-300), float(np.linalg.norm(command))
    if apart >= 0.6 + unsure:
        assert along >= -(apart - 0.6 - unsure) / PERIOD_S - 1e-9
    else:
        assert apart * along >= unsure * speed - 1e-9
        if apart <= unsure:
            assert speed == 0.0
    wished = float(place @ asked) / max(apart, 1e-300)
    free = wished >= -(apart - 0.6 - unsure) / PERIOD_S + 1e-9 if apart >= 0.6 + unsure else (
        apart > unsure + 1e-6 and apart * wished >= unsure * np.linalg.norm(asked) + 1e-6
    )  # fmt: skip
    if free:
        assert command == pytest.approx(asked, abs=1e-12)


def test_plans_keep_what_the_law_keeps_and_the_budget_tells_it() -> None:
    scenario = old_team(0, 0.12, 0.5)
    fastest = max(ugv.max_speed_m_s for ugv in scenario.ugvs.values())
    planner = make_planner(scenario, METHODS["d"], "uav")
    assert planner.robot_distance == pytest.approx(APART_M + 4 * PERIOD_S * fastest)
    kept = [pair.unsure_m for pair in budget(scenario) if pair.kind == "ugv"]
    assert max(kept) == pytest.approx(4 * PERIOD_S * fastest)
    assert SafeBudget().judge(SafeBudget().inputs(scenario)).status == "proved"


def test_a_method_that_is_not_among_the_runs_is_refused_too() -> None:
    with pytest.raises(ScenarioError, match="avoidance is not on top in this run"):
        build_diagram(old_team(0, 0.3, 0.1), "c")


@pytest.mark.parametrize(
    ("links", "law", "status"),
    [({}, "shared", []), ({"delay_s": 0.02}, "shared", []), ({"loss": 0.1}, "shared", ["proved"]),
     ({}, "asynchronous", ["proved"])],
)  # fmt: skip
def test_the_budget_is_about_positions_that_may_be_lacking(
    links: dict[str, float], law: str, status: list[str]
) -> None:
    data = resolved(team(0, None)) | {"channel": {"ugvs": links}}
    judged = judge_model(from_data(data, "test", {"control.law": law}), claims=["SAFE-BUDGET"])
    assert [verdict.status for verdict in judged] == status


def test_rounding_far_from_the_origin_adds_nothing_up() -> None:
    """Two that follow each other, 2 km away, each as near as it may be for most of the run."""
    data = resolved(old_team(0, 0.3, 0.0))
    for name, behind, speed in (("ugv1", 1.0, 0.5), ("ugv2", 3.0, 1.0)):
        ends = (2000.0 - behind, 2000.0), (2020.0 - behind, 2000.0)
        data["ugvs"][name] |= maps.straight(*ends, speed, max_speed_m_s=1.0, radius_m=0.0)
    data["ugvs"] = {name: data["ugvs"][name] for name in ("ugv1", "ugv2")}
    data |= {"obstacles": {}, "runs": {"a": {"method": "a"}}, "duration_s": 20.0}
    data["uav"] |= {"start_m": [2000.0, 2000.0, 3.0], "target_m": [2018.0, 2000.0, 3.0]}
    trace = simulate(from_data(data, "test", {}), "a")
    (verdict,) = judge(trace, ["SAFE-HYP"])
    assert (verdict.status, verdict.margin) == ("holds", 0.0)
    assert safety.safe_hyp(checked(trace)).status == "holds"


def test_the_shared_law_is_written_and_built_as_if_there_were_no_other() -> None:
    assert "law" not in resolved(load("case_a"))["control"]
    assert make_world(load("case_a")).unsure_s == 0.0
    assert simulate(old_team(0, 0.1, 0.5), "a", engine="batch").samples.equals(run(0, 0.1, 0.5).samples)
    with pytest.raises(PluginError, match="a monitor sees true positions"):
        make_monitor(old_team(0, 0.1, 0.5))
