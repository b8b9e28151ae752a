"""The questions of a report's reader, answered: safe, arrived, Zeno-free, the threshold, the paper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from math import dist
from typing import Any, NamedTuple

from airground_drake.base.statuses import NOTHING, PASSING, UNDECIDED
from airground_drake.report.outcomes import Document, ProofOutcome, RunOutcome, claims, distance, tolerance, triggers
from airground_drake.report.phrases import (
    MAX_NAMES,
    Line,
    collision,
    counted,
    encounter,
    ending,
    found_no_way,
    gatekeeper,
    grouped,
    in_words,
    intrusion,
    joined,
    labels,
    more_pairs,
    of_run,
)

NEGLIGIBLE = 1e-3
"""A risk that exceeds the smallest one by less than this share counts as the smallest."""
NEGLIGIBLE_S = 0.01
"""A risk that exceeds the smallest one by less than this delay costs counts as the smallest, s."""
MAX_TOLD = 2
"""Maximum number of lines about triggers and the task error."""
RULES = {"fixed": "set by hand (rule fixed)", "printed": "by (19) as printed (rule printed)", "bayes": "rule bayes"}
"""Where a threshold comes from, by rule."""
_MATCHES = {"reproduced": "without tuning", "calibrated": "after calibration"}
_VOID = ": nothing after that counts"
_REST = {"by_construction": "by construction", "ambiguous": "ambiguous", "not_reproduced": "not reproduced"}


class Answer(NamedTuple):
    """A question and its answer."""

    question: str
    lines: list[Line]


def answers(document: Document, every: Sequence[RunOutcome], *, tabulated: bool) -> list[Answer]:
    """The questions that the report has something to say about; `tabulated`: those that no table of runs answers."""
    asked = {"Safe?": _safe(document, every), "Arrived?": _arrived(document, every), "Runs": _runs(document, every)}
    asked = {} if tabulated else asked
    asked |= {
        "Messages": _messages(document, every),
        "Seeds?": _seeds(document),
        "Zeno-free?": _zeno(document),
        "Threshold?": _threshold(document),
        "Paper?": _paper(document),
    }
    return [Answer(question, lines) for question, found in asked.items() if (lines := list(found))]


def _safe(document: Document, every: Sequence[RunOutcome]) -> Iterator[Line]:
    for course in every:
        if course.blameless:
            told = "; ".join(encounter(course, one) for one in course.encounters[:MAX_NAMES])
            more = len(course.encounters) - MAX_NAMES
            told += f"; {counted(more, 'more encounter')}" if more > 0 else ""
            yield Line("partly", f"{course.name}: {told}{' (expected)' * course.declared_unsafe}.")
    bad = [course for course in every if course.safe is False and not course.blameless]
    printed = [course for course in bad if not course.plain and not course.hits]
    for course in bad:
        if course not in printed:
            yield Line("no", f"{course.name}: {_intrusion(course)}{' (expected)' * course.declared_unsafe}.")
    for why, names in grouped((course.why, course.name) for course in every if course.safe is None).items():
        yield Line("open", f"{', '.join(names)}: not known, {why}.")
    kept = [course for course in every if course.safe]
    if pairs := [course.near[0] for course in kept if course.near]:
        tested, least = any(course.tested for course in kept), min(pairs)
        told = f"minimum distance {least.told()}, required {least.required_m:g} m"
        told += "" if tested else "; nothing came near, so this was not tested"
        yield Line("yes" if tested else "none", f"{', '.join(course.name for course in kept)}: {told}.")
    yield from _proof(every)
    if printed:
        told = _intrusion(min(printed, key=lambda course: course.near[:1]))
        told += " (expected)" * any(course.declared_unsafe for course in printed)
        home = "all arrive, but " * all(course.away == {} for course in printed)
        yield Line("no", f"{counted(len(printed), 'run')} with recursion (5) as printed: {home}{told}.")


def _intrusion(course: RunOutcome) -> str:
    """Who came how near to what, when, and how many others did."""
    hits = list(dict.fromkeys(map(collision, course.hits.values())))
    if hits:
        told = "; ".join([*hits[:MAX_NAMES], *([f"{len(hits) - MAX_NAMES} more collisions"] * (len(hits) > MAX_NAMES))])
    elif course.near and course.near[0].is_short:
        told = f"{intrusion(course)} at {course.near[0].t_s:.2f} s, required {course.near[0].required_m:g} m"
    else:
        return intrusion(course)
    more = more_pairs(course, max(1, len(hits)))
    return f"{told}{more}{' too close' * bool(more)}"


def _proof(every: Sequence[RunOutcome]) -> Iterator[Line]:
    """Whether the safety of method (d) is proved, one sentence per status."""
    of_d = [course for course in every if course.proof]
    told = grouped(((*_lacking(course.proof), course.proof.status), course) for course in of_d if course.proof)
    for (lacking, refuted, status), alike in told.items():
        runs, who = joined([course.name for course in alike]), joined([*chain(*labels(alike, of_d))])
        yield {
            "tested": Line("yes", f"Proved for {who}, whatever the UAV asks for{_covered(alike)}."),
            "idle": Line(
                "none", f"Proved for {who}, but nothing came near: its conditions hold with nothing to check."
            ),
            "refuted": Line("no", f"The proof does not apply to {runs}: its conditions did not hold ({lacking})."),
            "undecided": Line("open", f"Not known whether the proof applies to {runs} ({lacking})."),
            "unproved": Line("no" if refuted else "open", f"Not proved for {who} ({lacking})."),
        }[status]


def _covered(those: Sequence[RunOutcome]) -> str:
    """For which pairs, if something may move."""
    if not any(course.movers for course in those):
        return ""
    return ": distances from bodies at rest and between robots; beside what moves, that no robot brings itself too near"


def _lacking(proof: ProofOutcome) -> tuple[str, bool]:
    """What a proof lacks, by claim, and whether one of these claims is refuted."""
    told = (f"{name}: {in_words(claim) if claim else 'not checked'}" for name, claim in proof.lacking.items())
    return "; ".join(told), any(claim and claim["status"] == "refuted" for claim in proof.lacking.values())


def _arrived(document: Document, every: Sequence[RunOutcome]) -> Iterator[Line]:
    if home := [course for course in every if course.away == {} and course.plain]:
        last = max((time_s for course in home for time_s in course.arrived_s.values()), default=0.0)
        within = f" within {tolerance(document)} of their targets" if tolerance(document) else ""
        by = f", by {last:.1f} s" if last else ""
        yield Line("yes", f"{', '.join(course.name for course in home)}: all{within}{by}.")
    for course in every:
        for robot, hit in course.hits.items():
            if robot in course.arrived_s:
                told = f"{robot} arrives at {course.arrived_s[robot]:.1f} s; {collision(hit)}{_VOID}"
                yield Line("partly", f"{course.name}: {told}.")
    away = [course for course in every if course.away != {}]
    for (mark, says), names in grouped((_whereabouts(document, course), course.name) for course in away).items():
        yield Line(mark, f"{', '.join(names)}: {says}.")


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
        then = _VOID if hit else f"; {found_no_way([robot])}" if robot in course.no_way else ""
        ends.append(f"{what} at ({place}) m{_off_the_paper(document, course.name, who)}{then}")
    if len(course.away) > MAX_NAMES:
        ends.append(f"{len(course.away) - MAX_NAMES} more")
    ugvs = len(resolved["ugvs"])
    count = f"{course.there} of {ugvs} UGVs; " if ugvs > 2 else ""
    return Line("no" if course.helped or course.hits else "none", count + "; ".join(dict.fromkeys(ends)))


def _off_the_paper(document: Document, run: str, robot: str) -> str:
    """How far the place where a robot stalled or collided is from that of the paper, if it counts as the same."""
    off = [
        dist(row["ours"], row["paper"])
        for row in document["reproduction"]
        if (row["run"], row["robot"]) == (run, robot)
        and row["measure"] in ("stall_position", "collision_position")
        and row["status"] in _MATCHES
    ]
    return f", {off[0]:.2f} m from the paper's" if off else ""


def _seeds(document: Document) -> Iterator[Line]:
    """How many seeds keep every distance, and how many bring all home; runs with the same answer together."""
    of_runs = grouped((row["run"], row) for row in document["seeds"])
    for (mark, says), runs in grouped((_over_seeds(document, rows), run) for run, rows in of_runs.items()).items():
        yield Line(mark, f"{', '.join(runs)}: {says}.")
    if of_runs and not _noisy(document):
        yield Line("", "There is no decision noise: the seed changes nothing but what third-party code makes of it.")


def _over_seeds(document: Document, rows: Sequence[Mapping[str, Any]]) -> Line:
    """What came of a run with several seeds, rows of `seeds` in report.json."""
    count = len(rows)
    kept, home = (sum(row[key] for row in rows) for key in ("kept", "home"))
    if kept == home == count:
        return Line("yes", f"all {counted(count, 'seed')} keep every distance and bring all home")
    said = f"{kept} of {counted(count, 'seed')} keep every distance, {home} bring all home"
    if kept < count:
        worst = min(rows, key=lambda row: row["min_distance_m"] - row["safe_distance_m"])
        apart, required = distance(worst["min_distance_m"], worst["safe_distance_m"]), worst["safe_distance_m"]
        said += (
            f"; worst: {apart} ({worst['first']} to {worst['second']}, seed {worst['seed']}), required {required:g} m"
        )
    promises = {claim["expected"] for claim in claims(document, "SAFE-TRACE", run=rows[0]["run"])}
    said += "; no distance is promised" * (promises == {NOTHING})
    return Line("partly" if kept else "no", said)


def _noisy(document: Document) -> bool:
    """Whether any run has decision noise, which the seed determines."""
    resolved = document["scenario"]["resolved"]
    noise = resolved["decision"]["noise_m_sqrt_s"]
    return any(run["set"].get("decision.noise_m_sqrt_s", noise) > 0.0 for run in resolved["runs"].values())


def _runs(document: Document, every: Sequence[RunOutcome]) -> Iterator[Line]:
    """What each run is, for readers who do not know its letter."""
    resolved = document["scenario"]["resolved"]
    told = []
    for course in every:
        if course.plain:
            own = course.method == "c" and not resolved["runs"][course.name].get("set")
            told.append(f"{course.name}: {of_run(resolved, course)}{f', {gatekeeper(resolved)}' if own else ''}")
    if told:
        yield Line("", f"{'; '.join(told)}.")


def _messages(document: Document, every: Sequence[RunOutcome]) -> Iterator[Line]:
    """What the UAV sent and the UGVs answered, beside a scheme without a trigger."""
    taken = {course.name: document["runs"][course.name]["metrics"]["messages"] for course in every if course.helped
             and course.name in document["runs"]}  # fmt: skip
    told = grouped((_of_kinds(found), run) for run, found in taken.items() if found["proposals"])
    if told:
        always = [found["always_on"] for found in taken.values()]
        most = {kind: max(each[kind] for each in always) for kind in always[0]}
        up_to = "up to " * any(0 < each[kind] < most[kind] for each in always for kind in most)
        runs = "; ".join(f"{', '.join(names)}: {says}" for says, names in told.items())
        yield Line("", f"{runs}. Always-on supervision: {up_to}{_of_kinds(most)}.")


def _of_kinds(count: Mapping[str, int]) -> str:
    """Numbers of proposals and answers."""
    answers = f" and {counted(count['answers'], 'answer')}" if count["answers"] else ""
    return f"{counted(count['proposals'], 'proposal')}{answers}"


def _zeno(document: Document) -> Iterator[Line]:
    resolved = document["scenario"]["resolved"]
    decision = resolved["decision"]
    for status in (claim["status"] for claim in claims(document, "ZENO-PROOF", run="")):
        if status == "proved":
            yield _dwell(decision["min_inter_event_s"], resolved["control"]["period_s"])
        else:
            bare = ", as the trigger is the bare threshold" if decision["trigger"] == "bare" else ""
            mark = "no" if status == "refuted" else "open"
            yield Line(mark, f"Not proved{bare} (ZENO-PROOF: {status.replace('_', ' ')}).")
    of_runs = claims(document, "ZENO-TRACE")
    bad = [claim for claim in of_runs if claim["status"] == "refuted"]
    for claim in bad:
        gap = (claim["counterexample"] or {}).get("gap_s")
        yield Line("no", f"{claim['run']}: two triggers {f'{gap:.3g} s' if gap is not None else 'too close'} apart.")
    if seen := [claim for claim in of_runs if claim["status"] in PASSING and claim["exercised"]]:
        gaps = [claim["evidence"].get("smallest_gap", {}).get("gap_s") for claim in seen]
        least = min((gap for gap in gaps if gap is not None), default=None)
        smallest = f"; the smallest is {least:.3f} s" if least is not None else ""
        yield Line("", f"Seen: {counted(sum(claim['exercised'] for claim in seen), 'gap')} between triggers{smallest}.")
    elif of_runs and not bad:
        why = "no UGV triggers twice" if triggers(document) else "nothing triggered"
        yield Line("", f"These runs cannot show it: {why}. Scenario dwell does.")


def _dwell(dwell_s: float, period_s: float) -> Line:
    """The proved minimum inter-event time; shorter than a control period it keeps nothing apart that matters."""
    told = f"Proved: triggers are at least {dwell_s:g} s apart"
    if dwell_s >= period_s:
        return Line("yes", f"{told}.")
    return Line("partly", f"{told}. No practical protection: that is shorter than the control period, {period_s:g} s.")


def _threshold(document: Document) -> Iterator[Line]:
    of_runs = claims(document, "THR-TRIG")
    bad = [claim for claim in of_runs if claim["status"] == "refuted"]
    unknown = [claim["run"] for claim in of_runs if claim["status"] in UNDECIDED]
    fired, runs = triggers(document), document["runs"]
    zeta = " or ".join(f"{zeta:.4g}" for zeta in dict.fromkeys(run["zeta_m"] for run in runs.values()))
    for claim in bad:
        yield Line("no", f"{claim['run']}: a trigger is missed, spurious or at the wrong time (THR-TRIG).")
    if unknown:
        yield Line("open", f"{', '.join(unknown)}: not known whether triggers are missed (THR-TRIG).")
    if not fired and runs:
        yield Line("none", f"Not tested here: nothing reached the {zeta} m.")
    elif of_runs and not bad and not unknown:
        times = sorted({round(event["t_s"], 3) for event in fired})
        in_runs = f" in {len(runs)} runs" if len(runs) > 1 else ""
        when = f"at {times[0]:.3f} s" if len(times) == 1 else f"{len(fired)} times{in_runs}, first at {times[0]:.3f} s"
        yield Line("yes", f"Fired at {zeta} m, {when}. Follows its own variable exactly: none missed, none spurious.")
    yield from _quality(document)
    for claim in claims(document, "THR-CHOICE"):
        if "optimal_threshold_m" in claim["evidence"]:
            yield _choice(document, claim["evidence"], claim["inputs"])
            yield from _for_own_numbers(claim["evidence"], claim["inputs"])


def _quality(document: Document) -> Iterator[Line]:
    """How the triggers compare with the task error without noise; where badly, beside (17)-(18)."""
    of_runs = claims(document, "THR-QUALITY")
    if unknown := [claim["run"] for claim in of_runs if claim["status"] in UNDECIDED]:
        yield Line("open", f"{', '.join(unknown)}: not compared with the task error without noise (THR-QUALITY).")
    tested = [claim for claim in of_runs if claim["status"] not in UNDECIDED and claim["exercised"]]
    tested.sort(key=lambda claim: float(claim["margin"]))
    told = grouped(((claim["status"] == "refuted", _timing(claim["evidence"])), claim["run"]) for claim in tested)
    for (bad, timing), names in list(told.items())[:MAX_TOLD]:
        where = f" ({', '.join(names)})" if len(told) > 1 else ""
        yield Line("no" if bad else "yes", f"Against the task error without noise{where}: {timing}.")
    if others := [name for names in list(told.values())[MAX_TOLD:] for name in names]:
        yield Line("", f"{', '.join(others)}: less far off.")
    if tested and tested[0]["status"] == "refuted" and (ddm := tested[0]["evidence"]["ddm"]):
        ugv = max(ddm, key=lambda name: ddm[name]["error_rate"] or 0.0)
        yield Line("", _beside_the_ddm(tested[0]["run"], ugv, ddm[ugv]))


def _timing(found: Mapping[str, Any]) -> str:
    """How late, how early, how often false or missed the triggers of a run were."""
    off = []
    for side, word in (("latest", "late"), ("earliest", "early")):
        if (one := found[side]) and abs(one["late_s"]) >= 0.005:
            off.append(f"up to {abs(one['late_s']):.2f} s {word} (at {one['error_m']:.2f} m)")
    counts = found["counts"]
    fired = sum(counts.values()) - counts["missed"]
    wrong = f"{counts['false']} of {fired} false alarms" if counts["false"] else "no false alarm"
    missed = f"{counts['missed']} missed" if counts["missed"] else "none missed"
    return ", ".join([*off, wrong, missed])


def _beside_the_ddm(run: str, ugv: str, of: Mapping[str, Any]) -> str:
    """Error rate and decision time of a UGV beside (17)-(18)."""
    given = f"{of['drift_m_s']:.2g} m/s and {of['noise_m_sqrt_s']:g} m/√s"
    mean = f", {of['decision_time_s']:.2g} s in the mean" if of["decision_time_s"] is not None else ""
    due = f"{100 * of['error_rate_of_18']:.2g} % wrong, {of['decision_time_of_17_s']:.2g} s"
    wrong = f"{100 * (of['error_rate'] or 0):.2g} % wrong"
    return f"Decisions about {ugv} in run {run}: {wrong}{mean}. By (17)-(18), for its {given}: {due}."


def _choice(document: Document, found: Mapping[str, Any], assumed: Mapping[str, Any]) -> Line:
    """Which rule gave the threshold, for which drift and noise, and what it costs against the optimum for these."""
    zeta, best = found["threshold_in_force_m"], found["optimal_threshold_m"]
    excess = found["extra_risk"] / found["least_risk"]
    given = f"{assumed['drift_m_s']:.4g} m/s and {assumed['noise_m_sqrt_s']:.4g} m/√s"
    fastest = max(ugv["max_speed_m_s"] + ugv["preset"]["speed_m_s"] for ugv in _ugvs(document))
    too_fast = assumed["drift_m_s"] > fastest
    mark = "none" if too_fast else "yes" if excess < NEGLIGIBLE else "partly"
    if found["kind"] != "declared":
        told = f" is the Bayes optimum for the assumed {given}"
    else:
        cost = "costs no more than" if excess < NEGLIGIBLE else f"costs {_more(excess)}"
        told = f", {RULES[found['rule']]}, {cost} the Bayes optimum {best:.4g} m for the assumed {given}"
    never = f"; no task error here grows faster than {fastest:.3g} m/s" if too_fast else ""
    return Line(mark, f"{zeta:.4g} m{told}{never}.")


def _ugvs(document: Document) -> list[Mapping[str, Any]]:
    return list(document["scenario"]["resolved"]["ugvs"].values())


def _more(excess: float) -> str:
    """An excess, relative, in words before "the optimum"."""
    return f"{100 * excess:.2g} % more risk than" if excess < 1.0 else f"{1.0 + excess:.2g} times the risk of"


def _for_own_numbers(found: Mapping[str, Any], assumed: Mapping[str, Any]) -> Iterator[Line]:
    """What the threshold costs for the drift and the noise of the run that asks for another one most, in seconds."""
    rows = found.get("runs", {})
    if not rows:
        return
    name = max(rows, key=lambda name: rows[name]["extra_risk"])
    row, (run, _, robot) = rows[name], name.partition(" ")
    cost_s, best = row["extra_risk"] / assumed["c1_1_s"], row["optimum_m"]
    told = f"{robot} had {row['drift_m_s']:.2g} m/s and {row['noise_m_sqrt_s']:g} m/√s in run {run}"
    if cost_s < NEGLIGIBLE_S:
        yield Line("yes", f"{told}: for these, too, no threshold is better.")
    else:
        ideal = f"{best:.2g} m is best" if best else "the lower, the better"
        cost = f"{row['threshold_m']:.4g} m costs as much as a delay of {cost_s:.2g} s"
        yield Line("partly", f"{told}: for these, {ideal}, and {cost}.")


def _paper(document: Document) -> Iterator[Line]:
    if not (rows := document["reproduction"]):
        return
    by = {status: [row["id"] for row in rows if row["status"] == status] for status in (*_MATCHES, *_REST)}
    matched = sum(len(by[status]) for status in _MATCHES)
    mark = "yes" if len(by["reproduced"]) == len(rows) else "partly" if matched else "no"
    told = ", ".join(f"{len(by[status])} {says}" for status, says in _MATCHES.items() if by[status])
    parts = [f"{matched} of {len(rows)} results match{': ' if told else ''}{told}"]
    parts += [f"{says}: {', '.join(by[status])}" for status, says in _REST.items() if by[status]]
    yield Line(mark, f"{'; '.join(parts)}.")
