"""The rules of a report's first screen, as tables: conditions on claims, and the words of each cell.

Claims are named only here. A cell uses the first row of its table that applies.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from airground_drake.base import registry
from airground_drake.base.statuses import PASSING

RunFacts = Any  # `facts.RunFacts`, which reads the names of claims here

# Claims about a run: its distances, the conditions of the proof, the robots' own effect, their ends.
DISTANCES, CONDITIONS, OWN_DOING, ARRIVAL = registry.DISTANCES, "SAFE-HYP", "SAFE-OWN", registry.ARRIVAL
# Claims that prove the distances of method (d); the other one joins them for bodies off their steered points.
PROOFS, PROOF_OF_PLANTS = ("SAFE-INV", "SAFE-GATE"), "SAFE-BUDGET"
# Claims about the time between triggers: its bound, in a run, and under finer noise.
DWELL, TRIGGER_GAPS, REFINEMENT = "ZENO-PROOF", "ZENO-TRACE", "ZENO-REFINE"
# Claims about triggers: against the decision variable, and against the error without noise.
CROSSINGS, TIMING = "THR-TRIG", "THR-QUALITY"
# Claims about the threshold: the one in force, the root of (19), and (17)-(18).
CHOICE, LEAST_RISK, DECISIONS = "THR-CHOICE", "THR-OPT", "THR-DDM"
PLANS, FOLLOWED = "GATE-PLAN", "LIVE-HYP"  # claims about the gatekeeper's plans, and about following the UAV
# Place of a claim's chart: a section, or a finding about the paper.
CHARTS = {CHOICE: "intervened", REFINEMENT: "audit-9"}
# Claims in the captions of exported figures, by figure.
CAPTIONS = {
    "trajectories": (ARRIVAL,),
    "distances": (DISTANCES, "SAFE-GATE"),
    "timelines": (CROSSINGS, CHOICE, FOLLOWED, TRIGGER_GAPS, DWELL),
}
# Verdicts that are not those declared, in words.
CAME_OUT: Mapping[str, str] = {
    "refuted": "failed", "inconclusive": "undecided", "error": "could not be checked", "not_run": "not checked",
    **dict.fromkeys(PASSING, "passed"),
}  # fmt: skip


class Rule(NamedTuple):
    """A row of a table: when it applies, the mark of its cell, a key of `sentences.MARKS`, and the words."""

    applies: Callable[[RunFacts], object]
    mark: str
    words: str
    kept: bool = True


# Whether a run was safe. "Kept" and "proved" require that its distances pass.
SAFE = (
    Rule(lambda run: run.collided, "no", "collision", kept=False),
    Rule(lambda run: run.is_broken, "no", "too close", kept=False),
    Rule(lambda run: run.claim(DISTANCES).status not in PASSING, "open", "not known", kept=False),
    Rule(lambda run: run.claim(DISTANCES).exercised == 0, "none", "nothing came near: untested"),
    Rule(lambda run: run.is_proved and run.movers, "yes", "distances kept, proved except for moving obstacles"),
    Rule(lambda run: run.is_proved, "yes", "distances kept, proved"),
    Rule(lambda run: True, "yes", "distances kept, not proved"),
)

# Why a UGV did not arrive.
CAUSES: tuple[tuple[Callable[[RunFacts, str], object], str], ...] = (
    (lambda run, robot: run.way(robot).kept_away, "{by} occupies its target"),
    (lambda run, robot: robot in [fault["robot"] for fault in run.run.faults], "the policy failed"),
    (lambda run, robot: robot in run.run.no_way, "no way found"),
    (lambda run, robot: run.way(robot).left_s is not None, "{left_s:g} s to go"),
    (lambda run, robot: run.holders(robot), "held by {held_by}"),
    (lambda run, robot: run.refused_all(robot), "refused all proposals"),
)

# Description of a run by its method, if it has no settings of its own.
RUNS = {
    "a": "alone", "b": "obeys the UAV", "c": "accepts by cost", "d": "avoidance first, accepts by outcome",
}  # fmt: skip
PRINTED = "priorities as the paper prints them"  # instead of the package's composition of priorities
# Settings of a run in words.
SETTINGS = {
    ("gatekeeper.route", "mixed_integer"): "(26) solved exactly",
    ("gatekeeper.route", "relaxed"): "(27) with half-planes",
    ("gatekeeper.route", "nonlinear"): "(27) by multiple shooting",
    ("gatekeeper.rule", "hysteresis"): "our hysteresis",
    ("gatekeeper.rule", "first_stage"): "the first stage applied",
    ("decision.threshold.rule", "printed"): "threshold by (19) as printed",
    ("decision.threshold.rule", "bayes"): "threshold at the Bayes optimum",
}
# Origin of a threshold, by rule.
THRESHOLDS = {"fixed": "set by hand", "printed": "by (19) as printed", "bayes": "Bayes optimum"}

OURS = ("robot", "under way", "both")  # values of an encounter's `doing` that are the robots' own
# Class of a proposal, by whether it was accepted and how it ended.
CLASSES: Mapping[tuple[bool, str], str] = {
    (False, "refused"): "refused", (False, "lost"): "never arrived", (True, "given up"): "dropped later",
}  # fmt: skip
OPEN: Mapping[bool, str] = {True: "accepted", False: "unanswered"}  # the class of the others
OBEYED: Mapping[str, str] = {"accepted": "obeyed", "unanswered": "not begun"}  # the classes of a method without answers

MATCHES = {"reproduced": "without tuning", "calibrated": "after calibration"}
# Statuses of the comparison with the paper: numbers that match, and the others.
REST = {"by_construction": "by construction", "ambiguous": "ambiguous", "not_reproduced": "not"}
