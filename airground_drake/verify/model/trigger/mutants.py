"""Broken triggers, and experiments that must be refuted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from airground_drake.decision.trigger import Mode, Trigger, TriggerState
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.trigger.refined_paths import (
    experiment,
)
from airground_drake.verify.model.trigger.zeno_proof import prove
from airground_drake.verify.model.trigger.zeno_refine import judge_experiment


class _NoDwell(Trigger):
    """The dwell is over at once."""

    def dwell_end(self, state: TriggerState) -> float:
        return state.triggered_at


class _NoRefractory(Trigger):
    """A release always leads back to SUPERVISING."""

    def fall(self, state: TriggerState, t: float) -> TriggerState:
        return replace(super().fall(state, t), mode=Mode.SUPERVISING)


class _RecoversAtOnce(Trigger):
    """REFRACTORY is over as soon as it begins."""

    def dwell_end(self, state: TriggerState) -> float:
        return state.released_at if state.mode is Mode.REFRACTORY else super().dwell_end(state)


class _Forgets(Trigger):
    """A trigger at the end of REFRACTORY keeps the time of the one before."""

    def recover(self, state: TriggerState, t: float, x: float) -> TriggerState:
        return replace(super().recover(state, t, x), triggered_at=state.triggered_at)


def _mutant(kind: type[Trigger]) -> Callable[[dict[str, Any]], Finding]:
    return lambda inputs: prove(kind(inputs["zeta_m"], inputs["released_below_m"], inputs["dwell_s"]), inputs)


MUTANTS: dict[str, Callable[[dict[str, Any]], Finding]] = {
    "no dwell": _mutant(_NoDwell),
    "no refractory mode": _mutant(_NoRefractory),
    "recovers at once": _mutant(_RecoversAtOnce),
    "forgets a trigger after the dwell": _mutant(_Forgets),
    "no hysteresis, no dwell": lambda inputs: prove(Trigger.bare(inputs["zeta_m"]), inputs),
}
"""Broken triggers; each must be refuted by a run that is replayed on it."""

REFINED: dict[str, Callable[[dict[str, Any]], Finding]] = {
    "automaton with no hysteresis and no dwell": lambda inputs: judge_experiment(
        replace(experiment(inputs), trigger=Trigger.bare(inputs["zeta_m"]))
    ),
    "a smooth signal instead of noise": lambda inputs: judge_experiment(replace(experiment(inputs), smooth=True)),
}
"""Experiments that must be refuted: the first is not flat, the second does not diverge."""
