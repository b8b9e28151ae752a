"""The table of deviations names code that exists, code that names the equation, and findings that are there."""

from __future__ import annotations

import inspect
import re
from functools import reduce
from importlib import import_module
from typing import Any

import pytest

from airground_drake.audit.equations import DEVIATIONS, Deviation
from airground_drake.check.verdicts import FINDINGS

EQUATIONS = [row for row in DEVIATIONS if row.place.startswith("(")]


def found(place: str) -> tuple[list[Any], Any]:
    """What `module:Class.method` names: module, class and method; the last one is returned besides."""
    module, _, name = place.partition(":")
    way = [import_module(f"airground_drake.{module}")]
    for part in name.split("."):
        way.append(getattr(way[-1], part))
    return way, way[-1]


def numbers(text: str) -> set[int]:
    """Equation numbers in a text, ranges expanded."""
    pairs = re.findall(r"\((\d{1,2})[a-e]?\)(?:-\((\d{1,2})[a-e]?\))?", text)
    return {k for first, last in pairs for k in range(int(first), int(last or first) + 1)}


def test_every_equation_is_there_once_and_in_order() -> None:
    assert [row.place for row in EQUATIONS] == [f"({number})" for number in range(1, 30)]
    assert len({row.place for row in DEVIATIONS}) == len(DEVIATIONS)


@pytest.mark.parametrize("row", DEVIATIONS, ids=lambda row: row.place)
def test_what_is_declared_exists(row: Deviation) -> None:
    for place in row.realised_in:
        found(place)
    assert bool(row.realised_in) == (row.kind != "not realised")
    assert set(row.findings) <= set(range(1, FINDINGS + 1))


@pytest.mark.parametrize("row", DEVIATIONS, ids=lambda row: row.place)
def test_what_is_changed_has_a_reason(row: Deviation) -> None:
    assert bool(row.here and row.why) == (row.kind == "changed")


@pytest.mark.parametrize("row", EQUATIONS, ids=lambda row: row.place)
def test_the_code_names_the_equation(row: Deviation) -> None:
    """In its own documentation, or in that of the class or module around it."""
    for place in row.realised_in:
        texts = [inspect.getdoc(each) or "" for each in found(place)[0]]
        assert int(row.place[1:-1]) in reduce(set.union, map(numbers, texts), set()), place
