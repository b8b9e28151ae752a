"""The UAV's controller and the task below its avoidance."""

from __future__ import annotations

import numpy as np
import pytest

from airground_drake.arrays import Array
from airground_drake.components import make_avoidance, make_team
from airground_drake.nsbc.tasks import FormationTask
from airground_drake.scenarios.load import load
from airground_drake.systems.controllers import UavController


def test_a_task_cannot_change_where_the_controller_thinks_that_ugvs_are() -> None:
    """Positions and velocities are given to read: the avoidance above the task looks at them, too."""

    class Moves(FormationTask):
        def __init__(self, positions: Array, velocities: Array, altitude: float, gain: float) -> None:
            for given in (positions, velocities):
                with pytest.raises(ValueError, match="read-only"):
                    given += 1e6
            super().__init__(positions, velocities, altitude, gain)

    case_a = load("case_a")[0]
    team, avoidance = make_team(case_a), make_avoidance(case_a)
    controllers = (UavController(team, avoidance, gain=1.0, altitude=2.0, task=each) for each in (Moves, FormationTask))
    positions = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [1.0, 0.0, 1.1]])
    own, plain = (controller.velocity(positions, np.zeros((2, 3))) for controller in controllers)
    assert own.tolist() == plain.tolist()
    assert positions[0].tolist() == [0.0, 0.0, 0.0]
