"""Draws: functions of their number, within what is stated, independent of other keys."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from scipy.stats import kstest, norm, qmc

from airground_drake.campaign.distributions import KINDS, Key, combinations, dimensions, made, values_at, values_of

SPECIMENS: dict[str, Any] = {
    "uniform": [[0.0, -1.0], [2.0, 1.0]],
    "log_uniform": [0.01, 10.0],
    "normal": [2.0, 0.5, 1.0, 4.0],
    "integer": [-2, 2],
    "choice": ["a", {"b": 1}, [3]],
    "grid": [1, 2, 3],
    "halton": [0.0, 5.0],
}


def specimens() -> dict[str, Key]:
    return {kind: made(kind, given) for kind, given in SPECIMENS.items()}


def test_there_is_a_specimen_of_each_kind() -> None:
    assert SPECIMENS.keys() == KINDS.keys()


@examples(50, fuzz=2000)
@given(st.integers(0, 10**6), st.integers(0, 10**6))
def test_a_draw_is_a_function_of_seed_and_index_and_within_its_bounds(seed: int, index: int) -> None:
    drawn = specimens()
    values = values_of(drawn, seed, index)
    assert values == values_of(drawn, seed, index)
    assert all(low <= v <= high for low, v, high in zip(*([0.0, -1.0], values["uniform"], [2.0, 1.0]), strict=True))
    assert 0.01 <= values["log_uniform"] <= 10.0
    assert 1.0 <= values["normal"] <= 4.0
    assert values["integer"] in range(-2, 3)
    assert values["choice"] in SPECIMENS["choice"]
    assert values["grid"] == SPECIMENS["grid"][index % 3]
    assert 0.0 <= values["halton"] < 5.0


def test_another_key_changes_no_value_that_is_random() -> None:
    drawn = specimens()
    alone = {"normal": drawn["normal"]}
    assert [values_of(drawn, 1, i)["normal"] for i in range(9)] == [values_of(alone, 1, i)["normal"] for i in range(9)]


def test_draws_have_the_distribution_that_is_asked_for() -> None:
    drawn = {"u": made("uniform", [2.0, 3.0]), "n": made("normal", [5.0, 2.0]), "l": made("log_uniform", [1.0, np.e])}
    values = [values_of(drawn, 3, i) for i in range(600)]
    assert kstest([v["u"] - 2.0 for v in values], "uniform").pvalue > 1e-3
    assert kstest([v["n"] for v in values], norm(5.0, 2.0).cdf).pvalue > 1e-3
    assert kstest(np.log([v["l"] for v in values]), "uniform").pvalue > 1e-3
    assert abs(np.corrcoef([v["u"] for v in values], [v["n"] for v in values])[0, 1]) < 0.15


@examples(50, fuzz=2000)
@given(st.integers(0, 10**6))
def test_every_point_of_the_unit_cube_is_a_draw(seed: int) -> None:
    drawn = specimens()
    size = dimensions(drawn)
    for shares in (np.zeros(size), np.nextafter(np.ones(size), 0.0), np.random.default_rng(seed).random(size)):
        values = values_at(drawn, shares)
        assert values.keys() == drawn.keys()
        assert 1.0 <= values["normal"] <= 4.0
        assert values["integer"] in range(-2, 3)
        assert values["choice"] in SPECIMENS["choice"]


def test_grids_are_gone_through_in_all_combinations() -> None:
    drawn = {"a": made("grid", [1, 2]), "b": made("grid", ["x", "y", "z"])}
    assert combinations(drawn) == 6
    assert len({tuple(values_of(drawn, 0, i).values()) for i in range(6)}) == 6


def test_halton_points_fill_a_box_more_evenly_than_random_ones() -> None:
    drawn = {"x": made("halton", [0.0, 1.0]), "y": made("halton", [[0.0, 0.0], [1.0, 2.0]])}
    points = [values_of(drawn, 0, i) for i in range(64)]
    for values in ([p["x"] for p in points], [p["y"][1] / 2.0 for p in points]):
        assert max(np.histogram(values, 8, (0.0, 1.0))[0]) <= 12
    assert len({p["x"] for p in points}) == 64


def test_a_late_halton_point_is_found_without_those_before() -> None:
    drawn = {"x": made("halton", [0.0, 1.0]), "y": made("halton", [0.0, 1.0])}
    points = qmc.Halton(2, rng=np.random.default_rng(3)).fast_forward(1000)
    assert list(values_of(drawn, 3, 1000).values()) == points.random(1)[0].tolist()
    assert 0.0 <= values_of(drawn, 3, 10**12)["x"] < 1.0


@pytest.mark.parametrize(
    ("kind", "given"),
    [
        ("log_uniform", [1e-300, 1e300]),
        ("uniform", [1.0]), ("uniform", [2.0, 1.0]), ("uniform", [[1.0], [2.0, 3.0]]), ("uniform", ["a", "b"]),
        ("uniform", 3), ("log_uniform", [0.0, 1.0]), ("normal", [0.0, 0.0]), ("normal", [1.0]), ("integer", [0.5, 2]),
        ("integer", [3, 2]), ("choice", []), ("choice", "abc"), ("grid", {}), ("halton", [0.0, float("nan")]),
    ],
)  # fmt: skip
def test_what_makes_no_distribution_is_refused_with_what_is_wanted(kind: str, given: Any) -> None:
    with pytest.raises(ValueError, match="wanted: "):
        made(kind, given)
