"""report.json: the content of a report as strict JSON, which HTML and JUnit render."""

import subprocess
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from airground_drake.base import files
from airground_drake.base.registry import method_of
from airground_drake.base.statuses import COUNTS, NOT_EXERCISED, STATUSES, UNDECIDED, outcome
from airground_drake.report import metrics, reproduction
from airground_drake.report.model import SCHEMA
from airground_drake.report.sentences import counted, some
from airground_drake.scenario.document import place_of, way
from airground_drake.scenario.plugins import OPTION
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import Verdict

MOST_LISTED = 4  # maximum number of checks that a sentence names
EXIT_CODES = {"as_expected": 0, "not_as_expected": 1, "inconclusive": 3}


def build(
    scenario: Scenario,
    traces: Mapping[str, Trace],
    verdicts: Iterable[Verdict],
    provenance: Mapping[str, Any],
    *,
    audit: Sequence[Mapping[str, Any]] = (),
    audited: bool = False,
    required: Iterable[str] = (),
    seeds: Sequence[Mapping[str, Any]] = (),
) -> dict[str, Any]:
    """The document. Returns strict JSON; numbers that are not finite have become None."""
    # traces: by run, in the order of the scenario; a run without a trace makes the report inconclusive.
    # audited: whether these are all findings: then each must be demonstrated.
    # required: claims about the model that must have a verdict.
    of_all = [name for name in traces if not scenario.runs[name].set]
    some_run = next(iter(of_all or traces), "")
    claims = [
        {
            **verdict.to_json(),
            "rerun": f"airground verify trace/{verdict.run or some_run} {verdict.claim.id}"
            + (f" {OPTION}" if verdict.claim.id in scenario.claims else ""),
        }
        for verdict in verdicts
    ]
    items = sorted(map(dict, audit), key=lambda item: item["id"])
    resolved = scenario.data()
    about = {key: resolved[key] for key in ("name", "title", "description")}
    runs = {name: _run(scenario, trace) for name, trace in traces.items()}
    numbers = expected_numbers(scenario, runs)
    document = {
        "schema": SCHEMA,
        "scenario": {**about, "sha256": scenario.digest, "resolved": resolved},
        "provenance": dict(provenance),
        "overall": overall(claims, missing(scenario, traces, claims, required), items if audited else (), numbers),
        "runs": runs,
        "seeds": list(seeds),
        "claims": claims,
        "reproduction": reproduction.rows(scenario, traces),
        "choices": [{**asdict(choice), "ours": _at(resolved, choice.key)} for choice in scenario.choices],
        "audit": items,
        "files": {},
    }
    made: dict[str, Any] = files.strict(document)
    return made


def sealed(document: Mapping[str, Any], folder: Path, names: Iterable[str]) -> dict[str, Any]:
    """The document with the SHA-256 of every other file of the report under `files`."""
    return {**document, "files": {name: files.sha256((folder / name).read_bytes()) for name in sorted(names)}}


def overall(
    claims: Sequence[Mapping[str, Any]],
    absent: Sequence[Mapping[str, Any]],
    items: Sequence[Mapping[str, Any]],
    numbers: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    """The verdict over all claims, over findings about the paper and over expected numbers, as of `model.Overall`."""
    undemonstrated = [item["id"] for item in items if not item["demonstrated"]]
    keys = ("id", "run", "status", "expected", "exercised")
    unexpected = [{key: claim[key] for key in keys} for claim in claims if claim["as_expected"] is False]
    unexpected += [
        {**{key: number[key] for key in ("id", "run")}, "status": str(number["found"]),
         "expected": f"at least {number['least']}", "exercised": number["found"]}
        for number in numbers if not number["as_expected"]
    ]  # fmt: skip
    checks = sum(claim["as_expected"] is not None for claim in claims) + len(numbers)
    differs = [claim for claim in unexpected if claim["status"] not in UNDECIDED]
    undecided = [claim for claim in unexpected if claim["status"] in UNDECIDED]
    outcomes = [(outcome(claim["status"], claim["exercised"]), claim) for claim in claims]
    counts = Counter(result for result, _ in outcomes)
    if differs:
        status = "not_as_expected"
        differ = "differs" if len(differs) == 1 else "differ"
        why = f"{len(differs)} of {counted(checks, 'check')} {differ} from what the scenario declares: "
        why += f"{some([*map(_told, differs)], MOST_LISTED)}."
    elif undemonstrated:
        status = "not_as_expected"
        why = f"Findings about the paper that were not demonstrated: {', '.join(map(str, undemonstrated))}."
    elif left := [*undecided, *absent]:
        status = "inconclusive"
        why = f"{counted(len(left), 'check')} could not be decided: {some([*map(_told, left)], MOST_LISTED)}."
    elif not claims:
        status, why = "inconclusive", "No checks."
    else:
        status, why = "as_expected", f"All {counted(checks, 'check')} gave the verdict that the scenario declares."
    return {
        "status": status,
        "exit_code": EXIT_CODES[status],
        "why": why,
        "checks": checks,
        "as_expected": checks - len(unexpected),
        "counts": {name: counts[name] for name in (*STATUSES, NOT_EXERCISED) if counts[name]},
        "not_exercised": _named(claim for result, claim in outcomes if result == NOT_EXERCISED),
        "unpromised": _named(claim for claim in claims if claim["as_expected"] is None),
        "differs": differs,
        "undecided": undecided,
        "missing": list(absent),
        "undemonstrated": undemonstrated,
        "numbers": list(numbers),
    }


def expected_numbers(scenario: Scenario, runs: Mapping[str, Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The numbers that a scenario expects of its runs: `id`, `run`, `found`, `least`, `as_expected`."""
    listed = []
    for name, run in runs.items():
        sent = run["metrics"]["messages"] or {"proposals": 0, "answers": 0}
        counts = {
            "interventions": sum(row["begun_s"] is not None for row in run["metrics"]["interventions"]),
            "messages": sent["proposals"] + sent["answers"],
        }
        expected = scenario.runs[name].expected
        for kind in COUNTS:
            if kind in expected:
                count, least = counts[kind], expected[kind]
                listed.append({"id": kind, "run": name, "found": count, "least": least, "as_expected": count >= least})
    return listed


def missing(
    scenario: Scenario, traces: Mapping[str, Trace], claims: Sequence[Mapping[str, Any]], required: Iterable[str] = ()
) -> list[dict[str, str]]:
    """Runs without a trace or verdict; claims that are expected, required or added, but were not checked."""
    checked = {(claim["run"], claim["id"]) for claim in claims}
    judged = {run for run, _ in checked}
    gaps = []
    for name, run in scenario.runs.items():
        if name not in traces:
            gaps.append((name, "", "the run has no trace"))
        elif name not in judged:
            gaps.append((name, "", "no claim was checked on the run"))
        else:
            gaps += [(name, claim, "expected, but not checked") for claim in run.expected if claim not in COUNTS]
    gaps += [("", claim, "not checked") for claim in dict.fromkeys([*required, *scenario.expected])]
    unjudged = {*scenario.claims} - {claim for _, claim in checked} - {claim for _, claim, _ in gaps}
    gaps += [("", claim, "the scenario adds it, and it applies to no run") for claim in sorted(unjudged)]
    return [{"run": run, "id": claim, "why": why} for run, claim, why in gaps if (run, claim) not in checked]


def _run(scenario: Scenario, trace: Trace) -> dict[str, Any]:
    run = scenario.runs[trace.run]
    return {
        "method": run.method,
        "method_name": method_of(run.method).says,
        "composition": run.composition,
        "set": run.set,
        "seed": trace.meta.get("seed"),
        "zeta_m": trace.meta["zeta_m"],
        "events": trace.events,
        "faults": list(trace.meta.get("faults", [])),
        "metrics": metrics.of_run(trace),
    }


def _at(resolved: Mapping[str, Any], key: str) -> Any:
    values = way(resolved, key)
    return values[-1] if len(values) == len(place_of(key)) else None


def _named(claims: Iterable[Mapping[str, Any]]) -> list[dict[str, str]]:
    return [{"id": claim["id"], "run": claim["run"]} for claim in claims]


def _told(item: Mapping[str, Any]) -> str:
    name = " on run ".join(filter(None, (item["id"], item["run"])))
    if "why" in item:
        return f"{name} ({item['why']})"
    tested = "" if outcome(item["status"], item["exercised"]) != NOT_EXERCISED else ", not tested"
    return f"{name} ({item['status']}{tested}, expected {item['expected']})"


def commit() -> str:
    """Commit of the checkout that the package is imported from, with '+changes', or 'not a checkout'."""
    here = ["git", "-C", str(Path(__file__).parent)]
    try:
        tracked = subprocess.run([*here, "ls-files", "--error-unmatch", __file__], capture_output=True, check=False)
        if tracked.returncode != 0:
            return "not a checkout"
        head = subprocess.run([*here, "rev-parse", "HEAD"], capture_output=True, text=True, check=True).stdout.strip()
        changed = subprocess.run([*here, "status", "--porcelain"], capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return "not a checkout"
    return head + ("+changes" if changed else "")
