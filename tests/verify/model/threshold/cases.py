"""Constants of threshold rules."""

from typing import Any

from airground_drake.model.trigger.bayes import optimal_threshold
from airground_drake.scenario.load import load
from airground_drake.verify.claims.thr_root import ThrRoot
from airground_drake.verify.model.levels import NUMBERS

TABLE_1: dict[str, Any] = ThrRoot().inputs(load("case_a"))


def rule(name: str, zeta: float, *numbers: float) -> dict[str, Any]:
    return {"rule": name, **dict(zip(NUMBERS, numbers, strict=True)), "zeta_m": zeta}


INPUTS = {
    "table 1": TABLE_1,
    "audit": rule("bayes", optimal_threshold(1.0, 1.0, 0.5, 1.0), 1.0, 1.0, 0.5, 1.0),
    "slow and noisy": rule("fixed", 2.0, 0.2, 5.0, 0.7, 0.3),
    "fast and quiet": rule("fixed", 0.3, 5.0, 0.2, 0.5, 9.0),
    "equal costs": rule("fixed", 1.0, 1.5, 0.7, 2.0, 2.0),
}
