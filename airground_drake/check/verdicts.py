"""The files and claims that a report must have, the expected verdict of each claim, and the verdict over all."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .files import Json, read_bytes, sha256
from .rules import holds, same

EXIT_CODES = {"as_expected": 0, "not_as_expected": 1, "inconclusive": 3}
FINDINGS = 25
"""Number of findings about the paper in a report of `report audit`."""

EVERY_RUN = ("SAFE-TRACE", "SAFE-HYP", "EXEC", "ZENO-TRACE", "THR-TRIG", "THR-QUALITY", "LIVE-GOAL")
BY_METHOD = {
    "a": (),
    "b": ("COMM",),
    "c": ("COMM", "GATE-PLAN", "GATE-MODEL"),
    "d": ("COMM", "GATE-PLAN", "GATE-MODEL", "LIVE-PROG"),
}
"""Claims about a run of each method, besides those about every run."""
PROVED = ("SAFE-INV", "SAFE-GATE", "SAFE-DIST", "ZENO-PROOF", "THR-ROOT", "THR-OPT", "LIVE-GATE", "LIVE-WAIT")
HOLDING = ("THR-CHOICE",)
"""Claims about the model that hold without a proof."""
SUPPORTED = ("THR-DDM", "ZENO-REFINE")
ABOUT_THE_MODEL = (
    dict.fromkeys(PROVED, "proved") | dict.fromkeys(HOLDING, "holds") | dict.fromkeys(SUPPORTED, "supported")
)
"""Expected verdict of each claim about the model, unless the scenario declares another."""
KNOWN = {*EVERY_RUN, *(claim for claims in BY_METHOD.values() for claim in claims), *ABOUT_THE_MODEL}
"""Identifiers of the claims of this package."""

UNDECIDED = ("inconclusive", "error", "not_run")
"""Statuses that leave a claim open."""
PASSING = ("proved", "holds", "supported")
"""Statuses with which a claim was established."""
NOTHING = "nothing"
"""An expectation: nothing is promised, so the verdict neither meets it nor differs from it."""
EXERCISED = "exercised"
"""An expectation: the claim was established, and something tested it."""
NOT_EXERCISED = "not_exercised"
"""How a claim counts that was established although nothing tested it."""

ADDED_LATER = "proofs/"
"""Folder of the files that `airground prove` adds to a report."""
OF_A_REPORT = re.compile(
    r"report\.json|report\.html|junit\.xml|diagram\.(dot|svg)|proofs/(proofs\.json|run_\w+\.v)"
    r"|trace/[^/]+/((meta|timings)\.json|(signals|decisions|problems|proposals)\.parquet)"
)
"""Files that a report may have."""


def is_foreign(claim: str, scenario: Json) -> bool:
    """Whether a scenario adds the claim to those of this package."""
    return claim in scenario["claims"] and claim not in KNOWN


def meets(expected: str, claim: Json) -> bool | None:
    """Whether an expectation such as "holds", "holds or supported" or "exercised" admits the verdict.

    None: nothing is expected, and the claim was judged.
    """
    if expected == NOTHING:
        return False if claim["status"] in ("error", "not_run") else None
    admitted = expected.split(" or ")
    status, count = claim["status"], claim["exercised"]
    return status in admitted or (EXERCISED in admitted and status in PASSING and count is not None and count > 0)


def outcome_of(claim: Json) -> str:
    """How a verdict counts: by its status, unless nothing tested the claim."""
    idle = claim["status"] in PASSING and claim["exercised"] == 0
    return NOT_EXERCISED if idle else str(claim["status"])


def check_expectation(claim: Json, scenario: Json) -> None:
    """The expectation of a claim is the scenario's, and `as_expected` follows from it.

    Raises:
        Disagreement: if not.
    """
    run, name = claim["run"], claim["id"]
    declared = (scenario["runs"][run] if run else scenario)["expected"]
    due = [declared.get(name, ABOUT_THE_MODEL.get(name, "holds"))]
    if is_foreign(name, scenario) and not run and name not in declared:
        due = [*PASSING]
    holds("expected verdict", claim["expected"] in due, claim["expected"], " or ".join(due))
    same("as expected", claim["as_expected"], meets(claim["expected"], claim))
    kept = (run == "" or name in ABOUT_THE_MODEL) and claim["status"] not in UNDECIDED
    holds("only claims about the model come from a cache", claim["from_cache"] in (False, kept),
          claim["from_cache"], "true or false" if kept else "false")  # fmt: skip


def check_overall(folder: Path, report: Json) -> str:
    """The claims and runs are those of the scenario, and the verdict over all claims follows from them.

    Returns:
        What was found, in words.

    Raises:
        Disagreement: if a rule is broken.
    """
    scenario = report["scenario"]["resolved"]
    found = [(claim["run"], claim["id"]) for claim in report["claims"]]
    foreign = {each for each in found if is_foreign(each[1], scenario)}
    same("claims that there are", sorted(map(list, found)), sorted(foreign | _own_claims(scenario, found)))
    left_out = _left_out(scenario, foreign)
    holds("claims that the scenario adds are there", not left_out, "nothing", ", ".join(left_out))
    same("runs", sorted(report["runs"]), sorted(scenario["runs"]))
    same("folders of traces", sorted(path.name for path in folder.glob("trace/*")), sorted(scenario["runs"]))
    same("seed", report["provenance"]["seed"], scenario["seed"])
    number = len({row["seed"] for row in report["seeds"]})
    due = [[run, seed] for run in scenario["runs"] for seed in range(1, number + 1)]
    same("runs and seeds", [[row["run"], row["seed"]] for row in report["seeds"]], due)
    overall = _overall(report)
    same("verdict over all", report["overall"] | {"why": ""}, overall | {"why": ""})  # `why` is judged again
    return f"{overall['status']}, exit code {overall['exit_code']}"


def _own_claims(scenario: Json, found: Sequence[tuple[str, str]]) -> set[tuple[str, str]]:
    """The claims of this package that a report must have, by run ('': about the model) and name.

    A claim about the model may be judged again for a run that sets values of its own. The checker does not know which
    ones must be; `airground check` finds out when it judges the report again.
    """
    wanted = {("", name) for name in ABOUT_THE_MODEL}
    for run, about in scenario["runs"].items():
        wanted |= {(run, name) for name in (*EVERY_RUN, *BY_METHOD[about["method"]])}
        wanted |= {each for each in found if about["set"] and each[0] == run and each[1] in ABOUT_THE_MODEL}
    return wanted


def _left_out(scenario: Json, foreign: set[tuple[str, str]]) -> list[str]:
    """Claims that the scenario adds and the report leaves out: everywhere, or where the scenario expects a verdict.

    For a run without an expectation, only the claim's own code says whether it applies.
    """
    judged = {name for _, name in foreign}
    found = [name for name in scenario["claims"] if is_foreign(name, scenario) and name not in judged]
    for run, expected in (("", scenario["expected"]), *((run, of["expected"]) for run, of in scenario["runs"].items())):
        found += [f"{name} {run}" for name in expected if is_foreign(name, scenario) and (run, name) not in foreign]
    return found


def check_files(folder: Path, there: Sequence[str], recorded: Json) -> str:
    """The files that report.json names, and no others, are there with their SHA-256.

    Returns:
        What was found, in words.

    Raises:
        Disagreement: if a rule is broken.
        NotEstablished: if a file cannot be read.
    """
    for name in there:
        holds("a report has such a file", OF_A_REPORT.fullmatch(name) is not None, "a file", "nothing", about=name)
    found = {name for name in there if name != "report.json" and not name.startswith(ADDED_LATER)}
    for name in sorted({*recorded} | found):
        same("a file is named if it is there", name in recorded, name in found, about=name)
        same("SHA-256 of a file", recorded[name], sha256(read_bytes(folder / name)), about=name)
    return f"{len(found)} files"


def _overall(report: Json) -> Json:
    """The verdict over all claims, and what prevents it; findings about the paper count in a report of all of them."""
    claims, audit = report["claims"], report["audit"]
    keys = ("id", "run", "status", "expected", "exercised")
    unexpected = [{key: claim[key] for key in keys} for claim in claims if meets(claim["expected"], claim) is False]
    unpromised = [{"id": each["id"], "run": each["run"]} for each in claims if meets(each["expected"], each) is None]
    undecided = [entry for entry in unexpected if entry["status"] in UNDECIDED]
    differs = [entry for entry in unexpected if entry["status"] not in UNDECIDED]
    whole = len(audit) >= FINDINGS
    undemonstrated: list[Any] = [item["id"] for item in audit if not item["demonstrated"]] if whole else []
    status = "as_expected"
    if differs or undemonstrated:
        status = "not_as_expected"
    elif undecided:
        status = "inconclusive"
    return {
        "status": status,
        "exit_code": EXIT_CODES[status],
        "checks": len(claims) - len(unpromised),
        "as_expected": len(claims) - len(unpromised) - len(unexpected),
        "counts": dict(Counter(map(outcome_of, claims))),
        "not_exercised": [{"id": c["id"], "run": c["run"]} for c in claims if outcome_of(c) == NOT_EXERCISED],
        "unpromised": unpromised,
        "differs": differs,
        "undecided": undecided,
        "missing": [],
        "undemonstrated": undemonstrated,
    }
