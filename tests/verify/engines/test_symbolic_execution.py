"""Linear forms that pass for floats."""

from __future__ import annotations

import pytest

from airground_drake.verify.engines.symbolic_execution import Branch


def test_symbols_refuse_what_they_cannot_decide() -> None:
    symbol = Branch([]).symbol("a")
    for question in (lambda: bool(symbol), lambda: symbol == 1.0):
        with pytest.raises(TypeError):
            question()
