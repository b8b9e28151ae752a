"""Draws: functions of their number, within their bounds, independent of other keys."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from scipy.stats import kstest, norm, qmc

from airground_drake.study.campaign.distributions import KINDS, combinations, dimensions, made, values_at, values_of

SPECIMENS: dict[str, Any] = {
    "uniform": [[0.0, -1.0], [2.0, 1.0]],
    "log_uniform": [0.01, 10.0],
    "normal": [2.0, 0.5, 1.0, 4.0],
    "integer": [-2, 2],
    "choice": ["a", {"b": 1}, [3]],
    "grid": [1, 2, 3],
    "halton": [0.0, 5.0],
}
DRAWN = {kind: made(kind, parameters) for kind, parameters in SPECIMENS.items()}


@examples(50, fuzz=2000)
@given(st.integers(0, 10**6), st.integers(0, 10**6))
def test_a_draw_is_a_function_of_seed_and_index_and_within_its_bounds(seed: int, index: int) -> None:
    assert SPECIMENS.keys() == KINDS.keys()
    drawn = values_of(DRAWN, seed, index)
    assert drawn == values_of(DRAWN, seed, index)
    assert drawn["grid"] == SPECIMENS["grid"][index % 3]
    assert values_of({"normal": DRAWN["normal"]}, seed, index)["normal"] == drawn["normal"]  # no other key matters
    size = dimensions(DRAWN)
    points = (np.zeros(size), np.nextafter(np.ones(size), 0.0), np.random.default_rng(seed).random(size))
    for values in (drawn, *(values_at(DRAWN, shares) for shares in points)):
        assert values.keys() == DRAWN.keys()
        assert 0.0 <= values["uniform"][0] <= 2.0
        assert -1.0 <= values["uniform"][1] <= 1.0
        assert 0.01 * (1.0 - 1e-15) <= values["log_uniform"] <= 10.0
        assert 1.0 <= values["normal"] <= 4.0
        assert values["integer"] in range(-2, 3)
        assert values["choice"] in SPECIMENS["choice"]
        assert 0.0 <= values["halton"] < 5.0


def test_draws_have_the_distribution_that_is_asked_for() -> None:
    drawn = {"u": made("uniform", [2.0, 3.0]), "n": made("normal", [5.0, 2.0]), "l": made("log_uniform", [1.0, np.e])}
    drawn |= {"i": made("integer", [-2, 2]), "c": made("choice", [0, 1, 2, 3, 4])}
    u, n, log, whole, choice = np.array([list(values_of(drawn, 3, i).values()) for i in range(600)]).T
    for values in (whole + 2.0, choice):
        assert (abs(np.bincount(values.astype(int), minlength=5) - 120) < 40).all()
    assert kstest(u - 2.0, "uniform").pvalue > 1e-3
    assert kstest(n, norm(5.0, 2.0).cdf).pvalue > 1e-3
    assert kstest(np.log(log), "uniform").pvalue > 1e-3
    assert abs(np.corrcoef(u, n)[0, 1]) < 0.15


def test_grids_are_gone_through_in_all_combinations() -> None:
    drawn = {"a": made("grid", [1, 2]), "b": made("grid", ["w", "x", "y", "z"])}
    assert combinations(drawn) == 8
    assert len({tuple(values_of(drawn, 0, i).values()) for i in range(8)}) == 8


def test_halton_keys_are_one_sequence_and_a_late_point_needs_none_before() -> None:
    drawn = {"x": made("halton", [0.0, 1.0]), "y": made("halton", [0.0, 1.0])}
    points = qmc.Halton(2, rng=np.random.default_rng(3)).random(1001)
    assert [[*values_of(drawn, 3, i).values()] for i in (0, 5, 1000)] == points[[0, 5, 1000]].tolist()
    assert 0.0 <= values_of(drawn, 3, 10**12)["x"] < 1.0


@pytest.mark.parametrize(
    ("kind", "given"),
    [
        ("log_uniform", [1e-300, 1e300]), ("log_uniform", [0.0, 1.0]), ("log_uniform", [1, 10**400]),
        ("uniform", [1.0]), ("uniform", [2.0, 1.0]), ("uniform", [[1.0], [2.0, 3.0]]), ("uniform", ["a", "b"]),
        ("uniform", 3), ("uniform", [1, 10**400]), ("halton", [0.0, float("nan")]), ("normal", [0.0, 0.0]),
        ("normal", [1.0]), ("normal", [1, 10**400]), ("normal", [0.0, 1.0, 2.0, 1.0]), ("integer", [0.5, 2]),
        ("normal", [1.0, "0.1"]), ("normal", [1.0, 0.1, "0", "2"]), ("normal", [0, 1e-300, 1, 2]),
        ("uniform", ["0", "1"]), ("uniform", [False, True]), ("uniform", [-1.7e308, 1.7e308]), ("uniform", [[], []]),
        ("integer", [3, 2]), ("integer", [0, 10**400]), ("choice", []), ("choice", "abc"), ("grid", {}),
    ],
)  # fmt: skip
def test_bad_parameters_are_refused_with_what_is_wanted(kind: str, given: Any) -> None:
    with pytest.raises(ValueError, match="wanted: "):
        made(kind, given)
