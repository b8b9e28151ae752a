"""What every claim about a run must do, whatever it claims."""

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from builders.edits import bumped, dropped, rows, set_nan, with_meta, with_scenario
from builders.runs import passing_by, run_of
from verify.judging import CLAIMS, GATE, UNRECORDED, decided

from airground_drake.sim.trace import Trace, load, save
from airground_drake.verify import Finding, judge, judge_model
from airground_drake.verify.claims.safe_budget import SafeBudget
from airground_drake.verify.finding import Chart


@pytest.mark.parametrize("method", "abcd")
def test_every_claim_holds_on_a_valid_run(method: str) -> None:
    verdicts = {verdict.claim.id: verdict for verdict in judge(run_of(method))}
    found = {name: verdict.status for name, verdict in verdicts.items()}
    assert found == {name: UNRECORDED.get(method, {}).get(name, "holds") for name in found}
    ungated = {"LIVE-HYP", *GATE}
    left_out = {"a": ungated, "b": ungated, "c": {"LIVE-HYP"}, "d": set[str]()}[method]
    assert set(verdicts) == set(CLAIMS) - left_out - {"SAFE-OWN"}  # nothing moves by itself
    assert all(json.dumps(verdict.to_json(), allow_nan=False) for verdict in verdicts.values())


@pytest.mark.parametrize("name", ["c", "d"])
def test_verdicts_survive_saving(run: Callable[[str, str], Trace], tmp_path: Any, name: str) -> None:
    trace = run("case_b", name)
    save(trace, tmp_path)
    assert [v.to_json() for v in judge(load(tmp_path))] == [v.to_json() for v in judge(trace)]


def test_expected_status_is_the_scenarios() -> None:
    trace = with_scenario(run_of("a"), runs__a__expected={"SAFE-TRACE": "refuted"})
    assert {v.claim.id for v in judge(trace) if not v.as_expected} == {"SAFE-TRACE"}


BROKEN: dict[str, Callable[[Trace], Trace]] = {
    "NaN in a position": set_nan("ugv1.x_m"),
    "no column of commands": dropped("ugv2.vy_m_s"),
    "one position altered": bumped("uav.z_m", 1e-8),
    "truncated at the end": rows(lambda states: states.iloc[:-1]),
    "truncated at the start": rows(lambda states: states.iloc[1:]),
    "time runs backwards": rows(lambda states: states.iloc[[0, 2, 1, *range(3, len(states))]]),
    "no rows": rows(lambda states: states.iloc[:0]),
    "a robot left out": lambda trace: with_meta(trace, robots=["ugv1", "uav"], ugvs=["ugv1"]),
    "no scenario": lambda trace: with_meta(trace, scenario={}),
    "another run": lambda trace: with_meta(trace, run="none"),
    "another method": lambda trace: with_meta(trace, method="b"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_of_a_broken_trace_no_claim_passes(name: str) -> None:
    found = {claim: decided(claim, BROKEN[name](run_of("d"))) for claim in CLAIMS}
    assert {f.status for f in found.values()} <= {"refuted", "not_run", "error"}, found
    assert all(f.evidence["error"] for f in found.values() if f.status == "error")


@pytest.mark.parametrize(
    ("returned", "error"),
    [
        (ZeroDivisionError("by 0"), "ZeroDivisionError: by 0"),
        (SystemExit(0), "SystemExit: 0"),
        (Finding("holds", margin=float("nan"), exercised=1), "ValueError"),
        (Finding("ok", exercised=1), "ValueError: LIVE-GOAL found 'ok'"),  # type: ignore[arg-type]
        (Finding("holds", margin=-5.0, exercised=1), "ValueError: LIVE-GOAL found 'holds' with the margin -5.0"),
        (Finding("holds", margin="big", exercised=1), "ValueError: LIVE-GOAL found the margin 'big'"),  # type: ignore[arg-type]
        (Finding("holds", exercised=1, figure={}), "ValueError: LIVE-GOAL found the figure dict; allowed: a Chart"),  # type: ignore[arg-type]
        (None, "AttributeError"),
    ],
)
def test_a_check_that_fails_is_an_error(returned: Any, error: str) -> None:
    class Failing(type(CLAIMS["LIVE-GOAL"])):  # type: ignore[misc]
        def check(self, trace: Trace) -> Finding:
            if isinstance(returned, BaseException):
                raise returned
            return returned

    finding = Failing().judge(run_of("d"))
    assert finding.status == "error"
    assert finding.evidence["error"].startswith(error)


@pytest.mark.parametrize(
    ("line", "log", "why"),
    [
        (([1.0, 2.0], [1.0]), "", r"line 'a' has 2 numbers across and 1 up; wanted: as many"),
        (([], []), "", "line 'a' has 0 numbers"),
        (([1.0, 2.0], [0.0, 1.0]), "xy", "0 on the logarithmic axis y; allowed: numbers above 0"),
    ],
)
def test_a_chart_that_cannot_be_drawn_is_refused(line: Any, log: str, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        Chart("Title", "t, s", "x, m", {"a": line}, {"b": (1.0, 1.0)}, log)


def test_a_claim_that_cannot_say_whether_it_applies_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def applies(self: Any, given: Any) -> bool:
        raise ValueError("applies")

    for kind in (type(CLAIMS["LIVE-GOAL"]), SafeBudget):
        monkeypatch.setattr(kind, "applies", applies)
    verdicts = judge(run_of("d"), claims=["LIVE-GOAL"]) + judge_model(run_of("d").scenario, claims=["SAFE-BUDGET"])
    assert [(each.status, each.evidence["error"]) for each in verdicts] == [("error", "ValueError: applies")] * 2


def test_a_count_of_numpy_is_a_count() -> None:
    class Counting(type(CLAIMS["LIVE-GOAL"])):  # type: ignore[misc]
        def check(self, trace: Trace) -> Finding:
            return Finding("refuted", margin=-1.0, exercised=np.int64(2))  # type: ignore[arg-type]

    finding = Counting().judge(run_of("d"))
    assert (finding.status, finding.exercised, type(finding.exercised)) == ("refuted", 2, int)


def test_half_a_run_can_refute_but_not_pass() -> None:
    cut = rows(lambda states: states[states["t_s"] < 0.8])
    assert decided("SAFE-TRACE", cut(passing_by(-1e-3))).status == "refuted"
    assert decided("SAFE-TRACE", cut(passing_by(+1e-3))).status == "error"
