"""THR-CHOICE."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from builders.edits import with_scenario
from builders.runs import run_of
from verify.model.threshold.cases import INPUTS

from airground_drake.model.trigger.bayes import optimal_threshold
from airground_drake.report import html
from airground_drake.scenario.load import load
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge_model
from airground_drake.verify.claims.thr_choice import ThrChoice


@pytest.mark.parametrize(
    ("name", "changes", "status", "exercised", "kind"),
    [
        ("table 1", {}, "holds", 0, "declared"),  # nothing could refute it
        ("table 1", {"zeta_m": optimal_threshold(6.05, 10.0, 0.5, 1.0)}, "holds", 1, "optimal"),
        ("audit", {}, "holds", 1, "optimal"),
        ("audit", {"zeta_m": (1.0 + 0.5e-6) * INPUTS["audit"]["zeta_m"]}, "holds", 1, "optimal"),
        ("audit", {"zeta_m": (1.0 + 2e-6) * INPUTS["audit"]["zeta_m"]}, "refuted", 1, "declared"),
        ("audit", {"zeta_m": (1.0 - 2e-6) * INPUTS["audit"]["zeta_m"]}, "refuted", 1, "declared"),
    ],
)
def test_a_threshold_is_optimal_or_declared(
    name: str, changes: dict[str, Any], status: str, exercised: int, kind: str
) -> None:
    finding = ThrChoice().judge(INPUTS[name] | changes)
    assert (finding.status, finding.exercised, finding.evidence["kind"]) == (status, exercised, kind)
    assert (finding.margin is not None and finding.margin < 0.0) == (status == "refuted")


@pytest.mark.parametrize(
    ("scenario", "run", "rule", "in_force", "extra"),
    [
        ("case_a", "", "fixed", 3.0, 3.118e-7),
        ("bayes_threshold", "", "bayes", 0.50310, 0.0),
        ("bayes_threshold", "d_printed", "printed", 0.03109, 1.44155),
    ],
)
def test_shipped_scenarios(scenario: str, run: str, rule: str, in_force: float, extra: float) -> None:
    verdicts = judge_model(load(scenario), claims=["THR-CHOICE"])
    (verdict,) = [each for each in verdicts if each.run == run]
    found = verdict.evidence
    assert verdict.as_expected
    assert verdict.expected == ("exercised" if rule == "bayes" else "holds")
    assert (found["rule"], found["kind"]) == (rule, "optimal" if rule == "bayes" else "declared")
    assert found["threshold_in_force_m"] == pytest.approx(in_force, rel=1e-4)
    assert found["extra_risk"] == pytest.approx(extra, rel=1e-3, abs=1e-12)
    if rule == "printed":
        assert found["threshold_in_force_m"] == found["threshold_as_printed_in_19_m"]


def test_runs_show_the_drift_and_the_noise_that_they_had(run: Callable[[str, str], Trace]) -> None:
    found = ThrChoice().seen_in(run("case_a", "b"))["b ugv1"]
    assert found["drift_m_s"] == pytest.approx(0.5606, abs=5e-4)
    assert found["noise_m_sqrt_s"] == 0.004
    assert found["optimum_m"] == pytest.approx(0.00016, abs=5e-6)
    assert found["extra_risk"] == pytest.approx(0.5 * 3.0 / 0.5606, rel=1e-2)  # c1 times the time to reach 3 m
    quiet = ThrChoice().seen_in(with_scenario(run_of("d"), decision__noise_m_sqrt_s=0.0))["d ugv1"]
    assert quiet["optimum_m"] == 0.0
    assert quiet["extra_risk"] == pytest.approx(0.5 * 3.0 / quiet["drift_m_s"])


@pytest.mark.parametrize(("kind", "shown"), [("declared", "declared"), ("optimal", "holds")])
def test_a_declared_threshold_never_looks_proved(kind: str, shown: str) -> None:
    for status, told in (("holds", shown), ("refuted", "refuted")):
        claim = SimpleNamespace(status=status, exercised=1, evidence={"kind": kind})
        assert html._shown(claim) == told
