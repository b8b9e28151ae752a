"""Broken triggers, and experiments that must be refuted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any
from unittest import mock

import numpy as np

from airground_drake.arrays import Array
from airground_drake.decision.excursion import task_errors
from airground_drake.decision.trigger import Mode, Trigger, TriggerState
from airground_drake.systems import decision
from airground_drake.verify.claim import Mutant
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.trigger.refined_paths import experiment
from airground_drake.verify.model.trigger.thr_iso import judge
from airground_drake.verify.model.trigger.zeno_proof import prove
from airground_drake.verify.model.trigger.zeno_refine import judge_experiment


class NoDwell(Trigger):
    """The dwell is over at once."""

    def dwell_end(self, state: TriggerState) -> float:
        """The trigger itself."""
        return state.triggered_at


class NoRefractory(Trigger):
    """A release always leads back to SUPERVISING."""

    def fall(self, state: TriggerState, t: float) -> TriggerState:
        """SUPERVISING, whatever the dwell."""
        return replace(super().fall(state, t), mode=Mode.SUPERVISING)


class RecoversAtOnce(Trigger):
    """REFRACTORY is over as soon as it begins."""

    def dwell_end(self, state: TriggerState) -> float:
        """The release, once released."""
        return state.released_at if state.mode is Mode.REFRACTORY else super().dwell_end(state)


class Forgets(Trigger):
    """A trigger at the end of REFRACTORY keeps the time of the one before."""

    def recover(self, state: TriggerState, t: float, x: float) -> TriggerState:
        """As always, but for the time of the trigger."""
        return replace(super().recover(state, t, x), triggered_at=state.triggered_at)


def _mutant(kind: type[Trigger]) -> Callable[[dict[str, Any]], Finding]:
    return lambda inputs: prove(kind(inputs["zeta_m"], inputs["released_below_m"], inputs["dwell_s"]), inputs)


def _bare_is_not_flat(inputs: dict[str, Any]) -> Finding:
    return judge_experiment(replace(experiment(inputs), trigger=Trigger.bare(inputs["zeta_m"])))


def _smooth_does_not_diverge(inputs: dict[str, Any]) -> Finding:
    return judge_experiment(replace(experiment(inputs), smooth=True))


def _ends_only(inputs: dict[str, Any]) -> Finding:
    """The running system looks at the ends of its steps only."""

    def of_ends(begun: Array, now: Array) -> tuple[Array, Array]:
        x = [np.linalg.norm(parts[:, :3], axis=1) + parts[:, 3] for parts in map(task_errors, (begun, now))]
        return np.minimum(*x), np.maximum(*x)

    with mock.patch.object(decision, "excursions", of_ends):
        return judge(Trigger(inputs["zeta_m"], inputs["released_below_m"], inputs["dwell_s"]))


MUTANTS: tuple[Mutant, ...] = (
    Mutant("THR-ISO", "the running system looks at the ends of steps only", _ends_only),
    Mutant("ZENO-PROOF", "no dwell", _mutant(NoDwell)),
    Mutant("ZENO-PROOF", "no refractory mode", _mutant(NoRefractory)),
    Mutant("ZENO-PROOF", "recovers at once", _mutant(RecoversAtOnce)),
    Mutant("ZENO-PROOF", "forgets a trigger after the dwell", _mutant(Forgets)),
    Mutant(
        "ZENO-PROOF", "no hysteresis, no dwell", lambda inputs: prove(Trigger.bare(inputs["zeta_m"]), inputs),
    ),
    Mutant("ZENO-REFINE", "automaton with no hysteresis and no dwell", _bare_is_not_flat),
    Mutant("ZENO-REFINE", "a smooth signal instead of noise", _smooth_does_not_diverge),
)  # fmt: skip
"""Broken triggers, each to be refuted by a run that is replayed on it; and experiments."""
