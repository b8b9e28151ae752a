"""The chosen mutants fit the code: every edit applies, once. `benchmarks/mutants.py` says what catches each."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from mutation import drawn
from mutation.chosen import CHOSEN
from mutation.mutant import DoesNotApplyError, Mutant
from mutation.probe import PROBES

ROOT = Path(__file__).resolve().parents[1]
CORE = {
    "world", "nsbc", "systems", "decision", "intervention", "gatekeeper", "geometry", "run", "scenarios", "verify",
    "check", "logs",
}  # fmt: skip


@pytest.mark.parametrize("mutant", CHOSEN, ids=lambda mutant: mutant.name)
def test_every_edit_applies_once(mutant: Mutant) -> None:
    text = (ROOT / "airground_drake" / mutant.path).read_text(encoding="utf-8")
    edited = mutant.edited(text)
    assert edited != text
    compile(edited, mutant.path, "exec")
    assert set(mutant.runs) <= set(PROBES)
    assert [test for test in mutant.tests if not (ROOT / test.partition("::")[0]).exists()] == []


def test_each_room_of_the_core_has_some_and_no_name_is_there_twice() -> None:
    assert {mutant.path.partition("/")[0] for mutant in CHOSEN} == CORE
    assert [name for name, count in Counter(m.name for m in CHOSEN).items() if count > 1] == []


def test_an_edit_is_made_in_its_function_only() -> None:
    text = "class A:\n    def f(self):\n        return 1\n\n    def g(self):\n        return 1\n"
    assert Mutant("x", "", "A.g", "return 1", "return 2").edited(text) == text[:-2] + "2\n"
    for function in ("", "A", "A.h"):
        with pytest.raises(DoesNotApplyError):
            Mutant("x", "", function, "return 1", "return 2").edited(text)


@pytest.mark.slow
def test_drawn_mutants_apply_once_and_are_the_same_for_a_seed() -> None:
    found = drawn.draw(ROOT, 200, seed=0)
    assert found == drawn.draw(ROOT, 200, seed=0)
    assert len({m.name for m in found}) == 200
    assert {m.path for m in drawn.draw(ROOT, 20, seed=0, only=["nsbc/law"])} == {"nsbc/law.py"}
    for mutant in found:
        text = (ROOT / "airground_drake" / mutant.path).read_text(encoding="utf-8")
        assert text.count(mutant.old) == 1
        assert mutant.old != mutant.new
        compile(text.replace(mutant.old, mutant.new), mutant.path, "exec")
        assert [test for test in mutant.tests if not (ROOT / test).exists()] == []


def test_what_is_edited_at_random_is_code_and_nothing_else() -> None:
    text = 'def f(x: float = 1.0) -> "int":\n    """1 + 1."""\n    if x < 2:\n        raise ValueError("2 + 2")\n'
    found = {text[: e.start] + e.new + text[e.end :] for e in drawn.Source(text).edits()}
    assert found == {
        text.replace("= 1.0", "= 1.1"), text.replace("= 1.0", "= 0.0"), text.replace("x < 2", "x <= 2"),
        text.replace("x < 2", "x > 2"), text.replace("x < 2", "x < 3"), text.replace("x < 2", "x < 1"),
        text.replace("x < 2", "not (x < 2)"),
    }  # fmt: skip
