"""The formulas in Signal Temporal Logic: rtamt agrees with our checkers, and wrong formulas are noticed."""

from __future__ import annotations

import itertools
import json
import pickle
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from builders.edits import with_events, with_scenario, with_signals
from builders.layout import rebuilt
from builders.runs import passing_by, run_of
from builders.scenarios import STILL, case_a, lone
from builders.simulation import simulate
from sharing import once

from airground_drake.scenarios.schema import Decision, Threshold
from airground_drake.side_by_side import side_by_side
from airground_drake.trace import Trace
from airground_drake.verify import verify
from airground_drake.verify.claim import Verdict
from airground_drake.verify.finding import Finding
from airground_drake.verify.stl.cross_check import FORMULAS, StlFormula, cross_check, merge
from airground_drake.verify.stl.signals import Signals

pytest.importorskip("rtamt")

Judgement = tuple[list[Verdict], list[dict[str, Any]]]
"""Our verdicts on a run, and rtamt's."""

CLAIMS = {"SAFE-TRACE", "SAFE-HYP", "ZENO-TRACE", "THR-TRIG", "LIVE-GOAL", "COMM"}

SHIPPED = [(scenario, name) for scenario in ("case_a", "case_b") for name in "abcd" if scenario + name != "case_ba"]


def out_and_back(dwell: float, trigger: str = "automaton") -> Trace:
    """x rises to 1.2 m and falls to 0 three times: triggers 1.2 s apart."""
    decision = Decision(Threshold(zeta_m=1.03), trigger, release_m=0.47, min_inter_event_s=dwell)
    scenario = lone([0.0] * 3, [0.0] * 3, STILL, 3.6, decision=decision)
    return simulate(scenario, drive=lambda t: [[-2.0 if int(t / 0.6 + 1e-6) % 2 else 2.0, 0.0, 0.0], [0.0] * 3])


def checked(trace: Trace, formulas: tuple[StlFormula, ...] = FORMULAS) -> dict[str, Verdict]:
    """Merged verdicts of the claims that have formulas here."""
    merged = merge(verify(trace), cross_check(trace, formulas))
    named = {formula.claim for formula in formulas}
    return {verdict.claim.id: verdict for verdict in merged if verdict.claim.id in named}


def assert_agreement(trace: Trace) -> None:
    for name, verdict in checked(trace).items():
        stl = verdict.finding.evidence["stl"]
        assert stl["agrees"] is True, (name, verdict.finding.evidence.get("error"), stl)
        assert json.dumps(stl, allow_nan=False)
        for check in stl["checks"]:
            assert check["engine"].startswith("rtamt 0.")
            if check["compares"] and check["robustness"] is not None:
                assert check["robustness"] == pytest.approx(check["ours"], abs=1e-10)


@pytest.mark.parametrize("method", "abcd")
def test_agreement_on_a_valid_run(method: str) -> None:
    assert_agreement(run_of(method))
    assert set(checked(run_of(method))) == CLAIMS - ({"COMM"} if method == "a" else set())


@pytest.mark.parametrize(("scenario", "name"), SHIPPED)
def test_agreement_on_the_shipped_runs(run: Callable[[str, str], Trace], scenario: str, name: str) -> None:
    trace = run(scenario, name)
    assert_agreement(trace)
    before = {verdict.claim.id: verdict.finding.status for verdict in verify(trace)}
    assert {name: verdict.finding.status for name, verdict in checked(trace).items()} == {
        name: status for name, status in before.items() if name in CLAIMS
    }


@pytest.mark.parametrize("periods", [1, 2])
def test_agreement_on_a_run_of_hardly_a_period(periods: int) -> None:
    scenario = case_a()
    assert_agreement(simulate(case_a({"duration_s": periods * scenario["control"]["period_s"]}), "d"))


@pytest.mark.parametrize("dwell", [0.3, 0.5, 1.0])
@pytest.mark.parametrize("t", [0.9999999999999887, 0.99999999999998, 1.0 - 2.0**-53, 1.0, 1.0 + 2.0**-52])
def test_a_trigger_whose_time_the_engines_round_differently_is_no_error(t: float, dwell: float) -> None:
    """A pulse of 1e-9 s from there ends at a sum that each rounds its own way."""
    decision = Decision(Threshold(zeta_m=1.03), "automaton", release_m=0.47, min_inter_event_s=dwell)
    scenario = lone([0.0] * 3, [0.0] * 3, STILL, 1.6, decision=decision)
    trace = simulate(scenario, drive=lambda _: [[1.03, 0.0, 0.0], [0.0] * 3])
    (before,) = (event["t_s"] for event in trace.events if event["kind"] == "trigger")
    assert before == pytest.approx(1.0, abs=1e-6)
    columns = ["t_s", "ugv1.triggered_at_s"]
    trace = with_signals(trace, lambda s: s.assign(**{c: s[c].where((s[c] - 1.0).abs() > 1e-6, t) for c in columns}))
    trace = with_signals(trace, lambda s: s.drop_duplicates("t_s", keep="last").reset_index(drop=True))
    trace = with_events(trace, lambda events: [{**e, "t_s": t} if e["t_s"] == before else e for e in events])
    verdict = checked(trace)["ZENO-TRACE"]
    assert verdict.finding.status == "holds", verdict.finding.evidence
    assert verdict.finding.evidence["triggers"]["ugv1"]["t_s"] == [t]
    assert verdict.finding.evidence["stl"]["agrees"] is True


@pytest.mark.parametrize("offset", [-1e-6, -2e-9, -1e-9, -5e-10, 0.0, 1e-6])
def test_distances_between_rows_are_seen(offset: float) -> None:
    trace = passing_by(offset)
    (check,) = (c for c in cross_check(trace) if c["claim"] == "SAFE-TRACE")
    assert check["robustness"] == pytest.approx(offset, abs=1e-12)
    assert checked(trace)["SAFE-TRACE"].finding.evidence["stl"]["agrees"]
    if abs(offset + 1e-9) > 1e-12:
        assert check["verdict"] == ("satisfied" if offset > -1e-9 else "violated")


def random_trace(seed: int) -> Trace:
    """Robots that move at random; then limits, targets and events are chosen so that claims are nearly broken."""
    rng = np.random.default_rng(seed)
    start = rng.uniform([-1.0, 1.0, 0.0], [3.0, 3.0, 0.0], (3, 3))
    start[2, 2] = 1.5
    changes = {f"{name}.start_m": s.tolist() for name, s in zip(("ugvs.ugv1", "ugvs.ugv2", "uav"), start, strict=True)}
    error = float(np.linalg.norm(start[0] - [3.3, 0.0, 0.0]))
    changes |= {
        "duration_s": 1.5,
        "decision.trigger": str(rng.choice(["automaton", "bare"])),
        "decision.threshold.zeta_m": error + float(rng.uniform(0.05, 0.3)),
        "decision.release_m": error - 0.1,
        "decision.min_inter_event_s": float(rng.choice([0.1, 0.25, 0.5])),
        "decision.noise_m_sqrt_s": float(rng.choice([0.02, 1.0])),
    }
    velocity = rng.normal(0.0, rng.choice([0.2, 2.0]), (15, 3, 3)) * [[1, 1, 0], [1, 1, 0], [1, 1, 1]]
    trace = simulate(case_a(changes), "bcd"[seed % 3], lambda t: velocity[int(t / 0.1 + 1e-6) % 15].tolist(), seed)
    return disturbed(trace, rng)


def disturbed(trace: Trace, rng: np.random.Generator) -> Trace:
    final = {robot: trace.position(robot)[-1] for robot in trace.robots}
    nearest = {"obstacle_m": np.inf, "ugv_m": np.inf, "air_ground_m": np.inf}
    fine = np.linspace(trace.t[0], trace.t[-1], 2000)
    path = {r: np.column_stack([np.interp(fine, trace.t, c) for c in trace.position(r).T]) for r in trace.robots}
    path |= {name: np.array(o["position_m"]) for name, o in trace.scenario["obstacles"].items()}
    for a, b in itertools.combinations(path, 2):
        if a in trace.robots:
            kind = "obstacle_m" if b not in trace.robots else "air_ground_m" if "uav" in (a, b) else "ugv_m"
            nearest[kind] = min(nearest[kind], float(np.linalg.norm(path[a] - path[b], axis=1).min()))
    factor = 1.0 + rng.choice([-0.3, -1e-3, 1e-3])  # a tenth of what follows only grazes
    changes: dict[str, Any] = {f"safe_distance__{kind}": value * factor for kind, value in nearest.items()}
    changes["arrival_tolerance_m"] = 0.1
    for robot, key in {"ugv1": "ugvs__ugv1", "ugv2": "ugvs__ugv2", "uav": "uav"}.items():
        away = rng.normal(size=3) * rng.choice([0.01, 0.01, 0.1])
        changes[f"{key}__target_m"] = (final[robot] + away).tolist()
        changes[f"{key}__max_speed_m_s"] = float(rng.choice([3.0, 20.0]))
    trace = rebuilt(with_scenario(trace, **changes))
    if rng.random() < 0.4:
        row = int(rng.integers(1, len(trace.t)))
        trace = with_signals(trace, lambda s: s.assign(**{"ugv1.noise_m": s["ugv1.noise_m"] + 0.3 * (s.index >= row)}))
    if rng.random() < 0.7:
        sent = {"robot": "ugv1", "kind": "proposal", "position_m": [0.0] * 3, "t_s": float(rng.uniform(0.0, 1.5))}
        trace = with_events(trace, lambda events: [*events, sent])
    return trace


def judged(seed: int) -> Judgement:
    """Our verdicts on a random trace, and rtamt's."""
    trace = random_trace(seed)
    return verify(trace, CLAIMS), cross_check(trace)


@pytest.fixture(scope="session")
def judgements(shared: Path) -> list[Judgement]:
    """`judged` of 200 random traces."""

    def make(folder: Path) -> None:
        folder.mkdir()
        made = side_by_side([partial(judged, seed) for seed in range(200)])
        (folder / "pickled").write_bytes(pickle.dumps(made))

    made: list[Judgement]
    made = pickle.loads((once(shared / "random_traces", make) / "pickled").read_bytes())
    return made


@pytest.fixture(scope="session")
def outcomes(
    judgements: list[Judgement],
) -> Counter[tuple[str, str, str, Any]]:
    """(claim, our status, joint verdict of rtamt, agreement) on the random traces."""
    found: Counter[tuple[str, str, str, Any]] = Counter()
    for verdicts, checks in judgements:
        for ours, verdict in zip(verdicts, merge(verdicts, checks), strict=True):
            stl = verdict.finding.evidence["stl"]
            said = "violated" if any(check["verdict"] == "violated" for check in stl["checks"]) else "satisfied"
            found[ours.claim.id, ours.finding.status, said, stl["agrees"]] += 1
    return found


@pytest.mark.parametrize("claim", sorted(CLAIMS))
def test_agreement_on_random_traces(claim: str, outcomes: Counter[tuple[str, str, str, Any]]) -> None:
    mine = {key[1:]: n for key, n in outcomes.items() if key[0] == claim}
    compared = {key: n for key, n in mine.items() if key[0] in ("holds", "refuted")}
    assert all(agrees is True for _, _, agrees in compared), compared
    for verdict in ("satisfied", "violated"):
        assert sum(n for (_, said, _), n in compared.items() if said == verdict) >= 20, compared
    for status in ("holds", "refuted"):
        assert sum(n for (ours, _, _), n in compared.items() if ours == status) >= 20, compared


def formula_of(claim: str, part: str = "") -> StlFormula:
    return next(f for f in FORMULAS if f.claim == claim and part in f.part)


def rewritten(claim: str, old: str, new: str, part: str = "") -> StlFormula:
    formula = formula_of(claim, part)
    assert old in formula.text
    return replace(formula, text=formula.text.replace(old, new))


def tuned(claim: str, part: str = "", **change: Callable[[float], float]) -> StlFormula:
    """The same formula with other constants."""
    formula = formula_of(claim, part)

    def evaluate_on(trace: Trace) -> Any:
        signals = formula.evaluate_on(trace)
        assert signals is not None
        return signals._replace(constants={k: change.get(k, float)(v) for k, v in signals.constants.items()})

    return replace(formula, evaluate_on=evaluate_on)


def rows_only(trace: Trace) -> Any:
    """Distances without the closest approaches between the rows."""
    signals = formula_of("SAFE-TRACE").evaluate_on(trace)
    assert signals is not None
    times, margin = signals.sets[0]["margin_m"]
    keep = np.isin(times, trace.t)
    return signals._replace(sets=[{"margin_m": (times[keep], margin[keep])}])


def with_message(delay: float) -> Trace:
    """The first intervention gets one more proposal, some time after its release."""
    trace = run_of("d")
    released = next(float(e["t_s"]) for e in trace.events if e["kind"] == "release")
    sent = {"t_s": released + delay, "robot": "ugv1", "kind": "proposal", "position_m": [0.0] * 3}
    return with_events(trace, lambda events: [*events, sent])


def passing_the_target() -> Trace:
    return with_scenario(passing_by(0.5), ugvs__ugv1__target_m=[0.0, 2.5, 0.0])


WRONG: dict[str, tuple[StlFormula, Callable[[], Trace]]] = {
    "safe distance shifted": (rewritten("SAFE-TRACE", "0", "0.001"), lambda: run_of("d")),
    "distance once, not always": (rewritten("SAFE-TRACE", "always", "eventually"), lambda: run_of("d")),
    "safe distance, <= for >=": (rewritten("SAFE-TRACE", ">=", "<="), lambda: passing_by(-0.1)),
    "distances at the rows only": (replace(formula_of("SAFE-TRACE"), evaluate_on=rows_only), lambda: passing_by(-1e-6)),
    "climbing, >= for <=": (rewritten("SAFE-HYP", "climb_m_s <=", "climb_m_s > 0.001 +", "vel"), lambda: run_of("d")),
    "dwell halved": (tuned("ZENO-TRACE", dwell=lambda t: t / 2), lambda: out_and_back(2.0, "bare")),
    "dwell doubled": (tuned("ZENO-TRACE", dwell=lambda t: 2 * t), lambda: out_and_back(0.8)),
    "trigger, no dwell after it": (
        rewritten("ZENO-TRACE", "-> always", "-> eventually"),
        lambda: out_and_back(2.0, "bare"),
    ),
    "threshold shifted down": (tuned("THR-TRIG", most=lambda z: z - 0.01), lambda: run_of("d")),
    "threshold shifted up": (tuned("THR-TRIG", least=lambda z: z + 0.01), lambda: run_of("d")),
    "release level shifted down": (tuned("THR-TRIG", high=lambda r: r - 0.01), lambda: run_of("d")),
    "release level shifted up": (tuned("THR-TRIG", low=lambda r: r + 0.2), lambda: run_of("d")),
    "threshold, >= for <=": (rewritten("THR-TRIG", "x_m <= {most", "x_m >= {most"), lambda: run_of("d")),
    "no allowance for messages": (tuned("COMM", "only", allowance=lambda a: 0.0), lambda: with_message(0.05)),
    "messages at the end of it only": (rewritten("COMM", "once", "historically", "only"), lambda: run_of("d")),
    "fewer messages than always-on": (tuned("COMM", "more", most_proposals=lambda n: 0.0), lambda: run_of("d")),
    "tolerance of arrival shifted": (rewritten("LIVE-GOAL", "goal_m >= 0", "goal_m >= 0.01"), lambda: run_of("d")),
    "there at the start, not in the end": (rewritten("LIVE-GOAL", "eventually always", "always"), lambda: run_of("d")),
    "there once, not in the end": (rewritten("LIVE-GOAL", "eventually always", "eventually"), passing_the_target),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_formulas_are_noticed(name: str) -> None:
    wrong, make = WRONG[name]
    trace = make()
    ours = next(v.finding for v in verify(trace) if v.claim.id == wrong.claim)
    formulas = [wrong if f == formula_of(wrong.claim, wrong.part) else f for f in FORMULAS]
    for which, expected in ((FORMULAS, True), (tuple(formulas), False)):
        merged = checked(trace, which)[wrong.claim].finding
        assert merged.evidence["stl"]["agrees"] is expected, merged.evidence["stl"]
    assert merged.status == "error"
    assert merged.evidence["ours"]["status"] == ours.status
    assert merged.evidence["ours"]["margin"] == ours.margin
    (check,) = (c for c in merged.evidence["stl"]["checks"] if c["part"] == wrong.part)
    assert repr(check["robustness"]) in merged.evidence["error"] or "satisfied" in merged.evidence["error"]
    assert json.dumps(merged.evidence, allow_nan=False)


@pytest.mark.parametrize("claim", sorted(CLAIMS))
def test_a_checker_that_passes_everything_is_noticed(claim: str, judgements: list[Judgement]) -> None:
    """Where a formula is violated, a finding that holds becomes an error, whatever its margin."""
    seen = 0
    for verdicts, checks in judgements:
        verdict = next(v for v in verdicts if v.claim.id == claim)
        lying = merge([replace(verdict, finding=Finding("holds"))], checks)[0].finding
        violated = any(check["verdict"] == "violated" for check in checks if check["claim"] == claim)
        assert (lying.status == "error") == violated
        seen += violated
    assert seen >= 20


@pytest.mark.parametrize("claim", sorted(CLAIMS - {"THR-TRIG", "SAFE-HYP", "COMM"}))
def test_a_checker_that_refutes_everything_is_noticed(claim: str) -> None:
    """THR-TRIG, SAFE-HYP and COMM say more than their formulas, so that no formula can contradict their refutation."""
    trace = passing_by(0.5) if claim == "SAFE-TRACE" else run_of("d")
    verdict = next(v for v in verify(trace) if v.claim.id == claim)
    assert verdict.finding.status == "holds"
    lying = merge([replace(verdict, finding=replace(verdict.finding, status="refuted"))], cross_check(trace))[0].finding
    assert lying.status == "error"
    assert lying.evidence["ours"]["status"] == "refuted"


def test_a_margin_that_is_off_is_noticed() -> None:
    trace = run_of("d")
    verdict = next(v for v in verify(trace) if v.claim.id == "LIVE-GOAL")
    assert verdict.finding.margin is not None
    for off, status in ((1e-12, "holds"), (1e-8, "error")):
        moved = replace(verdict, finding=replace(verdict.finding, margin=verdict.finding.margin + off))
        assert merge([moved], cross_check(trace))[0].finding.status == status


def test_without_rtamt_nothing_is_decided(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rtamt", None)
    checks = cross_check(run_of("d"))
    assert {check["verdict"] for check in checks} == {"not_run"}
    assert all("rtamt" in check["reason"] and check["robustness"] is None for check in checks)
    for before, after in zip(verify(run_of("d")), merge(verify(run_of("d")), checks), strict=True):
        assert after.finding.status == before.finding.status
        if before.claim.id in CLAIMS:
            assert after.finding.evidence["stl"]["agrees"] is None


def test_rtamt_is_imported_only_when_asked() -> None:
    code = "import sys, airground_drake.verify.stl.cross_check; sys.exit('rtamt' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=300)


@pytest.mark.parametrize(
    "text", ["always (margin_m >=", "always (other >= 0)", "always[0,1] (margin_m >= {unknown})", "rise(", ""]
)
def test_a_formula_that_cannot_be_evaluated_is_an_error(text: str) -> None:
    wrong = replace(formula_of("SAFE-TRACE"), text=text)
    finding = checked(run_of("d"), (wrong,))["SAFE-TRACE"].finding
    assert finding.status == "error"
    assert finding.evidence["stl"]["checks"][0]["reason"]
    refuted = checked(passing_by(-0.1), (wrong,))["SAFE-TRACE"].finding
    assert refuted.status == "refuted"
    assert refuted.evidence["stl"]["agrees"] is None


def test_signals_that_are_not_numbers_are_errors() -> None:
    def spoil(signals: pd.DataFrame) -> None:
        signals.loc[100, ["ugv1.x_m", "ugv1.mode", "ugv1.noise_m"]] = np.nan

    checks = cross_check(with_signals(run_of("d"), spoil))
    assert {c["verdict"] for c in checks if c["claim"] in ("SAFE-TRACE", "SAFE-HYP", "THR-TRIG")} >= {"error"}
    assert json.dumps(checks, allow_nan=False)
    nothing = replace(formula_of("SAFE-TRACE"), evaluate_on=lambda trace: Signals({}, []))
    infinite = Signals({}, [{"margin_m": (np.arange(2.0), np.array([1.0, np.inf]))}])
    for formula in (nothing, replace(formula_of("SAFE-TRACE"), evaluate_on=lambda trace: infinite)):
        assert cross_check(run_of("d"), (formula,))[0]["verdict"] == "error"


def test_merge_leaves_other_verdicts_alone() -> None:
    verdicts = verify(run_of("d"))
    assert merge(verdicts, []) == verdicts
    assert merge(verdicts, [c | {"run": "other"} for c in cross_check(run_of("d"))]) == verdicts
    before = json.dumps([v.to_json() for v in verdicts])
    merged = merge(verdicts, cross_check(run_of("d")))
    assert json.dumps([v.to_json() for v in verdicts]) == before  # pure
    for a, b in zip(verdicts, merged, strict=True):
        changed = replace(b.finding, evidence={k: v for k, v in b.finding.evidence.items() if k != "stl"})
        assert changed == a.finding
    broken = replace(verdicts[0], finding=Finding("error", evidence={"error": "no data"}))
    assert merge([broken], cross_check(run_of("d")))[0].finding.evidence["stl"]["agrees"] is None


def test_a_formula_about_nothing_is_left_out_or_vacuous() -> None:
    assert {c["claim"] for c in cross_check(run_of("a"))} == CLAIMS - {"COMM"}
    timeless = with_scenario(run_of("d"), decision__min_inter_event_s=0.0)
    assert "ZENO-TRACE" not in {c["claim"] for c in cross_check(timeless)}
