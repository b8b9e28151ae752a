"""Samplers, objectives and shrinking, without simulations."""

import copy
from typing import Any

import numpy as np
import pytest

from airground_drake.base.errors import ScenarioError
from airground_drake.base.registry import SAMPLERS
from airground_drake.scenario.load import from_data, load, resolved
from airground_drake.study.campaign.falsification import LATEST_S, Margin, Most
from airground_drake.study.campaign.rows import JUDGED, Row, blank
from airground_drake.study.campaign.search import Sampler
from airground_drake.study.campaign.shrink import shrink


@pytest.mark.parametrize("name", SAMPLERS.own)
@pytest.mark.parametrize("dimensions", [1, 5])
def test_samplers_stay_in_the_cube_and_depend_on_nothing_but_the_seed(name: str, dimensions: int) -> None:
    found: list[list[np.ndarray]] = [[], []]
    for batches in found:
        sampler = SAMPLERS.make(name, of=Sampler, dimensions=dimensions, seed=7)
        for _ in range(4):
            batches.append(points := sampler.ask())
            assert points.shape[1] == dimensions
            assert ((points >= 0.0) & (points < 1.0)).all()
            sampler.tell(points, ((points - 0.3) ** 2).sum(axis=1))
    np.testing.assert_array_equal(*found)


def test_the_strategy_goes_where_it_is_least_and_the_baselines_do_not() -> None:
    least = {}
    for name in SAMPLERS.own:
        sampler, tried, best = SAMPLERS.make(name, of=Sampler, dimensions=4, seed=1), 0, np.inf
        while tried < 400:
            points = sampler.ask()
            values = ((points - np.array([0.9, 0.1, 0.5, 0.7])) ** 2).sum(axis=1)
            values[points[:, 0] < 0.2] = np.inf
            sampler.tell(points, values)
            tried, best = tried + len(points), min(best, values.min())
        least[name] = best
    assert least["cma"] < 1e-4 < min(least["random"], least["halton"])


def row(**more: Any) -> Row:
    judged = {"ended": JUDGED, "claim": "SAFE-TRACE", "status": "holds", "margin": 0.5, "intervened_s": 2.0}
    return blank() | judged | more


def test_objectives() -> None:
    margin = Margin("SAFE-TRACE")
    assert margin.value([row(), row(margin=0.2)]) == 0.2
    assert margin.value([row(margin=float("nan")), row(claim="SAFE-HYP", margin=-3.0)]) == np.inf
    assert margin.value([row(status="refuted", margin=float("nan"))]) < 0.0
    assert margin.value([blank()]) == np.inf
    assert (margin.found([row(margin=0.0)]), margin.found([row(status="refuted")])) == (False, True)
    most = Most("intervened_s", 3.0)
    assert most.value([row(), row(intervened_s=2.5), row(intervened_s=float("nan"))]) == -2.5
    assert (most.found([row()]), most.found([row(intervened_s=3.5)])) == (False, True)
    last = Most("arrival_s", 20.0)
    assert last.found([row(arrival_s=9.0, arrived=1, ugvs=2)]), "one that never arrives is later than any limit"
    assert last.value([row(arrival_s=9.0, arrived=2, ugvs=2)]) == -9.0
    assert not last.found([row(duration_s=19.0, arrived=1, ugvs=2)]), "a run that is shorter than the limit"
    assert (last.said(-9.0), last.said(-LATEST_S)) == ("largest arrival_s 9", "a UGV does not arrive")
    assert margin.said(margin.value([row(status="refuted", margin=float("nan"))])) == "SAFE-TRACE is refuted"


def test_what_does_not_matter_goes() -> None:
    data = resolved(load("warehouse"))
    data["runs"] = {"d": data["runs"]["d"]}
    matters = sorted(data["obstacles"])[2]
    data["obstacles"][matters]["position_m"][0] += 0.123456
    needed = data["obstacles"][matters]["position_m"][0]

    def fails(candidate: dict[str, Any]) -> bool:
        try:
            from_data(copy.deepcopy(candidate), "candidate")
        except ScenarioError:
            return False
        there = candidate["obstacles"].get(matters)
        return there is not None and abs(there["position_m"][0] - needed) < 0.05 and candidate["duration_s"] > 3.0

    small, used = shrink(data, fails, 300)
    assert fails(small)
    assert used <= 300
    assert list(small["obstacles"]) == [matters]
    assert len(small["ugvs"]) == 1
    assert small["intervention"]["policies"] == []
    assert 3.0 < small["duration_s"] < 12.0
    assert round(small["obstacles"][matters]["position_m"][0], 1) == small["obstacles"][matters]["position_m"][0]


def test_of_several_uavs_one_is_left_in_charge_of_whom_it_takes() -> None:
    data = resolved(load("two_uavs"))

    def fails(candidate: dict[str, Any]) -> bool:
        try:
            scenario = from_data(copy.deepcopy(candidate), "candidate")
        except ScenarioError:
            return False
        return {"ugv2", "ugv7"} <= scenario.ugvs.keys()

    small, _ = shrink(data, fails, 300)
    assert [*small["ugvs"]] == ["ugv2", "ugv7"]
    assert [uav["ugvs"] for uav in small["uavs"].values()] == [["ugv7", "ugv2"]]


def test_shapes_become_plain_and_the_arena_goes() -> None:
    data = resolved(load("minimal"))
    ell = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]]
    wall = {"polygon_m": ell, "position_m": [40.0, 0.0, 0.0], "heading_rad": 0.3, "height_m": 2.0, "radius_m": 0.2}
    bent = {"segment_m": [[50.0, 0.0], [52.0, 0.0], [52.0, 2.0]]}
    data |= {"obstacles": {"wall": wall, "bent": bent}, "arena_m": [[-90.0, -90.0], [90.0, 90.0]]}
    data = resolved(from_data(data, "given"))

    def fails(candidate: dict[str, Any]) -> bool:
        try:
            there = from_data(copy.deepcopy(candidate), "candidate").obstacles
        except ScenarioError:
            return False
        return {"wall", "bent"} <= there.keys() and there["wall"].height_m > 0.0

    small, _ = shrink(data, fails, 300)
    wall, bent = small["obstacles"]["wall"], small["obstacles"]["bent"]
    assert (len(wall["polygon_m"]), len(bent["segment_m"]), small["arena_m"]) == (3, 2, [])
    assert (wall["heading_rad"], wall["radius_m"], wall["height_m"]) == (0.0, 0.0, 2.0)
