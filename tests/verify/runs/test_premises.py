"""How often the premises of theorems were met in runs."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from airground_drake.sim.trace import Trace
from airground_drake.verify import MODEL_CLAIMS, Finding
from airground_drake.verify.claims.live_gate import LiveGate

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
    proof = {"proof": "checked", "theorems": {}, "hypotheses": []}
    found = Finding("proved", evidence=proof, exercised=1)
    assert LiveGate().judge_runs(found, [(1, 2), None, (0, 3)]).evidence == proof | {"applies_to": 1, "of": 5}
    assert LiveGate().judge_runs(found, [None]).evidence is proof
    assert LiveGate().judge_runs(found, ["?"]).status == "error"


def test_a_run_whose_records_are_wrong_is_not_counted(run: Run) -> None:
    trace = run("case_a", "d")
    showing = {"SAFE-INV", "SAFE-GATE", "SAFE-DIST", "LIVE-GATE", "LIVE-WAIT", "THR-CHOICE"}
    assert {claim.id for claim in MODEL_CLAIMS if claim.judge_run(trace) is not None} == showing
    bare = Trace(trace.meta, trace.states, trace.samples, trace.decisions)
    assert {claim.id for claim in MODEL_CLAIMS if claim.judge_run(bare) is not None} == showing - {"LIVE-GATE"}
