"""The report as a whole: its claims, runs and files are those of the scenario, its verdict follows from theirs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .claims import NOT_EXERCISED, UNDECIDED, expectations, is_foreign, meets, outcome_of
from .files import Json, read_bytes, sha256
from .rules import agrees, holds, same

SCHEMA = "airground_drake.report/2"
ADDED_LATER = "proofs/"
"""Folder of what `airground prove` has written; nothing is taken from there."""
FINDINGS = 18
"""About the paper, in a report that has all of them."""
EXIT_CODES = {"as_expected": 0, "not_as_expected": 1, "inconclusive": 3}


def check_overall(folder: Path, report: Json) -> str:
    """The claims and runs are those of the scenario, and the verdict over all claims follows from them."""
    scenario, claims = report["scenario"]["resolved"], report["claims"]
    same("schema", report["schema"], SCHEMA)
    for name, run in scenario["runs"].items():
        holds("the method is known", run["method"] in ("a", "b", "c", "d"), run["method"], "a, b, c or d", about=name)
    recorded = sorted([claim["run"], claim["id"]] for claim in claims)
    foreign = [each for each in recorded if is_foreign(each[1], scenario)]
    own = [each for each in recorded if each not in foreign]
    same("claims that there are", own, sorted(map(list, expectations(scenario))))
    for run, name in foreign:
        holds("a claim of others is about a run or the model", run in ("", *scenario["runs"]), run, "a run", about=name)
        same("a claim of others is there once", foreign.count([run, name]), 1, about=name)
    same("runs", sorted(report["runs"]), sorted(scenario["runs"]))
    same("folders of traces", sorted(path.name for path in folder.glob("trace/*")), sorted(scenario["runs"]))
    same("seed", report["provenance"]["seed"], scenario["seed"])
    same("name of the scenario", report["scenario"]["name"], scenario["name"])
    _choices_are_the_scenarios(report["choices"], scenario)
    overall = _overall(report)
    agrees("verdict over all", report["overall"], overall, within=0.0)
    same("counts of verdicts", report["overall"]["counts"], overall["counts"])
    same("claims with nothing to check", report["overall"]["not_exercised"], overall["not_exercised"])
    return f"{overall['status']}, exit code {overall['exit_code']}"


def check_files(folder: Path, there: Sequence[str], recorded: Json) -> str:
    """Every file that is named is there with its SHA-256, and no other but `report.json` and what was added later."""
    found = {name for name in there if name != "report.json" and not name.startswith(ADDED_LATER)}
    for name in sorted({*recorded} | found):
        holds("a file that is named is there", name in found, "nothing", "a file", about=name)
        holds("a file that is there is named", name in recorded, "a file", "nothing", about=name)
        same("SHA-256 of a file", recorded[name], sha256(read_bytes(folder / name)), about=name)
    return f"{len(found)} files"


def _overall(report: Json) -> Json:
    """The verdict over all claims, and what stands in its way; findings about the paper count where all were made."""
    claims, audited = report["claims"], len(report["audit"]) >= FINDINGS
    keys = ("id", "run", "status", "expected", "exercised")
    unexpected = [{key: claim[key] for key in keys} for claim in claims if not meets(claim["expected"], claim)]
    undecided = [entry for entry in unexpected if entry["status"] in UNDECIDED]
    differs = [entry for entry in unexpected if entry["status"] not in UNDECIDED]
    undemonstrated = [item["id"] for item in report["audit"] if not item["demonstrated"]] if audited else []
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
        "differs": differs,
        "undecided": undecided,
        "missing": [],
        "undemonstrated": undemonstrated,
    }


def _choices_are_the_scenarios(recorded: list[Json], scenario: Json) -> None:
    """Every value that is not the paper's is quoted as the scenario has it."""
    same("number of choices", len(recorded), len(scenario["choices"]))
    for entry, choice in zip(recorded, scenario["choices"], strict=True):
        value: Any = scenario
        for key in choice["key"].split("."):
            value = value.get(key) if isinstance(value, dict) else None
        agrees("choice", entry, {**choice, "ours": value}, within=0.0, about=choice["key"])
