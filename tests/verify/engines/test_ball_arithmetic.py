"""Signs by ball arithmetic."""

from __future__ import annotations

from fractions import Fraction

import pytest

from airground_drake.verify.engines.ball_arithmetic import Sign, conclude, enclose, evaluate


def test_an_open_sign_is_inconclusive() -> None:
    finding = conclude([Sign("zero", "u - u is positive", "u-u", {"u": Fraction(1)}, ">")], {}, {}, ())
    assert finding.status == "inconclusive"
    with pytest.raises(ArithmeticError, match="open"):
        enclose("u-u", {}, Fraction(0))
    with pytest.raises(ArithmeticError, match="no sign"):
        enclose("0-u-1", {}, Fraction(0))


@pytest.mark.parametrize("expression", ["sin(u)", "v", "u**u", "1.5", "u if u else u", "__import__('os')"])
def test_expressions_are_limited(expression: str) -> None:
    with pytest.raises(ValueError, match="not allowed"):
        evaluate(expression, {"u": Fraction(1)})
