"""The chosen mutants fit the code: every edit applies, once. `benchmarks/mutants.py` says what catches each."""

from collections import Counter
from pathlib import Path

import pytest
from mutation.chosen import CHOSEN
from mutation.mutant import DoesNotApplyError, Mutant

ROOT = Path(__file__).resolve().parents[2]
CORE = {"check", "model", "uav", "ugv", "scenario", "sim", "verify", "study"}


@pytest.mark.parametrize("mutant", CHOSEN, ids=lambda mutant: mutant.name)
def test_every_edit_applies_once(mutant: Mutant) -> None:
    text = (ROOT / "airground_drake" / mutant.path).read_text(encoding="utf-8")
    edited = mutant.edited(text)
    assert edited != text
    compile(edited, mutant.path, "exec")
    assert [test for test in mutant.tests if not (ROOT / test.partition("::")[0]).exists()] == []


def test_each_room_of_the_core_has_some_and_no_name_is_there_twice() -> None:
    assert {mutant.path.partition("/")[0] for mutant in CHOSEN} == CORE
    assert [name for name, count in Counter(m.name for m in CHOSEN).items() if count > 1] == []


def test_an_edit_is_made_in_its_function_only() -> None:
    text = "class A:\n    def f(self):\n        return 1\n\n    def g(self):\n        return 1\n"
    assert Mutant("x", "", "A.g", "return 1", "return 2", ()).edited(text) == text[:-2] + "2\n"
    for function in ("", "A", "A.h"):
        with pytest.raises(DoesNotApplyError):
            Mutant("x", "", function, "return 1", "return 2", ()).edited(text)
