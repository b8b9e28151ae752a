"""The questions of a report's reader, a record each: the claims that feed the answer, and the answer in lines."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain
from math import dist
from typing import Any, NamedTuple

from airground_drake.base.statuses import NOTHING, PASSING, UNDECIDED
from airground_drake.report.outcomes import Document, ProofOutcome, RunOutcome, claims, distance, tolerance, triggers
from airground_drake.report.phrases import (
    RECURSION,
    appeared,
    collision,
    encounter,
    ending,
    found_no_way,
    gatekeeper,
    in_words,
    intrusion,
    labels,
    more_pairs,
    of_run,
)
from airground_drake.report.sentences import MAX_NAMES, Line, clause, counted, grouped, joined, say

NEGLIGIBLE = 1e-3
"""A risk that exceeds the smallest one by less than this share counts as the smallest."""
NEGLIGIBLE_S = 0.01
"""A risk that exceeds the smallest one by less than this delay costs counts as the smallest, s."""
MAX_TOLD = 2
"""Maximum number of lines about triggers and the task error."""
RULES = {"fixed": "set by hand (rule fixed)", "printed": "by (19) as printed (rule printed)", "bayes": "rule bayes"}
"""Where a threshold comes from, by rule."""
MATCHES = {"reproduced": "without tuning", "calibrated": "after calibration"}
REST = {"by_construction": "by construction", "ambiguous": "ambiguous", "not_reproduced": "not reproduced"}
"""Statuses of the comparison with the paper: results that match it, and the others."""

Runs = Sequence[RunOutcome]
Claims = Sequence[Mapping[str, Any]]


class Answer(NamedTuple):
    """A question and its answer."""

    question: str
    lines: list[Line]


class Question(NamedTuple):
    """A question of the first screen.

    Attributes:
        title: as the reader sees it.
        lines: the answer, from the report, what came of its runs, and the claims; without a line there is no question.
        claims: the claims that feed the answer, besides those that `RunOutcome` reads.
        in_table: whether the table of methods answers it for several runs.
    """

    title: str
    lines: Callable[..., Iterator[Line]]
    claims: tuple[str, ...] = ()
    in_table: bool = False


def answers(document: Document, every: Runs, *, tabulated: bool) -> list[Answer]:
    """The questions that the report has something to say about; `tabulated`: those that no table of runs answers."""
    found = []
    for question in QUESTIONS:
        about = (claims(document, name) for name in question.claims)
        if not (tabulated and question.in_table) and (lines := list(question.lines(document, every, *about))):
            found.append(Answer(question.title, lines))
    return found


def _safe(document: Document, every: Runs) -> Iterator[Line]:
    bad = sorted((course for course in every if course.safe is False), key=lambda course: not course.blameless)
    printed = [course for course in bad if not (course.blameless or course.plain or course.hits)]
    for course in bad:
        if course not in printed:
            what = _encounters(course) if course.blameless else _intrusion(course)
            line = say("broken", run=course, what=what, expected=_expected([course]))
            yield line._replace(mark="partly") if course.blameless else line
    for why, names in grouped((course.why, course.name) for course in every if course.safe is None).items():
        yield say("unknown", runs=", ".join(names), why=why)
    kept = [course for course in every if course.safe]
    if pairs := [course.near[0] for course in kept if course.near]:
        name = "kept" if any(course.tested for course in kept) else "kept_idly"
        yield say(name, runs=_names(kept), near=min(pairs))
    yield from _proof([course for course in every if course.proof])
    if printed:
        what = _intrusion(min(printed, key=lambda course: course.near[:1]))
        home = "all arrive, but " * all(course.away == {} for course in printed)
        runs = counted(len(printed), "run")
        yield say("printed", runs=runs, recursion=RECURSION, home=home, what=what, expected=_expected(printed))


def _names(those: Runs) -> str:
    return ", ".join(course.name for course in those)


def _expected(those: Runs) -> str:
    return " (expected)" * any(course.declared_unsafe for course in those)


def _encounters(course: RunOutcome) -> str:
    """How obstacles that move came too near by their own motion."""
    told, more = course.encounters[:MAX_NAMES], len(course.encounters) - MAX_NAMES
    return "; ".join([*(encounter(course, one) for one in told), *[counted(more, "more encounter")] * (more > 0)])


def _intrusion(course: RunOutcome) -> str:
    """Who came how near to what, when, and how many others did."""
    hits = list(dict.fromkeys(collision(hit, course.unknown) for hit in course.hits.values()))
    if hits and not appeared(course):
        more = len(hits) - MAX_NAMES
        told = "; ".join([*hits[:MAX_NAMES], *[f"{more} more collisions"] * (more > 0)])
    elif course.near and course.near[0].is_short:
        at = ", nearest at" if course.near[0].appeared else " at"
        told = f"{intrusion(course)}{at} {course.near[0].t_s:.2f} s, required {course.near[0].required_m:g} m"
    else:
        return intrusion(course)
    others = more_pairs(course, 1 if appeared(course) else max(1, len(hits)))
    return f"{told}{others}{' too close' * bool(others)}"


def _proof(of_d: Runs) -> Iterator[Line]:
    """Whether the safety of method (d) is proved, one sentence per status."""
    told = grouped(((*_lacking(course.proof), course.proof.status), course) for course in of_d if course.proof)
    for (lacking, refuted, status), alike in told.items():
        runs, who = joined([course.name for course in alike]), joined([*chain(*labels(alike, of_d))])
        s = "s" * (len([*chain(*labels(alike, of_d))]) == 1)
        covered = clause("covered", s=s) * any(course.movers for course in alike)
        line = say(status, runs=runs, who=who, s=s, lacking=lacking, covered=covered)
        yield line._replace(mark="no") if refuted else line


def _lacking(proof: ProofOutcome) -> tuple[str, bool]:
    """What a proof lacks, by claim, and whether one of these claims is refuted."""
    told = (f"{name}: {in_words(claim) if claim else 'not checked'}" for name, claim in proof.lacking.items())
    return "; ".join(told), any(claim and claim["status"] == "refuted" for claim in proof.lacking.values())


def _arrived(document: Document, every: Runs) -> Iterator[Line]:
    if home := [course for course in every if course.away == {} and course.plain]:
        last = max((time_s for course in home for time_s in course.arrived_s.values()), default=0.0)
        within = f" within {tolerance(document)} of their targets" if tolerance(document) else ""
        yield say("home", runs=_names(home), within=within, by=f", by {last:.1f} s" * bool(last))
    for course in every:
        for robot, hit in course.hits.items():
            if robot in course.arrived_s:
                at_s = course.arrived_s[robot]
                yield say("home_first", run=course, robot=robot, at_s=at_s, hit=collision(hit))
    away = [course for course in every if course.away != {}]
    for (mark, told), names in grouped((_whereabouts(document, course), course.name) for course in away).items():
        yield Line(mark, f"{', '.join(names)}: {told}.")


def _whereabouts(document: Document, course: RunOutcome) -> Line:
    """Who did not arrive, and where each is."""
    if course.away is None:
        return Line("open", f"not known, {course.why}")
    resolved, ends = document["scenario"]["resolved"], []
    for robot, end in list(course.away.items())[:MAX_NAMES]:
        hit = course.hits.get(robot)
        who, at = (hit["robot"], hit["position_m"]) if hit else (robot, end)
        place = ", ".join(f"{round(x, 2) + 0.0:.2f}" for x in (at if who == resolved["uav"]["name"] else at[:2]))
        what = f"{collision(hit)}," if hit else f"{robot} is {ending(course, robot)}"
        lost = f"; {found_no_way([robot])}" * (robot in course.no_way)
        then = ": nothing after that counts" if hit else lost
        ends.append(f"{what} at ({place}) m{_off_the_paper(document, course.name, who)}{then}")
    if len(course.away) > MAX_NAMES:
        ends.append(f"{len(course.away) - MAX_NAMES} more")
    ugvs = len(resolved["ugvs"])
    count = f"{course.there} of {ugvs} UGVs; " * (ugvs > 2)
    return Line("no" if course.helped or course.hits else "none", count + "; ".join(dict.fromkeys(ends)))


def _off_the_paper(document: Document, run: str, robot: str) -> str:
    """How far the place where a robot stalled or collided is from that of the paper, if it counts as the same."""
    for row in document["reproduction"]:
        is_place = row["measure"] in ("stall_position", "collision_position") and row["status"] in MATCHES
        if is_place and (row["run"], row["robot"]) == (run, robot):
            return f", {dist(row['ours'], row['paper']):.2f} m from the paper's"
    return ""


def _runs(document: Document, every: Runs) -> Iterator[Line]:
    """What each run is, for readers who do not know its letter."""
    resolved, told = document["scenario"]["resolved"], []
    for course in (course for course in every if course.plain):
        own = course.method == "c" and not resolved["runs"][course.name].get("set")
        told.append(f"{course.name}: {of_run(resolved, course)}{f', {gatekeeper(resolved)}' * own}")
    if told:
        yield Line("", f"{'; '.join(told)}.")


def _messages(document: Document, every: Runs) -> Iterator[Line]:
    """What the UAV sent and withdrew, and the UGVs answered, beside a scheme without a trigger."""
    helped = (course.name for course in every if course.helped and course.name in document["runs"])
    taken = {name: document["runs"][name]["metrics"]["messages"] for name in helped}
    told = grouped((_of_kinds(found), run) for run, found in taken.items() if found["proposals"])
    if told:
        always = [found["always_on"] for found in taken.values()]
        most = {kind: max(each[kind] for each in always) for kind in always[0]}
        up_to = "up to " * any(0 < each[kind] < most[kind] for each in always for kind in most)
        runs = "; ".join(f"{', '.join(names)}: {says}" for says, names in told.items())
        yield say("messages", runs=runs, always=f"{up_to}{_of_kinds(most)}")


def _of_kinds(count: Mapping[str, int]) -> str:
    """How many proposals, withdrawals and answers; kinds without any are left out."""
    return joined([counted(n, kind) for kind in ("proposal", "withdrawal", "answer") if (n := count.get(f"{kind}s"))])


def _seeds(document: Document, every: Runs, kept: Claims) -> Iterator[Line]:
    """How many seeds keep every distance, and how many bring all home; runs with the same answer together."""
    decision, runs = (document["scenario"]["resolved"][key] for key in ("decision", "runs"))
    of_runs = grouped((row["run"], row) for row in document["seeds"])
    for (mark, told), names in grouped((_over_seeds(rows, kept), run) for run, rows in of_runs.items()).items():
        yield Line(mark, f"{', '.join(names)}: {told}.")
    noises = (run["set"].get("decision.noise_m_sqrt_s", decision["noise_m_sqrt_s"]) for run in runs.values())
    if of_runs and not any(noise > 0.0 for noise in noises):
        yield say("no_noise")


def _over_seeds(rows: Claims, kept: Claims) -> Line:
    """What came of a run with several seeds, rows of `seeds` in report.json."""
    seeds, fine, home = counted(len(rows), "seed"), *(sum(row[key] for row in rows) for key in ("kept", "home"))
    if fine == home == len(rows):
        return say("all_seeds", seeds=seeds)
    worst = min(rows, key=lambda row: row["min_distance_m"] - row["safe_distance_m"])
    apart = distance(worst["min_distance_m"], worst["safe_distance_m"])
    promises = {claim["expected"] for claim in kept if claim["run"] == rows[0]["run"]}
    promised = "; no distance is promised" * (promises == {NOTHING})
    told = clause("worst_seed", worst, apart=apart) * (fine < len(rows))
    line = say("some_seeds", kept=fine, seeds=seeds, home=home, worst=told, promised=promised)
    return line if fine else line._replace(mark="no")


def _zeno(document: Document, every: Runs, proofs: Claims, traces: Claims) -> Iterator[Line]:
    resolved = document["scenario"]["resolved"]
    period_s, of_runs = resolved["control"]["period_s"], {claim["run"] for claim in proofs}
    others = [course.name for course in every if course.name not in of_runs]
    told = grouped(
        ((claim["status"], claim["inputs"].get("dwell_s")), claim["run"] or ", ".join(others))
        for claim in proofs
        if claim["run"] or others or not every
    )
    for (status, dwell_s), names in told.items():
        where = f" ({', '.join(names)})" * (len(told) > 1)
        if status == "proved":  # a dwell below the control period keeps nothing apart that matters
            name = "dwell" if dwell_s >= period_s else "short_dwell"
            yield say(name, where=where, dwell_s=dwell_s, period_s=period_s)
        else:
            bare = ", as the trigger is the bare threshold" * (dwell_s == 0.0)
            line = say("no_dwell", where=where, bare=bare, status=status.replace("_", " "))
            yield line._replace(mark="no") if status == "refuted" else line
    bad = [claim for claim in traces if claim["status"] == "refuted"]
    for claim in bad:
        gap_s = (claim["counterexample"] or {}).get("gap_s")
        yield say("too_soon", run=claim["run"], gap="too close" if gap_s is None else f"{gap_s:.3g} s")
    if seen := [claim for claim in traces if claim["status"] in PASSING and claim["exercised"]]:
        gaps_s = (claim["evidence"].get("smallest_gap", {}).get("gap_s") for claim in seen)
        least_s = min((gap_s for gap_s in gaps_s if gap_s is not None), default=None)
        smallest = f"; the smallest is {least_s:.3f} s" if least_s is not None else ""
        yield say("gaps", gaps=counted(sum(claim["exercised"] for claim in seen), "gap"), smallest=smallest)
    elif traces and not bad:
        yield say("no_gaps", why="no UGV triggers twice" if triggers(document) else "nothing triggered")


def _threshold(document: Document, every: Runs, exact: Claims, quality: Claims, choice: Claims) -> Iterator[Line]:
    runs, fired = document["runs"], triggers(document)
    bad, unknown = _with(exact, ["refuted"]), _with(exact, UNDECIDED)
    having = [run for run in runs.values() if any(event["kind"] == "trigger" for event in run["events"])]
    zeta = " or ".join(f"{zeta:.4g}" for zeta in dict.fromkeys(run["zeta_m"] for run in having or runs.values()))
    yield from (say("mistriggered", run=run) for run in bad)
    if unknown:
        yield say("not_judged", runs=", ".join(unknown))
    if not fired and runs:
        largest = [ugv["largest_decision_variable_m"] for claim in exact for ugv in claim["evidence"].get("ugvs", ())]
        yield say("never_fired", zeta=zeta, largest=clause("largest", largest=max(largest)) if largest else "")
    elif exact and not bad and not unknown:
        times = sorted({round(event["t_s"], 3) for event in fired})
        often = f"{len(fired)} times{f' in {len(having)} runs' * (len(having) > 1)}, first " * (len(times) > 1)
        yield say("fired", zeta=zeta, when=f"{often}at {times[0]:.3f} s")
    yield from _quality(quality)
    for claim in choice:
        if "optimal_threshold_m" in claim["evidence"]:
            yield _choice(document, claim["evidence"], claim["inputs"])
            yield from _for_own_numbers(claim["evidence"], claim["inputs"])


def _with(of_runs: Claims, statuses: Iterable[str]) -> list[str]:
    """The runs on which a claim has one of these statuses."""
    return [claim["run"] for claim in of_runs if claim["status"] in statuses]


def _quality(of_runs: Claims) -> Iterator[Line]:
    """How the triggers compare with the task error without noise; where badly, beside (17)-(18)."""
    if unknown := _with(of_runs, UNDECIDED):
        yield say("not_compared", runs=", ".join(unknown))
    tested = [claim for claim in of_runs if claim["status"] not in UNDECIDED and claim["exercised"]]
    tested.sort(key=lambda claim: float(claim["margin"]))
    allowed = {claim["evidence"]["tolerance_m"] for claim in tested}
    told = grouped(
        ((claim["status"] == "refuted", _timing(claim["evidence"]), claim["evidence"]["tolerance_m"]), claim["run"])
        for claim in tested
    )
    for (bad, timing, tolerance_m), names in list(told.items())[:MAX_TOLD]:
        within = f", {tolerance_m:.3g} m off allowed" * (len(allowed) > 1)
        line = say("compared", where=f" ({', '.join(names)}{within})" * (len(told) > 1), timing=timing)
        yield line._replace(mark="no") if bad else line
    if others := [name for names in list(told.values())[MAX_TOLD:] for name in names]:
        yield say("no_worse", runs=", ".join(others))
    if tested and tested[0]["status"] == "refuted" and (ddm := tested[0]["evidence"]["ddm"]):
        ugv = max(ddm, key=lambda name: ddm[name]["error_rate"] or 0.0)
        wrong, due = (100 * (ddm[ugv][key] or 0.0) for key in ("error_rate", "error_rate_of_18"))
        mean_s = ddm[ugv]["decision_time_s"]
        mean = f", {mean_s:.2g} s in the mean" if mean_s is not None else ""
        yield say("ddm", ddm[ugv], ugv=ugv, run=tested[0]["run"], wrong=wrong, mean=mean, due=due)


def _timing(found: Mapping[str, Any]) -> str:
    """How late, how early, how often false or missed the triggers of a run were."""
    worst = {"late": found["latest"], "early": found["earliest"]}
    off = [clause("off", one, off_s=abs(one["late_s"]), early=word) for word, one in worst.items()
           if one and abs(one["late_s"]) >= 0.005]  # fmt: skip
    counts = found["counts"]
    fired = sum(counts.values()) - counts["missed"]
    wrong = f"{counts['false']} of {fired} false alarms" if counts["false"] else "no false alarm"
    return ", ".join([*off, wrong, f"{counts['missed'] or 'none'} missed"])


def _choice(document: Document, found: Mapping[str, Any], assumed: Mapping[str, Any]) -> Line:
    """Which rule gave the threshold, for which drift and noise, and what it costs against the optimum for these."""
    excess, ugvs = found["extra_risk"] / found["least_risk"], document["scenario"]["resolved"]["ugvs"].values()
    more = f"{100 * excess:.2g} % more risk than" if excess < 1.0 else f"{1.0 + excess:.2g} times the risk of"
    more = "no more than" if excess < NEGLIGIBLE else more
    fastest = max(ugv["max_speed_m_s"] + ugv["preset"]["speed_m_s"] for ugv in ugvs)
    too_fast = assumed["drift_m_s"] > fastest
    numbers = {"zeta": found["threshold_in_force_m"], "best": found["optimal_threshold_m"]}
    name, never = "chosen" if found["kind"] == "declared" else "optimal", clause("never", fastest=fastest) * too_fast
    line = say(name, assumed, **numbers, rule=RULES[found["rule"]], more=more, never=never)
    return line._replace(mark="none" if too_fast else "yes" if excess < NEGLIGIBLE else "partly")


def _for_own_numbers(found: Mapping[str, Any], assumed: Mapping[str, Any]) -> Iterator[Line]:
    """What the threshold costs for the drift and the noise of the run that asks for another one most, in seconds."""
    if rows := found.get("runs", {}):
        name = max(rows, key=lambda name: rows[name]["extra_risk"])
        row, (run, _, robot) = rows[name], name.partition(" ")
        cost_s, best = row["extra_risk"] / assumed["c1_1_s"], row["optimum_m"]
        delay = clause("delay", row, ideal=f"{best:.2g} m is best" if best else "the lower, the better", cost_s=cost_s)
        is_least = cost_s < NEGLIGIBLE_S
        line = say("own", row, robot=robot, run=run, what="no threshold is better" if is_least else delay)
        yield line if is_least else line._replace(mark="partly")


def _paper(document: Document, every: Runs) -> Iterator[Line]:
    if rows := document["reproduction"]:
        by = {status: [row["id"] for row in rows if row["status"] == status] for status in (*MATCHES, *REST)}
        matched = sum(len(by[status]) for status in MATCHES)
        told = ", ".join(f"{len(by[status])} {says}" for status, says in MATCHES.items() if by[status])
        rest = "".join(f"; {says}: {', '.join(by[status])}" for status, says in REST.items() if by[status])
        line = say("matches", matched=matched, all=len(rows), how=f"{f': {told}' * bool(told)}{rest}")
        yield line if len(by["reproduced"]) == len(rows) else line._replace(mark="partly" if matched else "no")


QUESTIONS = (
    Question("Safe?", _safe, in_table=True),
    Question("Arrived?", _arrived, in_table=True),
    Question("Runs", _runs, in_table=True),
    Question("Messages", _messages),
    Question("Seeds?", _seeds, ("SAFE-TRACE",)),
    Question("Zeno-free?", _zeno, ("ZENO-PROOF", "ZENO-TRACE")),
    Question("Threshold?", _threshold, ("THR-TRIG", "THR-QUALITY", "THR-CHOICE")),
    Question("Paper?", _paper),
)
"""The questions, in the order of the screen."""
