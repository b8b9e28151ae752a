"""Several UAVs in a scenario: who is in charge of whom, what is filled in, and what is refused."""

from typing import Any

import numpy as np
import pytest
import yaml
from scenario.cases import DELETE, SMALL_DATA, Write, edit, message

from airground_drake.base.errors import ScenarioError
from airground_drake.scenario.load import from_data, load, resolved, validated
from airground_drake.scenario.schema import Uav
from airground_drake.verify.claims.live_goal import Way, conditions

NORTH: dict[str, Any] = {"start_m": [0, 4, 2], "ugvs": ["two"]}
SOUTH: dict[str, Any] = {"start_m": [0, 1, 2]}
BOTH = {"north": NORTH, "south": SOUTH}


def of(uavs: object, **more: object) -> dict[str, Any]:
    data = edit(edit(edit(SMALL_DATA, "uav", DELETE), "uavs", uavs), "safe_distance.uav_m", 1.0)
    for key, value in more.items():
        data = edit(data, key.replace("__", "."), value)
    return data


def test_what_is_left_out_is_filled_in(write: Write) -> None:
    scenario = load(write(yaml.safe_dump(of(BOTH))))
    assert scenario.uav is None
    assert {name: (uav.name, uav.ugvs, uav.target_m) for name, uav in scenario.uavs.items()} == {
        "north": ("north", ["two"], [9.0, 5.0, 2.0]),
        "south": ("south", ["one"], [9.0, 0.0, 2.0]),
    }
    assert [*scenario.robots] == ["one", "two", "north", "south"]
    assert scenario.in_charge("south") == ("one",)
    assert (scenario.key_of("south"), scenario.pair_of("north", "south")) == ("uavs.south", "uav")
    assert "2 UAVs" in repr(scenario)
    assert from_data(resolved(scenario), "again") == validated(scenario) == scenario


def test_one_uav_is_written_as_before() -> None:
    data = from_data(SMALL_DATA, "test").data()
    assert not {"uavs", "uav_m", "lost_at_s"} & {*data, *data["uav"], *data["safe_distance"]}
    assert "ugvs" not in data["uav"]
    assert from_data(SMALL_DATA | {"uavs": {}}, "test").data() == data
    assert from_data(edit(SMALL_DATA, "uav.lost_at_s", 2.0), "test").data()["uav"]["lost_at_s"] == 2.0


def test_a_ugv_that_is_added_later_needs_a_uav() -> None:
    scenario = from_data(of(BOTH), "test")
    assert scenario.uavs["south"].ugvs == ["one"]
    scenario.uavs["west"] = Uav("west", start_m=[0.0, -3.0, 2.0])
    with pytest.raises(
        ScenarioError, match=r"uavs\.west\.ugvs: missing; wanted: the list of its UGVs.* lists contain all"
    ):
        validated(scenario)


MISTAKES = [
    (of(BOTH, uav={"start_m": [0, 2, 2]}), "uavs: uav is given, too; one of both"),
    (of({}), "uav: missing; wanted: a mapping with start_m, or several by name in uavs"),
    (of(BOTH, safe_distance__uav_m=DELETE), "safe_distance.uav_m: missing; wanted: the distance between two UAVs"),
    (of(BOTH, uavs__south__name="kite"), "uavs.south.name: 'kite' is not allowed; south, its key, or no name"),
    (of(BOTH, uavs__south__ugvs=["two"]), "uavs.south.ugvs.0: 'two' is not allowed; a UGV of no other UAV"),
    (of(BOTH, uavs__south__ugvs=["one", "one"]), "uavs.south.ugvs.1: 'one' is not allowed; a UGV of no other UAV"),
    (of(BOTH, uavs__south__ugvs=["three"]), "uavs.south.ugvs.0: 'three' is not allowed; one of the UGVs one, two"),
    (of(BOTH, uavs__north__ugvs=["one", "two"]), "uavs.south.ugvs: missing; wanted: the list of its UGVs"),
    (of(BOTH, uavs__north__ugvs=[]), "uavs.north.ugvs: missing; wanted: the list of its UGVs"),
    (of({"north": NORTH}), "ugvs.one: assigned to no UAV; wanted: in uavs.north.ugvs, or one UAV without a list"),
    (edit(SMALL_DATA, "uav.ugvs", ["one"]), "ugvs.two: assigned to no UAV; wanted: in uav.ugvs"),
    (of(BOTH, uavs__south__start_m=[0, 3.5, 2]), "uavs.south.start_m: [0.0, 3.5, 2.0] is not allowed; south starts"),
    (of(BOTH, uavs__south__altitude_m=0.5), "uavs.south.altitude_m: 0.5 is not allowed; more than safe_distance"),
    (of({"one": NORTH, "south": SOUTH}), "ugvs.one: 'one' is not allowed; a name that no other UGV"),
    (of(BOTH, safe_distance__collision_m=1.0), "safe_distance.collision_m: 1.0 is not allowed; less than"),
    (of(BOTH, uavs__south__lost_at_s=-1), "uavs.south.lost_at_s: -1.0 is not allowed; wanted: a number in s from 0"),
    (of(BOTH, uavs__south__lost_s=1), "uavs.south.lost_s: unknown key; did you mean lost_at_s"),
    (of(BOTH, safe_distance__uav_m=3, control__sensing_range_m=3.1), "3.1 is not allowed; at least 3.5 m for south"),
]  # fmt: skip


@pytest.mark.parametrize(("data", "says"), MISTAKES)
def test_mistakes_are_refused_with_what_would_do(data: dict[str, Any], says: str, write: Write) -> None:
    assert says in message(write(yaml.safe_dump(data)))


def test_where_a_stall_is_expected_each_uav_ends_over_its_own_ugvs() -> None:
    scenario = load("two_uavs")
    last = np.arange(3.0 * len(scenario.ugvs)).reshape(-1, 3) ** 2
    ways = {robot: Way(np.array([0.0, 2.0]), np.zeros((2, 3))) for robot in scenario.robots}
    found = [*conditions(scenario, {next(iter(scenario.ugvs)): [0.0] * 3}, ways, last)]
    for name, uav in scenario.aerial.items():
        own = [k for k, ugv in enumerate(scenario.ugvs) if ugv in scenario.in_charge(name)]
        (over,) = (each.entry["point_m"] for each in found if each.entry["robot"] == name)
        assert over == (last[own].mean(axis=0) + np.array([0.0, 0.0, uav.altitude_m])).tolist()
