"""Short runs beside a person who walks, or another obstacle that moves, by name."""

from functools import cache
from typing import Any

import maps

import airground_drake as ag
from airground_drake.scenario.load import from_data
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace

H, D, RADII = 0.05, 0.3, 0.45
"""Control period, s; gap to keep; radii of a robot and a person, m."""


def walking(*way: list[float], speed: float = 1.2, **more: Any) -> dict[str, Any]:
    return {"radius_m": 0.25, "moves": {"waypoints_m": [*way], "speed_m_s": speed}, **more}


def lone(
    name: str, start: float, target: float, *, speed: float = 0.6, duration: float = 12.0, **more: Any
) -> Scenario:
    data = {
        "name": name,
        "duration_s": duration,
        "uav": {"start_m": [start, 0.0, 4.0], "altitude_m": 4.0},
        "safe_distance": {"obstacle_m": D, "ugv_m": D, "air_ground_m": 1.0},
        "control": {"period_s": H, "sensing_range_m": 4.0},
        "intervention": {"policies": [{"name": "coordinate"}]},
        "ugvs": {"ugv1": maps.straight((start, 0.0), (target, 0.0), speed, max_speed_m_s=1.0, radius_m=0.2)},
        "runs": {"a": {"method": "a"}},
    }
    return from_data(data | more, name)


WALLS = {
    "back": {"segment_m": [[1.0, -3.0], [1.0, 3.0]]},
    "left": {"segment_m": [[-3.0, 0.6], [1.0, 0.6]]},
    "right": {"segment_m": [[-3.0, -0.6], [1.0, -0.6]]},
}
FORK = {
    "polygon_m": [[-0.5, -1.0], [0.5, -1.0], [0.5, 1.0], [-0.5, 1.0]],
    "moves": {"waypoints_m": [[1.5, -3.0], [1.5, 3.0]], "speed_m_s": 1.2, "at_end": "reverse"},
}


@cache
def scenario(name: str) -> Scenario:
    if name == "standing":
        return lone(name, -1.0, 0.0, obstacles={"person": walking([5.0, 0.0], [-5.0, 0.0])})
    if name == "squeezed":
        person = walking([-6.0, 0.0], [0.1, 0.0], speed=1.0)
        return lone(name, -1.0, 0.0, speed=1.0, obstacles={**WALLS, "person": person})
    if name == "on the goal":
        runs = {"a": {"method": "a"}, "d": {"method": "d"}}
        obstacles = {"person": walking([2.0, -3.0], [2.0, 0.0])}
        return lone("on_the_goal", -2.0, 2.0, obstacles=obstacles, runs=runs)
    if name == "too fast":
        person = walking([0.0, 8.0], [0.0, 6.0], [0.0, 8.0], max_speed_m_s=0.6)
        return lone("too_fast", -2.0, 2.0, obstacles={"person": person}, runs={"d": {"method": "d"}})
    if name == "leaving":
        person = walking([0.5, 3.0], [0.5, 0.0], disappears_s=6.0)
        return lone(name, -2.0, 2.0, obstacles={"person": person})
    if name == "fork":
        return lone(name, -2.0, 3.0, obstacles={"fork": FORK})
    if name.startswith("round a wall"):  # which does not stop a person, whose way is known or not
        person = walking([6.2, 0.0], [-3.0, 0.0], speed=0.8, max_speed_m_s=0.9, known_motion=name.endswith("known"))
        person["moves"]["at_end"] = "reverse"
        wall = {"segment_m": [[0, -1.0], [1, -1.0], [1, 1.0], [0, 1.0]]}
        threshold = {"threshold": {"rule": "fixed", "zeta_m": 0.5}, "release_m": 0.3}
        runs = {method: {"method": method} for method in "bcd"}
        obstacles = {"person": person, "u_wall": wall}
        return lone("round", -2.0, 3.0, duration=14.0, obstacles=obstacles, decision=threshold, runs=runs)
    assert name == "two kinds"
    obstacles = {"person": walking([2.0, -3.0], [2.0, 0.0]), "post": {"position_m": [0.0, 0.55, 0.0]}}
    return lone("two_kinds", -2.0, 2.0, obstacles=obstacles, runs={"d": {"method": "d"}})


@cache
def run(name: str, of: str = "a") -> Trace:
    return ag.simulate(scenario(name), of)
