"""Linear forms that pass for floats."""

from __future__ import annotations

import pytest

from airground_drake.verify.engines.symbolic_execution import Branch, branches


def test_symbols_refuse_what_they_cannot_decide() -> None:
    symbol = Branch().symbol("a")
    for question in (lambda: bool(symbol), lambda: symbol == 1.0):
        with pytest.raises(TypeError):
            question()


def test_every_way_through_a_function_is_found() -> None:
    def sign(branch: Branch) -> str:
        x = branch.symbol("x")
        return "positive" if x > 0.0 else "zero" if x >= 0.0 else "negative"

    found = {result: [(str(form), strict) for form, strict in branch.guards] for branch, result in branches(sign)}
    assert found == {
        "negative": [("-x", False), ("-x", True)],
        "zero": [("-x", False), ("x", False)],
        "positive": [("x", True)],
    }


def test_forms_are_printed_in_the_order_of_their_symbols() -> None:
    branch = Branch(order=("b", "a"), counts=("n",))
    form = branch.symbol("a") - branch.symbol("b") - branch.symbol("c") + 0.5
    assert str(form) == "-b + a - c + 1/2"
    assert bool(branch.symbol("n")) in (True, False)  # a count has a truth value
