"""An independent check of a report, `python -m airground_drake.check DIR`, short enough to be read in one sitting.

Status and margin of every verdict in report.json are established again from trace/ and certificates/, by formulas
written here from the statements of the claims, proofs in exact arithmetic. Lines say `agrees`; `DISAGREES` where files
contradict the verdict or each other; `cannot be re-established` where one is unreadable or this program knows no way
(refutations of the model, other routes than 'relaxed'). Exit code 0: all agree; 1: not all; 2: usage, or no report.
Not compared: evidence, metrics, texts, margins that are nan here, most events. As recorded: comparisons with running
code, simulated paths; why the obligations of check_obligations.txt make a claim is in the claim's text.
"""

from __future__ import annotations

import ast
import hashlib
import json
import math
import sys
from collections import Counter
from decimal import Decimal, localcontext
from fractions import Fraction
from itertools import pairwise, product
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
import pandas as pd

Verdict = tuple[Any, Any]  # status, or whether a claim about a run holds; margin, nan if it is not to be compared
SMALL, EVENT_S, VARIABLE_M = 1e-9, 1e-5, 1e-6  # tolerances: m, s, m/s; times of events; decision variable


def demand(condition: Any, otherwise: str) -> None:  # AssertionError is for files that disagree
    if not condition:
        raise AssertionError(otherwise)


def near(ours: Any, theirs: Any, slop: float = SMALL) -> bool:  # arrays of numbers
    a, b = np.array(ours, dtype=np.float64), np.array(theirs, dtype=np.float64)
    return a.shape == b.shape and bool((np.abs(a - b) <= slop * (1.0 + np.abs(a))).all())


def read_json(path: Path) -> Any:  # strict JSON
    return json.loads(path.read_text("utf-8"), parse_constant=lambda text: demand(False, f"{path.name} has {text}"))


def pairs(scenario: Any) -> Any:  # robot, obstacle or robot, safe distance m, largest closing speed m/s, share
    safe, uav = scenario["safe_distance"], scenario["uav"]["name"]
    speeds = {name: robot["max_speed_m_s"] for name, robot in {**scenario["ugvs"], uav: scenario["uav"]}.items()}
    for i, (robot, speed) in enumerate(speeds.items()):
        yield from ((robot, name, safe["obstacle_m"], speed, 1.0) for name in scenario["obstacles"])
        for other in [*speeds][i + 1 :]:
            yield robot, other, safe["air_ground_m" if other == uav else "ugv_m"], speed + speeds[other], 0.5


class Run:  # a trace that is of the run it claims to be and obeys its law of motion; claims are methods
    def __init__(self, folder: Path, name: str, report: Any, zeta: float) -> None:
        meta, entry, scenario = read_json(folder / "meta.json"), report["runs"][name], report["scenario"]["resolved"]
        tables = [folder / f"{table}.parquet" for table in ("signals", "decisions", "problems")]
        digests = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in tables}
        ours = {"schema": "airground_drake.trace/2", "files": digests, "run": name, "scenario": scenario}
        ours |= {"seed": scenario["seed"], "events": entry["events"], "zeta_m": zeta}
        ours |= {key: scenario["runs"][name][key] for key in ("method", "composition")}
        odd = [key for key in ours if ours[key] != meta[key] or ours[key] != entry.get(key, ours[key])]
        demand(not odd, f"{odd} of the trace, of report.json and of the scenario differ")
        self.signals, self.decisions, self.problems = map(pd.read_parquet, tables)
        demand(np.isfinite(self.signals.to_numpy(dtype=np.float64)).all(), "signals are not finite")
        self.times_s = read_json(folder / "timings.json")["decision_times_s"]
        self.scenario, self.gate, self.control = scenario, scenario["gatekeeper"], scenario["control"]
        self.stalls, self.gated = scenario["runs"][name]["stalls_m"], meta["method"] in ("c", "d")
        self.ugvs, self.uav, self.events = list(scenario["ugvs"]), scenario["uav"]["name"], meta["events"]
        self.spec, self.zeta = {**scenario["ugvs"], self.uav: scenario["uav"]}, zeta
        self.t = t = self.signals["t_s"].to_numpy()  # each of the T rows ends a segment
        self.at = {robot: self.signals[[f"{robot}.{axis}_m" for axis in "xyz"]].to_numpy() for robot in self.spec}
        self.at |= {obstacle: np.tile(o["position_m"], (len(t), 1)) for obstacle, o in scenario["obstacles"].items()}
        self.v = {robot: self.signals[[f"{robot}.v{axis}_m_s" for axis in "xyz"]].to_numpy()[1:] for robot in self.spec}
        demand((np.diff(t) > 0.0).all() and near([0.0, scenario["duration_s"]], t[[0, -1]]), "times of the rows")
        samples = np.arange(math.ceil((t[-1] - SMALL) / self.control["period_s"])) * self.control["period_s"]
        demand(near(samples, t[np.searchsorted(t, samples - SMALL)]), "no row at a control sample")
        for robot, v in self.v.items():
            demand(near(self.spec[robot]["start_m"], self.at[robot][0]), f"{robot} starts elsewhere")
            off = np.abs(np.diff(self.at[robot], axis=0) - np.diff(t)[:, None] * v).max(axis=1)
            demand(off.max() <= SMALL, f"{robot} is not where its command leads, t = {t[off.argmax() + 1]:.6g} s")

    def seen(self, robot: str, *kinds: str) -> list[tuple[float, str]]:
        return [(e["t_s"], e["kind"]) for e in self.events if e["robot"] == robot and e["kind"] in kinds]

    def preset(self, ugv: str, t: Any) -> Any:  # preset trajectory at times (K,): (K, 3), m
        corners, speed = np.array(self.spec[ugv]["preset"]["waypoints_m"]), self.spec[ugv]["preset"]["speed_m_s"]
        passed = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1)))
        return np.stack([np.interp(t * speed, passed, x) for x in corners.T], axis=1)

    def safe_trace(self) -> Verdict:  # least distance of a pair: |r + s w|^2 is least at s = -r.w / w.w on a segment
        margin = math.inf
        for one, other, safe, *_ in pairs(self.scenario):
            r = self.at[one] - self.at[other]
            w = np.diff(r, axis=0)
            s = np.clip(-(r[:-1] * w).sum(axis=1) / np.maximum((w * w).sum(axis=1), 1e-99), 0.0, 1.0)
            margin = min(margin, np.linalg.norm(r[:-1] + s[:, None] * w, axis=1).min() - safe)
        return margin >= -SMALL, margin

    def safe_hyp(self) -> Verdict:  # the proof's inequalities at each sample; the hold in between, limits, start, range
        t, others, least = self.t, [], math.inf
        h, gain, sensed = (self.control[key] for key in ("period_s", "avoidance_gain_1_s", "sensing_range_m"))
        _, first, owner = np.unique(np.floor((t[1:] + t[:-1]) / 2.0 / h), return_index=True, return_inverse=True)
        for robot, v in self.v.items():  # first: segment at each sample; owner: sample of each segment
            others += [1.0 - gain * h, -np.abs(v - v[first][owner]).max(), -np.abs(v[:, 2]).max() * (robot != self.uav)]
            others.append(self.spec[robot]["max_speed_m_s"] - np.linalg.norm(v, axis=1).max())
        for one, other, safe, closing, share in pairs(self.scenario):
            offset = (self.at[one] - self.at[other])[first]
            distance = np.linalg.norm(offset, axis=1)
            others += [distance[0] - safe, sensed - safe - closing * h]
            required = share * np.where(distance <= safe, gain, 1.0 / h) * (safe - distance)
            for robot, away in ((one, offset), *([(other, -offset)] if other in self.v else [])):
                rate = (away * [1.0, 1.0, robot == self.uav] * self.v[robot][first]).sum(axis=1)
                spare = rate / np.maximum(distance, 1e-99) - required
                least = min(least, spare[distance <= sensed].min(initial=math.inf))
        margin = math.nan if min(others) < -SMALL else least if least < math.inf else None  # nan: another one broke
        return min(*others, least) >= -SMALL, margin

    def zeno_trace(self) -> Verdict:  # gaps between recorded triggers
        bound, times = self.scenario["decision"]["min_inter_event_s"], [self.seen(u, "trigger") for u in self.ugvs]
        gap = min((b[0] - a[0] for x in times for a, b in pairwise(x)), default=None)
        return (bound > 0.0 or "not_run", None) if gap is None or bound <= 0.0 else (gap >= bound - SMALL, gap - bound)

    def thr_trig(self) -> Verdict:  # the trigger run on x = |preset - p| + noise at the rows; events have their own
        law, lags, right = self.scenario["decision"], [], True
        release, dwell = (self.zeta, 0.0) if law["trigger"] == "bare" else (law["release_m"], law["min_inter_event_s"])
        for ugv in self.ugvs:
            names = ("noise_m", "decision_variable_m", "mode")
            noise, recorded, mode = (self.signals[f"{ugv}.{name}"].to_numpy() for name in names)
            x = np.linalg.norm(self.preset(ugv, self.t) - self.at[ugv], axis=1) + noise
            now, ready, modes, ours = 0, -math.inf, [0], []  # type: ignore[var-annotated]
            for when, value in zip(self.t.tolist(), x.tolist(), strict=True):
                if now != 1 and value >= self.zeta and when >= ready - SMALL:
                    now, ready, ours = 1, when + dwell, [*ours, (when, "trigger")]
                elif now == 1 and value < release:  # 2: released before the dwell is over
                    now, ours = 2 if when < ready - SMALL else 0, [*ours, (when, "release")]
                elif now == 2 and when >= ready - SMALL:
                    now = 0
                modes.append(now)
            theirs = self.seen(ugv, "trigger", "release")
            lags += [abs(a[0] - b[0]) if a[1] == b[1] else math.inf for a, b in zip(ours, theirs, strict=False)]
            right &= len(ours) == len(theirs) and near(x, recorded, VARIABLE_M / 10.0)
            right &= ((mode == modes[1:]) | (mode == modes[:-1])).all()
        right &= max(lags, default=0.0) <= EVENT_S
        return right, EVENT_S - max(lags) if right and lags else None

    def live_goal(self) -> Verdict:  # ends at targets, or stalls, standing for a second, where the scenario says so
        margins, arrival, stall = [], self.scenario["arrival_tolerance_m"], self.scenario["stall_tolerance_m"]
        for robot, spec in self.spec.items():
            at, goal = self.at[robot], np.array(spec["target_m"])
            if robot == self.uav and self.stalls:  # then over the centroid of the UGVs
                goal = np.mean([self.at[u][-1] for u in self.ugvs], axis=0) + [0.0, 0.0, spec["altitude_m"]]
            margins.append(arrival - np.linalg.norm(at[-1] - goal))
            if robot in self.stalls:  # then short of its target
                late = at[self.t >= self.t[-1] - 1.0 - SMALL]
                margins[-1:] = [-margins[-1], 1e-3 - np.linalg.norm(late - at[-1], axis=1).max()]
                margins.append(stall - np.linalg.norm(at[-1] - self.stalls[robot]))
        return min(margins) >= 0.0, min(margins)

    def comm(self) -> Verdict:  # proposals and decisions only while intervening (mode 1), and fewer than always-on
        periods, within, saved = (self.scenario["intervention"]["period_s"], self.gate["period_s"]), True, []
        sent = [(e["robot"], e["t_s"]) for e in self.events if e["kind"] == "proposal"]
        decided = [*zip(self.decisions["robot"], self.decisions["t_s"], strict=True)]
        for messages, period in zip((sent, decided)[: 1 + self.gated], periods, strict=False):
            saved.append(1.0 - len(messages) / (len(self.ugvs) * int((self.t[-1] + SMALL) / period)))
            for ugv, when in messages:  # the mode of a row is in force since the row before
                recent = (self.t[1:] >= when - sum(periods) - SMALL) & (self.t[:-1] <= when + SMALL)
                within &= (self.signals[f"{ugv}.mode"].to_numpy()[1:][recent] == 1.0).any()
        return within and min(saved) >= 0.0, min(saved) if within else None

    def gate_time(self) -> Verdict:  # the 99th percentile of the recorded CPU times, rounded up
        demand(len(self.times_s) == len(self.decisions) and min(self.times_s, default=0.0) >= 0.0, "times of decisions")
        margin = self.gate["period_s"] - np.quantile(self.times_s or [0.0], 0.99, method="higher")
        return (margin > 0.0, margin) if self.times_s else ("not_run", None)

    def plans(self) -> Any:  # decisions with their problems (26), N stages, m points to keep away from
        if self.gate["route"] != "relaxed" or len(self.decisions) != len(self.problems):
            raise NotImplementedError("only problems of the route 'relaxed' are known here")
        return self.decisions.join(self.problems).itertuples()

    def path(self, p: Any, omega: Any) -> Any:  # (23): positions at the ends of the stages, (3 N,), m
        accept, refuse = p.accept_m_s.reshape(-1, 3), p.refuse_m_s.reshape(-1, 3)
        return (p.initial_m + p.dt_s * np.cumsum(refuse + omega[:, None] * (accept - refuse), axis=0)).ravel()

    def cost(self, p: Any, path: Any, normals: Any = None) -> float:  # (25), slack being what distances lack at most
        away = path.reshape(-1, 1, 3) - p.centres_m.reshape(len(path) // 3, -1, 3)
        reach = np.linalg.norm(away, axis=2) if normals is None else (away * normals.reshape(away.shape)).sum(axis=2)
        slack, error = (reach - p.distances_m).min(axis=1, initial=0.0), path - p.reference_m
        return float(p.dt_s * (p.error_weight_1_m2_s * (error**2).sum() + p.slack_weight_1_m2_s * (slack**2).sum()))

    def gate_feas(self) -> Verdict:  # the problem's start, preset and weights; (23) and (25) of the plan
        gate, right, weights = self.gate, True, ("error_weight_1_m2_s", "slack_weight_1_m2_s")
        after = gate["horizon_s"] / gate["stages"] * np.arange(1.0, gate["stages"] + 1.0)
        for p in self.plans():
            right &= near(self.at[p.robot][np.searchsorted(self.t, p.t_s - SMALL)], p.initial_m)
            right &= near(self.preset(p.robot, p.t_s + after).ravel(), p.reference_m)
            right &= near([after[0], *(gate[key] for key in weights)], [p.dt_s, *(getattr(p, key) for key in weights)])
            own, chosen = self.cost(p, p.positions_m), (p.objective_refuse, p.objective_accept)
            right &= near([own, own], [p.objective, chosen[int(p.plan[0])]]) and not {*p.plan} - {0.0, 1.0}
            right &= near(self.path(p, p.plan), p.positions_m) and p.issued_s in dict(self.seen(p.robot, "proposal"))
        return right, math.nan

    def gate_sur(self) -> Verdict:  # (28)-(29) again, and the integrated rounding error, at most half a stage
        relaxed, rounded = (np.array([getattr(p, key) for p in self.plans()]) for key in ("relaxed", "rounded"))
        deficit = np.cumsum(relaxed, axis=-1) - np.cumsum(rounded, axis=-1) + rounded
        right = ((rounded == (deficit >= 0.5)) | (np.abs(deficit - 0.5) <= SMALL)).all()
        error = np.abs(np.cumsum(relaxed - rounded, axis=-1)).max(axis=-1) * self.problems["dt_s"].to_numpy()
        right &= (np.abs(relaxed - 0.5) <= 0.5).all() and near(error, self.decisions["rounding_deviation_s"])
        margin = (self.problems["dt_s"] / 2.0 - error).min()
        return right and margin >= -SMALL, max(0.0, margin)

    def gate_opt(self) -> Verdict:  # against the optimum along normals: a convex cost is never below a tangent of it
        right, margin = True, math.inf
        for p in self.plans():
            w, n, own = p.relaxed, len(p.relaxed), self.cost(p, p.positions_m)
            least = max(1e-6, min(self.cost(p, self.path(p, np.full(n, mode))) for mode in (0.0, 1.0)))
            ends = [w, *(w + side * e for e in 1e-5 * np.eye(n) for side in (-1.0, 1.0))]
            value, *costs = (self.cost(p, self.path(p, each), p.normals) for each in ends)
            slopes = np.diff(np.reshape(costs, (n, 2)))[:, 0] / 2e-5
            lower = value + np.minimum(-slopes * w, slopes * (1.0 - w)).sum()  # the tangent at a corner of the box
            demand(value - lower <= 1e-4 * least, "the recorded relaxation is too far from the optimum to bound it")
            right &= near(np.linalg.norm(p.normals.reshape(-1, 3), axis=1), np.ones(p.normals.size // 3))
            right &= p.lower_bound <= min(self.cost(p, p.positions_m, p.normals), value) + 1e-5 * least
            right, margin = right and own <= (1.0 + SMALL) * least, min(margin, 0.05 - (own - lower) / least)
        return right and margin >= 0.0, margin if margin < math.inf else None


class Polynomial(Counter[tuple[str, ...]]):  # coefficients by monomial, a sorted tuple of names; not there is 0
    def __add__(self, other: Any) -> Any:
        return Polynomial({key: self[key] + other[key] for key in {**self, **other}})

    def __mul__(self, other: Any) -> Any:
        demand(len(self) * len(other) < 10**4 and len(str(self)) < 10**5, "a polynomial is too large")
        total = Polynomial()
        for (a, x), (b, y) in product(self.items(), other.items()):
            total[tuple(sorted(a + b))] += x * y
        return total


def expand(text: str | ast.AST) -> Any:  # an expression in + - * / ** over numbers and names
    match ast.parse(text, mode="eval").body if isinstance(text, str) else text:
        case ast.Constant(int(value)):
            return Polynomial({(): Fraction(value)})
        case ast.Name(name):
            return Polynomial({(name,): Fraction(1)})
        case ast.UnaryOp(ast.USub(), x):
            return Polynomial({(): Fraction(-1)}) * expand(x)
        case ast.BinOp(x, (ast.Add() | ast.Sub()) as sign, y):
            return expand(x) + Polynomial({(): Fraction(1 if isinstance(sign, ast.Add) else -1)}) * expand(y)
        case ast.BinOp(x, ast.Mult(), y):
            return expand(x) * expand(y)
        case ast.BinOp(x, ast.Div(), ast.Constant(int(q))):
            return expand(x) * Polynomial({(): Fraction(1, q)})
        case ast.BinOp(x, ast.Pow(), ast.Constant(int(n))) if 0 <= n <= 12:
            return math.prod([expand(x)] * n, start=expand("1"))
    raise ValueError("a text is no polynomial")


def proof(claim: Any, folder: Path, scenario: Any) -> Verdict:
    """multiplier * goal = sum of c * factors * square^2 + sum of q * equation, with c >= 0 and multiplier > 0."""
    obligations = {one["name"].replace("_2_claim", "_claim"): one for one in read_json(folder / "obligations.json")}
    for name, one in obligations.items():
        given, sums = {key: expand(text) for key, text in {**one["hypotheses"], **one["strict"]}.items()}, []
        for terms in (one["multiplier"] or [{"coefficient": "1", "factors": [], "square": "1"}], one["certificate"]):
            demand(all("-" not in term["coefficient"] for term in terms), f"{name}: a negative coefficient")
            factors = ([*[expand(term["square"])] * 2, *(given[key] for key in term["factors"])] for term in terms)
            parts = (math.prod(f, start=expand(t["coefficient"])) for f, t in zip(factors, terms, strict=True))
            sums.append(sum(parts, start=Polynomial()))
        for key, text in one["equation_multipliers"].items():
            sums[1] = sums[1] + expand(text) * expand(one["equations"][key])
        sure = [t for t in one["multiplier"] if t["square"] == "1" and {*t["factors"]} <= {*one["strict"]}]
        positive = not one["multiplier"] or any(Fraction(term["coefficient"]) > 0 for term in sure)
        demand(positive and sums[0] * expand(one["goal"]) == sums[1], f"the certificate of {name} does not prove it")
    for line in Path(__file__).with_name("check_obligations.txt").read_text().splitlines():
        about, name, text = line.replace(":", "").split(maxsplit=2)
        if about == claim["id"]:
            (goal, _), *allowed = [(expand(part.strip(" =")), "=" in part) for part in text.split(";")]
            groups, found = ("hypotheses", "strict", "equations"), obligations[name]
            premises = [(expand(part), key == "equations") for key in groups for part in found[key].values()]
            demand(expand(found["goal"]) == goal, f"the goal of {name} is not that of the claim")
            demand(all(premise in allowed for premise in premises), f"{name} assumes more than the claim")
    h, gain, sensed = (scenario["control"][key] for key in ("period_s", "avoidance_gain_1_s", "sensing_range_m"))
    margin = min(sensed - safe - closing * h for _, _, safe, closing, _ in pairs(scenario))
    demand(margin >= 0.0 and gain * h <= 1.0, "range, speed, period or gain break a premise")
    return "proved", {"SAFE-INV": margin, "SAFE-LEMMA": None}.get(claim["id"], math.nan)


def root(claim: Any, folder: Path, scenario: Any) -> Verdict:  # f = k (sinh u + u) - c2/c1 increases and changes sign
    saved, rule = read_json(folder / "statements.json")["enclosures"], scenario["decision"]["threshold"]
    with localcontext(prec=100):
        drift, noise, c1, c2 = (Decimal(repr(rule[key])) for key in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2"))
        for name in sorted({"printed_u", "u"} & {*saved}):  # printed: with the ratio upside down
            low, high = (Decimal(Fraction(end).numerator) / Fraction(end).denominator for end in saved[name])
            f = [(noise / drift) ** 2 * ((u.exp() - (-u).exp()) / 2 + u) for u in (low, high)]
            demand(f[0] < (c2 / c1 if name == "u" else c1 / c2) < f[1], f"no root in the enclosure of {name}")
            demand(0 < low < high < low * (1 + Decimal("1e-12")), f"the enclosure of {name} is too wide")
        zeta = float(low * noise**2 / (2 * drift)) if rule["rule"] == "bayes" else rule["zeta_m"]
    demand(near(zeta, claim["inputs"]["zeta_m"]), "the threshold in force is not the root, or not the fixed one")
    return "proved", math.nan


def ddm(_: Any, folder: Path, __: Any) -> Verdict:  # (17)-(18) against the recorded counts, by normal approximation
    rows, right = read_json(folder / "paths.json")["comparisons"], True
    quantile = NormalDist().inv_cdf(1.0 - 0.005 / len(rows))  # 99 % for all rows together
    for c, n, row in ((row["constants"], row["constants"]["paths"], row) for row in rows):
        u, w = (2.0 * c[length] * c["drift"] / c["noise"] ** 2 for length in ("zeta", "deviation"))
        bias, wrong = (1.0 - math.exp(-w)) / (2.0 * math.sinh(u)), row["wrong_decisions"] / n
        off, variance, slack = wrong - 1.0 / (1.0 + math.exp(u)) + bias, wrong * (1.0 - wrong), 2e-4
        if row["quantity"] == "mean decision time":  # in periods of the noise
            mean, drift = row["periods_sum"] / n, c["drift"] * c["noise_period_s"]
            off = mean - 0.25 - (c["zeta"] * (math.tanh(u / 2.0) + 2.0 * bias) - c["deviation"]) / drift
            variance, slack = row["periods_sum_of_squares"] / n - mean**2, 0.05
        right &= abs(off) <= quantile * math.sqrt(variance / n) + slack
    return "supported" if right else "refuted", math.nan


def refine(claim: Any, folder: Path, _: Any) -> Verdict:  # exponents p of mean counts, c dt^p exp(b sqrt(dt))
    counts, given = pd.read_csv(folder / "counts.csv").groupby("dt_s"), claim["inputs"]
    dt, most = np.array([*counts.groups]), claim["evidence"]["duration_s"] / given["dwell_s"] + 1.0 + SMALL
    fit = np.linalg.pinv(np.column_stack([np.ones_like(dt), np.log(dt), np.sqrt(dt)]))[1]
    bare, ours = (fit @ np.log(counts[name].mean()) for name in ("bare", "automaton"))
    full = counts["path"].nunique().min() >= 96 and len(dt) >= 9 and counts["automaton"].max().max() <= most
    return "supported" if full and abs(bare + 0.5) <= 0.1 and abs(ours) <= 0.1 else "refuted", math.nan


TRACE = ("SAFE-TRACE", "SAFE-HYP", "ZENO-TRACE", "THR-TRIG", "LIVE-GOAL")  # of every run
GATED = ("GATE-OPT", "GATE-SUR", "GATE-FEAS", "GATE-TIME")  # of methods c and d
PROVED = ("SAFE-LEMMA", "SAFE-INV", "SAFE-GATE", "SAFE-DIST", "ZENO-PROOF", "THR-ROOT", "THR-OPT")
MODEL = {**dict.fromkeys(PROVED, proof), "THR-ROOT": root, "THR-OPT": root, "THR-DDM": ddm, "ZENO-REFINE": refine}


def main(arguments: list[str] | None = None) -> int:
    """Print a line for the report and for each claim, and a summary; returns the exit code."""
    try:
        folder = Path(*(sys.argv[1:] if arguments is None else arguments))
        report = read_json(folder / "report.json")
        scenario, claims, mutants = report["scenario"]["resolved"], report["claims"], report["mutants"]
        usual = dict.fromkeys(MODEL, "supported") | dict.fromkeys(PROVED, "proved") | scenario["expected"]
        wanted = {(name, ""): usual[name] for name in MODEL}
        for run, about in scenario["runs"].items():
            names = [*TRACE, *["COMM"] * (about["method"] != "a"), *GATED * (about["method"] in ("c", "d"))]
            wanted |= {(name, run): about["expected"].get(name, "holds") for name in names}
        steps = [("report", "", None), *((claim["id"], claim["run"], claim) for claim in claims)]
        runs, outcomes, zeta = dict[str, Run](), Counter[str](), report["runs"][run]["zeta_m"]
    except Exception as error:  # no report: nothing to be compared with
        print(f"usage: python -m airground_drake.check DIR ({type(error).__name__}: {error})", file=sys.stderr)
        return 2

    def overall() -> str:
        demand(report["schema"] == "airground_drake.report/1", "schema")
        demand(sorted((c["id"], c["run"]) for c in claims) == sorted(wanted), "claims missing, unknown or twice")
        demand({*report["runs"]} == {*scenario["runs"]} == {path.name for path in folder.glob("trace/*")}, "other runs")
        odd = [c["status"] in ("inconclusive", "error", "not_run") for c in claims if not c["as_expected"]]
        bad = mutants and not all([*(m["refuted"] for m in mutants), *(i["demonstrated"] for i in report["audit"])])
        code = 1 if bad or not all(odd) else 3 if odd else 0
        status = {0: "as_expected", 1: "not_as_expected", 3: "inconclusive"}[code]
        ours = {"status": status, "exit_code": code, "counts": Counter(claim["status"] for claim in claims)}
        demand(report["overall"] == report["overall"] | ours, f"verdict over all, should be {ours}")
        return status

    def judge(claim: Any) -> str:
        name, run, status, recorded = (claim[key] for key in ("id", "run", "status", "margin"))
        said, refuted = (claim["expected"], claim["as_expected"], bool(claim["counterexample"])), status == "refuted"
        demand(said == (wanted[name, run], status == wanted[name, run], refuted), "expectation, or counterexample")
        if run:
            runs[run] = runs[run] if run in runs else Run(folder / "trace" / run, run, report, zeta)
            ours, margin = getattr(runs[run], name.lower().replace("-", "_"))()
            ours = ours if isinstance(ours, str) else "holds" if ours else "refuted"
        else:
            if refuted and name in PROVED:
                raise NotImplementedError("refutations of the model are not checked here")
            place, rule = folder / "certificates" / name, scenario["decision"]["threshold"] if name[:3] == "THR" else {}
            digests = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in place.glob("*")}
            demand(claim["certificates"] == digests, "certificates are not those recorded")
            known = {**scenario, **scenario["control"], **scenario["decision"], **rule, "zeta_m": zeta}
            known |= {"gain_1_s": known["avoidance_gain_1_s"]}
            demand(all(known.get(key, x) == x for key, x in claim["inputs"].items()), "inputs are not the scenario's")
            ours, margin = MODEL[name](claim, place, scenario)
        demand(ours == status, f"recorded {status!r}, recomputed {ours!r}")
        same = margin is recorded if None in (margin, recorded) else near(margin, recorded, 1e-6)
        demand(same or math.isnan(margin or 0.0), f"margin recorded {recorded}, recomputed {margin}")
        return f"{status}, margin {recorded}"

    for subject, run, claim in steps:
        try:
            outcome, text = "agrees", judge(claim) if claim else overall()
        except Exception as error:  # files fail in more ways than can be listed
            outcome = "DISAGREES" if isinstance(error, AssertionError) else "cannot be re-established"
            text = f"{type(error).__name__}: {error}"
        outcomes[outcome] += 1
        print(f"{subject:<12}{run or '-':<8}{outcome}: {text}")
    print(f"{outcomes.total()} checks: {dict(outcomes)}")
    return int(outcomes.total() > outcomes["agrees"])


if __name__ == "__main__":
    sys.exit(main())
