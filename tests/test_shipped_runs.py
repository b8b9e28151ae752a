"""Every run of the shipped scenarios, made once by Drake and once by the compiled loop, before all who judge runs."""

import pickle
from collections.abc import Callable
from typing import Any

import pytest
from oracles import faults_of
from verify.judging import findings_agreed

from airground_drake.report.difference import first_difference
from airground_drake.scenario.load import load
from airground_drake.scenario.shipped import shipped
from airground_drake.sim.batch.run import Batch, LeftToDrakeError
from airground_drake.sim.trace import Trace
from airground_drake.uav import coordinate
from airground_drake.ugv.routes.mixed_integer import MixedIntegerRoute
from airground_drake.verify import judge
from airground_drake.verify.array_judges import NoScreenError

LEFT = {"noisy_link": "a channel", "two_uavs": "several UAVs"}
"""Those whose runs the loop leaves to Drake, and why."""


def once(work: Callable[..., Any], own: int = 0) -> Callable[..., Any]:
    """A function whose result, or a method (`own=1`) whose result, is that of its first call with the same data."""
    known: dict[bytes, Any] = {}

    def remembered(*given: Any, **named: Any) -> Any:
        key = pickle.dumps((given[own:], named))
        if key not in known:
            known[key] = work(*given, **named)
        return known[key]

    return remembered


@pytest.fixture(autouse=True)
def _worked_out_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """What takes minutes is not worked out for the loop again if it asks the same as Drake's run did, to the bit."""
    monkeypatch.setattr(MixedIntegerRoute, "solve", once(MixedIntegerRoute.solve, own=1))
    monkeypatch.setattr(coordinate, "plan", once(coordinate.plan))


@pytest.mark.slow
@pytest.mark.parametrize("scenario", shipped())
def test_no_fault_the_declared_verdicts_and_the_same_run_and_findings_by_the_loop(
    run: Callable[[str, str], Trace], scenario: str
) -> None:
    for name in load(scenario).runs:
        trace = run(scenario, name)
        assert not faults_of(trace), name
        verdicts = judge(trace)
        for verdict in verdicts:
            assert verdict.as_expected is not False, (name, verdict.claim.id, verdict)
        if scenario in LEFT:
            continue
        loop = Batch(load(scenario), name)
        made = loop.made()
        assert first_difference(trace, made.trace()) is None, name
        try:
            findings_agreed(loop, made, trace, verdicts)
        except NoScreenError:
            continue


@pytest.mark.parametrize("name", LEFT)
def test_what_the_loop_cannot_make_is_named(name: str) -> None:
    with pytest.raises(LeftToDrakeError, match=LEFT[name]):
        Batch(load(name), "d")
