"""The paper's audit: every item is demonstrated by what it computes, and not if the evidence is not there."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from airground_drake.model.trigger import bayes
from airground_drake.report.audit import companions, formulas, literal, thresholds
from airground_drake.report.audit.item import CONVERSION
from airground_drake.scenario.load import load
from airground_drake.ugv.solution import ConstantPlans
from airground_drake.verify import Finding, cache_folder, judge_model

pytestmark = pytest.mark.slow  # it looks at many runs

DOCS = Path(__file__).parents[3] / "docs"
FINDINGS = 25
FORMULAS = (2, 3, 4, 5, 8, 9, *range(12, 23))
COMPANIONS = (7, 10, 11, 23, 24, 25)


def from_formulas(proofs: dict[str, Finding]) -> list[dict[str, Any]]:
    scenario = load("case_a")
    return [*thresholds.threshold_findings(scenario, proofs), *formulas.formula_findings(scenario)]


@pytest.fixture(scope="module")
def proofs(report: Callable[[str], Path]) -> dict[str, Finding]:
    report("case_a")  # whose proofs these are
    return {verdict.claim.id: verdict for verdict in judge_model(load("case_a"), kept=cache_folder())}


@pytest.fixture(scope="module")
def items(proofs: dict[str, Finding]) -> dict[int, dict[str, Any]]:
    return {item["id"]: item for item in from_formulas(proofs)}


@pytest.fixture(scope="module")
def companion_items() -> dict[int, dict[str, Any]]:
    return {item["id"]: item for item in companions.companion_findings()}


def test_every_finding_is_demonstrated(items: dict[int, Any], companion_items: dict[int, Any]) -> None:
    """Besides these there are 1 and 6, of the report's own runs."""
    assert (set(items), set(companion_items)) == (set(FORMULAS), set(COMPANIONS))
    assert sorted([1, 6, *items, *companion_items]) == [*range(1, FINDINGS + 1)]
    assert not [number for number, item in (items | companion_items).items() if item["demonstrated"] is not True]


def test_what_the_paper_leaves_open_changes_the_literal_answers(companion_items: dict[int, dict[str, Any]]) -> None:
    """Against an independent program for (27), which gave these first shares and costs."""
    assert companion_items[25]["evidence"]["taken_back"]["case_a"]["accept_throughout"] == pytest.approx(
        10.56, abs=5e-3
    )
    assert companion_items[25]["evidence"]["taken_back"]["case_a"]["refuse_throughout"] == pytest.approx(
        16.08, abs=5e-3
    )
    table = companion_items[25]["evidence"]["answers_by_open_choice"]
    as_run, other, moved = (
        table[f"case_a, 14.55 s, {name}"] for name in (literal.AS_RUN, literal.OTHER_START, literal.AT_THE_PLAN)
    )
    assert [each["answer"] for each in (as_run, other, moved)] == ["accept", "refuse", "refuse"]
    assert [each["cost"] for each in (as_run, other)] == pytest.approx([22.55, 46.49], abs=0.01)
    assert moved["first_share"] == pytest.approx(0.14, abs=0.01)


def test_constant_plans_lead_where_the_closed_loop_does_wherever_the_velocities_are_from() -> None:
    """Between them, a plan mixes the velocities of the place that it has reached."""
    scenario = load("case_a", {"duration_s": 14.6, "reproduction": [], "choices": []})
    problem, loop = literal.simulate(scenario, "c_literal")[1][0][1:]
    plans = ConstantPlans.of(problem)
    for plan in plans.both:
        assert literal.cost_at_the_plan(problem, loop, plan.omega) == pytest.approx(plan.objective)
    half = np.full(problem.stages, 0.5)
    assert np.abs(literal.positions_at_the_plan(loop, half) - problem.positions(half)).max() > 0.1


def test_with_the_printed_equation_in_the_code_item_2_would_not_pass(
    proofs: dict[str, Finding], monkeypatch: pytest.MonkeyPatch
) -> None:
    def printed(drift: float, noise: float, c1: float, c2: float) -> float:
        return bayes.optimal_threshold(drift, noise, c2, c1)

    monkeypatch.setattr(thresholds, "optimal_threshold", printed)
    (item,) = [each for each in from_formulas(proofs) if each["id"] == 2]
    assert item["demonstrated"] is False


def test_without_proofs_the_items_that_rest_on_them_are_not_demonstrated(proofs: dict[str, Finding]) -> None:
    open_ones = {**proofs, "THR-OPT": replace(proofs["THR-OPT"], status="inconclusive")}
    found = {item["id"]: item["demonstrated"] for item in from_formulas(open_ones)}
    assert found == {number: number != 2 for number in FORMULAS}
    found = {item["id"]: item["demonstrated"] for item in from_formulas({})}
    assert found == {number: number not in (2, 9) for number in FORMULAS}


def test_page_and_article_mark_the_same_findings_as_possible_faults_of_the_conversion() -> None:
    article = (DOCS / "paper.md").read_text(encoding="utf-8")
    sections = re.split(r"^### (\d+)\. ", article, flags=re.MULTILINE)
    marked = [number for number in range(1, FINDINGS + 1) if "*(conversion?)*" in sections[2 * number]]
    assert [*CONVERSION] == marked
    assert f"could explain findings {', '.join(map(str, marked[:-1]))} and {marked[-1]}" in article


def test_the_article_has_the_numbers_of_the_audit(items: dict[int, Any], companion_items: dict[int, Any]) -> None:
    """Every decimal in a section of docs/paper.md is one of the item's, rounded."""
    sections = re.split(r"^### (\d+)\. ", (DOCS / "paper.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert sections[1::2] == [str(k + 1) for k in range(FINDINGS)]
    for number, item in (items | companion_items).items():
        found = [float(text) for text in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", json.dumps(item))]
        for text in re.findall(r"-?\d+\.\d+", re.sub(r"section [\d.]+", "", sections[2 * number])):
            places = len(text.partition(".")[2])
            assert any(round(value, places) == float(text) for value in found), (number, text)
