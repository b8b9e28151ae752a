"""What each theorem says, its hypotheses, and where a report or a test checks them.

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
        equation: number of the paper's equation that it is about, or "ours".
        checked_where: claims (such as "SAFE-HYP") and commands that check the hypotheses.
        statement: what it says, in one plain sentence.
        hypotheses: a sentence each.
    """

    name: str
    equation: str
    checked_where: tuple[str, ...]
    statement: str
    hypotheses: tuple[str, ...] = ()


_STABLE = "The product of gain and control period, A h, is at most 1: min(A h, 1) stands for it (Safety.capped)."
_SHARES = "The shares that the two robots of a pair take add up to 1."
_HELD = "Between two samples every body moves on a straight line at its velocity, up to `wander`."
_PLANAR = "A body that cannot leave the plane has no velocity out of it."
_LAW = "At every sample each pair meets its two inequalities, or is too far apart to matter."
_CONVEX = "Distances are signed distances to convex sets that do not turn, such as points, balls and polygons (Convex)."
_LAYER = (_STABLE, _SHARES, _HELD, _PLANAR, _LAW, _CONVEX)
_AROUND = ("The signed distance is that from a nearest point, or inside minus the depth (Convex.signed_distance).",)
_PERIOD = (
    "In the period the robot moves away from the set at min(r, (L - D)/h) or faster; r is the speed of its retreat.",
    "r is not negative.",
    _CONVEX,
)
_RUN_AND_SCENARIO = ("SAFE-HYP", "SAFE-INV")
_COSTS = ("drift, noise, c1 and c2 are positive.",)

_ALL = (
    Theorem(
        "Safety.lemma", "ours", ("SAFE-INV",),
        "After a time s on a straight line a distance is at least what it was plus s times its rate of change.",
        ("The distance is a convex function of the relative position, and n a unit subgradient of it.",),
    ),
    Theorem(
        "Safety.lemma_in_the_plane", "ours", ("SAFE-INV",),
        "The lemma for the distance of two points in the plane.",
        ("The two bodies are not at the same point.",),
    ),
    Theorem(
        "Safety.safe_always", "(7)-(8), (11)", _RUN_AND_SCENARIO,
        "Any number of bodies whose pairs start at their safe distances keep them at all times.",
        (*_LAYER, "The pair starts at its safe distance or farther."),
    ),
    Theorem(
        "Safety.recovers", "(7)-(8), (11)", _RUN_AND_SCENARIO,
        "What a pair lacks of its safe distance shrinks by the factor 1 - A h in each period and never grows.",
        _LAYER,
    ),
    Theorem(
        "Safety.disturbed", "(7)-(8), (11)", (*_RUN_AND_SCENARIO, "SAFE-DIST"),
        "A pair whose radial speed falls short by at most e keeps d - e/A at all times.",
        (*_LAYER, "A is positive.", "The pair starts at d - e/A or farther."),
    ),
    Theorem(
        "Safety.obstacle", "(7), (11)", ("SAFE-INV",),
        "A body that is held still and takes no share meets its inequality.",
        ("The body has velocity 0, share 0 and slack 0.",),
    ),
    Theorem(
        "Safety.unseen", "ours", _RUN_AND_SCENARIO,
        "A pair farther apart than the sensing range needs no inequality until the next sample.",
        ("The sensing range is at least d + c h.", "c is at least the sum of the two speeds."),
    ),
    Theorem(
        "Safety.standing", "ours", _RUN_AND_SCENARIO,
        "At its safe distance or farther a body that stands still meets its inequality.",
        ("A h is at most 1.", "The share is not negative."),
    ),
    Theorem(
        "Safety.capped", "ours", _RUN_AND_SCENARIO,
        "A gain with A h > 1 asks for more than min(A, 1/h), so that the theorems cover it with min(A h, 1).",
        ("h is positive.",),
    ),
    Theorem(
        "Convex.leads_away", "ours", ("SAFE-INV",),
        "The signed distance to a convex set is convex, and the unit vector away from the set is a subgradient of it.",
        _AROUND,
    ),
    Theorem(
        "Convex.ball", "ours", ("SAFE-INV",),
        "The distance from a ball or point is convex, and the unit vector away from its centre is a subgradient of it.",
        ("The vector points away from the centre.",),
    ),
    Theorem(
        "Convex.nearest_point", "ours", ("SAFE-INV",),
        "Outside a convex set that is the direction from its nearest point.",
        ("The set is convex.", "No point of it is nearer, and the point is not in it."),
    ),
    Theorem(
        "Convex.nearest_edge", "ours", ("SAFE-INV",),
        "Inside a polygon it is the normal of the nearest edge, whose line is as far as the set is deep.",
        ("The set is an intersection of half-planes or half-spaces.", "The point is in it."),
    ),
    Theorem(
        "Passive.own_doing", "ours", ("SAFE-HYP", "SAFE-OWN"),
        "Had the set stood still since the sample, the robot would be at min(D, L) or farther, less its errors w s.",
        _PERIOD,
    ),
    Theorem(
        "Passive.kept", "ours", ("SAFE-HYP",),
        "A period that starts at L or farther keeps d, whatever the set does at Vo or slower.",
        (*_PERIOD, "L is at least d + (w + Vo) h, w the largest velocity error of the robot."),
    ),
    Theorem(
        "Passive.since", "ours", ("SAFE-HYP", "SAFE-OWN"),
        "Since any sample the distance has fallen below L by no more than the set's way and the robot's errors.",
        _PERIOD,
    ),
    Theorem(
        "Passive.restored", "ours", ("SAFE-HYP",),
        "A retreat that is as fast as what comes nearer in a period loses nothing in it.",
        (*_PERIOD, "The distance starts at L or nearer, by what one period can take away."),
    ),
    Theorem(
        "Passive.loss_is_real", "ours", ("SAFE-DIST",),
        "Without a retreat errors add up: a robot told to stand that drifts towards a point loses all of its drift.",
        ("The drift is not negative.",),
    ),
    Theorem(
        "Gate.scaled_back", "(20)", ("SAFE-GATE",),
        "From a safe state any command that is scaled back far enough meets all inequalities.",
        ("All bounds are at most 0 (a safe state).",
         "The factor c is at most bound/rate for every inequality that the command misses."),
    ),
    Theorem(
        "Gate.no_faster", "ours", ("SAFE-GATE",),
        "Where standing still is allowed, the nearest allowed velocity is no faster than the one asked for.",
        ("The velocity is the projection onto a convex set that contains 0.",),
    ),
    Theorem(
        "Gate.deficit_closed_form", "ours", ("SAFE-DIST",),
        "After k disturbed periods inside the safe distance d - (e/A + (1 - A h)^k (f - e/A)) is left.",
        ("A is positive.", "f is what was missing at the start."),
    ),
    Theorem(
        "Gate.common_direction", "ours", ("SAFE-DIST",),
        "If one direction leads away from every near point, one velocity meets all inequalities at once.",
        ("Every distance is at least d - e/A.", "There is a unit vector g with n.g >= m > 0 for every near point."),
    ),
    Theorem(
        "Gate.overhead", "ours", ("SAFE-DIST",),
        "Straight over a UGV, which cannot move along n, the UAV's half of the inequality keeps d - W/A alone.",
        ("A is positive, and A h is at most 1.", "The UAV is disturbed by at most W/2."),
    ),
    Theorem(
        "Trigger.dwell_apart", "(20)", ("ZENO-PROOF", "ZENO-TRACE"),
        "Triggers i < j of a UGV are at least (j - i) dwell times apart, whatever the decision variable does.",
        ("Time does not run backwards.", "The automaton makes the transitions of the theorem's model."),
    ),
    Theorem(
        "Trigger.at_most", "(20)", ("ZENO-PROOF", "ZENO-TRACE"),
        "In a time T there are at most floor(T/dwell) + 1 triggers.",
        ("The dwell time is positive.", "The hypotheses of Trigger.dwell_apart."),
    ),
    Theorem(
        "Isolation.largest_at_an_end", "(15), (20)", ("THR-TRIG",),
        "Between two updates the decision variable is nowhere above the larger of its ends.",
        ("Between two updates error and noise are linear in time.",),
    ),
    Theorem(
        "Isolation.nowhere_below", "(15), (20)", ("THR-TRIG",),
        "Between two updates the decision variable is nowhere below p w, p the distance of the error's line from 0.",
        ("Between two updates error and noise are linear in time.", "w^2 + k^2 = 1, k the rate of the noise."),
    ),
    Theorem(
        "Isolation.attained", "(15), (20)", ("THR-TRIG",),
        "The decision variable attains p w at one point of the line.",
        ("The hypotheses of Isolation.nowhere_below.", "w is positive."),
    ),
    Theorem(
        "Patience.bounded", "(20)", ("LIVE-WAIT",),
        "Between two rests no UAV keeps a UGV from its own task longer than tries (longest + h).",
        ("The gatekeeper is sampled every period h.", "It makes the transitions of the theorem's model."),
    ),
    Theorem(
        "Patience.over_in_time", "(20)", ("LIVE-GATE", "LIVE-WAIT"),
        "An accepted intervention is over after `longest` and a sampling period at the latest.",
        ("The hypotheses of Patience.bounded.",),
    ),
    Theorem(
        "Patience.kept", "(20)", ("LIVE-GATE",),
        "Unless a new obstacle is sensed, an accepted intervention is kept until its time is over, and not longer.",
        ("The UAV has not withdrawn it.", "The gatekeeper makes the transitions of the theorem's model."),
    ),
    Theorem(
        "Threshold.increasing", "(19)", ("THR-ROOT",),
        "The left side of the threshold equation increases strictly.",
        _COSTS,
    ),
    Theorem(
        "Threshold.exactly_one", "(19)", ("THR-ROOT",),
        "The threshold equation with c2/c1 on the right has exactly one root, and it is positive.",
        _COSTS,
    ),
    Theorem(
        "Threshold.enclosed", "(19)", ("THR-ROOT",),
        "Two points at which the equation has different signs enclose its root.",
        (*_COSTS, "The left side is below c2/c1 at the lower point and above it at the upper one."),
    ),
    Theorem(
        "Threshold.least", "(16)-(19)", ("THR-OPT",),
        "The Bayes risk is strictly least at the root.",
        (*_COSTS, "There is no initial deviation."),
    ),
    Theorem(
        "Threshold.printed_is_worse", "(19)", ("THR-OPT",),
        "The root of the printed equation, with c1/c2, has a higher risk.",
        (*_COSTS, "c1 and c2 differ."),
    ),
    Theorem(
        "Threshold.not_least_with_deviation", "(17)-(19)", ("THR-OPT",),
        "With any initial deviation the risk is lower at some other threshold than at the root.",
        (*_COSTS, "The deviation is not 0 and smaller than the root."),
    ),
    Theorem(
        "Threshold.at_most_two_drifts", "(19)", ("THR-OPT",),
        "One threshold is the root of the equation for at most two drifts.",
        ("noise and threshold are positive.",),
    ),
    Theorem(
        "Run.nearby", "ours", ("airground prove DIR",),
        "Positions within r and q of those of the run lose at most r + q of a distance.",
        ("Recorded positions differ from the exported ones by their rounding.",),
    ),
    Theorem(
        "DistanceChecker.sound", "(7)-(8), (11)", ("airground prove DIR", "SAFE-TRACE"),
        "Two bodies of a recorded run that the checker accepts keep their distance at all times of the run.",
        ("The integers in the file are the recorded positions, rounded to 2^-60 m.",
         "Between two rows bodies move on straight lines."),
    ),
    Theorem(
        "DistanceChecker.sets_sound", "(7)-(8), (11)", ("airground prove DIR", "SAFE-TRACE"),
        "A body that the checker accepts keeps its distance from convex sets that move without turning, at all times.",
        ("The hypotheses of DistanceChecker.sound.",
         "The corners in the file are those of the scenario, rounded to 2^-60 m; the sets do not turn."),
    ),
    Theorem(
        "LawChecker.sound", "(7)-(8), (11)", ("airground prove DIR", "SAFE-HYP"),
        "Two bodies of a recorded run that the checker accepts obey the avoidance law at all rows, up to e per step.",
        ("The hypotheses of DistanceChecker.sound.",),
    ),
    Theorem(
        "LawChecker.law_keeps", "(7)-(8), (11)", ("airground prove DIR", "SAFE-HYP"),
        "Two bodies that obey the law up to e per step keep d - e/(A h) at all times of the run.",
        ("The hypotheses of LawChecker.sound.", "The pair starts at d - e/(A h) or farther."),
    ),
    Theorem(
        "Example.can_be_met", "ours", (),
        "A moving robot meets all hypotheses of Safety.safe_always: they do not contradict each other.",
    ),
)  # fmt: skip

THEOREMS: Mapping[str, Theorem] = MappingProxyType({theorem.name: theorem for theorem in _ALL})
"""All theorems by name."""
