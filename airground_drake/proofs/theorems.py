"""What each theorem says, what it takes, and where a report or a test checks that.

The theorems themselves are in the `.v` files of this folder, for the proof checker Coq.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class Theorem:
    """A theorem of the `.v` files.

    Attributes:
        name: file and name in Coq, such as "Safety.safe_always".
        statement: what it says, in one plain sentence.
        equation: number of the paper's equation that it is about, or "ours".
        hypotheses: what it takes, a sentence each.
        checked_where: claims (such as "SAFE-HYP") and tests that check the hypotheses.
    """

    name: str
    statement: str
    equation: str
    hypotheses: tuple[str, ...]
    checked_where: tuple[str, ...]


_STABLE = "The product of gain and control period, A h, is at most 1: min(A h, 1) stands for it (Safety.capped)."
_SHARES = "The shares that the two robots of a pair take add up to 1."
_HELD = "Between two samples every body moves on a straight line at its velocity, up to `wander`."
_PLANAR = "A body that cannot leave the plane has no velocity out of it."
_LAW = "At every sample each pair meets its two inequalities, or is too far apart to matter."
_LAYER = (_STABLE, _SHARES, _HELD, _PLANAR, _LAW)
_RUN_AND_SCENARIO = ("SAFE-HYP", "SAFE-INV")
_COSTS = ("drift, noise, c1 and c2 are positive.",)

_ALL = (
    Theorem(
        "Safety.lemma",
        "After a time s on a straight line the distance is at least what it was plus s times its rate of change.",
        "ours",
        ("The two bodies are not at the same point.",),
        ("SAFE-LEMMA",),
    ),
    Theorem(
        "Safety.lemma_in_the_plane",
        "The lemma for two coordinates.",
        "ours",
        ("The two bodies are not at the same point.",),
        ("SAFE-LEMMA",),
    ),
    Theorem(
        "Safety.safe_always",
        "Any number of bodies whose pairs start at their safe distances keep them at all times.",
        "(7)-(8), (11)",
        (*_LAYER, "The pair starts at its safe distance or farther."),
        _RUN_AND_SCENARIO,
    ),
    Theorem(
        "Safety.recovers",
        "What a pair lacks of its safe distance shrinks by the factor 1 - A h in each period and never grows.",
        "(7)-(8), (11)",
        _LAYER,
        _RUN_AND_SCENARIO,
    ),
    Theorem(
        "Safety.disturbed",
        "A pair whose radial speed falls short by at most e keeps d - e/A at all times.",
        "(7)-(8), (11)",
        (*_LAYER, "A is positive.", "The pair starts at d - e/A or farther."),
        (*_RUN_AND_SCENARIO, "SAFE-DIST"),
    ),
    Theorem(
        "Safety.obstacle",
        "A body that is held still and takes no share meets its inequality.",
        "(7), (11)",
        ("The body has velocity 0, share 0 and slack 0.",),
        ("SAFE-INV",),
    ),
    Theorem(
        "Safety.unseen",
        "A pair farther apart than the sensing range needs no inequality until the next sample.",
        "ours",
        (
            "The sensing range is at least d + c h.",
            "c is at least the sum of the two speeds.",
        ),
        _RUN_AND_SCENARIO,
    ),
    Theorem(
        "Safety.standing",
        "At its safe distance or farther a body that stands still meets its inequality.",
        "ours",
        ("A h is at most 1.", "The share is not negative."),
        _RUN_AND_SCENARIO,
    ),
    Theorem(
        "Safety.capped",
        "A gain with A h > 1 asks for more than min(A, 1/h), so that the theorems cover it with min(A h, 1).",
        "ours",
        ("h is positive.",),
        _RUN_AND_SCENARIO,
    ),
    Theorem(
        "Gate.scaled_back",
        "From a safe state any command that is scaled back far enough meets all inequalities.",
        "(20)",
        (
            "All bounds are at most 0 (a safe state).",
            "The factor c is at most bound/rate for every inequality that the command misses.",
        ),
        ("SAFE-GATE",),
    ),
    Theorem(
        "Gate.no_faster",
        "Where standing still is allowed, the nearest allowed velocity is no faster than the one asked for.",
        "ours",
        ("The velocity is the projection onto a convex set that contains 0.",),
        ("SAFE-GATE",),
    ),
    Theorem(
        "Gate.deficit_closed_form",
        "After k disturbed periods inside the safe distance d - (e/A + (1 - A h)^k (f - e/A)) is left.",
        "ours",
        ("A is positive.", "f is what was missing at the start."),
        ("SAFE-DIST",),
    ),
    Theorem(
        "Gate.common_direction",
        "If one direction leads away from every near point, one velocity meets all inequalities at once.",
        "ours",
        ("Every distance is at least d - e/A.", "There is a unit vector g with n.g >= m > 0 for every near point."),
        ("SAFE-DIST",),
    ),
    Theorem(
        "Gate.overhead",
        "Straight over a UGV, which cannot move along n, the UAV's half of the inequality keeps d - W/A alone.",
        "ours",
        ("A is positive, and A h is at most 1.", "The UAV is disturbed by at most W/2."),
        ("SAFE-DIST",),
    ),
    Theorem(
        "Trigger.dwell_apart",
        "Triggers i < j of a UGV are at least (j - i) dwell times apart, whatever the decision variable does.",
        "(20)",
        ("Time does not run backwards.", "The automaton makes the transitions of the theorem's model."),
        ("ZENO-PROOF", "ZENO-TRACE"),
    ),
    Theorem(
        "Trigger.at_most",
        "In a time T there are at most floor(T/dwell) + 1 triggers.",
        "(20)",
        ("The dwell time is positive.", "The hypotheses of Trigger.dwell_apart."),
        ("ZENO-PROOF", "ZENO-TRACE"),
    ),
    Theorem(
        "Isolation.largest_at_an_end",
        "Between two updates the decision variable is nowhere above the larger of its ends.",
        "(15), (20)",
        ("Between two updates error and noise are linear in time.",),
        ("THR-ISO",),
    ),
    Theorem(
        "Isolation.nowhere_below",
        "Between two updates the decision variable is nowhere below p w, p the distance of the error's line from 0.",
        "(15), (20)",
        ("Between two updates error and noise are linear in time.", "w^2 + k^2 = 1, k the rate of the noise."),
        ("THR-ISO",),
    ),
    Theorem(
        "Isolation.attained",
        "The decision variable attains p w at one point of the line.",
        "(15), (20)",
        ("The hypotheses of Isolation.nowhere_below.", "w is positive."),
        ("THR-ISO",),
    ),
    Theorem(
        "Patience.bounded",
        "Between two rests no UAV keeps a UGV from its own task longer than tries (longest + h).",
        "(20)",
        ("The gatekeeper is sampled every period h.", "It makes the transitions of the theorem's model."),
        ("LIVE-WAIT",),
    ),
    Theorem(
        "Patience.over_in_time",
        "An accepted intervention is over after `longest` and a sampling period at the latest.",
        "(20)",
        ("The hypotheses of Patience.bounded.",),
        ("LIVE-GATE", "LIVE-WAIT"),
    ),
    Theorem(
        "Patience.kept",
        "Unless a new obstacle is sensed, an accepted intervention is kept until its time is over, and not longer.",
        "(20)",
        ("The UAV has not withdrawn it.", "The gatekeeper makes the transitions of the theorem's model."),
        ("LIVE-GATE",),
    ),
    Theorem(
        "Threshold.increasing",
        "The left side of the threshold equation increases strictly.",
        "(19)",
        _COSTS,
        ("THR-ROOT",),
    ),
    Theorem(
        "Threshold.exactly_one",
        "The threshold equation with c2/c1 on the right has exactly one root, and it is positive.",
        "(19)",
        _COSTS,
        ("THR-ROOT",),
    ),
    Theorem(
        "Threshold.enclosed",
        "Two points at which the equation has different signs enclose its root.",
        "(19)",
        (*_COSTS, "The left side is below c2/c1 at the lower point and above it at the upper one."),
        ("THR-ROOT",),
    ),
    Theorem(
        "Threshold.least",
        "The Bayes risk is strictly least at the root.",
        "(16)-(19)",
        (*_COSTS, "There is no initial deviation."),
        ("THR-OPT",),
    ),
    Theorem(
        "Threshold.printed_is_worse",
        "The root of the printed equation, with c1/c2, has a higher risk.",
        "(19)",
        (*_COSTS, "c1 and c2 differ."),
        ("THR-OPT",),
    ),
    Theorem(
        "Threshold.not_least_with_deviation",
        "With any initial deviation the risk is lower at some other threshold than at the root.",
        "(17)-(19)",
        (*_COSTS, "The deviation is not 0 and smaller than the root."),
        ("THR-OPT",),
    ),
    Theorem(
        "Threshold.at_most_two_drifts",
        "One threshold is the root of the equation for at most two drifts.",
        "(19)",
        ("noise and threshold are positive.",),
        ("THR-OPT",),
    ),
    Theorem(
        "Run.nearby",
        "Positions within r and q of those of the run lose at most r + q of a distance.",
        "ours",
        ("Recorded positions differ from the exported ones by their rounding.",),
        ("airground prove DIR",),
    ),
    Theorem(
        "DistanceChecker.sound",
        "Two bodies of a recorded run that the checker accepts keep their distance at all times of the run.",
        "(7)-(8), (11)",
        (
            "The integers in the file are the recorded positions, rounded to 2^-60 m.",
            "Between two rows bodies move on straight lines.",
        ),
        ("airground prove DIR", "SAFE-TRACE"),
    ),
    Theorem(
        "LawChecker.sound",
        "Two bodies of a recorded run that the checker accepts obey the avoidance law at all rows, up to e per step.",
        "(7)-(8), (11)",
        ("The hypotheses of DistanceChecker.sound.",),
        ("airground prove DIR", "SAFE-HYP"),
    ),
    Theorem(
        "LawChecker.law_keeps",
        "Two bodies that obey the law up to e per step keep d - e/(A h) at all times of the run.",
        "(7)-(8), (11)",
        ("The hypotheses of LawChecker.sound.", "The pair starts at d - e/(A h) or farther."),
        ("airground prove DIR", "SAFE-HYP"),
    ),
    Theorem(
        "Example.can_be_met",
        "A moving robot meets all hypotheses of Safety.safe_always: they do not contradict each other.",
        "ours",
        (),
        (),
    ),
)

THEOREMS: Mapping[str, Theorem] = MappingProxyType({theorem.name: theorem for theorem in _ALL})
"""All theorems by name."""
