"""A run with values of its own, `set`: checked like `--set`, simulated, judged and reported with them."""

from __future__ import annotations

from typing import Any

import pytest
from scenarios.cases import SMALL, Write, message

from airground_drake.base.errors import ScenarioError
from airground_drake.report import document
from airground_drake.run.simulation import simulate
from airground_drake.scenarios import plugins
from airground_drake.scenarios.load import load, own
from airground_drake.verify import verify, verify_model

RUNS = "runs:\n"
"""Where SMALL has its runs."""


def with_run(settings: str, expected: str = "{}") -> str:
    """SMALL with one more run, on line 14."""
    return SMALL.replace(RUNS, f"{RUNS}  other: {{method: c, set: {{{settings}}}, expected: {expected}}}\n")


@pytest.mark.parametrize(
    ("settings", "fragments"),
    [
        ("gatekeeper.rul: first_stage", ["bad.yaml:13: gatekeeper.rul: unknown key", "did you mean rule?"]),
        ("gatekeeper.rule: last_stage", ["bad.yaml:13: gatekeeper.rule: 'last_stage'", "first_stage"]),
        ("gatekeeper.tries: 2.5", ["bad.yaml:13: gatekeeper.tries: 2.5", "a whole number", "as run other sets it"]),
        ("decision.release_m: 4.0", ["bad.yaml:13: decision.release_m: 4.0", "less than the fixed threshold, 3 m"]),
        ("decision.threshold: {zeta_m: 2}", ["bad.yaml:13: runs.other.set.decision.threshold: {'zeta_m'", "one value"]),
        ("duration_s: 7.0", ["runs.other.set.duration_s: 7.0", "decision, gatekeeper, intervention"]),
        ("control.period_s: 0.1", ["runs.other.set.control.period_s: 0.1", "decision, gatekeeper, intervention"]),
        ("gatekeeper: 3", ["runs.other.set.gatekeeper: 3", "such as gatekeeper.rule"]),
        ("intervention.policies.1.name: detour", ["bad.yaml:13: intervention.policies.1: unknown key", "allowed: 0"]),
    ],
)
def test_a_mistake_is_one_line(settings: str, fragments: list[str], write: Write) -> None:
    text = message(write(with_run(settings)))
    assert all(fragment in text for fragment in fragments), text
    assert "\n" not in text


def test_the_command_line_reaches_what_a_run_sets(write: Write) -> None:
    file = write(with_run("gatekeeper.tries: 2"))
    scenario = load(file, ["runs.other.set.gatekeeper.tries=3", "runs.d.set.decision.threshold.zeta_m=2"])[0]
    assert own(scenario, "other").gatekeeper.tries == 3
    assert own(scenario, "d").decision.threshold.zeta_m == 2.0
    assert (scenario.gatekeeper.tries, scenario.decision.threshold.zeta_m) == (5, 3.0)
    with pytest.raises(ScenarioError, match=r"--set runs.d.set.decision.threshold.zeta_m=1: .*decision.release_m"):
        load(file, ["runs.d.set.decision.threshold.zeta_m=1"])


@pytest.mark.parametrize("key", ["gatekeeper.route", "intervention.policies.0.name"])
def test_code_of_others_that_a_run_names_is_refused(key: str, write: Write) -> None:
    scenario = load(write(with_run(f"{key}: 'mine:Mine'")))[0]
    with pytest.raises(ScenarioError, match=f"runs.other.set.{key}: 'mine:Mine'.*only with --allow-plugins"):
        plugins.refuse(scenario, "x")
    assert plugins.plugins(plugins.without(scenario)) == {}


def test_a_run_is_simulated_judged_and_shown_with_what_it_sets(write: Write) -> None:
    settings = "decision.threshold.zeta_m: 2, decision.noise_m_sqrt_s: 0.01"
    scenario = load(write(with_run(settings)), ["runs.other.method=a", "duration_s=1"])[0]
    trace = simulate(scenario, "other")
    assert trace.meta["zeta_m"] == trace.scenario.decision.threshold.zeta_m == 2.0
    assert trace.column("one.noise_m").any()
    assert not simulate(scenario, "d").column("one.noise_m").any()
    assert trace.meta["scenario"]["decision"]["threshold"]["zeta_m"] == 3.0
    (verdict,) = verify(trace, ["THR-TRIG"])
    assert verdict.finding.status == "holds"
    shown: dict[str, Any] = document.build(scenario, "0", {"other": trace}, [verdict], {})["runs"]["other"]
    assert shown["set"] == {"decision.threshold.zeta_m": 2, "decision.noise_m_sqrt_s": 0.01}
    trace.meta["scenario"]["runs"]["other"]["set"]["decision.threshold.zeta_m"] = 2.5
    assert verify(trace, ["THR-TRIG"])[0].finding.status == "error"  # another threshold


def test_claims_about_the_model_are_judged_for_a_run_that_changes_their_constants(write: Write) -> None:
    file = write(with_run("decision.threshold.zeta_m: 2", "{THR-CHOICE: exercised}"))
    _, choice, other = verify_model(load(file)[0], claims=["SAFE-INV", "THR-CHOICE"])
    assert [each.finding.evidence.threshold_in_force_m for each in (choice, other)] == [3.0, 2.0]
    assert [(each.run, each.expected) for each in (choice, other)] == [("", "holds"), ("other", "exercised")]
    assert not other.as_expected  # it is declared
