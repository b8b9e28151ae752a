"""The claims that there are: what decides each of them, on which runs, and what a scenario expects of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from .execution import execution
from .feasibility import gate_feas
from .files import Json
from .optimality import gate_opt
from .outcome import comm, live_goal
from .prediction import gate_model
from .progress import live_prog
from .rules import Found
from .run import Run
from .safety import safe_hyp, safe_trace
from .statistics import ddm, refine
from .theorems import HYPOTHESES, theorem
from .triggers import thr_trig, zeno_trace

OfRun = Callable[[Run, Json], Found]
OfModel = Callable[[Json, Json], Found]

EVERY_RUN: Mapping[str, OfRun] = {
    "SAFE-TRACE": safe_trace,
    "SAFE-HYP": safe_hyp,
    "EXEC": execution,
    "ZENO-TRACE": zeno_trace,
    "THR-TRIG": thr_trig,
    "LIVE-GOAL": live_goal,
}
WITH_MESSAGES: Mapping[str, OfRun] = {"COMM": comm}
WITH_GATEKEEPER: Mapping[str, OfRun] = {
    "GATE-OPT": gate_opt,
    "GATE-FEAS": gate_feas,
    "GATE-MODEL": gate_model,
}
WITH_OUTCOMES: Mapping[str, OfRun] = {
    "GATE-FEAS": gate_feas,
    "GATE-MODEL": gate_model,
    "LIVE-PROG": live_prog,
}
OF_MODEL: Mapping[str, OfModel] = {
    **dict.fromkeys(HYPOTHESES, theorem),
    "THR-DDM": ddm,
    "ZENO-REFINE": refine,
}
"""The claims about the model."""
STATISTICAL = ("THR-DDM", "ZENO-REFINE")
"""Claims that are supported; the others about the model are proved."""
KNOWN = {*EVERY_RUN, *WITH_MESSAGES, *WITH_GATEKEEPER, *WITH_OUTCOMES, *OF_MODEL}
"""Identifiers of the claims of this package."""

UNDECIDED = ("inconclusive", "error", "not_run")
"""Statuses that say nothing about a claim."""
PASSING = ("proved", "holds", "supported")
"""Statuses in which a claim was established."""
EXERCISED = "exercised"
"""What may be expected besides a status: that the claim was established, on something that put it to the test."""
NOT_EXERCISED = "not_exercised"
"""How a claim counts that was established because nothing put it to the test."""


def claims_of(method: str) -> dict[str, OfRun]:
    """The claims about a run of a method."""
    found = dict(EVERY_RUN)
    if method != "a":
        found |= WITH_MESSAGES
    if method == "d":
        found |= WITH_OUTCOMES
    if method == "c":
        found |= WITH_GATEKEEPER
    return found


def is_foreign(claim: str, scenario: Json) -> bool:
    """Whether a scenario adds it to the claims of this package."""
    return claim in scenario["claims"] and claim not in KNOWN


def expectations(scenario: Json) -> dict[tuple[str, str], str]:
    """The verdict that a scenario declares, by run ('': about the model) and claim, of all claims of this package."""
    wanted = {("", name): "supported" if name in STATISTICAL else "proved" for name in OF_MODEL}
    declared = scenario["expected"].items()
    wanted |= {("", name): status for name, status in declared if not is_foreign(name, scenario)}
    for run, about in scenario["runs"].items():
        for name in claims_of(about["method"]):
            wanted[run, name] = about["expected"].get(name, "holds")
    return wanted


def expected_of_foreign(claim: Json, scenario: Json) -> tuple[str, ...]:
    """The verdicts that may be expected of a claim of others: the scenario's, else what passes for a claim.

    About the model that may be any: whether a claim of others is proved or supported is not in a report.
    """
    if claim["run"]:
        of_run = scenario["runs"].get(claim["run"], {}).get("expected", {})
        return (of_run.get(claim["id"], "holds"),)
    declared = scenario["expected"]
    return (declared[claim["id"]],) if claim["id"] in declared else PASSING


def meets(expected: str | None, claim: Json) -> bool:
    """Whether a verdict is one of those that an expectation admits: "holds", "holds or refuted", "exercised"."""
    admitted = str(expected).split(" or ")
    status, count = claim["status"], claim["exercised"]
    return status in admitted or (EXERCISED in admitted and status in PASSING and count is not None and count > 0)


def outcome_of(claim: Json) -> str:
    """How a verdict counts: by its status, unless nothing put the claim to the test."""
    idle = claim["status"] in PASSING and claim["exercised"] == 0
    return NOT_EXERCISED if idle else str(claim["status"])
