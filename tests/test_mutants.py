"""The list of mutants fits the code: every edit applies, once. `benchmarks/mutants.py` says what catches each."""

from __future__ import annotations

import sys
from collections import Counter
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from airground_drake.registry import MODEL_CLAIMS

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def listed() -> Any:
    """The modules `mutants` and `mutation.probe` of the benchmarks."""
    sys.path.insert(0, str(ROOT / "benchmarks"))
    yield import_module("mutants"), import_module("mutation.probe")
    sys.path.remove(str(ROOT / "benchmarks"))


def test_every_edit_applies_once(listed: Any) -> None:
    mutants, _ = listed
    texts = {m.path: (ROOT / "airground_drake" / m.path).read_text(encoding="utf-8") for m in mutants.MUTANTS}
    assert [m.name for m in mutants.MUTANTS if texts[m.path].count(m.old) != 1] == []
    assert [m.name for m in mutants.MUTANTS if m.old == m.new] == []
    for path in texts:
        edited = [texts[path].replace(m.old, m.new) for m in mutants.MUTANTS if m.path == path]
        for text in edited:
            compile(text, path, "exec")


def test_names_are_unique_and_what_is_run_exists(listed: Any) -> None:
    mutants, probe = listed
    assert [name for name, count in Counter(m.name for m in mutants.MUTANTS).items() if count > 1] == []
    assert len(mutants.MUTANTS) >= 100
    for mutant in mutants.MUTANTS:
        assert set(mutant.runs) <= set(probe.PROBES)
        assert set(mutant.proofs) <= set(MODEL_CLAIMS)
        assert [test for test in mutant.tests if not (ROOT / test).exists()] == []


@pytest.mark.slow
def test_drawn_mutants_apply_once_and_are_the_same_for_a_seed(listed: Any) -> None:
    drawn = import_module("mutation.drawn")
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


def test_what_is_edited_at_random_is_code_and_nothing_else(listed: Any) -> None:
    drawn = import_module("mutation.drawn")
    text = 'def f(x: float = 1.0) -> "int":\n    """1 + 1."""\n    if x < 2:\n        raise ValueError("2 + 2")\n'
    found = {text[: e.start] + e.new + text[e.end :] for e in drawn.Source(text).edits()}
    assert found == {
        text.replace("= 1.0", "= 1.1"), text.replace("= 1.0", "= 0.0"), text.replace("x < 2", "x <= 2"),
        text.replace("x < 2", "x > 2"), text.replace("x < 2", "x < 3"), text.replace("x < 2", "x < 1"),
        text.replace("x < 2", "not (x < 2)"),
    }  # fmt: skip
