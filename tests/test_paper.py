"""The table of deviations names code that exists, code that names the equation, and findings that are there."""

import inspect
import re
import runpy
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

DEVIATIONS = runpy.run_path(str(Path(__file__).parent.parent / "docs" / "equations.py"))["DEVIATIONS"]


def way_to(place: str) -> list[Any]:
    module, _, name = place.partition(":")
    way = [import_module(f"airground_drake.{module}")]
    for part in name.split("."):
        way.append(getattr(way[-1], part))
    return way


def numbers(text: str) -> set[int]:
    pairs = re.findall(r"\((\d{1,2})[a-e]?\)(?:-\((\d{1,2})[a-e]?\))?", text)
    return {k for first, last in pairs for k in range(int(first), int(last or first) + 1)}


def test_every_equation_is_there_once_and_in_order() -> None:
    equations = [row.place for row in DEVIATIONS if row.place.startswith("(")]
    assert equations == [f"({number})" for number in range(1, 30)]
    assert len({row.place for row in DEVIATIONS}) == len(DEVIATIONS)


@pytest.mark.parametrize("row", DEVIATIONS, ids=lambda row: row.place)
def test_the_code_exists_and_names_the_equation_and_a_change_has_a_reason(row: Any) -> None:
    """The equation is named in the documentation of the code, or of the class or module around it."""
    for place in row.realised_in:
        texts = [inspect.getdoc(each) or "" for each in way_to(place)]
        if row.place.startswith("("):
            assert int(row.place[1:-1]) in set[int]().union(*map(numbers, texts)), place
    assert bool(row.realised_in) == (row.kind != "not realised")
    assert set(row.findings) <= set(range(1, 26))
    assert bool(row.here and row.why) == (row.kind == "changed")
