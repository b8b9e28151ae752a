"""The claims that a report must have, the expected verdict of each, and the verdict over all."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .files import Json, read_bytes, sha256
from .rules import agrees, holds, same

SCHEMA = "airground_drake.report/2"
EXIT_CODES = {"as_expected": 0, "not_as_expected": 1, "inconclusive": 3}
FINDINGS = 25
"""Number of findings about the paper in a report of `report audit`."""

EVERY_RUN = ("SAFE-TRACE", "SAFE-HYP", "EXEC", "ZENO-TRACE", "THR-TRIG", "LIVE-GOAL")
BY_METHOD = {
    "a": (),
    "b": ("COMM",),
    "c": ("COMM", "GATE-OPT", "GATE-FEAS", "GATE-MODEL"),
    "d": ("COMM", "GATE-FEAS", "GATE-MODEL", "LIVE-PROG"),
}
"""Claims about a run of each method, besides those about every run."""
PROVED = (
    "SAFE-LEMMA", "SAFE-INV", "SAFE-GATE", "SAFE-DIST", "ZENO-PROOF", "THR-ISO", "THR-ROOT", "THR-OPT", "LIVE-GATE",
    "LIVE-WAIT",
)  # fmt: skip
HOLDING = ("THR-CHOICE",)
"""Claims about the model that hold without a proof."""
SUPPORTED = ("THR-DDM", "ZENO-REFINE")
ABOUT_THE_MODEL = (
    dict.fromkeys(PROVED, "proved") | dict.fromkeys(HOLDING, "holds") | dict.fromkeys(SUPPORTED, "supported")
)
"""What is expected of each claim about the model, unless the scenario says otherwise."""
KNOWN = {*EVERY_RUN, *(claim for claims in BY_METHOD.values() for claim in claims), *ABOUT_THE_MODEL}
"""Identifiers of the claims of this package."""

UNDECIDED = ("inconclusive", "error", "not_run")
"""Statuses that leave a claim open."""
PASSING = ("proved", "holds", "supported")
"""Statuses with which a claim was established."""
EXERCISED = "exercised"
"""An expectation: the claim was established, and something put it to the test."""
NOT_EXERCISED = "not_exercised"
"""How a claim counts that was established although nothing put it to the test."""


def expectations(scenario: Json, recorded: Sequence[Json]) -> dict[tuple[str, str], str]:
    """The verdict that a scenario declares for each claim of this package, by run ('': about the model) and claim.

    A claim about the model may have been judged again for a run that sets values of its own. The checker does not know
    which ones must be; `airground check` finds out when it judges the report again.
    """
    wanted = {("", name): status for name, status in ABOUT_THE_MODEL.items()}
    for run, about in scenario["runs"].items():
        again = {claim["id"] for claim in recorded if about["set"] and claim["run"] == run} & {*ABOUT_THE_MODEL}
        wanted |= {(run, name): about["expected"].get(name, ABOUT_THE_MODEL[name]) for name in again}
    wanted |= {("", name): status for name, status in scenario["expected"].items() if not is_foreign(name, scenario)}
    for run, about in scenario["runs"].items():
        for name in (*EVERY_RUN, *BY_METHOD[about["method"]]):
            wanted[run, name] = about["expected"].get(name, "holds")
    return wanted


def is_foreign(claim: str, scenario: Json) -> bool:
    """Whether a scenario adds the claim to those of this package."""
    return claim in scenario["claims"] and claim not in KNOWN


def meets(expected: str, claim: Json) -> bool:
    """Whether a verdict is one of those that an expectation admits: "holds", "holds or refuted", "exercised"."""
    admitted = expected.split(" or ")
    status, count = claim["status"], claim["exercised"]
    return status in admitted or (EXERCISED in admitted and status in PASSING and count is not None and count > 0)


def admits_either(expected: str) -> bool:
    """Whether an expectation admits a claim that was established and one that was refuted."""
    admitted = expected.split(" or ")
    return "refuted" in admitted and not {*PASSING, EXERCISED}.isdisjoint(admitted)


def outcome_of(claim: Json) -> str:
    """How a verdict counts: by its status, unless nothing put the claim to the test."""
    idle = claim["status"] in PASSING and claim["exercised"] == 0
    return NOT_EXERCISED if idle else str(claim["status"])


def check_expectation(claim: Json, scenario: Json) -> None:
    """The expectation of an entry is the scenario's, and `as_expected` follows from it.

    Raises:
        Disagreement: if not.
    """
    if is_foreign(claim["id"], scenario):
        of_run = scenario["runs"].get(claim["run"], {}).get("expected", {}) if claim["run"] else scenario["expected"]
        declared = of_run.get(claim["id"])
        due = (declared,) if declared is not None else PASSING if not claim["run"] else ("holds",)
        holds("expected verdict", claim["expected"] in due, claim["expected"], " or ".join(due))
    else:
        same("expected verdict", claim["expected"], expectations(scenario, [claim]).get((claim["run"], claim["id"])))
    same("as expected", claim["as_expected"], meets(claim["expected"], claim))
    same("a counterexample comes with a refutation", bool(claim["counterexample"]), claim["status"] == "refuted")
    kept = (claim["run"] == "" or claim["id"] in ABOUT_THE_MODEL) and claim["status"] not in UNDECIDED
    holds("only claims about the model come from a cache", claim["from_cache"] in (False, kept),
          claim["from_cache"], "true or false" if kept else "false")  # fmt: skip


def check_overall(folder: Path, report: Json) -> str:
    """The claims and runs are those of the scenario, and the verdict over all claims follows from them.

    Returns:
        What was found, in words.

    Raises:
        Disagreement: if a rule is broken.
    """
    scenario, claims = report["scenario"]["resolved"], report["claims"]
    same("schema", report["schema"], SCHEMA)
    for name, run in scenario["runs"].items():
        holds("the method is known", run["method"] in BY_METHOD, run["method"], "a, b, c or d", about=name)
    recorded = sorted([claim["run"], claim["id"]] for claim in claims)
    foreign = [each for each in recorded if is_foreign(each[1], scenario)]
    own = [each for each in recorded if each not in foreign]
    same("claims that there are", own, sorted(map(list, expectations(scenario, claims))))
    for run, name in foreign:
        about_a_run = run in ("", *scenario["runs"])
        holds("a third-party claim is about a run or the model", about_a_run, run, "a run", about=name)
        same("a third-party claim is there once", foreign.count([run, name]), 1, about=name)
    same("runs", sorted(report["runs"]), sorted(scenario["runs"]))
    same("folders of traces", sorted(path.name for path in folder.glob("trace/*")), sorted(scenario["runs"]))
    same("seed", report["provenance"]["seed"], scenario["seed"])
    same("name of the scenario", report["scenario"]["name"], scenario["name"])
    overall = _overall(report)
    agrees("verdict over all", report["overall"], overall, within=0.0)
    same("counts of verdicts", report["overall"]["counts"], overall["counts"])
    return f"{overall['status']}, exit code {overall['exit_code']}"


def check_files(folder: Path, there: Sequence[str], recorded: Json) -> str:
    """Every file that is named is there with its SHA-256, and no file is there that no report has.

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
        holds("a file that is named is there", name in found, "nothing", "a file", about=name)
        holds("a file that is there is named", name in recorded, "a file", "nothing", about=name)
        same("SHA-256 of a file", recorded[name], sha256(read_bytes(folder / name)), about=name)
    return f"{len(found)} files"


ADDED_LATER = "proofs/"
"""Folder of the files that `airground prove` adds to a report."""
OF_A_REPORT = re.compile(
    r"report\.json|report\.html|junit\.xml|diagram\.(dot|svg)|proofs/(proofs\.json|run_\w+\.v)"
    r"|trace/[^/]+/((meta|timings)\.json|(signals|decisions|problems|proposals)\.parquet)"
)
"""Files that a report may have."""


def _overall(report: Json) -> Json:
    """The verdict over all claims, and the claims that prevent it; findings about the paper count if all are there."""
    claims, audit = report["claims"], report["audit"]
    keys = ("id", "run", "status", "expected", "exercised")
    unexpected = [{key: claim[key] for key in keys} for claim in claims if not meets(claim["expected"], claim)]
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
        "checks": len(claims),
        "as_expected": len(claims) - len(unexpected),
        "counts": dict(Counter(map(outcome_of, claims))),
        "not_exercised": [{"id": c["id"], "run": c["run"]} for c in claims if outcome_of(c) == NOT_EXERCISED],
        "either": [{"id": c["id"], "run": c["run"]} for c in claims if admits_either(c["expected"])],
        "differs": differs,
        "undecided": undecided,
        "missing": [],
        "undemonstrated": undemonstrated,
    }
