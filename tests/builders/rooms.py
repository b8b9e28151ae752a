"""Shapes of obstacles, and a scenario with all of them."""

from airground_drake.scenario.schema import Obstacle, Policy, Preset, Run, SafeDistance, Scenario, Uav, Ugv
from airground_drake.scenario.validate import check

SQUARE = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
NOTCHED = [[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [0.5, 3.0], [0.5, -1.0], [-0.5, -1.0], [-0.5, 3.0], [-3.0, 3.0]]
"""A square with a notch 1 m wide from above, down to y = -1."""


def room(duration_s: float = 12.0) -> Scenario:
    """A UGV on its way into a U of walls, past other shapes; one is hidden from the UAV, one appears behind it.

    The policy of the UAV leads it into the middle wall.
    """
    way = [[-4.0, 0.2, 0.0], [5.0, 0.0, 0.0]]
    given = Scenario(
        name="room",
        duration_s=duration_s,
        ugvs={"ugv1": Ugv(way[0], way[1], Preset(way, 0.8), 1.5, radius_m=0.2)},
        uav=Uav(start_m=[-2.0, 0.0, 2.0], target_m=[5.0, 0.0, 2.0], altitude_m=2.0, radius_m=0.1),
        obstacles={
            "u": Obstacle(segment_m=[[0.0, 2.0], [3.0, 2.0], [3.0, -2.0], [0.0, -2.0]], radius_m=0.05),
            "notched": Obstacle(polygon_m=NOTCHED, position_m=[-3.0, 6.0, 0.0], heading_rad=0.3, height_m=5.0),
            "hidden": Obstacle(size_m=[0.4, 0.4], position_m=[1.0, -1.0, 0.0], distance_m=0.2, known_to_uav=False),
            "late": Obstacle(segment_m=[[-2.0, -1.0], [-2.0, 1.0]], appears_s=5.0),
            "rock": Obstacle([1.0, 1.2, 0.0], radius_m=0.1),
        },
        arena_m=[[-9.0, -9.0], [9.0, 12.0]],
        safe_distance=SafeDistance(0.3, ugv_m=0.3, air_ground_m=0.5),
        runs={method: Run(method) for method in "abcd"},
    )
    given.control.sensing_range_m = 3.0
    given.decision.threshold.zeta_m, given.decision.release_m = 1.0, 0.6
    given.intervention.policies = [Policy("towards", {"x_m": 6.0, "y_m": -0.5, "speed_m_s": 1.5})]
    check(given, "room")
    return given
