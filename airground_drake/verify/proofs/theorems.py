"""What each theorem says, its hypotheses, and where a report or a test checks them.

The theorems themselves are in the `.v` files of this folder, for the proof checker Coq.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class Theorem:
    """A theorem of the `.v` files."""

    name: str  # file and name in Coq, such as "Safety.safe_always"
    equation: str  # number of the paper's equation that it is about, or "ours"
    checked_where: tuple[str, ...]  # claims (such as "SAFE-HYP") and commands that check the hypotheses
    statement: str  # what it says, in one plain sentence
    hypotheses: tuple[str, ...] = ()  # a sentence each
    silent_on: str = ""  # what it does not say, in one plain sentence; empty if nothing needs to be said


_STABLE = "The product of gain and control period, A h, is at most 1: min(A h, 1) stands for it (Safety.capped)."
_SHARES = "The shares that the two robots of a pair take add up to 1."
_HELD = "Between two samples every body moves on a straight line at its velocity, up to `wander`."
_PLANAR = "A body that cannot leave the plane has no velocity out of it."
_LAW = "At every sample each pair meets its two inequalities, or is too far apart to matter."
_CONVEX = "Distances are signed distances to convex sets that do not turn, such as points, balls and polygons (Convex)."
_LAYER = (_STABLE, _SHARES, _HELD, _PLANAR, _LAW, _CONVEX)
_AROUND = ("The signed distance is that from a nearest point, or inside minus the depth (Convex.signed_distance).",)
_BUDGET = (
    _STABLE,
    "At every sample the pair meets the law, up to a slack, with a relative position that is measured up to eps; or it "
    "is far apart, or stands.",
    "W is at least the slacks and drifts of the two; dips and covers are what the plants have at most (Mixed).",
    "eps (1 - A h) <= A h (d_law - eps - W/A), and eps is below d_law - eps - W/A.",
    "The pair starts at d_law - eps - W/A or farther (Budget.measured_start).",
)
_HELD_EXACTLY = "Between its decisions, at most H apart, a robot moves straight at its command."
_OFF = "Each decision meets the law towards its danger: every place of the other one until that one decides again."
_PIECES = "Positions do not jump, and have the plant's derivatives inside the periods."
_CHORD = "Speed and turning rate are those of chord steering, and constant in a period."
_LAG = "The velocity goes towards the command at the rate (u - v)/tau."
_RECORDED = "The bodies are as recorded: no farther off the straight lines between the rows than is said of them."
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
        "Convex.clear_gap", "ours", ("SAFE-INV",),
        "A signed distance of at least m > 0 is a distance of at least m from every point of the set.",
        _AROUND,
    ),
    Theorem(
        "Convex.ball", "ours", ("SAFE-INV",),
        "The distance from a ball or point is convex, and the unit vector away from its centre is a subgradient of it.",
        ("The vector points away from the centre.",),
    ),
    Theorem(
        "Convex.nearest_point", "ours", ("SAFE-INV",),
        "Outside a convex set the unit vector away from it is the direction from its nearest point.",
        ("The set is convex.", "No point of it is nearer, and the point is not in it."),
    ),
    Theorem(
        "Convex.nearest_edge", "ours", ("SAFE-INV",),
        "Inside a polygon the unit vector away is normal to the nearest edge, whose line is as far as the set is deep.",
        ("The set is an intersection of half-planes or half-spaces.", "The point is in it."),
    ),
    Theorem(
        "Budget.at_samples", "(7)-(8), (11)", ("SAFE-BUDGET", "SAFE-HYP"),
        "At every sample the points that the law steers keep its distance d_law, but for eps and W/A.",
        _BUDGET,
        "How fast a pair that starts nearer recovers: that is Safety.recovers.",
    ),
    Theorem(
        "Budget.budget_always", "(7)-(8), (11)", ("SAFE-BUDGET", "SAFE-HYP", "SAFE-DIST"),
        "Pairs that meet the law, as measured and with the distance d_law, keep the true distance d at all times.",
        (*_BUDGET, "d_law is at least eps + W/A + sqrt((d + covers + dips)^2 + eps^2)."),
        "Anything about sets that turn, or about a pair from a period on in which it misses the law by more than W.",
    ),
    Theorem(
        "Budget.measured_start", "ours", ("SAFE-HYP", "SAFE-BUDGET"),
        "A pair that is measured to be at d_law at the start has the distance from which the budget begins.",
        ("Its relative position is measured with an error of eps at most.",),
    ),
    Theorem(
        "Budget.smaller_gain", "ours", ("SAFE-HYP",),
        "What meets the law with a gain meets it with a smaller one.",
        ("The period is positive.",),
    ),
    Theorem(
        "Budget.one_stands", "ours", ("SAFE-HYP", "SAFE-BUDGET"),
        "Where one of two robots stands and the other does its half with a gain, they meet the law with half of it.",
        ("The period is positive.",),
    ),
    Theorem(
        "Pieces.leaves_chord", "ours", ("SAFE-HYP",),
        "A motion that arrives where its command leads is off the straight line by at most M h^2/8 in between.",
        ("M bounds its acceleration.", _PIECES),
    ),
    Theorem(
        "Pieces.follows", "ours", ("SAFE-HYP",),
        "A point that is drawn after one that keeps m from a set at rest, within a of it, keeps sqrt(m^2 - a^2).",
        ("It starts there.", "It moves straight towards the other one.", _PIECES),
        "Anything about sets that move.",
    ),
    Theorem(
        "Plants.chord", "ours", ("SAFE-BUDGET", "SAFE-HYP"),
        "With chord steering the hand point of a unicycle arrives exactly where the command leads; its dip is known.",
        (_CHORD, _PIECES),
        "Slip, and errors of the heading.",
    ),
    Theorem(
        "Plants.unicycle_stands", "ours", ("SAFE-HYP", "SAFE-OWN"),
        "A unicycle that is told to stand neither turns nor drives.",
        (_CHORD, _PIECES),
    ),
    Theorem(
        "Plants.forwards", "ours", ("SAFE-BUDGET", "SAFE-HYP"),
        "The axle of a unicycle that never drives backwards keeps sqrt(m^2 - l^2) from sets that its hand point keeps "
        "m from.",
        ("It drives at v >= 0, a speed for each period.", "The set is at rest.", "It starts there.", _PIECES),
        "Anything about other robots, or about sets that move: there the cover l stays.",
    ),
    Theorem(
        "Plants.lag", "ours", ("SAFE-BUDGET", "SAFE-HYP"),
        "The point p + tau v of a body with lag moves exactly as commanded.",
        (_LAG, _PIECES),
        "What a wrong tau costs: that is a drift.",
    ),
    Theorem(
        "Plants.lag_speed", "ours", ("SAFE-BUDGET", "SAFE-HYP"),
        "A body with lag is never faster than the limit of its commands.",
        (_LAG, _PIECES, "It is no faster at the start."),
    ),
    Theorem(
        "Plants.lag_pair", "ours", ("SAFE-BUDGET", "SAFE-HYP"),
        "Where the points steered keep m, two bodies with lags keep sqrt(b^2 - (tau V_rel)^2), "
        "b = m - |tau_i - tau| V_i - |tau_j - tau| V_j.",
        ("tau is positive, of your choice, and b not negative.", "Speeds and relative speed are within their limits.",
         "They start there.", _PIECES),
    ),
    Theorem(
        "Plants.lag_needs", "ours", ("SAFE-BUDGET", "SAFE-HYP"),
        "The distance of Plants.lag_pair is d or more if b is at least sqrt(d^2 + (tau V_rel)^2).",
        ("d is not negative.",),
    ),
    Theorem(
        "Plants.delay", "ours", ("SAFE-BUDGET", "SAFE-HYP"),
        "A body with a delay is, some time later, within V |wait - delay| of the point that the law steers.",
        ("The law steers the point where the body will be after the commands on their way.",
         "They are no faster than V."),
    ),
    Theorem(
        "Turning.shortened_chord", "ours", ("SAFE-BUDGET", "SAFE-HYP"),
        "A command that is shortened as far as the turning limit asks for is followed exactly, within the limit.",
        ("The hand point is ahead of the axle.", "The limit is less than half a turn per period.", _CHORD, _PIECES),
        "Limits of wheel speeds: those shorten a command further.",
    ),
    Theorem(
        "Turning.steering_exists", "ours", ("SAFE-HYP",),
        "There is a chord steering for every command that was shortened like that.",
        ("The hand point is ahead of the axle.", "The limit is less than half a turn per period."),
    ),
    Theorem(
        "Turning.no_limit", "ours", ("SAFE-HYP",),
        "A limit of half a turn per period or more never binds.",
        ("The period is positive.",),
    ),
    Theorem(
        "Turning.chord_turns", "ours", ("SAFE-BUDGET", "SAFE-HYP"),
        "At speeds up to V chord steering turns at (2/h) asin(V h/(2 l)) at most.",
        ("V h is at most 2 l.", "2 l + a h is positive, a the command ahead."),
    ),
    Theorem(
        "Turning.car", "ours", ("SAFE-BUDGET", "SAFE-HYP"),
        "With chord steering a car follows every command of the cone R |b| <= l a at a radius of R at least.",
        ("The hand point is ahead of the axle.", "The command leads ahead: a is not negative.", _CHORD),
        "That a car gets anywhere: it stands where no command of the cone is allowed.",
    ),
    Theorem(
        "Turning.shortened", "ours", ("SAFE-BUDGET", "SAFE-HYP"),
        "A shortened command still meets every inequality that v = 0 meets.",
        ("The share that is left is above 0 and at most 1.",),
    ),
    Theorem(
        "Turning.shortened_gain", "ours", ("SAFE-HYP", "SAFE-DIST"),
        "Inside the distance of the law a command shortened to the share s meets the law with the gain s A.",
        ("The share that is left is above 0 and at most 1.",),
    ),
    Theorem(
        "Turning.shortened_obeys", "ours", ("SAFE-HYP", "SAFE-OWN"),
        "Beside an obstacle that moves a shortened command still obeys, and a retreat at r becomes one at s r.",
        ("The share that is left is above 0 and at most 1.",),
        "A retreat that was not asked for in full: of that only r = 0 is left.",
    ),
    Theorem(
        "Passive.own_doing", "ours", ("SAFE-BUDGET", "SAFE-HYP", "SAFE-OWN"),
        "Had the set stood still since the sample, the robot would be at min(D, L) or farther, less drift, dip and "
        "cover.",
        _PERIOD,
        "That the robot keeps a distance: what is missing, the set has moved itself.",
    ),
    Theorem(
        "Passive.kept", "ours", ("SAFE-BUDGET", "SAFE-HYP"),
        "A period that starts at L or farther keeps d, whatever the set does at Vo or slower.",
        (*_PERIOD, "L is at least d + cover + dip + (w + Vo) h, w the drift of the robot."),
        "Anything about a period that starts nearer than L.",
    ),
    Theorem(
        "Passive.since", "ours", ("SAFE-HYP", "SAFE-OWN"),
        "Since any sample the distance has fallen below L by no more than the set's way and the robot's drift.",
        _PERIOD,
    ),
    Theorem(
        "Passive.restored", "ours", ("SAFE-HYP",),
        "A retreat that is as fast as what comes nearer in a period loses nothing in it.",
        (*_PERIOD, "The distance starts at L, or nearer by at most what one period can take away."),
    ),
    Theorem(
        "Passive.held_off", "ours", ("SAFE-HYP",),
        "Within such a period the distance falls by the dip at most.",
        (*_PERIOD, "r is at least the speed of the set and the drift of the robot together."),
    ),
    Theorem(
        "Passive.loss_is_real", "ours", ("SAFE-DIST",),
        "Without a retreat errors add up: a robot told to stand that drifts towards a point loses all of its drift.",
        ("The drift is not negative.",),
    ),
    Theorem(
        "Mixed.first_order", "ours", ("airground prove DIR",),
        "A body that moves as commanded conforms to every drift, dip and cover.",
        ("They are not negative.",),
    ),
    Theorem(
        "Mixed.drifting", "ours", ("SAFE-BUDGET", "SAFE-HYP"),
        "A body whose velocity errs by w conforms to the drift w; and a set that moves at V, with the command 0, to V.",
        ("Dip and cover are not negative.",),
    ),
    Theorem(
        "Mixed.unicycle_chord", "ours", ("SAFE-BUDGET", "SAFE-HYP"),
        "A unicycle with chord steering conforms to no drift, the cover l and the dip |omega| |(v, l omega)| h^2/8.",
        (_CHORD, _PIECES),
        "Slip: it may be declared as a drift of a user's plant.",
    ),
    Theorem(
        "Mixed.lagging", "ours", ("SAFE-BUDGET", "SAFE-HYP"),
        "A body with lag conforms to no drift, no dip and the cover tau V.",
        (_LAG, "It is no faster than V.", _PIECES),
    ),
    Theorem(
        "Mixed.delayed", "ours", ("SAFE-BUDGET", "SAFE-HYP"),
        "A body with a delay conforms to no drift, no dip and the cover V |wait - delay|, as it is `wait` later.",
        ("The law steers the point where the body will be after the commands on their way.",
         "They are no faster than V."),
    ),
    Theorem(
        "Mixed.entry_keeps", "ours", ("airground prove DIR",),
        "An entry of a run's table that was checked keeps its promise, whatever is true of the others.",
        ("Those of its kind: the law in its periods, the plants of its two bodies, and the numbers of its budget.",),
        "Anything about a pair or a period that no entry is about.",
    ),
    Theorem(
        "Mixed.run_all", "ours", ("airground prove DIR",),
        "If all entries of a table were checked, all of them keep their promises.",
        ("The hypotheses of Mixed.entry_keeps.",),
    ),
    Theorem(
        "Mixed.shares", "(7)-(8), (11)", ("SAFE-HYP",),
        "Two bodies that both meet their shares of the law meet it as a pair.",
        ("The shares add up to 1.", "Both use the same measured positions."),
        "Anything about two robots with different measurements.",
    ),
    Theorem(
        "Mixed.from_rest", "ours", ("airground prove DIR",),
        "Bodies with lag that are at rest at the first sample of their entry need no first distance of their own.",
        ("b is not negative and at most m.",),
    ),
    Theorem(
        "Mixed.drive_kept", "ours", (),
        "A robot that drives towards a point, and beside a person, meets the hypotheses: they can be met.",
    ),
    Theorem(
        "Async.asynchronous", "ours", ("SAFE-HYP",),
        "Two robots that decide at instants of their own keep d, if each keeps off where the other can be until that "
        "one decides again.",
        (_HELD_EXACTLY, _OFF, "The first one knows where the second one starts.", "They start at d or farther."),
        "How a pair gets out of d: what its decisions miss is lost for good, and is their sum.",
    ),
    Theorem(
        "Async.towards_old", "ours", ("SAFE-HYP",),
        "The law towards an old position keeps a robot off all places within rho of that position.",
        ("The period is positive.",),
    ),
    Theorem(
        "Async.old_positions", "ours", ("SAFE-HYP", "SAFE-BUDGET"),
        "Two robots that act on positions that the other one had once keep d, whatever delays and losses made them "
        "old.",
        (_HELD_EXACTLY, "rho is V times the age of the position and the longest period of the other one, V its limit.",
         "Each decision meets n.u >= -(D - d - rho)/H where D >= d + rho, or D n.u >= rho |u|, or stands.",
         "Positions are exact, and none is from the future.", "The robots start at d or farther."),
        "How a pair gets out of d. Positions with errors, plants that drift, bodies that are no discs.",
    ),
    Theorem(
        "Async.half_shares_fail", "ours", (),
        "Half shares are not enough for robots whose samples are half a period apart: they end inside d.",
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
        "Entries that the checker accepts were checked: the pair of points obeys the law in their periods, up to e.",
        ("The hypotheses of DistanceChecker.sound.", _RECORDED),
    ),
    Theorem(
        "LawChecker.obeys_exactly", "(7)-(8), (11)", ("airground prove DIR", "SAFE-HYP"),
        "The same without error, with the distances of the law and of the bodies.",
        ("The hypotheses of LawChecker.sound.",
         "The distance of the law is at least what the bodies keep and are off."),
    ),
    Theorem(
        "LawChecker.first_order_recorded", "ours", ("airground prove DIR",),
        "Bodies that move on the straight lines between the rows are recorded, and nothing is off.",
        ("The hypotheses of DistanceChecker.sound.",),
    ),
    Theorem(
        "LawChecker.straight_is", "ours", ("airground prove DIR",),
        "Their places are the positions that the theorem about distances is about.",
        ("The hypotheses of DistanceChecker.sound.",),
    ),
    Theorem(
        "Example.can_be_met", "ours", (),
        "A moving robot meets all hypotheses of Safety.safe_always: they do not contradict each other.",
    ),
)  # fmt: skip

THEOREMS: Mapping[str, Theorem] = MappingProxyType({theorem.name: theorem for theorem in _ALL})  # all theorems by name
