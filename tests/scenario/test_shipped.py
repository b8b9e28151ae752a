"""What the shipped scenarios put to the test, all of them together: every claim, and every kind of inequality."""

import json
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from airground_drake.base.registry import MODEL_CLAIMS, RUN_CLAIMS
from airground_drake.report.interventions import avoidance
from airground_drake.scenario.estimate import DEFAULT_LIMITS, within
from airground_drake.scenario.load import load
from airground_drake.scenario.shipped import shipped, shipped_files
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge, judge_model
from airground_drake.verify.claim import Verdict

SHORT = (("dwell", "a"), ("dwell", "d"), ("contact", "d"), ("forklift", "d"))
"""Runs that are there to put claims to the test."""


@pytest.fixture(scope="module")
def verdicts(run: Callable[[str, str], Trace]) -> dict[str, dict[str, Verdict]]:
    judged = {f"{scenario} {name}": judge(run(scenario, name)) for scenario, name in SHORT}
    return {of: {verdict.claim.id: verdict for verdict in found} for of, found in judged.items()}


def evidence(verdicts: dict[str, dict[str, Verdict]], of: str, claim: str) -> dict[str, Any]:
    return verdicts[of][claim].evidence


def test_every_claim_is_exercised_in_at_least_one_shipped_scenario(
    verdicts: dict[str, dict[str, Verdict]], report: Callable[[str], Path]
) -> None:
    assert {scenario for scenario, _ in SHORT} <= set(shipped())
    often: Counter[str] = Counter()
    for found in verdicts.values():
        often.update({name: verdict.exercised or 0 for name, verdict in found.items()})
    for claim in json.loads((report("case_b") / "report.json").read_text(encoding="utf-8"))["claims"]:
        often[claim["id"]] += claim["exercised"] or 0
    choice, _ = judge_model(load("bayes_threshold"), claims=["THR-CHOICE"])  # the others declare their threshold
    often["THR-CHOICE"] += choice.exercised or 0
    (budget,) = judge_model(load("lagging"), claims=["SAFE-BUDGET"])
    often["SAFE-BUDGET"] += budget.exercised or 0
    assert [name for name in (*RUN_CLAIMS.own, *MODEL_CLAIMS.own) if not often[name]] == []


def test_every_kind_of_pair_has_an_inequality_that_binds(verdicts: dict[str, dict[str, Verdict]]) -> None:
    binding = evidence(verdicts, "contact d", "SAFE-HYP")["inequalities_that_bind"]
    kinds = {"ugv beside obstacle", "uav beside obstacle", "ugv beside ugv", "ugv beside uav", "uav beside ugv"}
    assert set(binding) == kinds
    assert all(binding[kind] >= 5 for kind in kinds), binding


@pytest.mark.parametrize("of", ["dwell a", "dwell d"])
def test_every_transition_of_the_automaton_comes_up(of: str, verdicts: dict[str, dict[str, Verdict]]) -> None:
    due = evidence(verdicts, of, "THR-TRIG")["transitions_due"]
    assert due == {"trigger": 2, "release": 1, "refractory": 2, "resume": 1, "retrigger": 1}
    assert verdicts[of]["ZENO-TRACE"].margin == pytest.approx(0.0, abs=1e-9)  # as soon as it may be


def test_accepted_proposals_are_executed_where_inequalities_bind_and_where_none_does(
    run: Callable[[str, str], Trace],
) -> None:
    found = avoidance(run("contact", "d"))
    assert all(0 < found[ugv]["both"] < found[ugv]["executing"] for ugv in ("ugv1", "ugv2")), found


@pytest.mark.parametrize("name", shipped())
def test_every_shipped_scenario_is_small_and_says_what_it_is_meant_to_put_to_the_test(name: str) -> None:
    scenario = load(name)
    assert (scenario.name, scenario.digest) == (name, load(str(shipped_files()[name])).digest)
    assert any("exercised" in str(expected) for expected in scenario.runs["d"].expected.values())
    asked = within(scenario, DEFAULT_LIMITS)
    assert asked.work < DEFAULT_LIMITS.work / 10.0
    assert asked.memory < DEFAULT_LIMITS.memory / 2.0
