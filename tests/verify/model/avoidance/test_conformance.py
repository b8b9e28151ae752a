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


STEEP = 20  # max(A, 1/h) of case A


@pytest.mark.parametrize(("units", "agrees"), [(4, True), (24, False), (-24, False), (800, False)])
def test_the_tolerance_of_the_bound_is_that_of_rounding(units: int, agrees: bool, inputs: dict[str, Any]) -> None:
    """8 units of what rounding may do are allowed: half of them beside its own 1 or 2 are, three times as many not."""
    u = Fraction(1, 2**53)
    off = conformance(inputs, lambda D, d, q, A, h: relation(D, d, q, A, h) + units * u * q * STEEP * max(D, d))
    assert off["agrees"] == agrees


@pytest.mark.parametrize(("units", "agrees"), [(1, True), (24, False), (5000, False)])
def test_the_tolerance_of_a_normal_is_that_of_rounding(
    units: int, agrees: bool, monkeypatch: pytest.MonkeyPatch, inputs: dict[str, Any]
) -> None:
    right = Avoidance.half_spaces

    def wrong(self: Avoidance, *args: Any) -> Any:
        spaces = right(self, *args)
        return replace(spaces, normal=spaces.normal * (1.0 + units * 2.0**-52))

    monkeypatch.setattr(Avoidance, "half_spaces", wrong)
    compared = conformance(inputs)
    assert compared["agrees"] == agrees
    assert SafeInv().judge(inputs).status == ("proved" if agrees else "refuted")
