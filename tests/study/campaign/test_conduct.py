"""Which draws of a folder count."""

import json
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from study.campaign.test_evidence import row

from airground_drake.base.errors import FolderError, LimitError
from airground_drake.base.registry import RUN_CLAIMS
from airground_drake.commands.campaign import _summary
from airground_drake.scenario.estimate import DEFAULT_LIMITS, MOST_ROWS
from airground_drake.study.campaign.conduct import EVIDENCE, PAGE, Stopping, conduct
from airground_drake.study.campaign.spec import Spec, load_spec
from airground_drake.study.campaign.statistics import confidence_sequence
from airground_drake.study.campaign.store import read


def spec(folder: Path, drawn: str = "seed: {integer: [0, 1000]}") -> Spec:
    path = folder / "x.yaml"
    path.write_text(f"scenario: minimal\ndraw: {{{drawn}}}\n", encoding="utf-8")
    return load_spec(path)


def draw_50_first(work: Callable[[int], Any], items: Iterable[int]) -> Iterator[tuple[int, Any]]:
    for index in sorted(items, key=lambda index: (index < 50, index)):
        yield index, [row(index, drawn={"duration_s": 1.0})]


def test_after_a_rule_has_stopped_a_campaign_only_draws_up_to_the_stop_count(tmp_path: Path) -> None:
    rule, out = Stopping.parse("SAFE-TRACE < 0.2"), tmp_path / "out"
    last = next(n for n in range(100) if confidence_sequence(0, n).high < 0.2) - 1
    assert last < 49
    for resume in (False, True):
        found = conduct(spec(tmp_path), out, draw_50_first, 100, resume=resume, stopping=rule)
        assert (found["draws"], found["claims"][0]["tested"], found["stopped"]) == (last + 1, last + 1, last)
        assert f"  stopped by its rule at draw {last}; later draws" in _summary(found, looked=True)
        assert json.loads((out / EVIDENCE).read_text()) == found
        assert len(read(out)[1]) == 50 + last + 1  # the others are kept
        rule = Stopping.parse("SAFE-TRACE < 0.2")


@pytest.mark.parametrize("drawn", ["duration_s: {halton: [1.0, 2.0]}", "duration_s: {grid: [1.0, 2.0]}"])
def test_a_rule_needs_independent_draws(drawn: str, tmp_path: Path) -> None:
    rule = Stopping.parse("SAFE-TRACE < 0.2")
    with pytest.raises(ValueError, match=r"--stop-when needs independent draws; not independent: duration_s$"):
        conduct(spec(tmp_path, drawn), tmp_path / "out", draw_50_first, 100, stopping=rule)
    found = conduct(spec(tmp_path, drawn), tmp_path / "out", draw_50_first, 100)
    assert (found["dependent"], found["claims"][0]["anytime"]) == (["duration_s"], None)


def test_a_scenario_s_claims_count_towards_the_limit_of_rows(tmp_path: Path) -> None:
    fits = MOST_ROWS // (2 * len(tuple(RUN_CLAIMS)))  # two runs
    own = spec(tmp_path, "seed: {integer: [0, 9]}}\nset: {claims: {OWN-CLAIM: 'mine.py:Mine'}")
    with pytest.raises(LimitError, match="allowed: 4e"):
        conduct(own, tmp_path / "out", draw_50_first, fits)


def test_a_campaign_goes_on_only_with_the_same_third_party_code(tmp_path: Path) -> None:
    drawn = "intervention.policies: {choice: [[], [{name: 'mine.py:Mine'}]]}"
    make = partial(
        conduct, spec(tmp_path, drawn), tmp_path / "out", draw_50_first, limits=DEFAULT_LIMITS._replace(plugins=True)
    )
    (tmp_path / "mine.py").write_text("class Mine: pass")
    make(3)
    make(4, resume=True)
    (tmp_path / "mine.py").write_text("class Mine: ...")
    with pytest.raises(FolderError, match=r"another campaign \(third_party\)"):
        make(5, resume=True)


def test_a_draw_whose_process_died_has_its_values_in_a_sweep(tmp_path: Path) -> None:
    def dying(work: Callable[[int], Any], items: Iterable[int]) -> Iterator[tuple[int, Any]]:
        yield from ((index, None) for index in items)

    result = conduct(spec(tmp_path, "duration_s: {grid: [1.0, 2.0]}"), tmp_path / "out", dying)
    entries = [(each["value"], each["run"], each["runs"], each["judged"]) for each in result["swept"][0]["entries"]]
    assert entries == [(1.0, "", 1, 0), (2.0, "", 1, 0)]
    assert "<td>none (0 of 1 judged)</td>" in (tmp_path / "out" / PAGE).read_text()
