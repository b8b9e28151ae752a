"""The running gatekeeper and control law on random ways with room, disturbed by the most that is allowed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from airground_drake.components import make_patience
from airground_drake.gatekeeper.answer import Foreseen
from airground_drake.gatekeeper.certified import CertifiedGatekeepers
from airground_drake.gatekeeper.outcome import Outcome, Outlook
from airground_drake.gatekeeper.patience import Patience
from airground_drake.gatekeeper.sample import Memory, Situation
from airground_drake.intervention.messages import ACCEPT
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.law import UgvLaw
from airground_drake.nsbc.motion import Motion
from airground_drake.nsbc.team import Team
from airground_drake.scenarios.load import load
from airground_drake.systems.controllers import UgvController

LEGS = 3
"""Of each way; corners lie on control samples, so that the rates of motion and sampled motion are the same."""
FAR = np.array([0.0, -1e3, 0.0])


class Stalled(CertifiedGatekeepers):
    """Takes its own way for stalled, so that every proposal is worth it; predicts acceptance as always."""

    def foresee(self, seen: Situation, i: int, proposal: Proposal) -> tuple[Outcome, Outcome]:
        """Refusing stalls; the way of accepting is the real one."""
        _, accept = super().foresee(seen, i, proposal)
        return Outcome(accept.positions, True, 1.0, 1.0), Outcome(accept.positions, False, 0.0, 0.0)


def run(rng: np.random.Generator, patience: Patience, inputs: dict[str, Any]) -> dict[str, Any]:
    """What came of a run: `samples`, `given_back` (before its time), `largest_excess_m`, `over_after_s`."""
    h, gain, limit = inputs["control_period_s"], inputs["intervention_gain_1_s"], inputs["max_speed_m_s"]
    d, every = inputs["obstacle_m"], round(inputs["period_s"] / inputs["control_period_s"])
    speed = 0.5 * min(limit, 2.0) - min(0.25 * limit, 0.5) * float(rng.random())
    heading = np.cumsum(rng.uniform(-1.0, 1.0, LEGS))
    count = max(1, round(min(3.0, 0.3 * patience.longest) / h))
    legs = speed * h * count * np.column_stack([np.cos(heading), np.sin(heading), np.zeros(LEGS)])
    corners = np.concatenate([np.zeros((1, 3)), np.cumsum(legs, axis=0)])
    motion = Motion(h * count * np.arange(LEGS + 1.0), corners)
    room = limit * h + patience.lag + d + 0.1
    across = np.array([-np.sin(heading[1]), np.cos(heading[1]), 0.0])
    stands = corners[1] + legs[1] / 2.0 + across * (room + np.linalg.norm(legs, axis=1).sum())
    team = Team(("ugv",), "uav", stands[None], d, 1.0, 1.0, np.array([limit, 1.0]))
    avoidance = Avoidance(inputs["avoidance_gain_1_s"], h, inputs["sensing_range_m"])
    law = UgvLaw(avoidance, inputs["motion_gain_1_s"], gain, intervention_on_top=False)
    preset = Motion(np.zeros(1), np.zeros((1, 3)))
    gatekeepers = Stalled(team, law, [preset], Outlook(patience.longest), patience)
    controller = UgvController(team, law)
    memory, proposal = Memory.empty(1), Proposal("way", 0.0, motion)
    place, excess, samples, over = np.zeros(3), 0.0, 0, -1.0
    push = np.zeros(3)
    for k in range(count * LEGS + 2 * every + 1):
        t = k * h
        if k % every == 0:
            memory = gatekeepers.sample(t, (proposal,), np.stack([place, FAR]), np.zeros((2, 3)), memory)
            last = memory.decisions[-1]
            samples += 1
            if not last.accepted:
                over = t
                break
            assert isinstance(last.grounds, Foreseen)
            excess = max(excess, last.grounds.lag - last.grounds.predicted_lag)
        accepted = [proposal if memory.answers[0] == ACCEPT else None]
        at = np.zeros((1, 3))
        velocity = controller.velocity(t, np.stack([place, FAR]), at, at, accepted)[0]
        if k % 40 == 0:  # pushed to one side for a while, as far as it may be
            angle = rng.uniform(-np.pi, np.pi)
            within = min(gain * patience.lag, 0.9 * (limit - speed))  # the speed limit is not to be reached
            push = 0.99 * within * np.array([np.cos(angle), np.sin(angle), 0.0])
        place = place + h * (velocity + push)
    ended = over >= motion.end - 1e-9 and memory.decisions[-1].reason == "over"
    return {"samples": samples, "given_back": not ended, "largest_excess_m": excess, "over_after_s": over}


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", ["case_a", "case_b", "warehouse"])
def test_what_is_disturbed_by_the_most_that_is_allowed_is_never_given_back(name: str, seed: int) -> None:
    scenario = load(name)[0]
    control, ugvs = scenario.control, scenario.ugvs.values()
    widest = max(ugv.radius_m for ugv in ugvs) + max(each.radius_m for each in scenario.obstacles.values())
    inputs = {
        "intervention_gain_1_s": control.intervention_gain_1_s,
        "motion_gain_1_s": control.motion_gain_1_s,
        "avoidance_gain_1_s": control.avoidance_gain_1_s,
        "control_period_s": control.period_s,
        "sensing_range_m": control.sensing_range_m,
        "period_s": scenario.gatekeeper.period_s,
        "max_speed_m_s": max(ugv.max_speed_m_s for ugv in ugvs),
        "obstacle_m": scenario.safe_distance.obstacle_m + widest,
    }
    patience = make_patience(scenario)
    found = run(np.random.default_rng([20261122, seed]), patience, inputs)
    assert not found["given_back"], found
    assert found["samples"] > 10
    assert found["largest_excess_m"] <= patience.lag
