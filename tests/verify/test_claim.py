"""What every claim about a run must do, whatever it claims."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pandas as pd
import pytest
from builders.edits import bumped, dropped, rows, set_nan, with_meta, with_scenario, with_signals
from builders.runs import passing_by, run_of
from verify.judging import CLAIMS, GATE, LAW, UNRECORDED, judge

from airground_drake.base.errors import TraceError
from airground_drake.run.trace import Trace, load, save
from airground_drake.verify import Finding, TraceClaim, verify


@pytest.mark.parametrize("method", "abcd")
def test_every_claim_holds_on_a_valid_run(method: str) -> None:
    verdicts = {verdict.claim.id: verdict for verdict in verify(run_of(method))}
    assert {name: v.finding.status for name, v in verdicts.items() if name not in LAW} == {
        name: UNRECORDED.get(method, {}).get(name, "holds") for name in verdicts if name not in LAW
    }
    ungated = {"LIVE-PROG", *GATE}
    left_out = {"a": {"COMM", *ungated}, "b": ungated, "c": {"LIVE-PROG"}, "d": {"GATE-OPT"}}[method]
    assert set(verdicts) == set(CLAIMS) - left_out
    assert all(json.dumps(v.to_json(), allow_nan=False) for v in verdicts.values())


@pytest.mark.parametrize("name", ["c", "d"])
def test_verdicts_survive_saving(run: Callable[[str, str], Trace], tmp_path: Any, name: str) -> None:
    trace = run("case_b", name)
    save(trace, tmp_path)
    assert [v.finding for v in verify(load(tmp_path))] == [v.finding for v in verify(trace)]


def test_expected_status_is_the_scenarios() -> None:
    trace = with_scenario(run_of("a"), runs__a__expected={"SAFE-TRACE": "refuted"})
    assert {v.claim.id for v in verify(trace) if not v.as_expected} - LAW == {"SAFE-TRACE"}


BROKEN: dict[str, Callable[[Trace], Trace]] = {
    "NaN in a position": set_nan("ugv1.x_m"),
    "no column of commands": dropped("ugv2.vy_m_s"),
    "one position altered": bumped("uav.z_m", 1e-8),
    "truncated at the end": rows(lambda signals: signals.iloc[:-1]),
    "truncated at the start": rows(lambda signals: signals.iloc[1:]),
    "time runs backwards": rows(lambda signals: signals.iloc[[0, 2, 1, *range(3, len(signals))]]),
    "no rows": rows(lambda signals: signals.iloc[:0]),
    "a robot left out": lambda trace: with_meta(trace, robots=["ugv1", "uav"], ugvs=["ugv1"]),
    "no scenario": lambda trace: with_meta(trace, scenario={}),
    "another run": lambda trace: with_meta(trace, run="none"),
    "another method": lambda trace: with_meta(trace, method="b"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_of_a_broken_trace_no_claim_passes(name: str) -> None:
    trace = BROKEN[name](run_of("d"))
    found = {claim: judge(claim, trace) for claim in CLAIMS}
    assert {f.status for f in found.values()} <= {"refuted", "not_run", "error"}, found
    assert all(f.evidence["error"] for f in found.values() if f.status == "error")


def test_checkers_that_fail_are_errors() -> None:
    class Failing(type(CLAIMS["COMM"])):  # type: ignore[misc]
        def check(self, trace: Trace) -> Finding:
            return self.finding(trace)

    def crash(trace: Trace) -> Finding:
        raise ZeroDivisionError("division")

    def unknown(trace: Trace) -> Finding:
        return Finding("ok", margin=1.0, exercised=1)  # type: ignore[arg-type]

    claim = Failing()
    for behaviour in (crash, lambda trace: Finding("holds", margin=float("nan")), unknown, lambda trace: None):
        claim.finding = behaviour
        assert claim.judge(run_of("d")).status == "error"
    assert TraceClaim.applies(claim, run_of("a"))


def test_a_claim_that_ends_the_process_is_an_error_too() -> None:
    class Exits(type(CLAIMS["SAFE-TRACE"])):  # type: ignore[misc]
        def check(self, trace: Trace) -> Finding:
            raise SystemExit(0)

    finding = Exits().judge(run_of("d"))
    assert (finding.status, finding.evidence) == ("error", {"error": "SystemExit: 0"})


def test_half_a_run_can_refute_but_not_pass() -> None:
    cut = rows(lambda signals: signals[signals["t_s"] < 0.8])
    assert judge("SAFE-TRACE", cut(passing_by(-1e-3))).status == "refuted"
    assert judge("SAFE-TRACE", cut(passing_by(+1e-3))).status == "error"


@pytest.mark.parametrize("gap", [0.0, 1e-17, 5e-10])
def test_rows_of_one_instant_are_merged(gap: float) -> None:
    """Around control samples, a row before with the old and a row after with the new command."""

    def split(signals: pd.DataFrame) -> pd.DataFrame:
        pieces, done = [], 0
        for k in range(100, 700, 20):
            row = signals.iloc[[k]]
            before, after = shifted(row, -gap, row.iloc[0]), shifted(row, gap, signals.iloc[k + 1])
            pieces += [signals.iloc[done:k], before, row, after]
            done = k + 1
        return pd.concat([*pieces, signals.iloc[done:]], ignore_index=True)

    def shifted(row: pd.DataFrame, dt: float, commanded: Any) -> pd.DataFrame:
        row = row.assign(t_s=row["t_s"] + dt)
        for name in (f"{robot}.{{}}{axis}_m" for robot in ("ugv1", "ugv2", "uav") for axis in "xyz"):
            velocity = float(commanded[name.format("v") + "_s"])
            row = row.assign(
                **{name.format(""): row[name.format("")] + dt * velocity, name.format("v") + "_s": velocity}
            )
        return row

    verdicts = verify(with_signals(run_of("d"), split))
    assert {v.claim.id for v in verdicts if v.finding.status != "holds"} - LAW == set(UNRECORDED["d"])


def test_trace_errors_name_the_place() -> None:
    finding = judge("SAFE-TRACE", bumped("ugv1.vx_m_s", 1e-4)(run_of("d")))
    assert TraceError.__name__ in finding.evidence["error"]
    assert "ugv1" in finding.evidence["error"]
