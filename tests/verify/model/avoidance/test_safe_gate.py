"""SAFE-GATE."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

from airground_drake.verify.finding import Finding
from airground_drake.verify.model.avoidance.safe_gate import SafeGate


def test_findings_depend_on_nothing_but_the_inputs(inputs: dict[str, Any], found: dict[str, Finding]) -> None:
    again = SafeGate().judge(json.loads(json.dumps(inputs)))
    assert again == replace(found["SAFE-GATE"], from_cache=False)


def test_what_is_not_finite_asks_for_nothing(found: dict[str, Finding]) -> None:
    answers = found["SAFE-GATE"].evidence["non_finite"]
    assert answers == dict.fromkeys(("nan", "infinity", "1e300"), "finite, inequality met")


def test_method_d_is_read_from_the_running_diagram(inputs: dict[str, Any]) -> None:
    assert inputs["method_d"] == {"intervention_on_top": False, "compositions": ["augmented"]}
