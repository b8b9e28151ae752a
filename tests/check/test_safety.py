"""SAFE-TRACE and SAFE-HYP of the checker refute what is broken by more than rounding, whatever a report says of it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from airground_drake.check import safety
from airground_drake.check.rules import Disagreement
from airground_drake.check.run import Run

RUN = cast(
    "Run",
    SimpleNamespace(
        pairs=[SimpleNamespace(robot="ugv1", other="rock", safe_m=2.0, closing_m_s=1.0)],
        scenario={"control": {"period_s": 0.05}},
    ),
)


@pytest.mark.parametrize(
    ("short_m", "status"), [(0.0, "holds"), (5e-10, "holds"), (2e-9, "refuted"), (0.01, "refuted")]
)
def test_a_distance_that_is_short_refutes(monkeypatch: pytest.MonkeyPatch, short_m: float, status: str) -> None:
    monkeypatch.setattr(safety, "least_distance_m", lambda run, pair: pair.safe_m - short_m)
    monkeypatch.setattr(safety, "_evidence_on_a_pair", lambda *_: None)
    noted = {"first": "ugv1", "second": "rock", "exercised": True, "margin_m": -short_m}
    claim = {"evidence": {"pairs": [noted], "pairs_in_all": 1}, "where": noted}
    assert safety.safe_trace(RUN, claim).status == status


@pytest.mark.parametrize(("margin", "broken"), [(0.0, False), (-5e-10, False), (-2e-9, True), (-0.5, True)])
def test_a_broken_inequality_refutes(monkeypatch: pytest.MonkeyPatch, margin: float, broken: bool) -> None:
    pair = {"first": "ugv1", "second": "rock"}
    found = safety.Hypothesis("avoidance", "m", np.array([1.0]), np.array([margin]), pair)
    for name in ("_constants", "_velocities", "_inequalities"):
        monkeypatch.setattr(safety, name, lambda run: iter(()))
    monkeypatch.setattr(safety, "_lost", lambda run: iter([found]))
    evidence = {"inequalities_that_bind": dict.fromkeys(safety.KINDS, 0), "different_parameters": [], "pairs": []}
    claim: dict[str, Any] = {"evidence": evidence, "where": {"hypothesis": "avoidance", **pair}}
    refuted = safety.safe_hyp(RUN, claim | {"status": "refuted"})
    assert refuted.status == ("refuted" if broken else "holds")
    if broken:
        with pytest.raises(Disagreement, match="the hypotheses held"):
            safety.safe_hyp(RUN, claim | {"status": "holds"})
