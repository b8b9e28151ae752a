"""A report: its verdicts one by one, and the verdict over all of them."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, NamedTuple

from .certificates import prove
from .command import LIMIT_S
from .enclosures import root
from .events import check_events
from .evidence import check_entry, nothing_besides
from .execution import execution
from .feasibility import gate_feas
from .files import Files, Json, canonical, is_plain, names_in, read_bytes, read_folder, read_json, sha256
from .inputs import inputs_of
from .limits import at_most_s, is_of_a_size
from .metrics import check_metrics
from .optimality import gate_opt, gate_sur
from .outcome import comm, gate_time, live_goal
from .prediction import gate_model
from .progress import live_prog
from .rules import Disagreement, Found, NotEstablished, agrees, holds, same
from .run import Run, read_run
from .safety import safe_hyp, safe_trace
from .statistics import ddm, refine
from .triggers import thr_trig, zeno_trace

SCHEMA = "airground_drake.report/2"
AGREES, DISAGREES, OPEN = "agrees", "DISAGREES", "cannot be re-established"
DECIDED_FROM = ("id", "status", "where", "counterexample", "evidence", "inputs", "certificates")
"""What of a recorded claim its formula looks at; the rest is compared with what the formula gives."""
UNDECIDED = ("inconclusive", "error", "not_run")
"""Statuses that say nothing about a claim."""
PASSING = ("proved", "holds", "supported")
"""Statuses in which a claim was established."""
EXERCISED = "exercised"
"""What may be expected besides a status: that the claim was established, on something that put it to the test."""
NOT_EXERCISED = "not_exercised"
"""How a claim counts that was established because nothing put it to the test."""
ADDED_LATER = "proofs/"
"""Folder of proofs that cvc5 has written for a report's scripts; nothing is taken from there."""
EXIT_CODES = {"as_expected": 0, "not_as_expected": 1, "inconclusive": 3}

OfRun = Callable[[Run, Json], Found]
OfModel = Callable[[Json, Files, Json], Found]

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
    "GATE-SUR": gate_sur,
    "GATE-FEAS": gate_feas,
    "GATE-MODEL": gate_model,
    "GATE-TIME": gate_time,
}
WITH_OUTCOMES: Mapping[str, OfRun] = {
    "GATE-FEAS": gate_feas,
    "GATE-MODEL": gate_model,
    "GATE-TIME": gate_time,
    "LIVE-PROG": live_prog,
}
ROUNDING_ROUTES = ("relaxed", "nonlinear")
"""Routes that GATE-SUR is about."""
REFUTED_BY_RULES = ("THR-TRIG", "COMM", "GATE-OPT", "GATE-SUR", "GATE-FEAS", "GATE-MODEL", "LIVE-PROG")
"""Claims that any broken rule of theirs refutes; the others are refuted by their margin."""
PROVED = (
    "SAFE-LEMMA", "SAFE-INV", "SAFE-GATE", "SAFE-DIST", "ZENO-PROOF", "LIVE-GATE", "LIVE-WAIT", "THR-ISO",
)  # fmt: skip
"""Claims with certificates."""
OF_MODEL: Mapping[str, OfModel] = {
    **dict.fromkeys(PROVED, prove),
    "THR-ROOT": root,
    "THR-OPT": root,
    "THR-DDM": ddm,
    "ZENO-REFINE": refine,
}
STATISTICAL = ("THR-DDM", "ZENO-REFINE")
"""Claims that are supported; the others about the model are proved."""


@dataclass(frozen=True)
class Line:
    """One check.

    Attributes:
        claim: identifier of the claim, or what else was checked: report, trace, events, metrics.
        run: on which run; '' for the report and the model.
        outcome: AGREES, DISAGREES or OPEN.
        text: what was found, or why nothing was.
        rule: the rule that is broken or cannot be applied; '' if all agrees.
        about: of which robot, pair, event, decision or obligation.
        t_s: when in the run; None where there is no time.
        recorded: what the files say, of a broken rule.
        recomputed: what follows from them.
        as_recorded: by key, how many values of the claim's entry were not established: see `evidence.py`.
    """

    claim: str
    run: str
    outcome: str
    text: str
    rule: str = ""
    about: str = ""
    t_s: float | None = None
    recorded: Any = None
    recomputed: Any = None
    as_recorded: Mapping[str, int] = field(default_factory=dict)


class Agreed(NamedTuple):
    """What agrees, in words, and what of it was taken as recorded."""

    text: str
    as_recorded: Mapping[str, int]


def check_report(folder: Path, limit_s: float = LIMIT_S) -> list[Line]:
    """All checks of a report.

    Args:
        folder: with report.json, trace/ and certificates/.
        limit_s: CPU time for each check; one that takes longer is not established.

    Raises:
        Disagreement, NotEstablished: if report.json is not strict JSON, or is not of the shape of a report, or there
            is anything but regular files in the folder.
    """
    report = read_json(folder / "report.json")
    _is_shaped_like_a_report(report)
    is_of_a_size(report["scenario"]["resolved"])
    return [*_lines(folder, names_in(folder), report, limit_s)]


def _is_shaped_like_a_report(report: Any) -> None:
    """Objects are objects, lists are lists of objects."""
    if not isinstance(report, dict):
        raise NotEstablished("it is a report", f"it is a {type(report).__name__}", "report.json")
    for key in ("scenario", "provenance", "overall", "runs", "files"):
        if not isinstance(report.get(key), dict):
            raise NotEstablished("it is a report", f"its {key!r} is missing or is no object", "report.json")
    for key in ("claims", "audit", "mutants", "choices"):
        listed = report.get(key)
        if not isinstance(listed, list) or not all(isinstance(entry, dict) for entry in listed):
            raise NotEstablished("it is a report", f"its {key!r} is missing or is no list of objects", "report.json")
    scenario = report["scenario"].get("resolved")
    if not isinstance(scenario, dict) or not isinstance(scenario.get("runs"), dict):
        raise NotEstablished("it is a report", "it has no resolved scenario with runs", "report.json")
    if not all({"id", "run"} <= {*claim} for claim in report["claims"]):
        raise NotEstablished("it is a report", "a claim has no id or no run", "report.json")
    for name in (*scenario["runs"], *report["runs"], *(claim["id"] for claim in report["claims"])):
        if not is_plain(name):
            raise NotEstablished("it is a report", f"{name!r} is no name of a run or a claim", "report.json")


def _lines(folder: Path, there: Sequence[str], report: Json, limit_s: float) -> Iterator[Line]:
    scenario = report["scenario"]["resolved"]
    attempt = partial(_attempt, limit_s)
    yield attempt("report", "", lambda: _check_overall(folder, report))
    yield attempt("files", "", lambda: _check_files(folder, there, report["files"]))
    runs: dict[str, Run] = {}

    def load(name: str) -> str:
        runs[name] = read_run(folder / "trace" / name, name, report)
        return f"{len(runs[name].t_s)} rows"

    def loaded(name: str) -> Run:
        if name not in runs:
            raise NotEstablished("the trace is one of the run", "it was refused")
        return runs[name]

    def events(name: str) -> str:
        return check_events(loaded(name))

    def metrics(name: str) -> str:
        return _check_metrics(loaded(name), canonical(report["runs"][name]["metrics"]))

    for name in scenario["runs"]:
        yield attempt("trace", name, partial(load, name))
        yield attempt("events", name, partial(events, name))
        yield attempt("metrics", name, partial(metrics, name))
    scenario_text = canonical(scenario)

    def decide(claim: Json) -> Found:
        about = canonical({key: claim[key] for key in DECIDED_FROM if key in claim})
        if claim["run"]:
            return _decide_of_run(loaded(claim["run"]), about)
        return _decide_of_model(about, read_folder(folder / "certificates" / claim["id"]), scenario_text)

    for claim in report["claims"]:
        yield attempt(claim["id"], claim["run"], partial(_judge, claim, scenario, decide))


def _attempt(limit_s: float, claim: str, run: str, check: Callable[[], str | Agreed]) -> Line:
    """What a check says, as a line; whatever goes wrong in it is not agreement."""
    try:
        with at_most_s(limit_s):
            said = check()
            agreed = said if isinstance(said, Agreed) else Agreed(said, {})
            return Line(str(claim), str(run), AGREES, agreed.text, as_recorded=agreed.as_recorded)
    except Disagreement as broken:
        when = "" if broken.t_s is None else f" at t = {broken.t_s:.9g} s"
        about = f" ({broken.about})" if broken.about else ""
        values = f"recorded {_short(broken.recorded)}, recomputed {_short(broken.recomputed)}"
        text = f"{broken.rule}{about}{when}: {values}"
        both = broken.recorded, broken.recomputed
        return Line(str(claim), str(run), DISAGREES, text, broken.rule, broken.about, broken.t_s, *both)
    except NotEstablished as error:
        about = f" ({error.about})" if error.about else ""
        return Line(str(claim), str(run), OPEN, f"{error.rule}{about}: {error.why}", error.rule, error.about)
    except Exception as error:  # files can be wrong in more ways than can be listed
        why = f"{type(error).__name__}: {error}".splitlines()[0]
        return Line(
            str(claim), str(run), OPEN, f"the files are well formed: {_short(why)}", "the files are well formed"
        )


def _short(value: Any, most: int = 120) -> str:
    try:
        text = value if isinstance(value, str) else repr(value)
    except ValueError:  # Python writes no integer of more than 4300 digits
        text = f"a {type(value).__name__} that is too long to be written"
    return text if len(text) <= most else f"{text[:most]}..."


def claims_of(method: str, route: str) -> dict[str, OfRun]:
    """The claims about a run of a method, with a route of the gatekeeper."""
    found = dict(EVERY_RUN)
    if method != "a":
        found |= WITH_MESSAGES
    if method == "d":
        found |= WITH_OUTCOMES
    if method == "c":
        found |= WITH_GATEKEEPER
        if route not in ROUNDING_ROUTES:
            del found["GATE-SUR"]
    return found


KNOWN = {*EVERY_RUN, *WITH_MESSAGES, *WITH_GATEKEEPER, *WITH_OUTCOMES, *OF_MODEL}
"""Identifiers of the claims of this package."""


def is_foreign(claim: str, scenario: Json) -> bool:
    """Whether a scenario adds it to the claims of this package."""
    return claim in scenario["claims"] and claim not in KNOWN


def expected_of_foreign(claim: Json, scenario: Json) -> tuple[str, ...]:
    """The verdicts that may be expected of a claim of others: the scenario's, else what passes for a claim.

    About the model that may be any: whether a claim of others is proved or supported is not in a report.
    """
    if claim["run"]:
        of_run = scenario["runs"].get(claim["run"], {}).get("expected", {})
        return (of_run.get(claim["id"], "holds"),)
    declared = scenario["expected"]
    return (declared[claim["id"]],) if claim["id"] in declared else PASSING


def expectations(scenario: Json) -> dict[tuple[str, str], str]:
    """The verdict that a scenario declares, by run ('': about the model) and claim, of all claims of this package."""
    wanted = {("", name): "supported" if name in STATISTICAL else "proved" for name in OF_MODEL}
    declared = scenario["expected"].items()
    wanted |= {("", name): status for name, status in declared if not is_foreign(name, scenario)}
    for run, about in scenario["runs"].items():
        for name in claims_of(about["method"], scenario["gatekeeper"]["route"]):
            wanted[run, name] = about["expected"].get(name, "holds")
    return wanted


def _meets(expected: str | None, claim: Json) -> bool:
    """Whether a verdict is one of those that an expectation admits: "holds", "holds or refuted", "exercised"."""
    admitted = str(expected).split(" or ")
    status, count = claim["status"], claim["exercised"]
    return status in admitted or (EXERCISED in admitted and status in PASSING and count is not None and count > 0)


def _outcome(claim: Json) -> str:
    """How a verdict counts: by its status, unless nothing put the claim to the test."""
    idle = claim["status"] in PASSING and claim["exercised"] == 0
    return NOT_EXERCISED if idle else str(claim["status"])


def _judge(claim: Json, scenario: Json, decide: Callable[[Json], Found]) -> Agreed:
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
    same("as expected", claim["as_expected"], _meets(claim["expected"], claim))
    same("a counterexample comes with a refutation", bool(claim["counterexample"]), status == "refuted")
    if foreign:
        raise NotEstablished("the claim is one of this package", "the scenario adds it", claim["id"])
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
    if _outcome(claim) == NOT_EXERCISED:
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


@lru_cache(maxsize=16)
def _check_metrics(run: Run, metrics_text: str) -> str:
    return check_metrics(run, json.loads(metrics_text))


@lru_cache(maxsize=256)
def _decide_of_run(run: Run, claim_text: str) -> Found:
    """What a claim's formula gives; the same for the same run and the same recorded claim."""
    claim, known = json.loads(claim_text), claims_of(run.method, run.scenario["gatekeeper"]["route"])
    same("inputs", claim["inputs"], {})
    if claim["id"] not in known:
        raise NotEstablished("the claim is known", f"known on this run: {', '.join(known)}", claim["id"])
    return known[claim["id"]](run, claim)


@lru_cache(maxsize=64)
def _decide_of_model(claim_text: str, files: Files, scenario_text: str) -> Found:
    """What a claim's formula gives; the same for the same certificates, scenario and recorded claim."""
    claim, scenario = json.loads(claim_text), json.loads(scenario_text)
    if claim["id"] not in OF_MODEL:
        raise NotEstablished("the claim is known", f"known: {', '.join(OF_MODEL)}", claim["id"])
    same("SHA-256 of certificates", claim["certificates"], {name: sha256(content) for name, content in files})
    inputs = inputs_of(claim["id"], scenario)
    agrees("inputs", claim["inputs"], inputs, within=1e-12)
    nothing_besides("inputs", claim["inputs"], inputs)
    return OF_MODEL[claim["id"]](claim, files, scenario)


def _check_overall(folder: Path, report: Json) -> str:
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


def _check_files(folder: Path, there: Sequence[str], recorded: Json) -> str:
    """Every file that is named is there with its SHA-256, and no other but `report.json` and what was added later."""
    found = {name for name in there if name != "report.json" and not name.startswith(ADDED_LATER)}
    for name in sorted({*recorded} | found):
        holds("a file that is named is there", name in found, "nothing", "a file", about=name)
        holds("a file that is there is named", name in recorded, "a file", "nothing", about=name)
        same("SHA-256 of a file", recorded[name], sha256(read_bytes(folder / name)), about=name)
    return f"{len(found)} files"


def _overall(report: Json) -> Json:
    """The verdict over all claims, and what stands in its way; findings about the paper count where all were made."""
    claims, audited = report["claims"], bool(report["mutants"])
    keys = ("id", "run", "status", "expected", "exercised")
    unexpected = [{key: claim[key] for key in keys} for claim in claims if not _meets(claim["expected"], claim)]
    undecided = [entry for entry in unexpected if entry["status"] in UNDECIDED]
    differs = [entry for entry in unexpected if entry["status"] not in UNDECIDED]
    undemonstrated = [item["id"] for item in report["audit"] if not item["demonstrated"]] if audited else []
    surviving = [f"{each['claim']}: {each['mutant']}" for each in report["mutants"] if not each["refuted"]]
    status = "as_expected"
    if differs or undemonstrated or surviving:
        status = "not_as_expected"
    elif undecided:
        status = "inconclusive"
    return {
        "status": status,
        "exit_code": EXIT_CODES[status],
        "checks": len(claims),
        "as_expected": len(claims) - len(unexpected),
        "counts": dict(Counter(map(_outcome, claims))),
        "not_exercised": [{"id": c["id"], "run": c["run"]} for c in claims if _outcome(c) == NOT_EXERCISED],
        "differs": differs,
        "undecided": undecided,
        "missing": [],
        "undemonstrated": undemonstrated,
        "surviving_mutants": surviving,
    }


def _choices_are_the_scenarios(recorded: list[Json], scenario: Json) -> None:
    """Every value that is not the paper's is quoted as the scenario has it."""
    same("number of choices", len(recorded), len(scenario["choices"]))
    for entry, choice in zip(recorded, scenario["choices"], strict=True):
        value: Any = scenario
        for key in choice["key"].split("."):
            value = value.get(key) if isinstance(value, dict) else None
        agrees("choice", entry, {**choice, "ours": value}, within=0.0, about=choice["key"])
