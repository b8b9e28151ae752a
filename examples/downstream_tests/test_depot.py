"""Your own team: claims about its runs, proofs for its numbers, your own policy and claim."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from airground_drake import Finding, Motion, Observation, Policy, Trace, TraceClaim
from airground_drake.study.testing import ClaimError, assert_holds, assert_proved

DEPOT = Path(__file__).with_name("depot.yaml")


class Reckless(Policy):
    """Straight to the target, through all obstacles."""

    def propose(self, seen: Observation) -> Motion:
        return Motion.at_speed(np.array([seen.position, seen.target]), 2.0, start=seen.start)


class Lane(TraceClaim):
    """LANE: the second cart, which nothing is in the way of, stays where it is expected."""

    id = "LANE"
    statement = "cart2 stayed within 0.5 m of its lane, y = 6 m."
    formula = "max over t of |y(t) - 6 m| <= 0.5 m"
    method = "The rows of the trace; in between the motion is straight."
    equations = "none"
    assumptions = ("Between two rows every robot moves on a straight line.",)
    does_not_establish = "Anything about other runs."
    exercised_by = "samples"

    def check(self, trace: Trace) -> Finding:
        off = float(np.abs(trace.position("cart2")[:, 1] - 6.0).max())
        return Finding(
            "holds" if off <= 0.5 else "refuted",
            margin=0.5 - off,
            unit="m",
            quantity="0.5 m less the farthest from the lane",
            where={"robot": "cart2"},
            exercised=len(trace.t),
        )


def test_the_carts_keep_their_distances_and_arrive(airground_trace):
    assert_holds(airground_trace(DEPOT, "d"), "SAFE-TRACE", "LIVE-GOAL", "LIVE-HYP", Lane(), exercised=True)


def test_without_the_uav_the_pallet_stops_the_first_cart(airground_trace):
    with pytest.raises(ClaimError, match=r"LIVE-GOAL is refuted.*\n.*\n  found: cart1"):
        assert_holds(airground_trace(DEPOT, "a"), "LIVE-GOAL")


@pytest.mark.parametrize("seed", [1, 2])
def test_noise_changes_nothing(airground_trace, seed):
    noisy = airground_trace(DEPOT, "d", set={"seed": seed, "decision.noise_m_sqrt_s": 0.01})
    assert_holds(noisy, "SAFE-TRACE", "THR-TRIG", "LIVE-GOAL", exercised=True)


def test_no_policy_can_break_a_distance(airground_trace):
    policies = [{"name": f"{__name__}:Reckless"}]
    trace = airground_trace(DEPOT, "d", set={"intervention.policies": policies})
    assert not trace.proposals.empty
    assert_holds(trace, "SAFE-TRACE", "SAFE-HYP", exercised=True)


def test_triggers_never_pile_up_whatever_the_noise():
    assert_proved(DEPOT, "ZENO-PROOF")


def test_our_claim_can_fail(airground_trace):
    """A check that cannot fail is a defect."""
    trace = airground_trace(DEPOT, "d")
    elsewhere = replace(trace, states=trace.states.assign(**{"cart2.y_m": trace.column("cart2.y_m") + 1.0}))
    assert Lane().check(elsewhere).status == "refuted"
