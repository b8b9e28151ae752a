"""Constants of threshold rules."""

from __future__ import annotations

from typing import Any

from airground_drake.decision.bayes import optimal_threshold
from airground_drake.scenarios.load import load
from airground_drake.verify.model.thr_root import ThrRoot

TABLE_1: dict[str, Any] = ThrRoot().inputs(load("case_a")[0])

_KEYS = ("rule", "drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2", "zeta_m")

OTHERS: dict[str, dict[str, Any]] = {
    "audit": dict(zip(_KEYS, ("bayes", 1.0, 1.0, 0.5, 1.0, optimal_threshold(1.0, 1.0, 0.5, 1.0)), strict=True)),
    "slow and noisy": dict(zip(_KEYS, ("fixed", 0.2, 5.0, 0.7, 0.3, 2.0), strict=True)),
    "fast and quiet": dict(zip(_KEYS, ("fixed", 5.0, 0.2, 0.5, 9.0, 0.3), strict=True)),
    "equal costs": dict(zip(_KEYS, ("fixed", 1.5, 0.7, 2.0, 2.0, 1.0), strict=True)),
}

INPUTS = {"table 1": TABLE_1, **OTHERS}
