"""One robot among bodies: which pieces of its preset another one leaves free."""

from __future__ import annotations

import numpy as np
import pytest

from airground_drake.intervention.coordination.roadmap import Space
from airground_drake.intervention.coordination.single import Body, _wished
from airground_drake.intervention.coordination.timed import free_pieces


@pytest.mark.parametrize(("radius", "beside", "free"), [(0.0, 0.5, True), (1.0, 0.5, False), (1.0, 1.1, True)])
def test_a_body_in_the_way_of_a_preset(radius: float, beside: float, free: bool) -> None:
    """It stands beside the middle piece, so much farther away than two points are to be."""
    room = Space(np.empty((0, 2)), np.empty(0), clearance=0.05, apart=2.0, spacing=0.1)
    preset = np.array([[0.0, -9.0, 0.0], [4.0, -5.0, 0.0], [14.0, 5.0, 0.0], [18.0, 9.0, 0.0]])
    other = Body(np.array([[0.0, 0.0, room.apart + room.spacing + beside]]), radius)
    assert free_pieces(preset, other.motion, _wished(room, other)).tolist() == [True, free, True]
