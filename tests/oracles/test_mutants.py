"""Faults of the running code: the oracle about it notices the run that it makes, and LIVE-HYP what it must."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from builders.misbuilt import Patch
from verify.judging import decided

from airground_drake.model.geometry.outline import moved
from airground_drake.scenario.load import load
from airground_drake.sim import components
from airground_drake.sim.simulation import simulate
from airground_drake.ugv import outcome, problem
from airground_drake.ugv.patience import Patience
from airground_drake.ugv.rollout import ACCEPTED, REFUSED, ClosedLoop, closed_loop
from oracles import ORACLES, Fault
from oracles.mutants import (
    FAR_UAV,
    PATIENCE,
    LateByASample,
    NoRest,
    executed,
    formation_gain,
    gain,
    moved_map,
    no_feed_forward,
    no_limit_of,
    selection_ignored,
    sent_with,
    ugv2_avoids_nothing,
    with_law,
)

pytestmark = pytest.mark.slow  # each simulates a run of its own


def found(oracle: str, run: str = "d", scenario: str = "case_b", given: Sequence[str] = ()) -> list[Fault]:
    return ORACLES[oracle](simulate(load(scenario, list(given)), run))


COMMANDS: dict[str, tuple[Patch, str, list[str], str]] = {
    "intervention gain": (gain("intervention_gain", 1.2), "d", [], "ugv"),
    "intervention gain, on top": (gain("intervention_gain", 1.2), "c", [], "ugv"),
    "intervention gain, no gatekeeper": (gain("intervention_gain", 1.2), "b", [], "ugv"),
    "motion gain off by 1 %": (gain("motion_gain", 0.99), "d", [], "ugv"),
    "formation gain": (formation_gain, "d", [], "uav"),
    "UGVs' velocity not fed forward": (no_feed_forward, "d", [FAR_UAV], "uav"),
    "ugv2 avoids nothing": (ugv2_avoids_nothing, "d", [], "ugv2"),
    "selection ignored": (selection_ignored, "d", [], "ugv"),
    "no speed limit": (no_limit_of("ugv"), "d", ["ugvs.ugv1.max_speed_m_s=2.0"], "ugv1"),
    "no speed limit of the UAV": (no_limit_of("uav"), "d", [FAR_UAV], "uav"),
}  # fmt: skip


@pytest.mark.parametrize("name", COMMANDS)
def test_other_commands_are_noticed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    patch, run, given, robot = COMMANDS[name]
    patch(monkeypatch)
    faults = found("commands", run, "case_a" if patch is selection_ignored else "case_b", given)
    assert any(fault.robot.startswith(robot) for fault in faults), faults


PROTOCOL: dict[str, tuple[Patch, str, str]] = {
    "executed late": (executed(lambda before, now: before[0]), "protocol", "executes another proposal"),
    "executed for ever": (
        executed(lambda before, now: [a or b for a, b in zip(now, before[1], strict=True)]),
        "protocol", "executes another proposal",
    ),
    "map told wrongly": (sent_with(moved_map), "communication", "map of a proposal"),
}  # fmt: skip


@pytest.mark.parametrize("name", PROTOCOL)
def test_another_protocol_is_noticed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    patch, oracle, what = PROTOCOL[name]
    patch(monkeypatch)
    assert any(fault.what.startswith(what) for fault in found(oracle))


PREDICTIONS: dict[str, Callable[[ClosedLoop], ClosedLoop]] = {
    "motion gain": with_law("motion_gain", lambda v: 1.1 * v),
    "intervention gain": with_law("intervention_gain", lambda v: 1.1 * v),
    "priorities": with_law("intervention_on_top", lambda v: not v),
    "speed limit": lambda loop: loop._replace(max_speed=0.5 * loop.max_speed),
    "no neighbours": lambda loop: loop._replace(shares=0.0 * loop.shares, distances=0.0 * loop.distances),
    "wrong neighbours": lambda loop: loop._replace(still=moved(loop.still, np.full(3, 0.1)), places=loop.places + 0.1),
    "late": lambda loop: loop._replace(wanted=np.concatenate([loop.wanted[:1], loop.wanted[:-1]])),
}


@pytest.mark.parametrize(
    ("run", "name"), [*(("c", name) for name in PREDICTIONS), ("d", "no neighbours"), ("d", "late")]
)
def test_wrong_predictions_are_noticed(run: str, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Until shortly after the first acceptance. What case B's outcomes under (d) rest on is not the gains."""
    for module in (problem, outcome):
        monkeypatch.setattr(module, "closed_loop", lambda *given: PREDICTIONS[name](closed_loop(*given)))
    assert found("predictions", run, given=["duration_s=14.0", "reproduction=[]"])


def test_exchanged_predictions_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, other in (("ACCEPTED", REFUSED), ("REFUSED", ACCEPTED)):
        monkeypatch.setattr(problem, name, other)
    assert found("predictions", "c", given=["duration_s=14.0", "reproduction=[]"])


@pytest.mark.parametrize(("kind", "what"), [(NoRest, ""), (LateByASample, "longer from its own task than allowed")])
def test_a_patience_that_is_wired_wrongly_is_noticed(
    kind: type[Patience], what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(components, "Patience", kind)
    trace = simulate(load("case_b", PATIENCE), "d")
    assert ORACLES["progress"](trace)
    finding = decided("LIVE-HYP", trace)
    assert (finding.status == "refuted") == bool(what), finding
    assert what in str(finding.counterexample or "")
