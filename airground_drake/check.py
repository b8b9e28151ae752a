"""An independent check of a report, `python -m airground_drake.check DIR`, short enough to be read in one sitting.

Establishes status and margin of every verdict in report.json again from trace/ and certificates/, by formulas written
here from the claims' statements, proofs in exact arithmetic. `DISAGREES`: files contradict the verdict or each other;
`cannot be re-established`: unreadable, or no way is known; docs/verification.md lists limits. A margin that is nan here
is not compared. Exit code 0: all agree; 1: not all; 2: usage.
"""

import hashlib
import json
import math
import re
import sys
from collections import Counter
from decimal import Decimal, localcontext
from fractions import Fraction
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

SMALL, EVENT_S = 1e-9, 1e-5  # tolerances: m, s, m/s; times of events between rows


def demand(condition: Any, otherwise: str) -> None:  # AssertionError is for files that disagree
    if not condition:
        raise AssertionError(otherwise)


def near(ours: Any, theirs: Any, slop: float = SMALL) -> bool:  # arrays of numbers
    return np.shape(ours) == np.shape(theirs) and np.allclose(theirs, ours, slop, slop) and np.isfinite(ours).all()


def read_json(path: Path) -> Any:  # strict JSON
    return json.loads(path.read_text("utf-8"), parse_constant=lambda text: demand(False, f"{path.name} has {text}"))


def pairs(scenario: Any) -> Any:  # robot, obstacle or other robot, safe distance m, largest closing speed m/s, share
    safe, uav = scenario["safe_distance"], scenario["uav"]["name"]
    speeds = {name: robot["max_speed_m_s"] for name, robot in {**scenario["ugvs"], uav: scenario["uav"]}.items()}
    for robot, speed in speeds.items():
        yield from ((robot, name, safe["obstacle_m"], speed, 1.0) for name in scenario["obstacles"])
        for other in (name for name in speeds if name != robot):
            yield robot, other, safe["air_ground_m" if uav in (robot, other) else "ugv_m"], speed + speeds[other], 0.5


class Run:  # a trace that is of the run it claims to be and obeys its law of motion; claims are methods
    def __init__(self, folder: Path, name: str, report: Any, zeta: float) -> None:
        meta, entry, scenario = read_json(folder / "meta.json"), report["runs"][name], report["scenario"]["resolved"]
        tables = [folder / f"{table}.parquet" for table in ("signals", "decisions", "problems")]
        digests = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in tables}
        ours = {"schema": "airground_drake.trace/2", "files": digests, "run": name, "scenario": scenario}
        ours |= {"seed": scenario["seed"], "events": entry["events"], "zeta_m": zeta}
        ours |= {key: scenario["runs"][name][key] for key in ("method", "composition")}
        demand(all(ours[key] == meta[key] == entry.get(key, meta[key]) for key in ours), "trace and report.json differ")
        self.signals, self.decisions, self.problems = (pd.read_parquet(path).reset_index(drop=True) for path in tables)
        self.times_s = read_json(folder / "timings.json")["decision_times_s"]
        self.plans: Any = [*self.decisions.join(self.problems, how="outer").itertuples()]  # each with its problem (26)
        self.scenario, self.gate, self.about, self.zeta = scenario, scenario["gatekeeper"], scenario["runs"][name], zeta
        events: Any = pd.DataFrame(meta["events"], columns=["t_s", "robot", "kind", "policy"])
        self.events, self.sent = events.sort_values("t_s"), events[events.kind == "proposal"]
        *self.ugvs, self.uav = self.spec = {**scenario["ugvs"], scenario["uav"]["name"]: scenario["uav"]}
        self.t = t = self.signals["t_s"].to_numpy()  # each of the T rows ends a segment
        self.at = {robot: self.signals[[f"{robot}.{axis}_m" for axis in "xyz"]].to_numpy() for robot in self.spec}
        self.at |= {obstacle: np.tile(o["position_m"], (len(t), 1)) for obstacle, o in scenario["obstacles"].items()}
        self.v = {robot: self.signals[[f"{robot}.v{axis}_m_s" for axis in "xyz"]].to_numpy() for robot in self.spec}
        dt = np.diff(t, prepend=0.0)
        demand((dt[1:] > 0.0).all() and near([0.0, scenario["duration_s"]], t[[0, -1]]), "times of the rows")
        keys = ("period_s", "avoidance_gain_1_s", "sensing_range_m", "motion_gain_1_s")
        h, *_ = self.h, self.gain, self.sensed, self.motion = [scenario["control"][key] for key in keys]
        _, self.first, self.owner = np.unique((t[1:] + t[:-1]) // (2.0 * h), return_index=True, return_inverse=True)
        demand(near(h * np.arange(math.ceil((t[-1] - SMALL) / h)), t[self.first]), "no row at a control sample")
        for robot, v in self.v.items():  # where the command of a row has led since the row before
            off = np.abs(np.diff([self.spec[robot]["start_m"], *self.at[robot]], axis=0) - dt[:, None] * v).max(axis=1)
            demand(off.max() <= SMALL, f"{robot} is not where its command leads, t = {t[off.argmax()]:.6g} s")
        inside: Any = (self.signals[f"{ugv}.mode"] == 1.0 for ugv in self.ugvs)  # intervening
        longest = max((mode * dt).groupby((~mode).cumsum()).sum().max() for mode in inside)
        idle = longest <= scenario["intervention"]["period_s"] + self.gate["period_s"]  # or else there are messages
        talk = len(self.sent) and (meta["method"] == "b" or len(self.decisions))
        self.silent: Any = {} if idle or talk else dict.fromkeys(("COMM", *GATED), ("not_run", None))

    def preset(self, ugv: str, t: Any) -> Any:  # preset trajectory at times (K,): (K, 3), m
        corners, speed = np.array(self.spec[ugv]["preset"]["waypoints_m"]), self.spec[ugv]["preset"]["speed_m_s"]
        passed = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1)))
        return np.stack([np.interp(t * speed, passed, x) for x in corners.T], axis=1)

    def safe_trace(self) -> Any:  # least distance of a pair: |r + s w|^2 is least at s = -r.w / w.w on a segment
        r = np.stack([self.at[robot] - self.at[other] for robot, other, *_ in pairs(self.scenario)])
        w, a = np.diff(r, axis=1), r[:, :-1]
        s = np.clip(-(a * w).sum(axis=2) / np.maximum((w * w).sum(axis=2), 1e-99), 0.0, 1.0)
        spare = np.linalg.norm(a + s[..., None] * w, axis=2).min(axis=1) - [pair[2] for pair in pairs(self.scenario)]
        return spare.min() >= -SMALL, spare.min()

    def spare(self, robot: str, other: str, safe: float, share: float, v: Any) -> Any:  # n.v less its bound at samples
        away = self.at[robot][self.first] - self.at[other][self.first]
        distance, rate = np.linalg.norm(away, axis=1), (away * v * [1.0, 1.0, robot == self.uav]).sum(axis=1)
        bound = share * np.where(distance <= safe, self.gain, 1.0 / self.h) * (safe - distance)
        return np.where(distance <= self.sensed, rate / np.maximum(distance, 1e-99) - bound, math.inf)

    def safe_hyp(self) -> Any:  # the proof's inequalities at each sample; the hold in between, limits, start, range
        others, least = [1.0 - self.gain * self.h], math.inf
        for robot, v in ((robot, v[1:]) for robot, v in self.v.items()):
            others += [self.spec[robot]["max_speed_m_s"] - np.linalg.norm(v, axis=1).max()]
            others += [-np.abs(v - v[self.first][self.owner]).max(), -np.abs(v[:, 2]).max() * (robot != self.uav)]
        for robot, other, safe, closing, share in pairs(self.scenario):
            others += [math.dist(self.at[robot][0], self.at[other][0]) - safe, self.sensed - safe - closing * self.h]
            least = min(least, self.spare(robot, other, safe, share, self.v[robot][self.first + 1]).min())
        margin = math.nan if min(others) < -SMALL else least if least < math.inf else None  # nan: another one broke
        return min(*others, least) >= -SMALL, margin

    def zeno_trace(self) -> Any:  # gaps between recorded triggers
        bound, triggers = self.scenario["decision"]["min_inter_event_s"], self.events[self.events.kind == "trigger"]
        gap = triggers.groupby("robot").t_s.diff().min()
        return (gap >= bound - SMALL, gap - bound) if gap >= 0.0 < bound else (bound > 0.0 or "not_run", None)

    def thr_trig(self) -> Any:  # the trigger run on x = |preset - p| + noise at the rows; events have their own
        law, lags, right = self.scenario["decision"], [], True
        release, dwell = (self.zeta, 0.0) if law["trigger"] == "bare" else (law["release_m"], law["min_inter_event_s"])
        for ugv in self.ugvs:
            x = np.linalg.norm(self.preset(ugv, self.t) - self.at[ugv], axis=1) + self.signals[f"{ugv}.noise_m"]
            ready, modes = -math.inf, [0]  # 0: supervising, 1: intervening, 2: released before the dwell is over
            for last, before, when, value in zip([x[0], *x], [0.0, *self.t], self.t, x, strict=False):
                now, rested = modes[-1], when >= ready - SMALL
                if now != 1 and value >= self.zeta and rested:  # as soon as x was there, or the dwell over
                    late = min((value - self.zeta) / max(value - last, 1e-99) * (when - before), when - ready)
                    now, ready, right = 1, when + dwell, right and (late <= EVENT_S or when == 0.0)
                elif (now == 1 and value < release) or now == 2:
                    now = 0 if rested else 2
                modes.append(now)
            ours = self.t[np.diff(np.equal(modes, 1))]
            theirs = self.events[(self.events.robot == ugv) & self.events.kind.isin(["trigger", "release"])]
            same = [*theirs.kind] == (["trigger", "release"] * len(ours))[: len(ours)]
            right &= same and near(x, self.signals[f"{ugv}.decision_variable_m"], 1e-7)
            right &= all(m in both for m, both in zip(self.signals[f"{ugv}.mode"], pairwise(modes), strict=True))
            lags += [*np.abs(ours - theirs.t_s)] if same else []
        right &= len(lags) == self.events.kind.isin(["trigger", "release"]).sum() and max(lags, default=0.0) <= EVENT_S
        return right, EVENT_S - max(lags) if right and lags else None

    def live_goal(self) -> Any:  # ends at targets, or stalls, standing for a second, where the scenario says so
        margins, stalls, late = list[float](), self.about["stalls_m"], self.t >= self.t[-1] - 1.0 - SMALL
        for robot, spec in self.spec.items():
            end, uav = self.at[robot][-1], robot == self.uav and stalls  # then over the centroid of the UGVs
            over = np.mean([self.at[u][-1] for u in self.ugvs], axis=0) + [0.0, 0.0, spec["altitude_m"] if uav else 0.0]
            spare = self.scenario["arrival_tolerance_m"] - math.dist(end, over if uav else spec["target_m"])
            if robot in stalls:  # then short of its target
                still, off = np.linalg.norm(self.at[robot][late] - end, axis=1).max(), math.dist(end, stalls[robot])
                margins += [1e-3 - still, self.scenario["stall_tolerance_m"] - off]
            margins.append(-spare if robot in stalls else spare)
        return min(margins) >= 0.0, min(margins)

    def comm(self) -> Any:  # proposals and decisions only while intervening (mode 1), and fewer than always-on
        periods, within, saved = (self.scenario["intervention"]["period_s"], self.gate["period_s"]), True, list[float]()
        for messages, period in zip((self.sent, self.decisions), periods, strict=True):
            saved.append(1.0 - len(messages) / (len(self.ugvs) * int((self.t[-1] + SMALL) / period)))
            for ugv, when in zip(messages.robot, messages.t_s, strict=True):
                recent = (self.t[1:] >= when - sum(periods) - SMALL) & (self.t[:-1] <= when + SMALL)
                within &= (self.signals[f"{ugv}.mode"].to_numpy()[1:][recent] == 1.0).any()
        return within and min(saved) >= 0.0, min(saved) if within else None

    def gate_time(self) -> Any:  # the 99th percentile of the recorded CPU times, rounded up
        demand(len(self.times_s) == len(self.decisions) and min(self.times_s, default=0.0) >= 0.0, "times of decisions")
        margin = self.gate["period_s"] - np.quantile(self.times_s or [0.0], 0.99, method="higher")
        return (margin > 0.0, margin) if self.times_s else (True, None)

    def predict(self, p: Any, omega: Any, normals: Any = None) -> Any:  # (25), and (23), (..., N, 3) m, of (..., N)
        a, b = p.accept_m_s.reshape(-1, 3), p.refuse_m_s.reshape(-1, 3)
        path = p.initial_m + p.dt_s * np.cumsum(b + omega[..., None] * (a - b), axis=-2)
        away = path[..., None, :] - p.centres_m.reshape(len(b), -1, 3)
        reach = np.linalg.norm(away, axis=-1) if normals is None else (away * normals.reshape(len(b), -1, 3)).sum(-1)
        u, e = (reach - p.distances_m).min(axis=-1, initial=0.0), path - p.reference_m.reshape(-1, 3)  # slack, error
        return p.dt_s * (p.error_weight_1_m2_s * (e**2).sum((-1, -2)) + p.slack_weight_1_m2_s * (u**2).sum(-1)), path

    def gate_feas(self) -> Any:  # problems against scenario and signals; plans; answers by the rules; obedience
        gate, right, before, say = self.gate, True, dict[str, Any](), ("refuse", "accept")
        t, lead = self.t[self.first], gate["horizon_s"] / gate["stages"] * np.arange(1.0, gate["stages"] + 1.0)
        half, weights = gate["period_s"] / 2.0, [lead[0], gate["error_weight_1_m2_s"], gate["slack_weight_1_m2_s"]]
        given = {*zip(self.sent.robot, self.sent.t_s, self.sent.policy, strict=True)}
        for p in self.plans:
            now, k, left = p.t_s, np.searchsorted(self.t, p.t_s - SMALL), [*range(len(p.distances_m))]
            (own, path), *rest = (self.predict(p, omega) for omega in (p.plan, 0.0 * p.plan, 0.0 * p.plan + 1.0))
            modes = np.stack([p.accept_m_s, p.refuse_m_s]).reshape(2, -1, 3)
            far = p.dt_s * np.cumsum(np.linalg.norm(modes, axis=2).max(axis=0))  # no plan leads farther
            for robot, other, safe, *_ in pairs(self.scenario):
                if robot == p.robot and math.dist(self.at[other][k], p.initial_m) <= self.sensed:
                    way = self.at[other][k] + lead[:, None] * (self.v[other][k] if other in self.v else 0.0)
                    centres = p.centres_m.reshape(len(lead), -1, 3)
                    found = [j for j in left if near(way, centres[:, j]) and near(safe, p.distances_m[j])][:1]
                    left = [j for j in left if j not in found]
                    beyond = np.maximum([math.dist(w, p.initial_m) for w in way] - far, np.abs(way - p.initial_m)[:, 2])
                    right &= bool(found) or (beyond >= safe).all()  # left out, but out of reach
            first, keep, costs = int(p.plan[0]), [cost for cost, _ in rest], (p.objective_refuse, p.objective_accept)
            ours = [self.at[p.robot][k], self.preset(p.robot, now + lead), path, [own] * 3, keep + weights]
            theirs = [p.initial_m, p.reference_m, p.positions_m, [p.objective, min(costs), costs[first]]]
            theirs += [[p.refuse_throughout, p.accept_throughout, p.dt_s, p.error_weight_1_m2_s, p.slack_weight_1_m2_s]]
            right &= all(map(near, map(np.ravel, ours), theirs)) and not left and not {*p.plan} - {0.0, 1.0}
            issued, standing, since, due = before.get(p.robot, (None, 0, 0.0, 0.0))  # 0: refuse, 1: accept
            new, bent, useless = issued != p.issued_s, not p.bend <= gate["max_bend"], own >= (1.0 - 1e-6) * keep[0]
            standing, since, due = (0, now, p.issued_s + half) if new else (standing, since, due)
            right &= (p.robot, p.issued_s, p.policy) in given and abs(now - due) <= half * new + SMALL
            better = first != standing and own < (1.0 - gate["switching_margin"]) * keep[standing]
            turn, early = better or bent if standing else better and not bent, now - since < gate["min_dwell_s"] - SMALL
            fresh = "not_cheaper" if not first else "no_difference" if useless else "bent" if bent else "cheaper"
            reason = fresh if new else "kept" if not turn else "dwell" if early else "reversed"
            answer = standing ^ (reason in ("cheaper", "reversed"))
            right &= (p.route, p.first_stage, p.decision, p.reason) == (gate["route"], say[first], say[answer], reason)
            before[p.robot] = p.issued_s, answer, since if answer == standing else now, now + 2.0 * half
        due = ((robot, t_s) for robot, t_s, _ in given if t_s < self.t[-1] - 4.0 * half)  # proposals to be decided on
        right &= {*due} <= {*zip(self.decisions["robot"], self.decisions["issued_s"], strict=True)}
        for ugv in self.ugvs:  # nothing is executed without an acceptance in force; nothing accepted: the own task (6)
            mine, executed = self.decisions[self.decisions["robot"] == ugv], self.signals[f"{ugv}.accepted"] != 0.0
            chosen, lasts = t[self.owner][executed[1:]] + SMALL, gate["period_s"] + 2.0 * SMALL
            right &= (mine.set_index("t_s").decision.reindex(chosen, method="ffill", tolerance=lasts) == "accept").all()
            early, here, late = (self.preset(ugv, t + s) for s in (-self.h, 0.0, self.h))
            v = (late - early) / (2.0 * self.h) + self.motion * (here - self.at[ugv][self.first])  # asks for
            v *= np.minimum(1.0, self.spec[ugv]["max_speed_m_s"] / np.maximum(np.hypot(*v.T[:2]), 1e-99))[:, None]
            free = (np.abs(late - 2.0 * here + early).max(axis=1) <= SMALL) & ~executed[self.first + 1]  # no corner
            for robot, other, safe, _, share in pairs(self.scenario):
                free &= (robot != ugv) | (self.spare(robot, other, safe, share, v) > 1e-6)
            right &= (np.linalg.norm((self.v[ugv][self.first + 1] - v)[:, :2], axis=1)[free] <= 1e-6).all()
        return right, math.nan

    def gate_sur(self) -> Any:  # (28)-(29) again, and the integrated rounding error, at most half a stage
        w, z = (np.array([getattr(p, key) for p in self.plans]) for key in ("relaxed", "rounded"))
        ahead, dt = np.cumsum(w - z, axis=-1), np.array([p.dt_s for p in self.plans])
        right = ((z == (ahead + z >= 0.5)) | (np.abs(ahead + z - 0.5) <= SMALL)).all() and {*z.flat} <= {0.0, 1.0}
        error = dt * np.abs(ahead).max(axis=-1, initial=0.0)
        right &= (np.abs(w - 0.5) <= 0.5).all() and near(error, [p.rounding_deviation_s for p in self.plans])
        return right and (error <= dt / 2.0 + SMALL).all(), max(0.0, (dt / 2.0 - error).min()) if self.plans else None

    def gate_opt(self) -> Any:  # against the optimum along normals: a convex cost is never below a tangent of it
        right, gaps = True, [np.zeros(2)]
        for p in self.plans:
            w, n, own = p.relaxed, len(p.relaxed), self.predict(p, p.plan)[0]
            least = max(1e-6, min(p.refuse_throughout, p.accept_throughout))
            ends = np.vstack([w, p.plan, w + 1e-5 * np.eye(n), w - 1e-5 * np.eye(n)])
            value, along, *costs = self.predict(p, ends, p.normals)[0]
            slopes = np.subtract(costs[:n], costs[n:]) / 2e-5
            lower = value + np.minimum(-slopes * w, slopes * (1.0 - w)).sum()  # the tangent at a corner of the box
            won = min(p.refuse_throughout - p.objective_refuse, p.accept_throughout - p.objective_accept, least - own)
            right &= np.allclose(np.linalg.norm(p.normals.reshape(-1, 3), axis=1), 1.0, 0.0, SMALL) and won >= -SMALL
            right &= p.lower_bound <= min(along, value) + 1e-5 * least and p.gap >= 1.0 - p.lower_bound / own - 1e-6
            gaps.append((own - np.array([lower, min(along, value)])) / least)
        low, high = 0.05 - np.max(gaps, axis=0)
        if right and low < 0.0 <= high:
            raise NotImplementedError("these tangents are too weak a bound")
        return right and low >= 0.0, (low, high) if self.plans else None


def combine(*products: Any) -> Any:  # sum of products of polynomials: coefficients by monomial, a sorted tuple of names
    total = Counter[tuple[str, ...]]()
    for factors in map(list, products):
        demand(math.prod(map(len, factors)) < 10**5 and all(len(str(f)) < 10**5 for f in factors), "too large")
        for terms in product(*(factor.items() for factor in factors)):
            total[tuple(sorted(name for names, _ in terms for name in names))] += math.prod(size for _, size in terms)
    return total


def expand(text: str) -> Any:  # a sum of products of numbers and names, such as "2*h*r - 1/2*d"
    total: Any = Counter()
    for sign, factors in re.findall(r"([-+]?) ?([^ +-]+)", text):
        names = [word for word in factors.split("*") if word.isidentifier()]
        sizes = (Fraction(*map(int, word.split("/"))) for word in factors.split("*") if not word.isidentifier())
        total[tuple(sorted(names))] += math.prod(sizes, start=Fraction(-1 if sign == "-" else 1))
    return total


def proof(claim: Any, folder: Path, scenario: Any) -> Any:  # m * goal = sum c * factors * square^2 + sum q * equation
    saved = read_json(folder / "obligations.json")
    for one in saved:
        given, n = {**one["hypotheses"], **one["strict"]}, len(one["multiplier"])
        terms = one["multiplier"] + one["certificate"]
        cone = [[*map(expand, [t["coefficient"], *[t["square"]] * 2, *map(given.get, t["factors"])])] for t in terms]
        zero = [map(expand, (text, one["equations"][key])) for key, text in one["equation_multipliers"].items()]
        sure = not n or any(t["square"] == "1" and {*t["factors"]} <= {*one["strict"]} for t in terms[:n])
        demand(sure and all({*c} == {()} and c[()] > 0 for c, *_ in cone), f"{one['name']}: a term may be below 0")
        left = combine([combine(*cone[:n] or [[]]), expand(one["goal"])])
        demand(left == combine(*cone[n:], *zero), f"the certificate of {one['name']} does not prove it")
    for name, texts in read_json(Path(__file__).with_name("check_obligations.json"))[claim["id"]].items():
        (goal, _), *assumed = [(expand(text.strip("=> ")), text[0] in "=>" and text[0]) for text in texts]
        kinds, one = {"hypotheses": False, "strict": ">", "equations": "="}, {o["name"]: o for o in saved}[name]
        fit = ((expand(text), kinds[kind]) in assumed for kind in kinds for text in one[kind].values())
        demand(expand(one["goal"]) == goal and all(fit), f"{name} has another goal than the claim, or assumes more")
    used = {"ZENO-PROOF": [scenario["decision"]["trigger"]]}  # what the proof is about
    used["SAFE-GATE"] = [run["composition"] for run in scenario["runs"].values() if run["method"] == "d"]
    demand({*used.get(claim["id"], [])} <= {"automaton", "augmented"}, "the proof is about another system")
    h, gain, sensed = (scenario["control"][key] for key in ("period_s", "avoidance_gain_1_s", "sensing_range_m"))
    margin = min(sensed - safe - closing * h for _, _, safe, closing, _ in pairs(scenario))
    demand(margin >= 0.0 and 0.0 <= gain * h <= 1.0, "range, speed, period or gain break a premise")
    return "proved", {"SAFE-INV": margin, "SAFE-LEMMA": None}.get(claim["id"], math.nan)


def root(claim: Any, folder: Path, scenario: Any) -> Any:  # f = k (sinh u + u) - c2/c1 increases and changes sign
    saved, rule = read_json(folder / "statements.json")["enclosures"], scenario["decision"]["threshold"]
    with localcontext(prec=100):
        drift, noise, c1, c2 = (Decimal(repr(rule[key])) for key in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2"))
        for name, ratio in [("printed_u", c1 / c2)] * (claim["id"] == "THR-OPT") + [("u", c2 / c1)]:
            low, high = (Decimal(Fraction(end).numerator) / Fraction(end).denominator for end in saved[name])
            f = [(noise / drift) ** 2 * ((u.exp() - (-u).exp()) / 2 + u) - ratio for u in (low, high)]
            demand(f[0] < 0 < f[1] and 0 < low < high < low * (1 + Decimal("1e-12")), f"{name} encloses no root")
        zeta = float(low * noise**2 / (2 * drift)) if rule["rule"] == "bayes" else rule["zeta_m"]
    demand(near(zeta, claim["inputs"]["zeta_m"]), "the threshold in force is not the root, or not the fixed one")
    return "proved", math.nan


def ddm(_: Any, folder: Path, __: Any) -> Any:  # (17)-(18) against the recorded counts, by normal approximation
    rows, right = read_json(folder / "paths.json")["comparisons"], True  # 12, at 99 % for all of them together
    for c, n, row in ((row["constants"], row["constants"]["paths"], row) for row in rows):
        u, w = (2.0 * c[length] * c["drift"] / c["noise"] ** 2 for length in ("zeta", "deviation"))
        bias, wrong = (1.0 - math.exp(-w)) / (2.0 * math.sinh(u)), row["wrong_decisions"] / n
        off, variance, slack = wrong - 1.0 / (1.0 + math.exp(u)) + bias, wrong * (1.0 - wrong), 2e-4
        if row["quantity"] == "mean decision time":  # in periods of the noise
            mean, drift = row["periods_sum"] / n, c["drift"] * c["noise_period_s"]
            off = mean - 0.25 - (c["zeta"] * (math.tanh(u / 2.0) + 2.0 * bias) - c["deviation"]) / drift
            variance, slack = row["periods_sum_of_squares"] / n - mean**2, 0.05
        right &= n >= 4000 and abs(off) <= 3.34 * math.sqrt(variance / n) + slack
    return "supported" if right and len(rows) == 12 else "refuted", math.nan


def refine(_: Any, folder: Path, scenario: Any) -> Any:  # exponents p of mean counts, c dt^p exp(b sqrt(dt))
    counts, law = pd.read_csv(folder / "counts.csv").groupby("dt_s"), scenario["decision"]
    dt, most = np.array([*counts.groups]), scenario["duration_s"] / law["min_inter_event_s"] + 1.0 + SMALL
    fit = np.linalg.pinv(np.column_stack([np.ones_like(dt), np.log(dt), np.sqrt(dt)]))[1]
    bare, ours = (fit @ np.log(counts[name].mean()) for name in ("bare", "automaton"))
    full = counts["path"].nunique().min() >= 96 and len(dt) >= 9 and counts["automaton"].max().max() <= most
    return "supported" if full and abs(bare + 0.5) <= 0.1 and abs(ours) <= 0.1 else "refuted", math.nan


TRACE = ("SAFE-TRACE", "SAFE-HYP", "ZENO-TRACE", "THR-TRIG", "LIVE-GOAL")  # of every run
GATED = ("GATE-SUR", "GATE-OPT", "GATE-FEAS", "GATE-TIME")  # of methods c and d
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
        skip = scenario["gatekeeper"]["route"] not in ("relaxed", "nonlinear")  # no GATE-SUR: nothing to round
        for run, about in scenario["runs"].items():
            names = [*TRACE, *["COMM"] * ((rank := [*"abcd"].index(about["method"])) > 0), *GATED[skip:] * (rank > 1)]
            wanted |= {(name, run): about["expected"].get(name, "holds") for name in names}
        runs, outcomes, zeta = dict[str, Run](), Counter[str](), report["runs"][run]["zeta_m"]
        labels = [(claim["id"], claim["run"]) for claim in claims]
    except Exception as error:  # no report: nothing to be compared with
        print(f"usage: python -m airground_drake.check DIR ({type(error).__name__}: {error})", file=sys.stderr)
        return 2

    def overall() -> str:
        demand(report["schema"] == "airground_drake.report/1" and sorted(labels) == sorted(wanted), "schema, or claims")
        demand({*report["runs"]} == {*scenario["runs"]} == {path.name for path in folder.glob("trace/*")}, "other runs")
        odd = [c["status"] in ("inconclusive", "error", "not_run") for c in claims if not c["as_expected"]]
        bad = not all([*odd, *(m["refuted"] for m in mutants), *(item["demonstrated"] for item in report["audit"])])
        code, status = (1, "not_as_expected") if bad else (3, "inconclusive") if odd else (0, "as_expected")
        ours = {"status": status, "exit_code": code, "counts": Counter(claim["status"] for claim in claims)}
        demand(report["overall"] == report["overall"] | ours, f"verdict over all, should be {ours}")
        return status

    def judge(claim: Any) -> str:
        name, run, status, given = (claim[key] for key in ("id", "run", "status", "margin"))
        said, refuted = (claim["expected"], claim["as_expected"], bool(claim["counterexample"])), status == "refuted"
        demand(said == (wanted[name, run], status == wanted[name, run], refuted), "expectation, or counterexample")
        if (refuted and name in PROVED) or (name in GATED[:3] and scenario["gatekeeper"]["route"] != "relaxed"):
            raise NotImplementedError("refutations of the model, and other routes than 'relaxed', are not known here")
        if run:
            trace = runs[run] = runs[run] if run in runs else Run(folder / "trace" / run, run, report, zeta)
            ours, margin = trace.silent.get(name) or getattr(trace, name.lower().replace("-", "_"))()
        else:
            place, rule = folder / "certificates" / name, scenario["decision"]["threshold"] if name[:3] == "THR" else {}
            digests = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in place.glob("*")}
            demand(claim["certificates"] == digests, "certificates are not those recorded")
            known = {**scenario, **scenario["control"], **scenario["decision"], **rule, "zeta_m": zeta}
            demand(all(known.get(key, x) == x for key, x in claim["inputs"].items()), "inputs are not the scenario's")
            ours, margin = MODEL[name](claim, place, scenario)
        demand({True: "holds", False: "refuted"}.get(ours, ours) == status, f"recorded {status!r}, recomputed {ours!r}")
        ends = margin if isinstance(margin, tuple) else (margin, margin)  # of what is possible
        same = margin is given if None in (margin, given) else np.isclose(given, np.clip(given, *ends), 1e-6, 1e-9)
        demand(same or math.isnan(ends[0] or 0.0), f"margin recorded {given}, recomputed {margin}")
        return f"{status}, margin {given}"

    for (subject, run), claim in zip([("report", ""), *labels], [None, *claims], strict=True):
        try:
            outcome, text = "agrees", judge(claim) if claim else overall()
        except Exception as error:  # files fail in more ways than can be listed
            outcome = "DISAGREES" if isinstance(error, AssertionError) else "cannot be re-established"
            text = f"{type(error).__name__}: {error}"
        outcomes[outcome] += 1
        print(f"{subject!s:<12}{run or '-'!s:<8} {outcome}: {text}")
    print(f"{outcomes.total()} checks: {dict(outcomes)}")
    return int(outcomes.total() > outcomes["agrees"])


if __name__ == "__main__":
    sys.exit(main())
