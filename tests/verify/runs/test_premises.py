"""How often the premises of theorems were met in runs."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from airground_drake.sim.trace import Trace
from airground_drake.verify import MODEL_CLAIMS, Finding
from airground_drake.verify.claims.live_gate import LiveGate
from airground_drake.verify.model.theorem import Proof

Run = Callable[[str, str], Trace]


@pytest.mark.parametrize(
    ("scenario", "run_name", "met"),
    [("case_a", "d", 1), ("case_b", "d", 1), ("pocket", "d", 1), ("doorway", "d", 3), ("case_a", "c", 0)],
)
def test_what_is_accepted_where_all_obstacles_are_known_meets_the_premise(
    run: Run, scenario: str, run_name: str, met: int
) -> None:
    assert LiveGate().seen_in(run(scenario, run_name)) == (met, met)


def test_an_obstacle_that_is_sensed_later_is_no_part_of_the_premise(run: Run) -> None:
    trace = run("case_a", "d")
    later = len(trace.decisions) // 2
    assert trace.decisions["decision"][later] == "accept"
    news = [[0] if k == later else [] for k in range(len(trace.decisions))]
    assert LiveGate().seen_in(replace(trace, decisions=trace.decisions.assign(new=news))) == (0, 1)


def test_counts_of_several_runs_are_added() -> None:
    proof = Proof(proof="checked", theorems={}, hypotheses=[])
    found = Finding("proved", evidence=proof, exercised=1)
    assert LiveGate().judge_runs(found, [(1, 2), None, (0, 3)]).evidence == replace(proof, applies_to=1, of=5)
    assert LiveGate().judge_runs(found, [None]).evidence is proof
    assert LiveGate().judge_runs(found, ["?"]).status == "error"


def test_a_run_whose_records_are_wrong_is_not_counted(run: Run) -> None:
    trace = run("case_a", "d")
    showing = {"SAFE-INV", "SAFE-GATE", "SAFE-DIST", "LIVE-GATE", "LIVE-WAIT", "THR-CHOICE"}
    assert {claim.id for claim in MODEL_CLAIMS if claim.judge_run(trace) is not None} == showing
    bare = Trace(trace.meta, trace.states, trace.samples, trace.decisions)
    assert {claim.id for claim in MODEL_CLAIMS if claim.judge_run(bare) is not None} == showing - {"LIVE-GATE"}


def test_theorems_say_how_often_their_premise_was_met(report: Callable[[str], Path]) -> None:
    document = json.loads((report("case_b") / "report.json").read_text())
    evidence = {claim["id"]: claim["evidence"] for claim in document["claims"] if not claim["run"]}
    found = {name: (each["applies_to"], each["of"]) for name, each in evidence.items() if "of" in each}
    assert found["LIVE-GATE"] == (1, 1)
    assert found["SAFE-GATE"] == found["LIVE-WAIT"]
    assert found["SAFE-GATE"][0] < found["SAFE-GATE"][1]  # not where the intervention is on top: runs b and c
    assert 0 < found["SAFE-INV"][0] < found["SAFE-INV"][1]  # run b hits an obstacle
    assert "applies to 1 of 1 in these runs" in (report("case_b") / "report.html").read_text()
