"""SAFE-TRACE and SAFE-HYP: the distances of a run, and the hypotheses of the invariance proof along it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache, partial
from itertools import chain
from typing import NamedTuple

import numpy as np

from .files import Json
from .rules import SMALL, Array, Disagreement, Found, NotEstablished, agrees, at_most, close, holds, same
from .run import Run
from .scenario import Pair

MOST_LISTED = 300
"""Pairs that the evidence lists at most: those of least margin."""


@lru_cache(maxsize=4096)
def least_distance_m(run: Run, pair: Pair) -> float:
    """Least distance of a pair over continuous time.

    On a segment the relative position is r + s w, 0 <= s <= 1; |r + s w|^2 is least at s = -r.w / w.w.
    """
    relative = run.position_m[pair.robot] - run.position_m[pair.other]
    r, w = relative[:-1], np.diff(relative, axis=0)
    ww = (w * w).sum(axis=1)
    s = np.clip(-(r * w).sum(axis=1) / np.where(ww > 0.0, ww, 1.0), 0.0, 1.0)
    return float(np.linalg.norm(r + s[:, None] * w, axis=1).min())


def safe_trace(run: Run, claim: Json) -> Found:
    """SAFE-TRACE: min over t of ||p_i(t) - q_j(t)|| >= d_ij for every pair."""
    by_names = {(entry["first"], entry["second"]): entry for entry in claim["evidence"]["pairs"]}
    known = {(pair.robot, pair.other) for pair in run.pairs}
    same("pairs", claim["evidence"]["pairs_in_all"], len(known))
    same("pairs", sorted({*by_names} - known), [])
    same("pairs", [len(claim["evidence"]["pairs"]), len(by_names)], [min(len(known), MOST_LISTED)] * 2)
    largest = max(float(entry["margin_m"]) for entry in by_names.values())
    margins, close_by, doubtful = {}, 0, 0
    for pair in run.pairs:
        names, closing = (pair.robot, pair.other), pair.closing_m_s * run.scenario["control"]["period_s"]
        if names not in by_names and run.apart_m[names] - pair.safe_m > max(largest, closing + SMALL):
            continue
        least = least_distance_m(run, pair)
        margins[names] = least - pair.safe_m
        spare = margins[names] - closing
        close_by += spare < -SMALL
        doubtful += abs(spare) <= SMALL
        about = ", ".join(names)
        if names not in by_names:
            farther = margins[names] >= largest - SMALL
            holds("a pair that is not listed is farther apart", farther, margins[names], largest, about=about)
            continue
        _evidence_on_a_pair(run, pair, least, by_names[names])
        if abs(spare) > SMALL:
            same("a period at full speed breaks it", by_names[names]["exercised"], bool(spare < 0.0), about=about)
    margin = min(margins.values())
    worst = claim["where"]["first"], claim["where"]["second"]
    close("pair of least margin", margins[worst], margin, within=SMALL, about=", ".join(worst))
    status = "holds" if margin >= -SMALL else "refuted"
    found = Found.with_margin(status, margin, tolerance_m=SMALL, pairs_in_all=len(known)).having_judged(*JUDGED)
    found = found.judging(partial(_where_pairs_meet, run, claim, by_names[worst]), *JUDGED_OF_THE_WORST)
    return found.counted(close_by, close_by + doubtful)


def _where_pairs_meet(run: Run, claim: Json, worst: Json) -> None:
    """Time of least distance, and the counterexample, are those of the pair of least margin."""
    about, shown = f"{worst['first']}, {worst['second']}", claim["counterexample"]
    same("time of least distance", claim["where"]["t_s"], worst["t_s"], about=about)
    if shown:
        same("counterexample", {key: shown.get(key) for key in worst}, worst, about=about)
        _snapshot(run, shown)


PAIR_KEYS = ("first", "second", "safe_distance_m", "min_distance_m", "margin_m", "t_s", "row", "exercised")
"""What is recorded of a pair; that it is exercised is judged where rounding does not decide it."""
JUDGED = ("where.first", "where.second", *(f"evidence.pairs.*.{key}" for key in PAIR_KEYS))
SNAPSHOT = ("counterexample.positions_m.*", "counterexample.velocities_m_s.*")
JUDGED_OF_THE_WORST = ("where.t_s", *(f"counterexample.{key}" for key in PAIR_KEYS), *SNAPSHOT)


def _snapshot(run: Run, shown: Json) -> None:
    """Places at the time of a counterexample, and velocities just after it, of the things that it names."""
    when = shown["t_s"]
    row = min(int(np.searchsorted(run.t_s, when + SMALL)), len(run.t_s) - 1)
    named = {value for value in shown.values() if isinstance(value, str) and value in run.position_m}
    same("things in the counterexample", sorted(shown["positions_m"]), sorted(named))
    same("robots in the counterexample", sorted(shown["velocities_m_s"]), sorted(named & {*run.robots}))
    for name, place in shown["positions_m"].items():
        close("place in the counterexample", place, run.place_m(name, when), within=SMALL, about=name, t_s=when)
    for name, velocity in shown["velocities_m_s"].items():
        now = run.command_m_s[name][row]
        close("velocity in the counterexample", velocity, now, within=SMALL, about=name, t_s=when)


def _evidence_on_a_pair(run: Run, pair: Pair, least_m: float, recorded: Json) -> None:
    about, when = f"{pair.robot}, {pair.other}", recorded["t_s"]
    there = np.linalg.norm(run.place_m(pair.robot, when) - run.place_m(pair.other, when))
    close("least distance", recorded["min_distance_m"], least_m, within=SMALL, about=about, t_s=when)
    close("margin of a pair", recorded["margin_m"], least_m - pair.safe_m, within=SMALL, about=about, t_s=when)
    close("distance at the recorded time", recorded["min_distance_m"], there, within=SMALL, about=about, t_s=when)
    agrees("safe distance", recorded["safe_distance_m"], pair.safe_m, within=0.0, about=about)
    row = recorded["row"]
    holds("row of the least distance", type(row) is int and 0 < row < len(run.t_s), row, "a row", about=about)
    within = run.t_s[row - 1] - SMALL <= when <= run.t_s[row] + SMALL
    holds("row of the least distance", within, row, "the one at the end of the segment", about=about, t_s=when)


class Hypothesis(NamedTuple):
    """A hypothesis of SAFE-INV at some instants: it holds where its margin is not negative.

    Of an avoidance inequality `kind` says who moves and what it avoids, such as `ugv beside obstacle`. `about` are the
    robots that it is about, as recorded; where there is another one at each instant, `others` has their names.
    """

    name: str
    unit: str
    t_s: Array
    margin: Array
    about: Mapping[str, str] = {}
    others: tuple[str, ...] = ()
    kind: str = ""
    slop: float = SMALL

    @property
    def who(self) -> tuple[str, str]:
        """The hypothesis, and the robot: of these the evidence has the least margin."""
        return self.name, next(iter(self.about.values()), "")

    def margin_at(self, recorded: Json) -> float | None:
        """The margin at an instant as recorded, that is of the other one there; None if there is none."""
        there = np.abs(self.t_s - recorded["t_s"]) <= SMALL
        if self.others:
            there &= np.array([other == recorded.get("second") for other in self.others])
        described = {"hypothesis": self.name, **self.about, "unit": self.unit}
        if not there.any() or any(recorded.get(key) != value for key, value in described.items()):
            return None
        return float(self.margin[there].min())


KINDS = ("ugv beside obstacle", "uav beside obstacle", "ugv beside ugv", "ugv beside uav", "uav beside ugv")
DOUBT_M_S = 1e-11
"""An inequality binds where a command has 1e-9 m/s to spare at most; of one this close to that, rounding decides."""


def _binding(found: list[Hypothesis], recorded: Json) -> tuple[int, int]:
    """How many avoidance inequalities bound a command, at least and at most; by kinds as recorded."""
    least, most = dict.fromkeys(KINDS, 0), dict.fromkeys(KINDS, 0)
    for each in found:
        if each.name == "avoidance":
            least[each.kind] += int((each.margin <= SMALL - DOUBT_M_S).sum())
            most[each.kind] += int((each.margin <= SMALL + DOUBT_M_S).sum())
    same("kinds of inequalities", sorted(recorded), sorted(KINDS))
    for kind in KINDS:
        possible = type(recorded[kind]) is int and least[kind] <= recorded[kind] <= most[kind]
        between = f"{least[kind]}" if least[kind] == most[kind] else f"{least[kind]} to {most[kind]}"
        holds("inequalities that bind", possible, recorded[kind], between, about=kind)
    return sum(least.values()), sum(most.values())


AVOIDANCE, BUILT = "avoidance", "controller parameters"
MOST_MISSED = ("first", "second", "safe_distance_m", "guarantee_m", "e_m", "t_s")
"""What is recorded of a pair and what it is promised."""


def safe_hyp(run: Run, claim: Json) -> Found:
    """SAFE-HYP: the hypotheses of the safety theorem held at every control sample, up to e for each pair of bodies.

    In floats, so that what is missed is known to 1e-9 m. What the controllers were built with is not judged here.

    Raises:
        NotEstablished: if the controllers are said to differ from the scenario.
    """
    evidence, leading = claim["evidence"], AVOIDANCE
    if evidence["different_parameters"]:
        raise NotEstablished("the controllers are the scenario's", "the trace says otherwise", BUILT)
    others, lost, spares = [*_constants(run), *_velocities(run)], [*_lost(run)], [*_inequalities(run)]
    found = [*others, *lost]
    broken = [(each, k) for each in found for k in np.flatnonzero(~(each.margin >= -each.slop))[:1]]
    first_s = None
    if broken:
        first, k = min(broken, key=lambda one: float(one[0].t_s[one[1]]))
        first_s = float(first.t_s[k])
        if claim["status"] == "holds":
            raise Disagreement("the hypotheses held", "held", float(first.margin[k]), first.name, first_s)
        leading = claim["where"]["hypothesis"]
        earliest = sorted({each.name for each, j in broken if each.t_s[j] <= first_s + SMALL})
        holds("hypothesis broken first", leading in earliest, leading, " or ".join(earliest), t_s=first_s)
    margins = [float(each.margin.min()) for each in found if each.name == leading and len(each.margin)]
    status = "refuted" if broken else "holds"
    margin = min(margins, default=0.0)
    least, most = _binding(spares, evidence["inequalities_that_bind"])
    facts = {"inequalities_in_range": sum(len(each.margin) for each in spares), "tolerance_m": SMALL}
    result = Found(status, margin, margin, facts).counted(least, most)
    result = result.having_judged("evidence.inequalities_that_bind.*")
    shown = tuple(f"counterexample.{key}" for key in LISTED)
    result = result.judging(partial(_first_broken, run, claim, found, first_s), *shown, *SNAPSHOT)
    result = result.judging(partial(_worst, claim, others), "evidence.worst.*.*")
    of_pairs = [f"evidence.pairs.*.{key}" for key in MOST_MISSED] if evidence["pairs"] else ["evidence.pairs"]
    promised = (*of_pairs, "evidence.e_m", "evidence.guarantee_m")
    result = result.judging(partial(_promised, run, claim, lost), *promised)
    return result.judging(partial(_where, claim, leading, margin), *(f"where.{key}" for key in LISTED))


def _promised(run: Run, claim: Json, lost: list[Hypothesis]) -> None:
    """What each listed pair missed, and what it is promised; no other one is promised less."""
    evidence, gain, periods = claim["evidence"], _gain(run), len(run.sample_s)
    safe = {(pair.robot, pair.other): pair.safe_m for pair in run.pairs}
    least = {(each.about["first"], each.about["second"]): each.margin for each in lost}
    for entry in evidence["pairs"]:
        names = entry["first"], entry["second"]
        about, margin = ", ".join(names), least.get(names, np.zeros(1))
        holds("a pair of the run", names in safe, about, "one of its pairs")
        same("safe distance", entry["safe_distance_m"], safe[names], about=about)
        close("promised distance", entry["guarantee_m"], safe[names] + margin.min(), within=SMALL, about=about)
        e = -margin.min() * (gain if gain else 1.0 / periods)
        close("what is missed", entry["e_m"], e, within=SMALL, about=about)
        if entry["t_s"] is not None:
            there = margin[np.abs(run.sample_s[: len(margin)] - entry["t_s"]) <= SMALL]
            close("when the most is missed", there, margin.min(keepdims=True), within=SMALL, about=about)
    listed = {(entry["first"], entry["second"]) for entry in evidence["pairs"]}
    for each in lost:
        names = each.about["first"], each.about["second"]
        holds("a pair that misses something is listed", names in listed or len(listed) == MOST_LISTED
              or each.margin.min() >= -SMALL, ", ".join(names), "listed")  # fmt: skip
    largest = max((entry["e_m"] for entry in evidence["pairs"]), default=0.0)
    same("the most that is missed", evidence["e_m"], largest)
    first = evidence["pairs"][0]["guarantee_m"] if evidence["pairs"] else None
    same("the least promise", evidence["guarantee_m"], first)


def _first_broken(run: Run, claim: Json, found: list[Hypothesis], first_s: float | None) -> None:
    """The counterexample is of the first instant at which a hypothesis is broken."""
    shown = claim["counterexample"]
    if shown and first_s is not None:
        close("time of the counterexample", shown["t_s"], first_s, within=SMALL)
        at_most("margin of the counterexample", shown["margin"], 0.0, t_s=first_s)
        _is_attained(found, shown, "counterexample", (*LISTED, "positions_m", "velocities_m_s"))
        _snapshot(run, shown)


LISTED = ("hypothesis", "robot", "first", "second", "other", "t_s", "margin", "unit")
"""What is recorded of a hypothesis at an instant."""


def _is_attained(found: list[Hypothesis], recorded: Json, what: str, keys: tuple[str, ...] = LISTED) -> None:
    """A margin is attained at the instant, and by those, that are recorded with it."""
    strange = sorted({*recorded} - {*keys})
    same(f"keys of {what}", strange, [])
    there = [at for each in found if (at := each.margin_at(recorded)) is not None]
    about = f"{recorded['hypothesis']}, {recorded.get('robot', recorded.get('first', ''))}"
    when = recorded["t_s"]
    holds(f"{what} is of an instant of the run", bool(there), str(recorded), "one that there is", about=about, t_s=when)
    off = min(abs(at - recorded["margin"]) for at in there)
    holds(f"margin of {what}", off <= SMALL, recorded["margin"], str(there), about=about, t_s=when)


def _worst(claim: Json, found: list[Hypothesis]) -> None:
    """The least margin of each hypothesis and robot, and where it is attained."""
    recorded = claim["evidence"]["worst"]
    least: dict[tuple[str, str], float] = {}
    for each in found:
        if len(each.margin):
            least[each.who] = min(least.get(each.who, np.inf), float(each.margin.min()))
    named = [(str(entry["hypothesis"]), str(entry.get("robot", entry.get("first", "")))) for entry in recorded]
    same("hypotheses in the evidence", sorted(map(list, named)), sorted(map(list, least)))
    for who, entry in zip(named, recorded, strict=True):
        close("least margin", entry["margin"], least[who], within=SMALL, about=", ".join(who), t_s=entry["t_s"])
        _is_attained(found, entry, "least margin")


def _where(claim: Json, leading: str, margin: float | None) -> None:
    """Where the margin is attained: one of the least ones of the leading hypothesis."""
    if leading == AVOIDANCE:
        worst = claim["evidence"]["pairs"][:1]
        due = {"hypothesis": AVOIDANCE, **{key: pair[key] for pair in worst for key in ("first", "second")}}
        same("where the margin is attained", claim["where"], due)
        return
    listed = [entry for entry in claim["evidence"]["worst"] if entry["hypothesis"] == leading]
    lowest = [entry for entry in listed if margin is not None and entry["margin"] <= margin + SMALL]
    places = [{key: entry[key] for key in entry if key not in ("margin", "unit")} for entry in lowest]
    there = claim["where"] in places or (margin is None and claim["where"] == {})
    holds("where the margin is attained", there, str(claim["where"]), str(places))


def _constants(run: Run) -> Iterator[Hypothesis]:
    """A h <= 1; every pair starts at its safe distance; the sensing range covers d + (closing speed) h."""
    control, start = run.scenario["control"], run.t_s[:1]
    h = control["period_s"]
    yield Hypothesis("gain: A h <= 1", "1", start, np.array([1.0 - control["avoidance_gain_1_s"] * h]))
    first = {name: place[0] for name, place in run.position_m.items()}
    for robot in dict.fromkeys(pair.robot for pair in run.pairs):
        pairs = [pair for pair in run.pairs if pair.robot == robot]
        others, about = tuple(pair.other for pair in pairs), {"first": robot}
        offset = np.array([first[robot] - first[other] for other in others])
        safe, closing = np.array([(pair.safe_m, pair.closing_m_s) for pair in pairs]).T
        each = np.repeat(start, len(safe))
        yield Hypothesis("safe start", "m", each, np.linalg.norm(offset, axis=1) - safe, about, others)
        yield Hypothesis("sensing range", "m", each, control["sensing_range_m"] - safe - closing * h, about, others)


def _velocities(run: Run) -> Iterator[Hypothesis]:
    """||v|| <= v_max; z constant for a UGV; straight from sample to sample. Rows within 1e-9 s are one instant."""
    t, begins, samples = run.t_s, run.t_s[:-1], run.t_s[run.sample_row]
    spacing = np.diff(np.append(samples, t[-1]))
    yield Hypothesis("sampling", "s", samples, run.scenario["control"]["period_s"] - spacing)
    rows = np.append(run.sample_row, len(t) - 1)
    for robot, spec in run.robots.items():
        v, place, about = run.command_m_s[robot], run.position_m[robot], {"robot": robot}
        straight = np.stack([np.interp(t, t[rows], axis[rows]) for axis in place.T], axis=1)
        yield Hypothesis("straight motion", "m", t, -np.linalg.norm(place - straight, axis=1), about)
        spare = spec["max_speed_m_s"] - np.linalg.norm(v[1:], axis=1)
        yield Hypothesis("speed limit", "m/s", begins, spare, about)
        if robot != run.uav:
            yield Hypothesis("planar motion", "m", t, -np.abs(place[:, 2] - place[0, 2]), about, slop=0.0)


def _gain(run: Run) -> float:
    """What of a deficit is restored in a control period, A h, at most 1."""
    control = run.scenario["control"]
    return min(float(control["avoidance_gain_1_s"] * control["period_s"]), 1.0)


def _lost(run: Run) -> Iterator[Hypothesis]:
    """What each pair's steps miss of its inequalities at each sample, as what this costs of the safe distance.

    Where the two are farther apart than d and both steps, nothing is asked of them. Without a gain nothing is restored.
    """
    rows = np.append(run.sample_row, len(run.t_s) - 1)
    periods = (np.diff(run.t_s[rows]) / run.scenario["control"]["period_s"])[:, None]
    periods = np.where(np.abs(periods - 1.0) <= 1e-6, 1.0, periods)
    gain, place = _gain(run), {name: each[rows] for name, each in run.position_m.items()}
    step = {name: np.diff(each, axis=0) / periods for name, each in place.items()}
    longest = {name: float(np.linalg.norm(each, axis=1).max()) for name, each in step.items()}
    for pair in run.pairs:
        robot, other = pair.robot, pair.other
        if run.apart_m[robot, other] > pair.safe_m + longest[robot] + longest[other] + SMALL:
            continue
        offset = (place[robot] - place[other])[:-1]
        distance = np.linalg.norm(offset, axis=1)
        normal = offset / np.where(distance > 0.0, distance, 1.0)[:, None]
        bound = np.where(distance <= pair.safe_m, gain, 1.0) * (pair.safe_m - distance)
        missed = [np.maximum(share * bound - sign * (normal * step[name]).sum(axis=1), 0.0)
                  for name, sign, share in ((robot, 1.0, pair.share), (other, -1.0, 1.0 - pair.share))]  # fmt: skip
        far = distance >= pair.safe_m + sum(np.linalg.norm(step[name], axis=1) for name in (robot, other))
        loss = np.where(far, 0.0, missed[0] + missed[1]) * (1.0 / gain if gain else len(distance))
        yield Hypothesis(AVOIDANCE, "m", run.sample_s, -loss, {"first": robot, "second": other})


def _inequalities(run: Run) -> Iterator[Hypothesis]:
    """n.v >= share A (d - D) where D <= d, else n.v >= -share (D - d) / h, for what is within sensing range."""
    sort = {robot: "uav" if robot == run.uav else "ugv" for robot in run.robots}
    for pair in chain.from_iterable(run.near_views.values()):
        kind = f"{sort[pair.robot]} beside {sort.get(pair.other, 'obstacle')}"
        spare = avoidance_spare_m_s(run, pair, run.command_m_s[pair.robot][run.chosen_row])
        seen = np.isfinite(spare)
        about = {"robot": pair.robot, "other": pair.other}
        yield Hypothesis("avoidance", "m/s", run.sample_s[seen], spare[seen], about, kind=kind)


def avoidance_spare_m_s(run: Run, pair: Pair, v_m_s: Array) -> Array:
    """n.v less its bound at every control sample, (S,); infinite beyond the sensing range.

    Args:
        run: the run.
        pair: the robot that moves, and what it avoids.
        v_m_s: velocity of the robot at the samples, (S, 3); a UGV cannot use the z component of n.
    """
    control = run.scenario["control"]
    offset = run.position_m[pair.robot][run.sample_row] - run.position_m[pair.other][run.sample_row]
    distance = np.linalg.norm(offset, axis=1)
    normal = offset / np.where(distance > 0.0, distance, 1.0)[:, None]
    if pair.robot != run.uav:
        normal = normal * [1.0, 1.0, 0.0]
    steepness = np.where(distance <= pair.safe_m, control["avoidance_gain_1_s"], 1.0 / control["period_s"])
    bound = pair.share * steepness * (pair.safe_m - distance)
    return np.where(distance <= control["sensing_range_m"], (normal * v_m_s).sum(axis=1) - bound, np.inf)
