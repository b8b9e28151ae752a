"""LIVE-GATE on the running gatekeeper and control law: a UGV that is pushed aside keeps to what it has accepted."""

import numpy as np
from builders.worlds import world

from airground_drake.model.geometry.motion import Motion
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.scenario.load import load
from airground_drake.sim.blocks.controllers import UgvController
from airground_drake.uav.messages import ACCEPT
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.mpc_gatekeeper import GatekeeperState, Inputs
from airground_drake.ugv.outcome import Outcome, Outlook
from airground_drake.ugv.outcome_gatekeeper import OutcomeGatekeepers
from airground_drake.ugv.patience import Commitment, Patience
from airground_drake.ugv.rollout import View

PUSHED_M = 0.5
"""How far a UGV is pushed aside, about."""
LEGS = 3
"""Of each way; corners lie on control samples, so that the rates of motion and sampled motion are the same."""
FAR = np.array([0.0, -1e3, 0.0])
CASE_B = load("case_b")


class Stalled(OutcomeGatekeepers):
    """Takes its own way for stalled, so that every proposal is worth it; predicts acceptance as always."""

    def foresee(self, seen: View, law: UgvLaw, proposal: Proposal) -> tuple[Outcome, Outcome]:
        """Refusing stalls; the way of accepting is the real one."""
        _, accept = super().foresee(seen, law, proposal)
        return Outcome(accept.positions, True, 1.0, 1.0), Outcome(accept.positions, False, 0.0, 0.0)


def drive(rng: np.random.Generator, patience: Patience) -> tuple[bool, float, float]:
    """Whether a way was given back before its time, how far it was left, m, and when it was over after its end, s."""
    control, every = CASE_B.control, round(CASE_B.gatekeeper.period_s / CASE_B.control.period_s)
    h, gain, d = control.period_s, control.intervention_gain_1_s, CASE_B.safe_distance.obstacle_m
    limit = max(ugv.max_speed_m_s for ugv in CASE_B.ugvs.values())
    speed = 0.5 * min(limit, 2.0) - min(0.25 * limit, 0.5) * float(rng.random())
    heading = np.cumsum(rng.uniform(-1.0, 1.0, LEGS))
    count = max(1, round(min(3.0, 0.3 * patience.longest) / h))
    legs = speed * h * count * np.column_stack([np.cos(heading), np.sin(heading), np.zeros(LEGS)])
    corners = np.concatenate([np.zeros((1, 3)), np.cumsum(legs, axis=0)])
    motion = Motion(h * count * np.arange(LEGS + 1.0), corners)
    room = limit * h + PUSHED_M + d + 0.1
    across = np.array([-np.sin(heading[1]), np.cos(heading[1]), 0.0])
    stands = corners[1] + legs[1] / 2.0 + across * (room + np.linalg.norm(legs, axis=1).sum())
    around = world(("ugv",), stands[None], d, 1.0, 1.0, max_speed=[limit, 1.0])
    avoidance = Avoidance(control.avoidance_gain_1_s, h, control.sensing_range_m)
    law = UgvLaw(avoidance, control.motion_gain_1_s, gain, intervention_on_top=False)
    preset = Motion(np.zeros(1), np.zeros((1, 3)))
    gatekeepers = Stalled(around, law, [preset], Outlook(patience.longest), patience)
    controller = UgvController(around, law)
    memory, proposal = GatekeeperState.empty(1), Proposal("way", 0.0, motion)
    place, push, largest, over = np.zeros(3), np.zeros(3), 0.0, -1.0
    for k in range(count * LEGS + 2 * every + 1):
        t = k * h
        if k % every == 0:
            memory = gatekeepers.sample(Inputs(t, (proposal,), np.stack([place, FAR]), np.zeros((2, 3)), law), memory)
            if not memory.decisions[-1].accepted:
                over = t
                break
            largest = max(largest, float(np.linalg.norm(place - motion.at(t)[0])))
        accepted = [proposal if memory.answers[0] == ACCEPT else None]
        at = np.zeros((1, 3))
        velocity = controller.velocity(t, np.stack([place, FAR]), at, at, accepted)[0]
        if k % 40 == 0:  # pushed to one side for a while, as far as it may be
            angle = rng.uniform(-np.pi, np.pi)
            within = min(gain * PUSHED_M, 0.9 * (limit - speed))  # the speed limit is not to be reached
            push = 0.99 * within * np.array([np.cos(angle), np.sin(angle), 0.0])
        place = place + h * (velocity + push)
    ended = over >= motion.end - 1e-9 and memory.decisions[-1].reason == "over"
    return not ended, largest, over - motion.end


def runs(kind: type[Patience]) -> list[tuple[bool, float, float]]:
    gate = CASE_B.gatekeeper
    patience = kind(gate.tries, gate.rest_s, gate.longest_s)
    return [drive(np.random.default_rng([20261122, k]), patience) for k in range(4)]


def test_nothing_is_given_back_before_its_time() -> None:
    for given_back, largest, over_after_s in runs(Patience):
        assert not given_back
        assert largest > 0.5 * PUSHED_M
        assert over_after_s <= CASE_B.gatekeeper.period_s + 1e-9


class OverAtOnce(Patience):
    def over(self, now: Commitment, t: float) -> bool:
        return t > now.since


def test_a_run_that_is_given_back_early_is_noticed() -> None:
    assert all(given_back for given_back, *_ in runs(OverAtOnce))
