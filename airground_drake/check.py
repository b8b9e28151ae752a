"""An independent check of a report: `python -m airground_drake.check DIR`.

Every verdict in DIR/report.json is established again from trace/<run>/ and certificates/<claim>/, by formulas written
here from the statements of the claims; proofs in exact rational arithmetic. Only the standard library, numpy and pandas
are used: no Drake, no solver, nothing else of this package. One line per claim and run:

    agrees                     established again, with the recorded status, margin and evidence
    DISAGREES                  the files contradict the verdict or each other
    cannot be re-established   a file is missing or unreadable, or this program knows no way to decide the claim

Exit codes: 0 everything agrees; 1 something does not; 2 usage, or no report.

Taken from the record and not repeated (the line says so): comparisons of proofs with the running code, and the paths
simulated for THR-DDM and ZENO-REFINE, whose verdicts follow from the recorded counts. Every certificate of a proof is
expanded, and the key ones must be the statements of STATEMENTS, with the scenario's numbers and no premise besides;
that the obligations together make the claim is the argument in the claim's text.

What no such program can notice: a run that was made up and obeys its own motion, trigger, inequalities and problems
throughout (a digest says that a file is the recorded one, not that a simulation made it); a scenario that was another
from the beginning; and what no verdict depends on: texts, the noise as such, times between the quantiles. Evidence is
compared where it is recomputed here; solvers' answers, cross-checks and the numbers of a counterexample are not. Not
looked at: the reproduction table, findings about the paper except for their flag, report.html, junit.xml, the diagram.
"""

from __future__ import annotations

import ast
import hashlib
import io
import json
import math
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import partial
from itertools import pairwise, product, zip_longest
from operator import add, mul, sub, truediv
from pathlib import Path
from statistics import NormalDist
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

Json = dict[str, Any]
TABLES = ("signals.parquet", "decisions.parquet", "problems.parquet")
SMALL = 1e-9
"""Tolerance of the claims on times (s), lengths (m) and velocities (m/s)."""
EVENT_S, VARIABLE_M = 1e-5, 1e-6
AGREES, DISAGREES, OPEN = "agrees", "DISAGREES", "cannot be re-established"


class Disagreement(Exception):  # noqa: N818 - what the program is for, not an error
    """Something in the files contradicts something else in them."""


class Found(NamedTuple):
    """What a claim's own formula gives; `facts` must be in the recorded evidence, the margin equal to within `slop`."""

    status: str
    margin: float | None = None
    facts: Mapping[str, Any] = MappingProxyType({})
    slop: float = 1e-7
    remark: str = ""


def demand(condition: Any, otherwise: str) -> None:
    """Raise Disagreement unless the condition is true."""
    if not condition:
        raise Disagreement(otherwise)


def same(ours: Any, theirs: Any, what: str, slop: float = 1e-7) -> None:
    """Raise Disagreement where a recorded value is not the recomputed one; keys unknown here are left alone."""
    if isinstance(ours, Mapping) and isinstance(theirs, dict):
        for key, value in ours.items():
            same(value, theirs.get(key), f"{what}.{key}", slop)
    elif isinstance(ours, (list, tuple)) and isinstance(theirs, list) and len(ours) == len(theirs):
        for i, both in enumerate(zip(ours, theirs, strict=True)):
            same(*both, f"{what}[{i}]", slop)
    else:
        numbers = all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in (ours, theirs))
        equal = abs(ours - theirs) <= slop * (1.0 + abs(ours)) if numbers else ours == theirs
        demand(equal, f"{what} is recorded as {theirs!r:.60}, recomputed {ours!r:.60}")


def read_json(path: Path) -> Any:
    """Strict JSON: no NaN, no infinity, no key twice."""

    def pairs(found: list[tuple[str, Any]]) -> Json:
        demand(len(dict(found)) == len(found), f"{path.name}: a key is there twice")
        return dict(found)

    def constant(text: str) -> None:
        raise Disagreement(f"{path.name}: {text} is no strict JSON")

    return json.loads(path.read_text(encoding="utf-8"), parse_constant=constant, object_pairs_hook=pairs)


# ---------------------------------------------------------------------------------------------- runs


class Run:
    """A trace that is of the run it claims to be, agrees with report.json, and obeys its own law of motion.

    Attributes (T rows): `t` (T,) s; `where` places by name, robots (T, 3), obstacles (1, 3), m; `v` commands of robots,
    (T - 1, 3), m/s, each in force up to the end of its segment.
    """

    def __init__(self, folder: Path, name: str, report: Json) -> None:
        """Read and check the files; Disagreement if they contradict each other."""
        meta, entry, scenario = read_json(folder / "meta.json"), report["runs"][name], report["scenario"]["resolved"]
        demand(meta["schema"] == "airground_drake.trace/2", f"schema {meta['schema']!r}")
        data = [(folder / file).read_bytes() for file in TABLES]
        for file, content in zip(TABLES, data, strict=True):
            demand(hashlib.sha256(content).hexdigest() == meta["files"][file], f"{file}: not the recorded SHA-256")
        self.signals, self.decisions, self.problems = (pd.read_parquet(io.BytesIO(content)) for content in data)
        self.timings, self.name, self.scenario = read_json(folder / "timings.json"), name, scenario
        demand(meta["scenario"] == scenario, "the trace is of another scenario than report.json")
        demand(meta["run"] == name, f"the trace is of run {meta['run']!r}")
        shared = ("method", "composition", "seed", "zeta_m", "events", "faults")
        same({key: entry[key] for key in shared}, meta, "meta.json", 0.0)
        same({key: meta[key] for key in shared[:2]}, scenario["runs"][name], "run", 0.0)
        demand(meta["seed"] == scenario["seed"] == report["provenance"]["seed"], "the seed is not the scenario's")
        self.method, self.events, self.zeta = meta["method"], meta["events"], float(meta["zeta_m"])
        same(threshold(scenario), self.zeta, "zeta_m")
        self.ugvs, self.uav = list(scenario["ugvs"]), scenario["uav"]["name"]
        self.spec = {**scenario["ugvs"], self.uav: scenario["uav"]}
        demand([meta["ugvs"], meta["robots"]] == [self.ugvs, list(self.spec)], "the robots are not the scenario's")
        self.t = self.column("t_s")
        self.where = {robot: self.vector(f"{robot}.{{}}_m") for robot in self.spec}
        self.v = {robot: self.vector(f"{robot}.v{{}}_m_s")[1:] for robot in self.spec}
        for obstacle, spec in scenario["obstacles"].items():
            self.where[obstacle] = np.array([spec["position_m"]], dtype=np.float64)
        self.x = {ugv: Variable(self, ugv) for ugv in self.ugvs}
        self._motion()
        least: Json = {robot: {} for robot in self.spec}
        for one, other, safe, share in self.pairs():
            if share == 1.0:
                least[one][other] = {"value": self.least_distance(one, other), "safe_distance_m": safe}
        counts = {robot: dict(Counter(e["kind"] for e in self.events if e["robot"] == robot)) for robot in self.spec}
        ends = {robot: self.where[robot][-1].tolist() for robot in self.spec}
        same({"min_distance_m": least, "final_position_m": ends, "event_counts": counts}, entry["metrics"], "metrics")
        self._events()

    def column(self, name: str) -> Any:
        """A column of the signals, (T,)."""
        values = self.signals[name].to_numpy(dtype=np.float64)
        demand(np.isfinite(values).all(), f"column {name} has values that are not finite")
        return values

    def vector(self, name: str) -> Any:
        """Three columns, (T, 3); {} in the name stands for the axis."""
        return np.stack([self.column(name.format(axis)) for axis in "xyz"], axis=1)

    def place(self, name: str, t: float) -> Any:
        """Position of a robot or obstacle at a time, (3,), m."""
        moving = len(self.where[name]) == len(self.t)
        return np.array([np.interp(t, self.t, axis) for axis in self.where[name].T]) if moving else self.where[name][0]

    def pairs(self) -> Iterator[tuple[str, str, float, float]]:
        """(robot, obstacle or other robot, safe distance in m, share of each robot)."""
        safe, robots = self.scenario["safe_distance"], list(self.spec)
        for i, robot in enumerate(robots):
            yield from ((robot, name, safe["obstacle_m"], 1.0) for name in self.scenario["obstacles"])
            for other in robots[i + 1 :]:
                yield robot, other, safe["air_ground_m" if other == self.uav else "ugv_m"], 0.5

    def least_distance(self, one: str, other: str) -> float:
        """Least distance over continuous time, m: |r0 + s w|^2 is least at s = -r0.w / w.w on each segment."""
        r = self.where[one] - self.where[other]
        r0, w = r[:-1], np.diff(r, axis=0)
        ww = (w * w).sum(axis=1)
        s = np.clip(-(r0 * w).sum(axis=1) / np.where(ww > 0.0, ww, 1.0), 0.0, 1.0)
        return float(np.linalg.norm(r0 + s[:, None] * w, axis=1).min())

    def times(self, robot: str, kind: str) -> Any:
        """Times of a robot's events of a kind, s."""
        return np.array(sorted(float(e["t_s"]) for e in self.events if (e["robot"], e["kind"]) == (robot, kind)))

    def _motion(self) -> None:
        """Rows from 0 to the duration, at every control sample; starts and straight steps as the commands say."""
        t, duration, period = self.t, float(self.scenario["duration_s"]), float(self.scenario["control"]["period_s"])
        demand(len(t) > 1 and (np.diff(t) > 0.0).all(), "time does not increase from row to row")
        demand(abs(t[0]) <= SMALL and abs(t[-1] - duration) <= SMALL, "the rows do not cover the run")
        samples = np.arange(math.ceil((duration - SMALL) / period)) * period
        apart = np.abs(t[np.searchsorted(t, samples - SMALL)] - samples)
        demand(apart.max() <= SMALL, f"no row at the control sample {samples[np.argmax(apart)]:.6g} s")
        for robot, v in self.v.items():
            same(self.spec[robot]["start_m"], self.where[robot][0].tolist(), f"start of {robot}", SMALL)
            off = np.abs(np.diff(self.where[robot], axis=0) - np.diff(t)[:, None] * v).max(axis=1)
            k = int(np.argmax(off))
            demand(off[k] <= SMALL, f"{robot} is {off[k]:.3g} m from where its command leads, t = {t[k + 1]:.6g} s")

    def _events(self) -> None:
        """All events but proposals follow from signals and decisions; who follows an intervention has accepted it."""
        t, table, period = self.t, self.decisions, self.scenario["control"]["period_s"]
        found = [(float(e["t_s"]), str(e["robot"]), "proposal") for e in self.events if e["kind"] == "proposal"]
        for robot in self.spec:
            away = np.linalg.norm(self.where[robot] - np.array(self.spec[robot]["target_m"]), axis=1)
            far = np.flatnonzero(away > self.scenario["arrival_tolerance_m"])
            found += [(when, robot, "arrival") for when in t[int(far[-1]) + 1 if len(far) else 0 :][:1]]
            for name in self.scenario["obstacles"]:
                hit = np.linalg.norm(self.where[robot] - self.where[name], axis=1)
                hit = hit < self.scenario["safe_distance"]["collision_m"]
                found += [(when, robot, "collision") for when in t[hit & ~np.append(False, hit[:-1])]]
        chosen = np.floor((t[1:] + t[:-1]) / 2.0 / period) * period + SMALL  # sample at which a command was chosen
        for ugv in self.ugvs:
            for kind, name in (("trigger", "triggered_at_s"), ("release", "released_at_s")):
                found += [(when, ugv, kind) for when in np.unique(self.column(f"{ugv}.{name}")) if when >= 0.0]
            of_ugv = table[table["robot"] == ugv]
            when, issued, answer = (of_ugv[name].to_numpy() for name in ("t_s", "issued_s", "decision"))
            given = self.times(ugv, "proposal")
            demand((np.diff(when) > 0.0).all() and np.isin(issued, given).all(), f"{ugv}: decisions on no proposal")
            new = np.append(True, (issued[1:] != issued[:-1]) | (answer[1:] != answer[:-1]))[: len(when)]
            found += [(w, ugv, str(what)) for w, what in zip(when[new], answer[new], strict=True)]
            asked, yes = (when, answer == "accept") if self.method in "cd" else (given, given >= 0.0)
            last = np.searchsorted(asked, chosen[self.column(f"{ugv}.accepted")[1:] != 0.0], side="right") - 1
            demand((last >= 0).all() and yes[last].all(), f"{ugv} follows an intervention that was not accepted")
        demand(all(a["t_s"] <= b["t_s"] for a, b in pairwise(self.events)), "the events are not ordered by time")
        recorded = sorted((e["t_s"], e["robot"], e["kind"]) for e in self.events)
        same(sorted((float(when), robot, kind) for when, robot, kind in found), [list(e) for e in recorded], "events")
        for event in self.events:
            where = self.place(event["robot"], event["t_s"]).tolist()
            same(where, event["position_m"], f"position of the {event['kind']} at {event['t_s']:.6g} s")

    def safe_trace(self, claim: Json) -> Found:
        """SAFE-TRACE: least distance of every pair in continuous time."""
        keys = ("first", "second", "safe_distance_m", "min_distance_m")
        pairs = [(one, other, safe, self.least_distance(one, other)) for one, other, safe, _ in self.pairs()]
        margin = min(least - safe for _, _, safe, least in pairs)
        facts = {"pairs": [dict(zip(keys, pair, strict=True)) for pair in pairs]}
        for said in claim["evidence"]["pairs"]:
            apart = self.place(said["first"], said["t_s"]) - self.place(said["second"], said["t_s"])
            same(float(np.linalg.norm(apart)), said["min_distance_m"], f"distance at {said['t_s']} s")
        return Found("holds" if margin >= -SMALL else "refuted", margin, facts)

    def safe_hyp(self, claim: Json) -> Found:
        """SAFE-HYP: the proof's inequalities at each control sample, the hold in between, limits, start and range."""
        control, t, specs = self.scenario["control"], self.t, self.spec
        h, gain, sensed = control["period_s"], control["avoidance_gain_1_s"], control["sensing_range_m"]
        sample, first = np.unique(np.floor((t[1:] + t[:-1]) / 2.0 / h), return_index=True)
        owner = np.searchsorted(first, np.arange(len(t) - 1), side="right") - 1  # sample of each segment
        found = [("gain: A h <= 1", t[:1], np.array([1.0 - gain * h]))]  # name, times, margins
        for robot, v in self.v.items():
            found.append(("zero-order hold", t[:-1], -np.linalg.norm(v - v[first][owner], axis=1)))
            found.append(("speed limit", t[:-1], specs[robot]["max_speed_m_s"] - np.linalg.norm(v, axis=1)))
            found += [("planar motion", t[:-1], -np.abs(v[:, 2]))] if robot != self.uav else []
        in_range = 0
        for one, other, safe, share in self.pairs():
            closing = sum(specs[robot]["max_speed_m_s"] for robot in (one, other) if robot in specs)
            found.append(("sensing range", t[:1], np.array([sensed - safe - closing * h])))
            offset = (self.where[one] - self.where[other])[first]
            distance = np.linalg.norm(offset, axis=1)
            found.append(("safe start", t[:1], distance[:1] - safe))
            required = share * np.where(distance <= safe, gain * (safe - distance), (safe - distance) / h)
            near = distance <= sensed
            for robot, away in ((one, offset), (other, -offset)):
                if robot in specs:
                    rate = (away * [1.0, 1.0, float(robot == self.uav)] * self.v[robot][first]).sum(axis=1)
                    spare = rate / np.where(distance > 0.0, distance, 1.0) - required
                    found.append(("avoidance", sample[near] * h, spare[near]))
                    in_range += int(near.sum())
        broken = [(times[bad][0], name) for name, times, margin in found if (bad := ~(margin >= -SMALL)).any()]
        name = claim["where"].get("hypothesis") if broken else "avoidance"
        earliest = {what for when, what in broken if when <= min(broken)[0] + SMALL}
        demand(not broken or name in earliest, f"first broken is {sorted(earliest)}, not {name!r}")
        margin = min((float(x.min()) for what, _, x in found if what == name and len(x)), default=None)
        return Found("refuted" if broken else "holds", margin, {"inequalities_in_range": in_range})

    def zeno_trace(self, _: Json) -> Found:
        """ZENO-TRACE: gaps between recorded triggers."""
        bound = float(self.scenario["decision"]["min_inter_event_s"])
        times = {ugv: self.times(ugv, "trigger") for ugv in self.ugvs}
        facts = {"triggers": {ugv: {"count": len(x), "t_s": x.tolist()} for ugv, x in times.items()}, "bound_s": bound}
        gap = min((float(np.diff(x).min()) for x in times.values() if len(x) > 1), default=None)
        if bound <= 0.0 or gap is None:
            return Found("holds", None, facts) if bound > 0.0 else Found("not_run")
        return Found("holds" if gap >= bound - SMALL else "refuted", gap - bound, facts)

    def thr_trig(self, _: Json) -> Found:
        """THR-TRIG: the automaton run on x(t) = ||preset - p|| + noise, against events, modes and the recorded x."""
        decision, t = self.scenario["decision"], self.t
        bare = decision["trigger"] == "bare"
        release, dwell = (self.zeta, 0.0) if bare else (decision["release_m"], decision["min_inter_event_s"])
        right, lags, facts = True, [], []
        for ugv, x in self.x.items():
            steps = x.automaton(self.zeta, release, dwell)
            ours = [(when, kind) for when, kind, _ in steps if kind]
            theirs = sorted((when, kind) for kind in ("trigger", "release") for when in self.times(ugv, kind))
            facts.append({"robot": ugv, "events": [{"t_s": when, "kind": kind} for when, kind in ours]})
            for a, b in zip_longest(ours, theirs):
                if a and b and a[1] == b[1] and abs(a[0] - b[0]) <= EVENT_S:
                    lags.append(abs(a[0] - b[0]))
                else:
                    right &= not (a and b) and (a or b)[0] >= t[-1] - EVENT_S
            right &= bool(np.abs(self.column(f"{ugv}.decision_variable_m") - x(t)).max() <= VARIABLE_M)
            modes, when = np.array([0, *(m for _, _, m in steps)]), np.array([w for w, _, _ in steps])
            early, late = (modes[np.searchsorted(when, t + side)] for side in (-EVENT_S, EVENT_S))
            mode, count = self.column(f"{ugv}.mode"), self.column(f"{ugv}.triggers")
            right &= bool(((mode == early) | (mode == late)).all())
            for kind, name in (("trigger", "triggered_at_s"), ("release", "released_at_s")):
                times, value = np.append(-1.0, self.times(ugv, kind)), self.column(f"{ugv}.{name}")
                held = [np.searchsorted(times[1:], t + side) for side in (-SMALL, SMALL)]
                fits = [(value == times[n]) & ((count == n) | (kind == "release")) for n in held]
                right &= bool((fits[0] | fits[1]).all())
        margin = EVENT_S - max(lags) if lags and right else None
        more = {"zeta_m": self.zeta, "release_m": release, "dwell_s": dwell}
        return Found("holds" if right else "refuted", margin, {"ugvs": facts, **more}, 1e-9)

    def live_goal(self, _: Json) -> Found:
        """LIVE-GOAL: ends at targets, or stalls where the scenario says so."""
        stalls, t = self.scenario["runs"][self.name]["stalls_m"], self.t
        arrival, stalled = float(self.scenario["arrival_tolerance_m"]), self.scenario["stall_tolerance_m"]
        found: list[tuple[str, str, float]] = []
        for robot, spec in self.spec.items():
            at, goal, what = self.where[robot], spec["target_m"], "at its target"
            if robot == self.uav and stalls:
                goal = np.mean([self.where[ugv][-1] for ugv in self.ugvs], axis=0) + np.array(
                    [0.0, 0.0, spec["altitude_m"]]
                )
                what = "over the centroid of the UGVs"
            away = float(np.linalg.norm(at[-1] - goal))
            if robot in stalls:
                late = np.vstack([self.place(robot, max(t[-1] - 1.0, t[0])), at[t >= t[-1] - 1.0]])
                moved = float(np.linalg.norm(late - at[-1], axis=1).max())
                off = float(np.linalg.norm(at[-1] - stalls[robot]))
                found += [(robot, "at its stall point", stalled - off), (robot, "stands", 1e-3 - moved)]
            found.append((robot, "short of its target" if robot in stalls else what, arrival - away))
            if robot in stalls:
                found[-1] = (robot, "short of its target", away - arrival)
        least = min(margin for _, _, margin in found)
        facts = [{"robot": robot, "condition": what, "margin_m": margin} for robot, what, margin in found]
        return Found("holds" if least >= 0.0 else "refuted", least, {"conditions": facts})

    def interventions(self, ugv: str) -> tuple[Any, Any]:
        """Begins and ends of the stays in mode 1, (K,) s each; the mode of a row is in force since the row before."""
        inside = np.concatenate([[0], self.column(f"{ugv}.mode")[1:] == 1.0, [0]])
        begins, ends = self.t[np.flatnonzero(np.diff(inside))].reshape(-1, 2).T
        return begins, ends

    def comm(self, _: Json) -> Found:
        """COMM: proposals and decisions only while intervening, and fewer than always-on."""
        scenario, strays, spent = self.scenario, 0, {"proposal": 0, "decision": 0}
        periods = {"proposal": scenario["intervention"]["period_s"], "decision": scenario["gatekeeper"]["period_s"]}
        for ugv in self.ugvs:
            begins, ends = self.interventions(ugv)
            decided = self.decisions.loc[self.decisions["robot"] == ugv, "t_s"].to_numpy()
            for kind, times in (("proposal", self.times(ugv, "proposal")), ("decision", decided)):
                spent[kind] += len(times)
                soon = times[:, None] - ends <= sum(periods.values()) + SMALL
                strays += int((~((times[:, None] >= begins - SMALL) & soon).any(axis=1)).sum())
                due = (kind == "proposal" or self.method in "cd") and (ends - begins > sum(periods.values())).any()
                if due and not len(times):
                    return Found("not_run")
        most = {k: len(self.ugvs) * int((scenario["duration_s"] + SMALL) / p) for k, p in periods.items()}
        most["decision"] *= self.method in "cd"
        saved = min((1.0 - spent[kind] / count for kind, count in most.items() if count), default=None)
        held = not strays and all(spent[kind] <= count for kind, count in most.items())
        return Found("holds" if held else "refuted", None if strays else saved, {"spent": spent, "always_on": most})

    def gate_time(self, _: Json) -> Found:
        """GATE-TIME: the 99th percentile of the recorded CPU times, rounded up."""
        times = np.sort(np.array(self.timings["decision_times_s"], dtype=np.float64))
        if not len(times) or not len(self.decisions):
            return Found("not_run")
        demand(len(times) == len(self.decisions) and times[0] >= 0.0, "not one time >= 0 for each decision")
        p50, p99 = (float(times[math.ceil(level * (len(times) - 1))]) for level in (0.5, 0.99))
        period = float(self.scenario["gatekeeper"]["period_s"])
        facts = {"p50_s": p50, "p99_s": p99, "max_s": float(times[-1]), "period_s": period, "count": len(times)}
        return Found("holds" if p99 < period else "refuted", period - p99, facts)

    def plans(self) -> list[Plan]:
        """Every decision with its problem; LookupError if a UGV was intervened on for long and none is recorded."""
        rows, problems, scenario = self.decisions, self.problems, self.scenario
        demand(len(rows) == len(problems), "decisions and problems differ in number")
        for ugv in self.ugvs:
            begins, ends = self.interventions(ugv)
            due = ends - begins > scenario["intervention"]["period_s"] + scenario["gatekeeper"]["period_s"]
            if due.any() and not (rows["robot"] == ugv).any():
                raise LookupError(f"no decision on {ugv}, which was intervened on")
        sent = {(e["robot"], e["t_s"], e["policy"]) for e in self.events if e["kind"] == "proposal"}
        known = set(zip(rows["robot"], rows["issued_s"], rows["policy"], strict=True)) <= sent
        demand(
            known and set(rows["route"]) <= {scenario["gatekeeper"]["route"]}, "decisions of another policy or route"
        )
        both = zip(rows.to_dict("records"), problems.to_dict("records"), strict=True)
        return [Plan(dict(row), dict(data), int(scenario["gatekeeper"]["stages"])) for row, data in both]

    def gate_feas(self, _: Json) -> Found:
        """GATE-FEAS: problem data against the trace; (23), (25) and clearance of the plan; the answers by the rules."""
        gate, right, plans = self.scenario["gatekeeper"], True, self.plans()
        before: dict[str, tuple[float, str, float, float]] = {}  # by UGV: issued, answer, since when, time of decision
        for p in plans:
            now, ugv, issued = p.row["t_s"], p.row["robot"], p.row["issued_s"]
            right &= self._situated(p) and (not p.planned or p.consistent())
            known, standing, since, last = before.get(ugv, (-1.0, "", now, now))
            standing, due = (standing, last + gate["period_s"]) if known == issued else ("", now)
            answer, reason = p.answer(standing, now - since, gate)
            right &= abs(now - due) <= SMALL and (answer, reason) == (p.row["decision"], p.row["reason"])
            before[ugv] = (issued, answer, since if answer == standing else now, now)
        # the recorded margin is the part of a tolerance that rounding leaves: anything from 0 to 1
        return Found("holds" if right else "refuted", 0.5 if right and plans else None, {"decisions": len(plans)}, 0.34)

    def _situated(self, p: Plan) -> bool:
        """Whether a problem is about the UGV's situation: position, preset, and what it senses, moving on straight."""
        gate, now, ugv = self.scenario["gatekeeper"], p.row["t_s"], p.row["robot"]
        after = gate["horizon_s"] / gate["stages"] * np.arange(1.0, gate["stages"] + 1.0)
        off = [p.dt - after[0], p.a - gate["error_weight_1_m2_s"], p.b - gate["slack_weight_1_m2_s"]]
        off += [p.initial - self.place(ugv, now), p.reference - self.x[ugv].reference(now + after)]
        right, left = all(float(np.abs(each).max()) <= SMALL for each in off), list(range(len(p.distances)))
        for one, other, safe, _ in self.pairs():
            name = other if one == ugv else one if other == ugv else ugv
            at = self.place(name, now)
            if name == ugv or np.linalg.norm(at - p.initial) > self.scenario["control"]["sensing_range_m"]:
                continue
            held = max(0, min(int(np.searchsorted(self.t, now - SMALL)), len(self.t) - 1) - 1)
            path = at + after[:, None] * (self.v[name][held] if name in self.v else np.zeros(3))
            known = [
                j for j in left if abs(p.distances[j] - safe) + np.abs(p.centres[:, j] - path).max() <= 2.0 * SMALL
            ]
            left = [j for j in left if j not in known[:1]]
            if not known:  # left out of the problem: then out of reach
                right &= not p.planned or bool((np.linalg.norm(p.positions - path, axis=1) >= safe).all())
        return right and not left

    def gate_sur(self, _: Json) -> Found:
        """GATE-SUR: (28)-(29) again, and the integrated rounding error, at most half a stage."""
        right, margins, plans = True, [], self.plans()
        for p in plans:
            if not len(p.relaxed):
                demand(p.row["status"] != "optimal", "an optimal decision without a relaxation")
                continue
            deficit = np.cumsum(p.relaxed) - np.cumsum(p.rounded) + p.rounded
            right &= bool(((p.rounded == (deficit >= 0.5)) | (np.abs(deficit - 0.5) <= SMALL)).all())
            right &= bool((np.abs(p.relaxed - 0.5) <= 0.5).all() and np.isin(p.rounded, (0.0, 1.0)).all())
            error = float(p.dt * np.abs(np.cumsum(p.relaxed - p.rounded)).max())
            off = max(abs(p.row["rounding_deviation_s"] - error), abs(p.row["relaxed_first_stage"] - p.relaxed[0]))
            right &= off <= SMALL and error <= (0.5 + SMALL) * p.dt
            margins.append(max(0.0, p.dt / 2.0 - error))
        if not margins:
            return Found("not_run" if plans else "holds")
        return Found("holds" if right else "refuted", min(margins) if right else None)

    def gate_opt(self, _: Json) -> Found:
        """GATE-OPT: an enclosure of every optimum, see `Plan.enclose`; what is recorded of gap and bound against it."""
        right, gaps, plans, route = True, [], self.plans(), self.scenario["gatekeeper"]["route"]
        for p in plans if route in ("relaxed", "branch_and_bound", "enumeration") else []:
            if p.planned:
                lines, row, bound = (None if route == "enumeration" else p.normals), p.row, p.row["lower_bound"]
                constant = [p.path(np.full(len(p.plan), mode)) for mode in (0.0, 1.0)]
                least, (lower, upper) = max(1e-6, min(map(p.cost, constant))), p.enclose(route == "relaxed", lines)
                demand(upper - lower <= 1e-4 * least, "the recorded relaxation is too far from the optimum to bound it")
                gaps.append((p.cost(p.positions) - lower) / least)
                # the plan of the choice that lost is not recorded: along normals it costs what it does, or more
                known = [p.cost(path, lines) for path in (*constant, *([p.path(p.rounded)] if len(p.rounded) else []))]
                own = p.cost(p.positions, lines)
                best = min(own, max(row["objective_accept"], row["objective_refuse"]), *known)
                low, high = ((cost - bound) / max(cost, 1e-12) for cost in (best, own))
                right &= lines is None or bool(np.abs(np.linalg.norm(lines, axis=2) - 1.0).max(initial=0.0) <= SMALL)
                right &= bound <= min(own, upper) + 1e-5 * least and low - 1e-6 <= row["gap"] <= high + 1e-6
                most = [p.cost(path) * (1.0 + SMALL) + SMALL for path in constant]  # of the plan, and of each choice
                right &= gaps[-1] <= 0.05 and row["objective"] <= min(most)
                right &= row["objective_refuse"] <= most[0] and row["objective_accept"] <= most[1]
        if not gaps:
            return Found("inconclusive" if plans else "holds")
        return Found("holds" if right else "refuted", 0.05 - max(gaps) if right else None, {"bounded": len(gaps)}, 1e-5)


class Plan:
    """A decision's problem (26) and what was found: N stages, m points to keep away from."""

    def __init__(self, row: dict[Any, Any], data: dict[Any, Any], n: int) -> None:
        """Arrays in shape; Disagreement where a number is missing or not finite."""
        self.row, flat = row, {name: np.array(value, dtype=np.float64).ravel() for name, value in data.items()}
        numbers = [*flat.values(), np.array([value for value in row.values() if isinstance(value, float)])]
        demand(all(np.isfinite(value).all() for value in numbers), f"decision at {row['t_s']} s: numbers not finite")
        m, self.distances, self.initial = len(flat["distances_m"]), flat["distances_m"], flat["initial_m"]
        self.dt, self.a, self.b = (float(data[k]) for k in ("dt_s", "error_weight_1_m2_s", "slack_weight_1_m2_s"))
        self.plan, self.relaxed, self.rounded = flat["plan"], flat["relaxed"], flat["rounded"]
        self.accept, self.refuse = flat["accept_m_s"].reshape(n, 3), flat["refuse_m_s"].reshape(n, 3)
        self.reference, self.positions = flat["reference_m"].reshape(n, 3), flat["positions_m"].reshape(-1, 3)
        self.centres, self.normals = flat["centres_m"].reshape(n, m, 3), flat["normals"].reshape(-1, m, 3)
        self.planned = row["status"] in ("optimal", "budget_spent")
        demand(not self.planned or len(self.plan) == len(self.positions) == n, "a decision without its plan")

    def path(self, omega: Any) -> Any:
        """(23): positions at the ends of the stages, (N, 3), m."""
        return self.initial + self.dt * np.cumsum(self.refuse + omega[:, None] * (self.accept - self.refuse), axis=0)

    def clearance(self, path: Any, normals: Any = None) -> Any:
        """Distances less the safe ones, (N, m), m; along normals if given."""
        away = path[:, None] - self.centres
        return (np.linalg.norm(away, axis=2) if normals is None else (away * normals).sum(axis=2)) - self.distances

    def cost(self, path: Any, normals: Any = None) -> float:
        """(25), slack being what the distances lack at most."""
        slack = np.maximum(0.0, -self.clearance(path, normals)).max(axis=1, initial=0.0)
        return float(self.dt * (self.a * ((path - self.reference) ** 2).sum() + self.b * (slack**2).sum()))

    def consistent(self) -> bool:
        """Whether plan, positions, costs and clearance belong together (route 'rollout' has its own dynamics)."""
        row, total = self.row, self.cost(self.positions)
        first = "accept" if self.plan[0] == 1.0 else "refuse"
        other = min(row["objective_accept"], row["objective_refuse"])
        clear = min(float(self.clearance(self.positions).min(initial=np.inf)), 1e9)
        off = [(row["objective"] - total) / max(total, 1e-6), (row[f"objective_{first}"] - total) / max(total, 1e-6)]
        off += [max(0.0, row["objective"] - other) / max(total, 1e-6), row["predicted_clearance_m"] - clear]
        off += [self.positions - self.path(self.plan)] if row["route"] != "rollout" else []
        binary = np.isin(self.plan, (0.0, 1.0)).all() and row["first_stage"] == first
        return bool(binary and all(np.abs(each).max() <= SMALL for each in off))

    def answer(self, standing: str, stood: float, gate: Json) -> tuple[str, str]:
        """Answer and reason by the rules; `standing` is the answer so far ('': none), for `stood` s."""
        if not self.planned:
            return "refuse", "no_plan"
        cost = {"accept": self.row["objective_accept"], "refuse": self.row["objective_refuse"]}
        bent, other = self.row["bend"] > gate["max_bend"], "refuse" if standing == "accept" else "accept"
        if not standing:
            useless = cost["accept"] >= (1.0 - 1e-6) * cost["refuse"]
            reason = (
                "not_cheaper" if self.plan[0] != 1.0 else "no_difference" if useless else "bent" if bent else "cheaper"
            )
            return "accept" if reason == "cheaper" else "refuse", reason
        cheaper = cost[other] < (1.0 - gate["switching_margin"]) * cost[standing]
        if not (cheaper or bent if standing == "accept" else cheaper and not bent):
            return standing, "kept"
        return (standing, "dwell") if stood < gate["min_dwell_s"] - SMALL else (other, "reversed")

    def enclose(self, relaxed: bool, lines: Any) -> tuple[float, float]:
        """Bounds of the least cost of a relaxed plan, or of one that is constant on each of 10 blocks of stages.

        J with distances along lines is convex: it is nowhere below its tangent at the recorded relaxation, which is
        least at a corner of the box. Plans on blocks are few enough to be evaluated one by one.
        """
        if not relaxed:
            blocks = np.arange(len(self.accept)) * min(10, len(self.accept)) // len(self.accept)
            plans = (np.array([n >> block & 1 for block in blocks]) for n in range(2 ** (int(blocks[-1]) + 1)))
            return (least := min(self.cost(self.path(plan), lines) for plan in plans)), least
        path = self.path(self.relaxed)
        reach, slope = self.clearance(path, lines), 2.0 * self.dt * self.a * (path - self.reference)
        if reach.shape[1]:
            k, j = np.arange(len(reach)), reach.argmin(axis=1)
            slope += (2.0 * self.dt * self.b * np.minimum(0.0, reach[k, j]))[:, None] * lines[k, j]
        by_stage = self.dt * (self.accept - self.refuse) * np.cumsum(slope[::-1], axis=0)[::-1]
        slopes, value = by_stage.sum(axis=1), self.cost(path, lines)
        return value + float(np.minimum(-slopes * self.relaxed, slopes * (1.0 - self.relaxed)).sum()), value


class Variable:
    """x(t) = ||preset(t) - p(t)|| + noise(t); between rows and corners of the preset it is convex in time."""

    def __init__(self, run: Run, ugv: str) -> None:
        """Cut at its minima (ternary search), so that x is monotone between the knots `t`."""
        preset = run.scenario["ugvs"][ugv]["preset"]
        self._corners, speed = np.array(preset["waypoints_m"], dtype=np.float64), float(preset["speed_m_s"])
        self._passed = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(self._corners, axis=0), axis=1))) / speed
        self._rows, self._own = run.t, np.column_stack([run.where[ugv], run.column(f"{ugv}.noise_m")])
        off = np.abs(run.vector(f"{ugv}.ref_{{}}_m") - self.reference(run.t)).max()
        demand(off <= SMALL, f"the recorded preset of {ugv} is {off:.3g} m from that of the scenario")
        t = np.union1d(run.t, self._passed[(self._passed > run.t[0]) & (self._passed < run.t[-1])])
        low, high = t[:-1], t[1:]
        for _ in range(90):
            left, right = low + (high - low) / 3.0, high - (high - low) / 3.0
            falls = self(left) > self(right)
            low, high = np.where(falls, left, low), np.where(falls, high, right)
        self.t = np.union1d(t, (low + high) / 2.0)
        self.x = self(self.t)

    def reference(self, t: Any) -> Any:
        """Preset trajectory at times (K,): (K, 3), m."""
        return np.stack([np.interp(t, self._passed, axis) for axis in self._corners.T], axis=1)

    def __call__(self, t: Any) -> Any:
        """x at times (K,), m."""
        own = np.stack([np.interp(t, self._rows, column) for column in self._own.T], axis=1)
        return np.linalg.norm(self.reference(t) - own[:, :3], axis=1) + own[:, 3]

    def first(self, level: float, after: float, above: bool) -> float | None:
        """First time after `after`, s, at which x comes to be >= level, or < level; by bisection."""
        later = np.flatnonzero(((self.x >= level) == above) & (self.t > after))
        if not len(later):
            return None
        low, high = max(after, float(self.t[later[0] - 1])), float(self.t[later[0]])
        for _ in range(60):
            middle = (low + high) / 2.0
            low, high = (low, middle) if (self(np.array([middle]))[0] >= level) == above else (middle, high)
        return high

    def automaton(self, zeta: float, release: float, dwell: float) -> list[tuple[float, str, int]]:
        """(time, event or '', mode from then on) of the trigger."""
        found: list[tuple[float, str, int]] = []
        now = 0.0 if self.x[0] >= zeta else self.first(zeta, 0.0, True)
        while now is not None:
            ready, down = now + dwell, self.first(release, now, False)
            found.append((now, "trigger", 1))
            if down is None:
                break
            found.append((down, "release", 2 if down < ready else 0))
            if down < ready:
                if ready > self.t[-1]:
                    break
                found.append((ready, "", 0))
            again = down < ready and self(np.array([ready]))[0] >= zeta
            now = ready if again else self.first(zeta, max(down, ready) if down < ready else down, True)
        return found


def threshold(scenario: Json) -> float:
    """The fixed threshold, or that of the root of (19) with c2/c1 on the right, by bisection, m."""
    rule, low, high = scenario["decision"]["threshold"], 0.0, 700.0
    if rule["rule"] == "fixed":
        return float(rule["zeta_m"])
    scale = (rule["noise_m_sqrt_s"] / rule["drift_m_s"]) ** 2
    for _ in range(200):
        middle = (low + high) / 2.0
        above = scale * (math.sinh(middle) + middle) > rule["c2"] / rule["c1_1_s"]
        low, high = (low, middle) if above else (middle, high)
    return float(low * rule["noise_m_sqrt_s"] ** 2 / (2.0 * rule["drift_m_s"]))


# ---------------------------------------------------------------------------------------------- proofs, exactly


class Polynomial(dict[tuple[str, ...], Fraction]):
    """Rational polynomial: coefficient by monomial, a sorted tuple of names."""

    def __add__(self, other: Polynomial) -> Polynomial:
        total = {key: self.get(key, Fraction()) + other.get(key, Fraction()) for key in {**self, **other}}
        return Polynomial({key: value for key, value in total.items() if value})

    def __mul__(self, other: Polynomial) -> Polynomial:
        demand(len(self) * len(other) < 10**5, "a polynomial is too large")
        total: dict[tuple[str, ...], Fraction] = {}
        for (a, x), (b, y) in product(self.items(), other.items()):
            key = tuple(sorted(a + b))
            total[key] = total.get(key, Fraction()) + x * y
            demand(total[key].numerator.bit_length() < 10**5, "a coefficient is too large")
        return Polynomial({key: value for key, value in total.items() if value})

    def __neg__(self) -> Polynomial:
        return self * number("-1")

    def __sub__(self, other: Polynomial) -> Polynomial:
        return self + -other

    def __truediv__(self, other: Polynomial) -> Polynomial:
        return self * Polynomial({(): 1 / other[()]}) if set(other) == {()} else NotImplemented


def rational(text: str) -> Fraction:
    """A rational number; none so large that computing with it would take for ever."""
    demand(len(text) < 1000 and len(text.lower().partition("e")[2]) < 5, f"{text[:20]!r}... is no reasonable number")
    return Fraction(text)


def number(text: str) -> Polynomial:
    """A rational constant."""
    value = rational(text)
    return Polynomial({(): value} if value else {})


def evaluate(
    text: str, names: Mapping[str, Any] = MappingProxyType({}), constant: Callable[[str], Any] = number
) -> Any:
    """An expression in + - * / **, numbers, names and exp; a name that stands for nothing else is a variable."""

    def walk(node: ast.AST) -> Any:
        match node:
            case ast.Constant(int(value) | float(value)):
                return constant(repr(value))
            case ast.Name(name):
                return names[name] if name in names else Polynomial({(name,): Fraction(1)})
            case ast.UnaryOp(ast.USub(), x):
                return -walk(x)
            case ast.BinOp(x, ast.Pow(), ast.Constant(int(power))) if 0 <= power <= 12:
                return math.prod([walk(x)] * power, start=constant("1"))
            case ast.BinOp(x, (ast.Add() | ast.Sub() | ast.Mult() | ast.Div()) as sign, y):
                return {ast.Add: add, ast.Sub: sub, ast.Mult: mul, ast.Div: truediv}[type(sign)](walk(x), walk(y))
            case ast.Call(ast.Name("exp"), [x], []):
                return walk(x).exp()
        raise ValueError(f"{text[:60]!r} is no expression that is allowed here")

    demand(len(text) < 5000, "an expression is too long")
    return walk(ast.parse(text, mode="eval").body)


def certified(obligation: Json) -> bool:
    """Whether multiplier * goal = sum of c * hypotheses * square^2 + sum of q * equation, c >= 0, multiplier > 0."""
    given = {key: evaluate(text) for key, text in {**obligation["hypotheses"], **obligation["strict"]}.items()}

    def total(terms: list[Json]) -> Polynomial:
        found = Polynomial()
        for term in terms:
            demand(rational(term["coefficient"]) >= 0, f"{obligation['name']}: a negative coefficient")
            square = evaluate(term["square"])
            weight = number(term["coefficient"]) * square * square
            found += math.prod([given[name] for name in term["factors"]], start=weight)
        return found

    strict, multiplier = set(obligation["strict"]), obligation["multiplier"]
    sure = [term for term in multiplier if term["square"] == "1" and set(term["factors"]) <= strict]
    positive = any(rational(term["coefficient"]) > 0 for term in sure)
    left = (total(multiplier) if multiplier else number("1")) * evaluate(obligation["goal"])
    for name, text in obligation["equation_multipliers"].items():
        left -= evaluate(text) * evaluate(obligation["equations"][name])
    return (positive or not multiplier) and not left - total(obligation["certificate"])


STATEMENTS = """
SAFE-LEMMA lagrange: (x1**2+x2**2+x3**2)*(v1**2+v2**2+v3**2)-(x1*v1+x2*v2+x3*v3)**2
SAFE-LEMMA forward: E-D-s*r; s; E; D**2*(Q-r**2); D; D+s*r; =E**2-D**2-2*s*D*r-s**2*Q
SAFE-LEMMA backward: E-D-s*r; s; E; D; -D-s*r; =E**2-D**2-2*s*D*r-s**2*Q
SAFE-INV outside: D+s*r-d; s; h-s; D-d; h*r+D-d; h
SAFE-INV inside: s*r; s; A; d-D; r-A*(d-D)
SAFE-INV pair_outside: D+s*(ri+rj)-d; s; h-s; D-d; 2*h*ri+D-d; 2*h*rj+D-d; h
SAFE-INV pair_inside: s*(ri+rj); s; A; d-D; 2*ri-A*(d-D); 2*rj-A*(d-D)
SAFE-INV unseen: D+s*r-d; s; h-s; D-R; R-d-c*h; r+c; c
SAFE-INV planar: n1*v1+n2*v2+n3*v3-b; n1*v1+n2*v2-b; =v3
SAFE-GATE zero_outside: -b; q; D-d; h; =h*b+q*(D-d)
SAFE-GATE zero_at_distance: -b; =b-q*A*(d-D); =D-d
SAFE-GATE scaling_keeps: sigma*r-b; sigma; 1-sigma; -b; r-b
SAFE-GATE scaling_mends: sigma*r-b; sigma; 1-sigma; -b; b-r; ratio-sigma; =ratio*r-b
SAFE-DIST outside_bound: A*(D+s*r-s*W-d)+W; s; h-s; D-d; A; W; 1-A*h; h*r+D-d; h
SAFE-DIST inside_bound: A*(D+s*r-s*W-d)+W; s; h-s; d-D; A; W; 1-A*h; A*(D-d)+W; r-A*(d-D)
SAFE-DIST pair_outside_bound: A*(D+s*(ri+rj)-s*W-d)+W; s; h-s; D-d; A; W; 1-A*h; 2*h*ri+D-d; 2*h*rj+D-d; h
SAFE-DIST pair_inside_bound: A*(D+s*(ri+rj)-s*W-d)+W; s; h-s; d-D; A; W; 1-A*h; A*(D-d)+W; 2*ri-A*(d-D); 2*rj-A*(d-D)
SAFE-DIST unseen_bound: A*(D+s*r-s*W-d)+W; s; h-s; A; W; 1-A*h; D-R; R-d-c*h; r+c; c
ZENO-PROOF supervising_intervening_claim: s-l-dwell;s-t;k;k*(t-l-dwell);zeta-release;dwell;zeta;x-zeta;=n-k
ZENO-PROOF refractory_intervening_claim: s-l-dwell;s-a-dwell;s-t;k;k-1;n;zeta-release;dwell;zeta;x-zeta;=n-k;=a-l
ZENO-PROOF dwell_is_the_bound: dwell-bound; =dwell-DWELL; =bound-BOUND
"""
"""Key obligations by claim and name: goal >= 0; the premises that it may have, >= 0 or, with =, equations."""


def kinds(scenario: Json) -> Iterator[tuple[str, float, float, float]]:
    """Kinds of pairs: name, safe distance m, largest closing speed m/s, share of each robot."""
    safe, uav = scenario["safe_distance"], scenario["uav"]["max_speed_m_s"]
    speeds = sorted((ugv["max_speed_m_s"] for ugv in scenario["ugvs"].values()), reverse=True)
    if scenario["obstacles"]:
        yield "obstacle", safe["obstacle_m"], max(uav, speeds[0]), 1.0
    yield "uav_ugv", safe["air_ground_m"], uav + speeds[0], 0.5
    if len(speeds) > 1:
        yield "ugv_ugv", safe["ugv_m"], speeds[0] + speeds[1], 0.5


def constants(scenario: Json) -> Json:
    """What a claim about the model must be about, by claim, from the resolved scenario."""
    control, decision, safe = scenario["control"], scenario["decision"], scenario["safe_distance"]
    speeds = [robot["max_speed_m_s"] for robot in (*scenario["ugvs"].values(), scenario["uav"])]
    gain, bare = control["avoidance_gain_1_s"], decision["trigger"] == "bare"
    distances = {"obstacle_distance": safe["obstacle_m"], "ugv_distance": safe["ugv_m"]}
    team = {"ugvs": list(scenario["ugvs"]), "uav": scenario["uav"]["name"], "max_speed": speeds, **distances}
    team |= {"air_ground_distance": safe["air_ground_m"]}
    team |= {"obstacles": [obstacle["position_m"] for obstacle in scenario["obstacles"].values()]}
    layer = {"gain_1_s": gain, "team": team, **{key: control[key] for key in ("period_s", "sensing_range_m")}}
    push = min(0.1 * max(speeds), gain * min(d for _, d, _, _ in kinds(scenario)) / 4.0)
    noise = {key: decision[key] for key in ("noise_m_sqrt_s", "leak_1_s", "noise_period_s")}
    rule = {key: decision["threshold"][key] for key in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2")}
    force = {"rule": decision["threshold"]["rule"], "zeta_m": threshold(scenario), **rule}
    dwell, zeta = decision["min_inter_event_s"], force["zeta_m"]
    trigger = {"zeta_m": zeta, "release_m": zeta if bare else decision["release_m"], "dwell_s": 0.0 if bare else dwell}
    return {
        "SAFE-INV": layer, "SAFE-GATE": {**layer, "method_d": {"intervention_on_top": False}},
        "SAFE-DIST": {**layer, "disturbance_m_s": push}, "ZENO-PROOF": {**trigger, "min_inter_event_s": dwell},
        "ZENO-REFINE": {**trigger, **noise, "duration_s": scenario["duration_s"]},
        "THR-ROOT": force, "THR-OPT": force, "THR-DDM": rule,
    }  # fmt: skip


def proof(claim: Json, folder: Path, scenario: Json) -> Found:
    """SAFE-*, ZENO-PROOF: every certificate expanded; key statements are the claim's, with the scenario's numbers."""
    if claim["status"] != "proved":
        raise NotImplementedError("only proofs are checked here, no refutations of the model")
    listed = read_json(folder / "obligations.json")
    obligations = {obligation["name"].replace("_2_claim", "_claim"): obligation for obligation in listed}
    demand(len(obligations) == len(listed), "two obligations of one name")
    for name, obligation in obligations.items():
        demand(certified(obligation), f"the certificate of {name} does not prove it")
    given, evidence, wanted = claim["inputs"], claim["evidence"], {}
    numbers = {"DWELL": given.get("dwell_s", 0.0), "BOUND": given.get("min_inter_event_s") or 1e-3}
    for line in STATEMENTS.strip().splitlines():
        head, text = line.split(": ")
        if head.split()[0] == claim["id"]:
            wanted[head.split()[1]] = (text, numbers)
    margin = None
    if claim["id"] in ("SAFE-INV", "SAFE-DIST"):
        A, h, R = given["gain_1_s"], given["period_s"], given["sensing_range_m"]
        margin = min(R - d - closing * h for _, d, closing, _ in kinds(scenario))
        bases = [name for name in wanted if name.split("_bound")[0] in ("outside", "inside", "unseen")]
        for kind, d, closing, share in kinds(scenario):
            numbers = {"d": d, "h": h, "A": A, "R": R, "c": closing, "W": given.get("disturbance_m_s", 0.0) / share}
            for base in bases:
                name = base if share == 1.0 or base.startswith("unseen") else f"pair_{base}"
                wanted[f"{name}_{kind}"] = (wanted[name][0], numbers)
    for name, (text, values) in wanted.items():
        demand(name in obligations, f"there is no certificate of {name}")
        found, names = obligations[name], {key: number(repr(float(value))) for key, value in values.items()}
        goal, *allowed = [(evaluate(part.strip(" ="), names), "=" in part) for part in text.split(";")]
        demand(evaluate(found["goal"]) == goal[0], f"the goal of {name} is not that of the claim")
        for group in ("hypotheses", "strict", "equations"):
            for part in found[group].values():
                premise = evaluate(part)
                if group == "equations" or set(premise) - {()} or premise.get((), 0) < 0:  # else it is a true number
                    known = (premise, group == "equations") in allowed
                    demand(known, f"{name} assumes {part!r}, which the claim does not")
    remark, listed = "certificates expanded", evidence["obligations"]
    demand(listed and all(one["status"] == "proved" for one in listed), "an obligation is recorded as not proved")
    if claim["id"] in ("SAFE-INV", "SAFE-DIST"):
        demand(evidence["conformance"]["agrees"] is True, "the running code was found not to conform")
    if claim["id"] == "SAFE-INV":
        demand(evidence["composition"]["met"] is True, "the running composition missed an inequality")
    elif claim["id"] == "SAFE-GATE":
        demand(all(layer["met"] for layer in evidence["layer"]), "the running layer missed an inequality")
        demand(all(team["missed"] == 0 for team in evidence["controller"]), "the running controller missed one")
        margin = min(layer["worst_slack_m_s"] for layer in evidence["layer"])
    elif claim["id"] == "SAFE-DIST":
        demand(all(row["broken"] == 0 for row in evidence["runs"]), "a disturbed run broke the bound")
        margin = min(row["worst_margin_m"] for row in evidence["runs"] if not row["unmet"])
    elif claim["id"] == "ZENO-PROOF":
        demand(not evidence["conformance"]["disagreements"], "the running trigger was found not to conform")
        margin = 1e-9 - evidence["rounding_s"]
    remark += "" if claim["id"] == "SAFE-LEMMA" else "; comparisons with running code are as recorded, not repeated"
    return Found("proved", margin, {}, 1e-7 if margin is None or margin > 1e-6 else 1e-14, remark)


def sinh(u: Fraction) -> tuple[Fraction, Fraction]:
    """Bounds of sinh u, u > 0, by its Taylor series: the rest is less than the last term once terms halve."""
    term, total, n = u, u, 1
    while term > total / 10**30 or u * u > n * (n + 1):
        n += 2
        term = term * u * u / (n * (n - 1))
        total += term
    return total, total + term


def root(claim: Json, folder: Path, _: Json) -> Found:
    """THR-ROOT, THR-OPT: f(u) = k (sinh u + u) - r, increasing, changes its sign in the enclosure; B falls, then rises.

    With q = exp u: dB/du = c1 q/(q + 1)^2 f(u), so that a root elsewhere, such as the printed one, has a larger B.
    """
    if claim["status"] != "proved":
        raise NotImplementedError("only proofs are checked here, no refutations of the model")
    saved, given = read_json(folder / "statements.json"), claim["inputs"]
    drift, noise, c1, c2 = (Fraction(repr(float(given[k]))) for k in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2"))
    k, r, ends = noise**2 / drift**2, c2 / c1, {key: [*map(rational, x)] for key, x in saved["enclosures"].items()}
    stated = {name: rational(text) for name, text in saved["constants"].items()}
    demand(stated == {"k": k, "r": r, "c1": c1, "c2": c2, "drift": drift}, "constants are not the scenario's")
    for name, right in (("u", r), ("printed_u", 1 / r)):
        if name in ends:
            low, high = ends[name]
            narrow = 0 < low < high <= low * (1 + Fraction(1, 10**12)) and high < 800
            demand(narrow, f"{name}: no enclosure of relative width 1e-12")
            signs = k * (sinh(low)[1] + low) < right < k * (sinh(high)[0] + high)
            demand(signs, f"{name}: the equation has no root in the enclosure")
            zeta = [u * noise**2 / (2 * drift) for u in ends[name]]
            demand(ends[name[:-1] + "zeta_m"] == zeta, f"{name}: zeta is not u noise^2 / (2 drift)")
    with localcontext() as context:
        context.prec = 100
        for one in saved["statements"]:
            if one["kind"] == "sign":
                names = {n: Decimal(rational(v).numerator) / rational(v).denominator for n, v in one["values"].items()}
                value = evaluate(one["expression"], names, Decimal)
                demand(abs(value) > Decimal("1e-60") and (value > 0) == (one["sign"] == ">"), f"{one['name']} is false")
    if claim["id"] == "THR-ROOT":
        running = claim["evidence"]["running_threshold_m"]
        first, last = (float(u * noise**2 / (2 * drift)) for u in ends["u"])
        values = (running, given["zeta_m"] if given["rule"] == "bayes" else running)
        outside = max(max(first - zeta, zeta - last) for zeta in values)
        demand(outside <= 1e-12 * last, "the code's threshold is not the root")
        return Found("proved", 1e-12 * last - outside, {}, 1e-14, "root enclosed by Taylor series with rational ends")
    demand(c1 == c2 or "printed_u" in ends, "the printed root is not enclosed")
    if c1 == c2:
        return Found("proved", None, {}, remark="root enclosed")
    near, other = (ends["u"][0], ends["printed_u"][1]) if c1 < c2 else (ends["u"][1], ends["printed_u"][0])
    demand(other < near if c1 < c2 else other > near, "the enclosures of both roots overlap")

    def risk(u: float) -> float:
        return float(c1 * k) / 2.0 * u * math.tanh(u / 2.0) + float(c2) / (math.exp(u) + 1.0)

    margin = risk(float(other)) - risk(float(near))
    return Found("proved", margin, {}, 1e-9, "roots enclosed by Taylor series, signs in 100 digits")


def ddm(claim: Json, folder: Path, _: Json) -> Found:
    """THR-DDM: intervals and formulas (17)-(18) again from the recorded counts; 99 % over all comparisons."""
    rows = read_json(folder / "paths.json")["comparisons"]
    tail, margins, rule = 0.01 / len(rows) / 2.0, [], claim["inputs"]
    demand(rows == claim["evidence"]["comparisons"], "the certificate is not the evidence")
    first = rows[0]["constants"]
    demand((first["drift"], first["noise"]) == (rule["drift_m_s"], rule["noise_m_sqrt_s"]), "drift or noise is another")
    for row in rows:
        c, n, wrong = row["constants"], row["constants"]["paths"], row["wrong_decisions"]
        u, w = (2.0 * c[length] * c["drift"] / c["noise"] ** 2 for length in ("zeta", "deviation"))
        bias = (1.0 - math.exp(-w)) / (2.0 * math.sinh(u))
        demand(0 <= wrong <= n <= 10**6, "counts that cannot be")
        low, high = row["interval"]
        if row["quantity"] == "error rate":
            value = 1.0 / (1.0 + math.exp(u)) - bias
            for p, inner in ((low + 2e-4, range(wrong, n + 1)), (high - 2e-4, range(wrong + 1))):  # Clopper-Pearson
                logs = [math.lgamma(n + 1) - math.lgamma(j + 1) - math.lgamma(n - j + 1) + j * math.log(p)
                        + (n - j) * math.log1p(-p) for j in inner]  # fmt: skip
                demand(abs(sum(map(math.exp, logs)) / tail - 1.0) < 1e-3, "an interval does not follow from its counts")
        else:
            value = c["zeta"] / c["drift"] * (math.tanh(u / 2.0) + 2.0 * bias) - c["deviation"] / c["drift"]
            mean, h = row["periods_sum"] / n, c["noise_period_s"]
            spread = math.sqrt((row["periods_sum_of_squares"] - row["periods_sum"] * mean) / (n - 1.0) / n)
            half = NormalDist().inv_cdf(1.0 - tail) * spread + 0.05
            same([(mean - 0.25 - half) * h, (mean - 0.25 + half) * h], row["interval"], "interval")
        same(value, row["formula"], f"formula of {row['experiment']}, {row['quantity']}")
        margins.append(2.0 * min(value - low, high - value) / (high - low))
    status = "supported" if min(margins) >= 0.0 else "refuted"
    return Found(status, min(margins), {}, 1e-6, "on the recorded counts; the paths were not simulated again")


def refine(claim: Json, folder: Path, _: Json) -> Found:
    """ZENO-REFINE: means, exponents and the rule again from the recorded counts; the theory of the bare count.

    Fit: ln(mean) = c + p ln(dt) + b sqrt(dt). The recorded bootstrap intervals of p are compared with those of its
    linearisation in the paths, which they may differ from by a quarter of their width.
    """
    evidence, table = claim["evidence"], pd.read_csv(folder / "counts.csv")
    dt, names = np.sort(table["dt_s"].unique())[::-1], ("bare", "automaton", "automaton_at_scenario_noise")
    counts = {name: table.pivot_table(name, "path", "dt_s").to_numpy()[:, ::-1].astype(np.float64) for name in names}
    demand(all(x.shape == (evidence["paths"], len(dt)) and (x >= 0.0).all() for x in counts.values()), "counts missing")
    demand(evidence["paths"] >= 96 and len(dt) >= 9 and np.isfinite(dt).all(), "fewer paths or steps than stated")
    series = {name: {"mean": x.mean(axis=0).tolist(), "largest": x.max(axis=0).tolist()} for name, x in counts.items()}
    row = np.linalg.pinv(np.column_stack([np.ones_like(dt), np.log(dt), np.sqrt(dt)]))[1]
    ends, width = {}, NormalDist().inv_cdf(0.995)
    for name in names[:2]:
        mean, fit = counts[name].mean(axis=0), evidence["fit"][name]
        same(float(row @ np.log(mean)), fit["exponent"], f"exponent of {name}")
        spread = width * float(np.linalg.norm((counts[name] / mean - 1.0) @ row)) / len(counts[name])
        low, high = ends[name] = fit["interval"]
        off = max(abs(low - fit["exponent"] + spread), abs(high - fit["exponent"] - spread))
        demand(off <= 0.5 * spread + 1e-3, f"the interval of {name} does not follow from its counts")
    expected, given = [], claim["inputs"]
    demand(dt[-1] > 0.0 and evidence["duration_s"] / dt[-1] < 1e6, "the noise steps are too fine to go through")
    for step in dt:
        keep, variance, total = 1.0 - given["leak_1_s"] * step, dt[0], 0.5
        for _k in range(round(evidence["duration_s"] / step)):
            after = keep**2 * variance + step
            total += math.acos(min(1.0, keep * math.sqrt(variance / after))) / (2.0 * math.pi)
            variance = after
        expected.append(total)
    bias, dwell = abs(float(row @ np.log(expected)) + 0.5), given["dwell_s"]
    most = int(evidence["duration_s"] / dwell + 1e-9) + 1 if dwell > 0.0 else None
    (low, high), (ours_low, ours_high) = ends["bare"], ends["automaton"]
    diverges = min(-0.5 - low + bias, high + bias + 0.5, -0.25 - high)
    slack = min(diverges, -ours_low, ours_high, 0.1 + ours_low, 0.1 - ours_high)
    error = counts["bare"].std(axis=0, ddof=1) / math.sqrt(len(counts["bare"]))
    sure = bool((np.abs(counts["bare"].mean(axis=0) - expected) <= 5.0 * error).all())
    over = most is not None and counts["automaton"].max() > most
    status = "refuted" if over else "inconclusive" if max(high - low, ours_high - ours_low) > 0.2 else "supported"
    status = ("refuted" if slack < -1e-9 else status if sure else "inconclusive") if status == "supported" else status
    facts = {**series, "expected_bare": expected, "most_triggers": most, "dt_s": dt.tolist()}
    return Found(status, slack, facts, remark="on the recorded counts; the paths were not simulated again")


# ---------------------------------------------------------------------------------------------- the report


EVERY: dict[str, Callable[[Run, Json], Found]] = {
    "SAFE-TRACE": Run.safe_trace, "SAFE-HYP": Run.safe_hyp, "ZENO-TRACE": Run.zeno_trace, "THR-TRIG": Run.thr_trig,
    "LIVE-GOAL": Run.live_goal,
}  # fmt: skip
GATED: dict[str, Callable[[Run, Json], Found]] = {
    "GATE-OPT": Run.gate_opt, "GATE-SUR": Run.gate_sur, "GATE-FEAS": Run.gate_feas, "GATE-TIME": Run.gate_time,
}  # fmt: skip
MODEL: dict[str, Callable[[Json, Path, Json], Found]] = {
    **dict.fromkeys(("SAFE-LEMMA", "SAFE-INV", "SAFE-GATE", "SAFE-DIST", "ZENO-PROOF"), proof),
    "ZENO-REFINE": refine, "THR-ROOT": root, "THR-OPT": root, "THR-DDM": ddm,
}  # fmt: skip


def claims_of(method: str, route: str) -> dict[str, Callable[[Run, Json], Found]]:
    """The claims that apply to a run."""
    gated = {name: check for name, check in GATED.items() if name != "GATE-SUR" or route in ("relaxed", "nonlinear")}
    return {**EVERY, **({"COMM": Run.comm} if method != "a" else {}), **(gated if method in "cd" else {})}


class Line(NamedTuple):
    """One line of the output."""

    subject: str
    run: str
    outcome: str
    text: str


def attempt(subject: str, run: str, check: Callable[[], str]) -> Line:
    """What a check says, as a line; whatever goes wrong in it is not agreement."""
    try:
        return Line(subject, run, AGREES, check())
    except Disagreement as error:
        return Line(subject, run, DISAGREES, str(error))
    except Exception as error:  # bad files fail in more ways than can be listed
        return Line(subject, run, OPEN, f"{type(error).__name__}: {error}".splitlines()[0][:200])


def judge(claim: Json, declared: str, recheck: Callable[[], Found]) -> str:
    """Compare a recorded verdict with what a claim's own formula gives."""
    demand(claim["expected"] == declared, f"expects {claim['expected']!r}, the scenario declares {declared!r}")
    demand(claim["as_expected"] is (claim["status"] == declared), "as_expected is wrong")
    refuted = claim["status"] == "refuted"
    demand(bool(claim["counterexample"]) == refuted, "a counterexample must come with a refutation, and only with it")
    found = recheck()
    demand(found.status == claim["status"], f"recorded {claim['status']!r}, recomputed {found.status!r}")
    same(found.margin, claim["margin"], "margin", found.slop)
    same(found.facts, claim["evidence"], "evidence")
    margin = "" if claim["margin"] is None else f", margin {claim['margin']:.4g} {claim['unit']}"
    return f"{found.status}{margin}{found.remark and f' ({found.remark})'}"


def overall(report: Json) -> str:
    """The verdict over all claims, its lists and its exit code."""
    claims, keys = report["claims"], ("id", "run", "status", "expected")
    unexpected = [{key: c[key] for key in keys} for c in claims if c["status"] != c["expected"]]
    undecided = [c for c in unexpected if c["status"] in ("inconclusive", "error", "not_run")]
    differs = [c for c in unexpected if c not in undecided]
    failed = [item["id"] for item in report["audit"] if not item["demonstrated"]]
    status = "not_as_expected" if differs or failed else "inconclusive" if undecided else "as_expected"
    counts = Counter(c["status"] for c in claims)
    demand(counts == report["overall"]["counts"], f"overall.counts: recomputed {dict(counts)}")
    code = {"as_expected": 0, "not_as_expected": 1, "inconclusive": 3}[status]
    ours = {"status": status, "exit_code": code, "checks": len(claims), "undecided": undecided}
    ours |= {"as_expected": len(claims) - len(unexpected), "differs": differs, "missing": [], "undemonstrated": failed}
    same(ours, report["overall"], "overall")
    return f"{status}, exit code {code}"


def check(folder: Path) -> list[Line]:
    """All lines for a report.

    Raises:
        OSError, ValueError, Disagreement: if report.json cannot be read as a report.
    """
    report = read_json(folder / "report.json")
    demand(isinstance(report, dict) and report.get("schema") == "airground_drake.report/1", "not a report of schema /1")
    scenario = report["scenario"]["resolved"]
    wanted = {("", name): "supported" if name in ("ZENO-REFINE", "THR-DDM") else "proved" for name in MODEL}
    wanted = {key: scenario["expected"].get(key[1], usual) for key, usual in wanted.items()}
    for name, run in scenario["runs"].items():
        every = claims_of(run["method"], scenario["gatekeeper"]["route"])
        wanted |= {(name, claim): run["expected"].get(claim, "holds") for claim in every}

    def structure() -> str:
        found = Counter((claim["run"], claim["id"]) for claim in report["claims"])
        odd = sorted({key for key, count in found.items() if count > 1} | set(found) ^ set(wanted))
        demand(not odd, f"claims missing, unknown or there twice: {odd}")
        named = {path.name for path in (folder / "trace").iterdir() if path.is_dir()}
        demand(set(report["runs"]) == set(scenario["runs"]) == named, "the runs are not those of the scenario")
        return overall(report)

    lines, runs = [attempt("report", "", structure)], {}

    def load(name: str) -> str:
        runs[name] = Run(folder / "trace" / name, name, report)
        return f"{len(runs[name].t)} rows, {len(runs[name].events)} events"

    lines += [attempt("trace", name, partial(load, name)) for name in scenario["runs"]]

    def model(claim: Json) -> Found:
        place = folder / "certificates" / claim["id"]
        digests = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in place.glob("*")}
        demand(digests == claim["certificates"], "certificate files are not those recorded")
        same(constants(scenario).get(claim["id"], {}), claim["inputs"], "inputs", 1e-12)
        return MODEL[claim["id"]](claim, place, scenario)

    def again(claim: Json) -> str:
        name, run = claim["id"], claim["run"]
        if not run:
            return judge(claim, wanted[run, name], lambda: model(claim))
        if run not in runs:
            raise LookupError("the trace was refused")
        every = claims_of(runs[run].method, scenario["gatekeeper"]["route"])
        return judge(claim, wanted[run, name], lambda: every[name](runs[run], claim))

    return [*lines, *(attempt(claim["id"], claim["run"], partial(again, claim)) for claim in report["claims"])]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print all lines and a summary; returns the exit code."""
    arguments = sys.argv[1:] if arguments is None else arguments
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print(
            "usage: python -m airground_drake.check DIR   (DIR has report.json, trace/, certificates/)", file=sys.stderr
        )
        return 2
    try:
        lines = check(Path(arguments[0]))
    except Exception as error:  # no report: nothing to be compared with
        print(f"error: {arguments[0]}: not a readable report: {type(error).__name__}: {error}", file=sys.stderr)
        return 2
    for line in lines:
        print(f"{line.subject:<12}{line.run or '-':<8}{line.outcome}: {line.text}")
    counts = Counter(line.outcome for line in lines)
    print(f"{len(lines)} checks: " + ", ".join(f"{counts[outcome]} {outcome}" for outcome in (AGREES, DISAGREES, OPEN)))
    return 0 if counts[AGREES] == len(lines) else 1


if __name__ == "__main__":
    sys.exit(main())
