"""Scenarios as resolved: nested dicts, as a trace carries them."""

import copy
from dataclasses import asdict
from typing import Any

from airground_drake.scenario.schema import Decision, Obstacle, Preset, Run, Scenario, Uav, Ugv

AWAY = Uav(start_m=[50.0, 50.0, 2.0], target_m=[50.0, 50.0, 2.0])
"""Far from everything else."""

STILL = Preset([[0.0, 0.0, 0.0]] * 2, 1.0)


def case_a(changes: dict[str, Any] | None = None) -> dict[str, Any]:
    """Geometry of case A with the printed reference speed, resolved; `changes` maps dotted keys to values."""
    scenario = Scenario(
        name="synthetic",
        duration_s=18.0,
        ugvs={
            "ugv1": Ugv([1.0, 0.5, 0.0], [3.3, 13.0, 0.0], Preset([[3.3, 0.0, 0.0], [3.3, 13.0, 0.0]], 1.0)),
            "ugv2": Ugv([-1.0, 0.5, 0.0], [-1.3, 13.0, 0.0], Preset([[-1.3, 0.0, 0.0], [-1.3, 13.0, 0.0]], 1.0)),
        },
        uav=Uav(start_m=[0.2, 1.0, 2.0], target_m=[1.0, 13.0, 2.0]),
        obstacles={
            "obstacle_1": Obstacle([1.7, 4.0, 0.0]),
            "obstacle_2": Obstacle([4.0, 7.0, 0.0]),
            "obstacle_3": Obstacle([-0.5, 5.0, 0.0]),
        },
        decision=Decision(noise_m_sqrt_s=0.004),
        runs={m: Run(method=m) for m in "bcd"} | {"a": Run(method="a", stalls_m={"ugv1": [3.37, 5.10, 0.0]})},
    )
    return changed(asdict(scenario), changes or {})


def lone(start: list[float], target: list[float], preset: Preset, duration_s: float, **more: Any) -> dict[str, Any]:
    scenario = Scenario(
        name="lone", duration_s=duration_s, ugvs={"ugv1": Ugv(start, target, preset)}, uav=AWAY, runs={"d": Run("d")},
        **more,
    )  # fmt: skip
    return asdict(scenario)


def changed(tree: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    tree = copy.deepcopy(tree)
    for key, value in changes.items():
        *path, last = key.split(".")
        node = tree
        for part in path:
            node = node[part]
        assert last in node, key
        node[last] = value
    return tree
