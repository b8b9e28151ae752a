"""A recorded verdict, compared with what the claim's own formula gives."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import NamedTuple

from .claims import (
    NOT_EXERCISED,
    OF_MODEL,
    UNDECIDED,
    claims_of,
    expectations,
    expected_of_foreign,
    is_foreign,
    meets,
    outcome_of,
)
from .evidence import check_entry, nothing_besides
from .files import Json
from .inputs import inputs_of
from .rules import Disagreement, Found, NotEstablished, agrees, holds, same
from .run import Run

DECIDED_FROM = ("id", "status", "where", "counterexample", "margin", "exercised", "evidence", "inputs")
"""What of a recorded claim its formula looks at; the rest is compared with what the formula gives."""
REFUTED_BY_RULES = ("THR-TRIG", "COMM", "GATE-OPT", "GATE-FEAS", "GATE-MODEL", "LIVE-PROG")
"""Claims that any broken rule of theirs refutes; the others are refuted by their margin."""


class Agreed(NamedTuple):
    """What agrees, in words, and what of it was taken as recorded."""

    text: str
    as_recorded: Mapping[str, int]


def judge(claim: Json, scenario: Json, decide: Callable[[Json], Found]) -> Agreed:
    """Compare a recorded verdict with what the claim's own formula gives."""
    status, foreign = claim["status"], is_foreign(claim["id"], scenario)
    if foreign:
        due = expected_of_foreign(claim, scenario)
        holds("expected verdict", claim["expected"] in due, claim["expected"], " or ".join(due))
    else:
        same("expected verdict", claim["expected"], expectations(scenario).get((claim["run"], claim["id"])))
    may_be_kept = claim["run"] == "" and status not in UNDECIDED
    holds("only what is about the model comes from a cache", claim["from_cache"] in (False, may_be_kept),
          claim["from_cache"], "false" if not may_be_kept else "true or false")  # fmt: skip
    same("as expected", claim["as_expected"], meets(claim["expected"], claim))
    if foreign:
        raise NotEstablished("the claim is one of this package", "the scenario adds it", claim["id"])
    same("a counterexample comes with a refutation", bool(claim["counterexample"]), status == "refuted")
    try:
        found = decide(claim)
    except Disagreement as broken:
        if status != "refuted" or claim["id"] not in REFUTED_BY_RULES:
            raise
        found = Found("refuted")
        remark = f" (broken: {broken.rule})"
    else:
        remark = ""
    if status in UNDECIDED and found.status != status:
        raise NotEstablished("verdict", f"recorded {status!r}, which decides nothing; here it is {found.status!r}")
    same("verdict", status, found.status)
    if not remark:
        _counted_as_here(claim, found)
    margin: float | None = claim["margin"]
    if found.least is None or found.most is None or margin is None:
        same("margin", margin, found.least)
    else:
        slop = found.within + 1e-6 * abs(margin)
        possible = found.least if found.least == found.most else f"{found.least} to {found.most}"
        holds("margin", found.least - slop <= margin <= found.most + slop, margin, possible)
    taken = check_entry(claim, found, whole=not remark and status not in UNDECIDED)
    if outcome_of(claim) == NOT_EXERCISED:
        return Agreed(f"{status}, nothing to check", taken)
    attained = "" if margin is None else f", margin {margin:.6g} {claim['unit']}".rstrip()
    return Agreed(f"{status}{remark}{attained}", taken)


def _counted_as_here(claim: Json, found: Found) -> None:
    """How often the claim was put to the test is what is counted here, where something is."""
    recorded, rule = claim["exercised"], "how often the claim was exercised"
    if found.exercised is None:
        same(rule, recorded, None)
        return
    least, most = found.exercised
    possible = type(recorded) is int and least <= recorded <= most
    holds(rule, possible, recorded, f"{least}" if least == most else f"{least} to {most}")


@lru_cache(maxsize=256)
def decide_of_run(run: Run, claim_text: str) -> Found:
    """What a claim's formula gives; the same for the same run and the same recorded claim."""
    claim, known = json.loads(claim_text), claims_of(run.method)
    same("inputs", claim["inputs"], {})
    if claim["id"] not in known:
        raise NotEstablished("the claim is known", f"known on this run: {', '.join(known)}", claim["id"])
    return known[claim["id"]](run, claim)


@lru_cache(maxsize=64)
def decide_of_model(claim_text: str, scenario_text: str) -> Found:
    """What a claim's formula gives; the same for the same scenario and recorded claim."""
    claim, scenario = json.loads(claim_text), json.loads(scenario_text)
    if claim["id"] not in OF_MODEL:
        raise NotEstablished("the claim is known", f"known: {', '.join(OF_MODEL)}", claim["id"])
    inputs = inputs_of(claim["id"], scenario)
    agrees("inputs", claim["inputs"], inputs, within=1e-12)
    nothing_besides("inputs", claim["inputs"], inputs)
    return OF_MODEL[claim["id"]](claim, scenario)
