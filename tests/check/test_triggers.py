"""The checker's own decision variable against closed forms."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.check.rules import Disagreement
from airground_drake.check.run import Run
from airground_drake.check.scenario import Levels
from airground_drake.check.triggers import Variable, decision_variable, refuted_zeno_proof

SPEED_M_S = 2.0


def passing(aside_m: float, slope_m_s: float) -> Variable:
    """X of a preset that passes a standing UGV at so many metres, in one segment of 10 s; the noise is linear in time.

    With v = 2 m/s: x = sqrt(c^2 + v^2 (t - 5)^2) + m t.
    """

    def position_m(t_s: np.ndarray) -> np.ndarray:
        return np.column_stack([SPEED_M_S * (t_s - 5.0), np.zeros_like(t_s), np.zeros_like(t_s)])

    t = np.array([0.0, 10.0])
    preset = SimpleNamespace(corner_s=t, position_m=position_m)
    run = SimpleNamespace(
        t_s=t, presets={"ugv1": preset}, position_m={"ugv1": np.tile([0.0, aside_m, 0.0], (2, 1))},
        column={"ugv1.noise_m": slope_m_s * t}.__getitem__,
    )  # fmt: skip
    return decision_variable(cast("Run", cast("Any", run)), "ugv1")


@pytest.mark.parametrize("aside_m", [0.0, 0.3, 1.0])
def test_a_dip_within_one_segment_is_found(aside_m: float) -> None:
    x, level = passing(aside_m, 0.0), aside_m + 0.01
    before = np.sqrt(level**2 - aside_m**2) / SPEED_M_S
    assert x.reaches(level, 0.0, above=False) == pytest.approx(5.0 - before, abs=1e-9)
    assert x.reaches(level, 5.0, above=True) == pytest.approx(5.0 + before, abs=1e-9)
    assert x.reaches(aside_m - 1e-9, 0.0, above=False) is None


@given(aside_m=st.floats(1e-3, 5.0), slope_m_s=st.floats(-1.9, 1.9))
def test_the_least_value_of_a_segment_is_a_knot(aside_m: float, slope_m_s: float) -> None:
    x = passing(aside_m, slope_m_s)
    t = np.linspace(0.0, 10.0, 2001)
    sampled = np.hypot(aside_m, SPEED_M_S * (t - 5.0)) + slope_m_s * t
    assert x.x_m.min() <= sampled.min() + 1e-9
    assert x.x_m.min() >= sampled.min() - 0.01 * (SPEED_M_S + abs(slope_m_s))


REST = {"t_s": 0.1, "x_m": 0.0, "mode": "SUPERVISING", "trigger": False}


def refutation(first_s: float, rest_s: float, last_s: float, mode: str = "SUPERVISING") -> dict[str, Any]:
    """ZENO-PROOF, refuted by two triggers of an automaton."""
    risen = {"x_m": 3.0, "mode": "INTERVENING", "trigger": True}
    run = [{"t_s": first_s, **risen}, {**REST, "t_s": rest_s, "mode": mode}, {"t_s": last_s, **risen}]
    return {"counterexample": {"run": run, "gap_s": last_s - first_s, "bound_s": 0.5}}


@pytest.mark.parametrize(
    ("claim", "dwell_s", "rule"),
    [
        (refutation(0.0, 0.25, 0.5, "REFRACTORY"), 0.5, "two triggers are closer than the bound"),
        (refutation(0.0, 0.1, 0.2), 0.5, "mode of the automaton"),
        (refutation(10.0, 20.0, 9.9), 0.0, "time goes on in a run"),
        (refutation(-2.0, -1.0, -1.9), 0.0, "a run begins at 0 or later"),
    ],
)
def test_a_refutation_of_zeno_proof_is_a_run_of_the_automaton(claim: Any, dwell_s: float, rule: str) -> None:
    with pytest.raises(Disagreement) as caught:
        refuted_zeno_proof(claim, Levels(3.0, 1.5, dwell_s), 0.5, -0.5)
    assert caught.value.rule == rule


def test_a_refutation_by_a_bare_trigger_agrees() -> None:
    assert refuted_zeno_proof(refutation(0.0, 0.1, 0.2), Levels(3.0, 3.0, 0.0), 0.5, -0.5).status == "refuted"
