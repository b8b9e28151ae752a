"""The running kernels against the encoded relation."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.verify.model.avoidance.conformance import Relation, conformance, relation
from airground_drake.verify.model.avoidance.safe_inv import SafeInv


def test_conformance(inputs: dict[str, Any]) -> None:
    compared = conformance(inputs)
    assert compared["agrees"]
    assert 0 < compared["unseen"] < compared["points"] / 2
    assert 0.01 < compared["worst_ratio"]["bound"] <= 1.0  # the bound on rounding is not idle either


@pytest.mark.parametrize(
    "mutant",
    [
        lambda D, d, q, A, h: relation(D, d, q, A * (1 + Fraction(1, 10**9)), h),
        lambda D, d, q, A, h: -relation(D, d, q, A, h),
        lambda D, d, q, A, h: relation(D, d, Fraction(1), A, h),
        lambda D, d, q, A, h: relation(D, d, q, A, h * 2),
        lambda D, d, q, A, h: q * A * (d - D),
        lambda D, d, q, A, h: -q * (D - d) / h,
    ],
    ids=["gain", "sign", "share", "period", "always_inside", "always_outside"],
)
def test_conformance_refutes(mutant: Relation, inputs: dict[str, Any]) -> None:
    compared = conformance(inputs, mutant)
    assert not compared["agrees"]
    assert compared["first_difference"] is not None


def test_a_kernel_that_differs_refutes_safe_inv(monkeypatch: pytest.MonkeyPatch, inputs: dict[str, Any]) -> None:
    right = Avoidance.half_spaces

    def wrong(self: Avoidance, *args: Any) -> Any:
        return right(replace(self, gain=self.gain * 1.001), *args)

    monkeypatch.setattr(Avoidance, "half_spaces", wrong)
    finding = SafeInv().judge(inputs)
    assert finding.status == "refuted"
    assert finding.counterexample is not None
