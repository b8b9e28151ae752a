"""Hostile inputs to the running layer."""

from __future__ import annotations

from typing import Any

import numpy as np

from airground_drake.verify.model.avoidance.hostile_inputs import postcondition, safe_states


def test_sample_is_what_it_says(inputs: dict[str, Any]) -> None:
    states = safe_states(inputs, 2400)
    reach = np.linalg.norm(states.position[:, None] - states.around.centre, axis=-1)
    seen = reach <= inputs["sensing_range_m"]
    excess = (reach - states.around.distance)[seen]
    assert excess.min() >= 0.0
    assert (excess <= 1e-14).mean() > 0.2
    assert set(seen.sum(axis=1).tolist()) >= set(range(1, 13))
    speed = np.linalg.norm(states.lower, axis=1)
    assert speed.max() > 1e5
    assert speed.min() < 1e-2


def test_layer_meets_every_inequality_as_floats(inputs: dict[str, Any]) -> None:
    sampled = postcondition(inputs, 2400)
    assert sampled["met"]
    assert sampled["missed"] == 0
    assert sampled["worst_loss_over_rounding"] <= 1.0
    assert sampled["largest_gain_in_speed"] <= 1.0 + 1e-9
