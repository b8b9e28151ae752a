"""What needs attention: in words, with who and when."""

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from report.cases import FINE, built, verdict

from airground_drake.report import attention
from airground_drake.report.model import of
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace


def items(report: dict[str, Any]) -> list[attention.Item]:
    return attention.items(of(report))


AT = {"first": "ugv1", "second": "obstacle_1", "t_s": 7.717}
TOO_NEAR = {"min_distance_m": 0.0, "safe_distance_m": 2.0, "margin_m": -2.0}
END = {"robot": "ugv1", "condition": "at its target", "distance_m": 4.2, "margin_m": -4.1}
AVOIDANCE = {"hypothesis": "avoidance", "margin": -0.5}


@pytest.mark.parametrize(
    ("status", "finding", "words"),
    [
        ("refuted", {"counterexample": AT | TOO_NEAR}, "ugv1 and obstacle_1 at 0.000 m, 2 m required, 7.717 s"),
        ("refuted", {"counterexample": END}, "ugv1 ended 4.20 m from where it must end, 0.1 m allowed"),
        ("refuted", {"counterexample": END | {"collided_s": 5.78}},
         "ugv1 collided at 5.78 s, 4.20 m from where it must end, 0.1 m allowed"),
        ("refuted", {"counterexample": {"robot": "ugv1", "parameter": "share", "built": 0.4, "scenario": 0.5}},
         "ugv1: share was built as 0.4, the scenario has 0.5"),
        ("refuted", {"margin": -3.0, "unit": "m/s", "counterexample": AT | AVOIDANCE},
         "ugv1 and obstacle_1: avoidance missed by 0.5 m/s, 7.717 s"),
        ("refuted", {"counterexample": {"kind": "stray", "t_s": 1.0}}, "stray, 1.000 s"),
        ("refuted", {}, "refuted"),
        ("error", {"evidence": {"error": "TraceError: no"}}, "TraceError: no"),
        ("not_run", {"evidence": {"reason": "no bound"}}, "no bound"),
        ("inconclusive", {}, "could not be decided"),
        ("holds", {"expected": "refuted"}, "holds all the same"),
        ("holds", {"expected": "exercised", "exercised": 0}, "not tested: no pairs"),
    ],
)  # fmt: skip
def test_in_words(
    scenario: Scenario, traces: dict[str, Trace], status: Any, finding: dict[str, Any], words: str
) -> None:
    (item,) = items(built(scenario, traces, [*FINE[1:], verdict("a", status, **finding)]))
    assert (item.words, item.claim, item.run, item.anchor) == (words, "SAFE-TRACE", "a", "claim-SAFE-TRACE")


def test_why_a_robot_was_not_helped(scenario: Scenario, traces: dict[str, Trace]) -> None:
    report = built(scenario, traces, [FINE[0], verdict("c", "refuted", counterexample=END), FINE[2]])
    refusals = report["runs"]["c"]["metrics"]["gatekeeper"]["refusals"]
    refusals["ugv1"] = {"not_cheaper": 1, "a_new_one": 2}
    (item,) = items(report)
    assert item.words.endswith("; refused 3 times: a new one (2); the UGV's own task looked as good (1)")


def test_what_is_missing_or_faulty_or_ends_too_early(scenario: Scenario, traces: dict[str, Trace]) -> None:
    def faults(*said: tuple[str, float]) -> list[dict[str, Any]]:
        return [{"t_s": t_s, "robot": "ugv1", "policy": "mine", "what": what} for what, t_s in said]

    assert not items(built(scenario, traces, FINE))
    wrong = built(scenario, traces, [verdict("a", "error"), verdict("c", "refuted"), FINE[2]])
    assert [item.chip for item in items(wrong)] == ["refuted", "error"]
    report = built(scenario, traces, FINE[:2])
    report["runs"]["c"]["faults"] = faults(*[("boom.py:5 ValueError: no", 6.05)] * 14, ("late", 9.0))
    report["overall"] |= {"undemonstrated": [7]}
    report["scenario"]["resolved"]["duration_s"] = 15.0
    first, second, early, *rest = items(report)
    assert first.words == "policy mine: boom.py:5 ValueError: no (14 times, first at 6.05 s)"
    assert second.words == "policy mine: late (once, at 9.00 s)"
    assert early.words.startswith("duration_s = 15 ends the runs before the presets of ugv1, ugv2 do (2")
    assert [(item.words, item.anchor) for item in rest] == [
        ("no claim was checked on the run", "claims"), ("finding 7 about the paper", "audit"),
    ]  # fmt: skip
    for kinds, more in ((100, ["97 more kinds of faults"]), (3, [])):
        report["runs"]["c"]["faults"] = faults(*((f"ValueError: {k}", 1.0) for k in range(kinds)))
        assert [item.words for item in items(report) if "more" in item.words] == more
    report["scenario"]["resolved"]["duration_s"] = 13.0 / 0.5606  # as long as the presets take
    assert not [item for item in items(report) if "ends the runs" in item.words]


def test_for_whom_the_uav_found_no_way(scenario: Scenario, traces: dict[str, Trace]) -> None:
    """A policy that failed has found nothing either: that is said apart."""
    report = built(scenario, traces, FINE)
    report["runs"]["c"]["metrics"]["without_proposals"] = ["ugv1", "ugv2"]
    (item,) = items(report)
    assert (item.words, item.run) == ("the UAV found no way for ugv1 and ugv2", "c")
    report["runs"]["c"]["faults"] = [{"t_s": 1.0, "robot": "ugv1", "policy": "mine", "what": "no"}]
    assert [item.words for item in items(report)][1:] == ["the UAV found no way for ugv2"]


KEYS = st.sampled_from([*attention.ROLES, *TOO_NEAR, *END, "t_s", "hypothesis", "margin", "unit", "kind"])
VALUES = st.none() | st.booleans() | st.floats() | st.text() | st.sampled_from(["ugv1", "uav", "obstacle_1"])


@settings(max_examples=12)
@given(found=st.dictionaries(KEYS, VALUES | st.lists(VALUES)), margin=st.none() | st.floats(allow_nan=False))
def test_whatever_a_third_party_claim_found_is_told(
    scenario: Scenario, traces: dict[str, Trace], found: dict[str, Any], margin: float | None
) -> None:
    report = built(scenario, {"c": traces["c"]}, [verdict("c", "refuted", margin=margin, counterexample=found)])
    assert items(report)[0].words
