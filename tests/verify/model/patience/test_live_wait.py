"""LIVE-WAIT and LIVE-GATE: proved for the shipped numbers; broken automata and weaker assumptions have no proof."""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np
import pytest
from verify.judging import Judged

from airground_drake.gatekeeper import certified
from airground_drake.gatekeeper.answer import Foreseen
from airground_drake.gatekeeper.certified import CertifiedGatekeepers
from airground_drake.gatekeeper.outcome import Outlook
from airground_drake.gatekeeper.patience import Patience
from airground_drake.gatekeeper.sample import Gatekeepers, Memory
from airground_drake.intervention.messages import ACCEPT
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.law import UgvLaw
from airground_drake.nsbc.motion import Motion
from airground_drake.nsbc.team import Team
from airground_drake.scenarios.load import load
from airground_drake.systems.controllers import UgvController
from airground_drake.verify.engines.prover import discharge
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.patience import attack, live_wait, mutants, tracking_runs
from airground_drake.verify.model.patience.live_gate import LiveGate
from airground_drake.verify.model.patience.live_wait import LiveWait
from airground_drake.verify.model.patience.relation import obligations, symbolic
from airground_drake.verify.model.patience.tracking_obligations import Tracking
from airground_drake.verify.model.patience.tracking_obligations import obligations as of_tracking

KINDS = [
    mutants.NeverExhausted, mutants.RestsAtOnce, mutants.Endless, mutants.DoesNotCount, mutants.NeverOver,
    mutants.NeverLate,
]  # fmt: skip
WEAKER = [{"disturbance": "2*g*r"}, {"contraction": "1"}, {"contraction": "1 - g*h/2"}, {"room": "v*h"}, {"room": "r"}]


@pytest.mark.parametrize("claim", [LiveWait(), LiveGate()])
def test_proved_for_the_shipped_numbers(judged: Judged, claim: LiveWait | LiveGate) -> None:
    finding = judged(claim, claim.inputs(load("case_b")[0]))
    assert finding.status == "proved", finding
    assert finding.margin is not None
    assert finding.margin > 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_a_broken_patience_has_no_proof(kind: type[Patience]) -> None:
    failing = [each for each in obligations(symbolic(kind)) if not each.certified()]
    assert "refuted" in {proof.status for proof in discharge(failing)}


@pytest.mark.parametrize("changes", WEAKER)
def test_weaker_assumptions_have_no_proof(changes: dict[str, str]) -> None:
    failing = [each for each in of_tracking(Tracking(**changes), Patience) if not each.certified()]
    assert "refuted" in {proof.status for proof in discharge(failing)}


def _judged(monkeypatch: pytest.MonkeyPatch) -> Finding:
    """LIVE-WAIT, its obligations taken for proved."""
    monkeypatch.setattr(live_wait, "finding", lambda *_, **__: Finding("proved"))
    monkeypatch.setattr(live_wait, "discharge", lambda *_: [])
    return live_wait.judge(Patience, LiveWait().inputs(load("case_b")[0]))


@pytest.mark.parametrize(("longest_s", "unexpected"), [(1e9, 0), (1.0, 1)])
def test_an_attack_that_gets_through_makes_the_claim_an_error(
    monkeypatch: pytest.MonkeyPatch, longest_s: float, unexpected: int
) -> None:
    """What runs is not what was read off: the relation would be worth nothing."""
    row = {
        "attack": "endless", "tries": 1, "longest_between_rests_s": longest_s, "longest_try_s": 1.0, "reasons": [],
        "unexpected": unexpected,
    }  # fmt: skip
    monkeypatch.setattr(live_wait, "attacks", lambda *_: [row])
    assert _judged(monkeypatch).status == "error"


TURNED = [
    ("standing != ACCEPT:  # withdrawn", "proposal is None:"),
    (
        "            turns[i] = self._patience.rested(turns[i], t)\n            if proposal is None:\n",
        "            if proposal is None:\n                turns[i] = self._patience.rested(turns[i], t)\n",
    ),
    ("proposal.cause in self._team.ugvs and proposal", "proposal"),
]
"""Ways to call `Patience` wrongly: text of the gatekeeper's module, and what takes its place."""


@pytest.mark.parametrize(("old", "new"), TURNED, ids=["replaced", "rests in silence only", "forged favours"])
def test_a_gatekeeper_that_miscounts_makes_the_claim_an_error(
    monkeypatch: pytest.MonkeyPatch, old: str, new: str
) -> None:
    source = inspect.getsource(certified)
    assert source.count(old) == 1
    broken: dict[str, Any] = {"__name__": certified.__name__}
    exec(compile(source.replace(old, new), certified.__file__, "exec"), broken)
    for method in ("sample", "_judge"):
        monkeypatch.setattr(CertifiedGatekeepers, method, getattr(broken["CertifiedGatekeepers"], method))
    assert _judged(monkeypatch).status == "error"


def test_a_gatekeeper_that_does_not_notice_withdrawals_makes_the_claim_an_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Gatekeepers, "idle", lambda _, proposals, *__: not any(proposals))
    assert _judged(monkeypatch).status == "error"


def test_attacks_use_all_tries_and_no_more() -> None:
    patience = Patience(most=2, rest=1.0, longest=2.0, lag=0.5, behind=0.5)
    rows: list[dict[str, Any]] = attack.attacks(patience, 0.1)
    assert {reason for row in rows for reason in row["reasons"]} >= {"over", "exhausted", "no_progress"}
    assert max(row["longest_between_rests_s"] for row in rows) == pytest.approx(4.0, abs=0.3)


def test_only_another_ugv_of_the_team_is_made_way_for_and_not_for_longer() -> None:
    patience = Patience(most=2, rest=1.0, longest=2.0, lag=0.5, behind=0.5)
    rows = {row["attack"]: row for row in attack.attacks(patience, 0.1)}
    assert rows["favours"]["reasons"] == ["exhausted", "kept", "makes_way", "over"]
    assert rows["favours"]["longest_between_rests_s"] <= patience.most * (patience.longest + 0.1)
    assert [rows[name]["reasons"] for name in attack.FORGED] == [["not_cheaper"]] * 2


def test_a_run_that_is_given_back_early_is_noticed() -> None:
    inputs = LiveGate().inputs(load("case_b")[0])
    numbers = [inputs[name] for name in ("tries", "rest_s", "longest_s", "lag_m", "behind_s")]
    assert not any(row["given_back"] for row in tracking_runs.runs(Patience(*numbers), inputs))
    assert all(row["given_back"] for row in tracking_runs.runs(mutants.LateAtOnce(*numbers), inputs))


@pytest.mark.parametrize(
    ("selection", "kept"), [([[1.0, 1.0, 0.0], [1.0, -1.0, 0.0]], True), ([[1.0, 0.0, 0.0]], False)]
)
def test_a_direction_that_is_left_to_the_own_task_may_cost_the_room(selection: list[list[float]], kept: bool) -> None:
    """Past the end of a wall with room, pushed to where the wall is: only Lambda is strong enough to hold the UGV."""
    patience, h, limit, d = Patience(5, 5.0, 30.0, 0.5, 2.0), 0.025, 5.0, 1.0
    room = limit * h + patience.lag + 0.1
    stands = np.column_stack([np.full(8, 8.0), d + room + 0.8 * np.arange(8.0), np.zeros(8)])
    team = Team(("ugv",), "uav", stands, d, 1.0, 1.0, np.array([limit, 1.0]))
    law = UgvLaw(Avoidance(1.0, h, 20.0), motion_gain=0.1, intervention_gain=1.0, intervention_on_top=False)
    preset = Motion(np.zeros(1), np.zeros((1, 3)))
    gatekeepers = tracking_runs.Stalled(team, law, [preset], Outlook(patience.longest), patience)
    controller, at = UgvController(team, law), np.zeros((1, 3))
    motion = Motion(np.array([0.0, 20.0]), np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]]))
    proposal = Proposal("way", 0.0, motion, selection=np.array(selection))
    memory, place, push = Memory.empty(1), np.zeros(3), np.array([0.0, 0.99 * patience.lag, 0.0])
    for k in range(round(motion.end / h) + 1):
        positions = np.stack([place, tracking_runs.FAR])
        if k % 2 == 0:
            memory = gatekeepers.sample(k * h, (proposal,), positions, np.zeros((2, 3)), memory)
        accepted = [proposal if memory.answers[0] == ACCEPT else None]
        velocity = controller.velocity(k * h, positions, at, at, accepted)[0]
        place = place + h * (velocity + push)
    first = memory.decisions[0].grounds
    assert isinstance(first, Foreseen)
    assert first.accept is not None
    along = first.accept.positions[: round(motion.end / h)]
    assert np.linalg.norm(along[:, None] - stands, axis=2).min() >= d + limit * h + patience.lag
    reasons = [decision.reason for decision in memory.decisions]
    assert ("no_progress" in reasons) != kept
    assert ("over" in reasons) == kept
