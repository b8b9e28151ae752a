"""Rules refuse what they are for, and say where."""

import math
from typing import Any

import numpy as np
import pytest

from airground_drake.check.rules import Disagreement, close, holds, same


def test_the_first_part_that_differs_is_named() -> None:
    with pytest.raises(Disagreement) as found:
        same("rule", {"a": [1, {"b": 2}], "c": 3}, {"a": [1, {"b": 5}], "c": 4}, about="it", t_s=2.0)
    assert (found.value.about, found.value.recorded, found.value.recomputed) == ("it.a.1.b", 2, 5)
    assert (found.value.rule, found.value.t_s) == ("rule", 2.0)


def test_the_first_row_that_differs_is_named_with_its_time() -> None:
    recorded, t = np.array([[1.0, 2.0], [1.0, 2.5], [9.0, 9.0]]), np.array([0.0, 0.1, 0.2])
    with pytest.raises(Disagreement) as found:
        close("rule", recorded, np.array([[1.0, 2.0]] * 3), within=1e-9, t_s=t)
    assert (found.value.recorded, found.value.recomputed, found.value.t_s) == ([1.0, 2.5], [1.0, 2.0], 0.1)


@pytest.mark.parametrize(
    ("recorded", "recomputed"),
    [(1, True), (True, 1), ("1", 1), (None, 0), ([1], [1, 2]), ({"a": 1}, {}), ({}, {"a": 1}), (1.0, math.nan)],
)
def test_different_values_are_refused(recorded: Any, recomputed: Any) -> None:
    with pytest.raises(Disagreement):
        same("rule", recorded, recomputed)


@pytest.mark.parametrize(("recorded", "recomputed"), [([math.nan], [math.nan]), ([1.0, 2.0], [1.0])])
def test_a_nan_is_close_to_nothing_and_shapes_must_agree(recorded: Any, recomputed: Any) -> None:
    with pytest.raises(Disagreement):
        close("rule", recorded, recomputed, within=9.0)


def test_nothing_breaks_no_rule() -> None:
    close("rule", [], [], within=0.0)
    holds("rule", np.array([], dtype=bool), [], "nothing")
