"""SAFE-LEMMA, SAFE-INV, SAFE-GATE, SAFE-DIST, ZENO-PROOF, LIVE-GATE, LIVE-WAIT and THR-ISO, every certificate exactly.

An obligation says: wherever all hypotheses are >= 0, the strict ones > 0 and all equations 0, the goal is >= 0. Its
certificate is an identity of polynomials with rational coefficients,

    multiplier * goal = sum_j c_j * (product of hypotheses) * square_j^2 + sum_i q_i * equation_i,

with c_j >= 0 and a multiplier that is such a sum itself, one term of which is a positive number times strict
hypotheses only (or no multiplier: 1). Whoever expands both sides has done the proof again.

An identity may prove something else than the claim. What a claim consists of is therefore listed here, in
`obligations.json`: by claim and name of the obligation

    {"goal": polynomial, "nonnegative": [...], "positive": [...], "zero": [...]},

the goal to be shown and the premises that may be used, no others: hypotheses, strict ones and equations. Names in
capitals (DWELL, BOUND, GAIN, PERIOD) are numbers of the scenario. That these obligations together make the claim is the
argument in the claim's own text. Some are there again with the scenario's numbers, `inside_obstacle` for `inside`
between robots and obstacles and so on: then the numbers are put into goal and premises, and a premise that has become a
number must be a true one.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from fractions import Fraction
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any

from .files import Files, Json, content_of, parse_json, read_json
from .polynomials import Polynomial, number, parse
from .rules import SMALL, Disagreement, Found, NotEstablished, agrees, at_most, close, holds, same
from .scenario import Kind, disturbance_m_s, kinds_of, levels_of, rounding_m, views_of
from .triggers import refuted_zeno_proof

GROUPS = {"hypotheses": "nonnegative", "strict": "positive", "equations": "zero"}
"""Kinds of premises: in a certificate, and in obligations.json."""
NUMBERED = {
    "SAFE-INV": ("outside", "inside", "unseen"),
    "SAFE-DIST": ("outside_bound", "inside_bound", "unseen_bound", "positive"),
}
"""Obligations that are there again for each kind of pairs."""
ONE_FORM = ("unseen", "unseen_bound", "positive")
"""Those that have the same form for obstacles and for robots; of the others, robots have the one named `pair_...`."""
ONLY_NUMBERED = "positive"
"""The one that is there with numbers only."""
SHORTEST_S = 1e-3
"""Bound that ZENO-PROOF tries where the scenario has none."""
ROUNDOFF = 2.0**-53


def prove(claim: Json, files: Files, scenario: Json) -> Found:
    """A proof: its certificates prove their goals, the goals are the claim's, and the record of it is consistent."""
    if claim["status"] == "refuted":
        if claim["id"] == "ZENO-PROOF":
            bound = scenario["decision"]["min_inter_event_s"] or SHORTEST_S
            found = refuted_zeno_proof(claim, levels_of(scenario), bound).also(conformance=_TRIGGER_CONFORMS)
            return found.judging(partial(_rounding_of_the_dwell, claim["evidence"], scenario), "evidence.rounding_s")
        raise NotEstablished("a refutation is established again", "no way is known here")
    content = content_of(files, "obligations.json")
    obligations = _expanded(content)
    _consists_of_the_claim(claim["id"], obligations, scenario)
    recorded = claim["evidence"]["obligations"]
    same("obligations in the evidence", [entry["name"] for entry in recorded], list(obligations))
    for entry in recorded:
        same("an obligation is proved", entry["status"], "proved", about=entry["name"])
    if claim["id"] == "SAFE-LEMMA":
        _gram_matrix(parse_json(content_of(files, "gram.json"), "gram.json"))
        found = Found("proved")
    else:
        found = _RECORDED[claim["id"]](claim, scenario)
    return found.counted(len(obligations)).having_judged("evidence.obligations.*.name", "evidence.obligations.*.status")


@lru_cache(maxsize=64)
def _expanded(content: bytes) -> Mapping[str, Json]:
    """The obligations in a file by name, each with a certificate that proves it."""
    listed = parse_json(content, "obligations.json")
    names = [one["name"] for one in listed]
    holds("an obligation is there once", len({*names}) == len(names), sorted(names), "no name twice")
    for one in listed:
        _certificate_proves(one)
    return {one["name"]: one for one in listed}


def _certificate_proves(one: Json) -> None:
    """multiplier * goal = sum of terms + sum of equations, nothing in it being below 0.

    Raises:
        Disagreement: if it does not.
    """
    name = one["name"]
    for term in one["certificate"] + one["multiplier"]:
        holds("coefficients are not negative", number(term["coefficient"]) >= 0, term["coefficient"], "0 or more",
              about=name)  # fmt: skip
    if one["multiplier"]:
        sure = any(_is_positive(term, one["strict"]) for term in one["multiplier"])
        holds("the multiplier is positive", sure, one["multiplier"], "a term of strict hypotheses", about=name)
    premises = {**one["hypotheses"], **one["strict"]}
    left = parse(one["goal"])
    if one["multiplier"]:
        left = _sum_of_terms(one["multiplier"], premises) * left
    right = _sum_of_terms(one["certificate"], premises)
    for equation, factor in one["equation_multipliers"].items():
        right += parse(factor) * parse(one["equations"][equation])
    if left != right:
        raise Disagreement("the certificate expands to its goal", _written(right), _written(left), name)


def _is_positive(term: Json, strict: Mapping[str, str]) -> bool:
    return number(term["coefficient"]) > 0 and term["square"] == "1" and {*term["factors"]} <= {*strict}


def _sum_of_terms(terms: list[Json], premises: Mapping[str, str]) -> Polynomial:
    total = Polynomial()
    for term in terms:
        product = parse(term["coefficient"]) * parse(term["square"]) * parse(term["square"])
        for factor in term["factors"]:
            product *= parse(premises[factor])
        total += product
    return total


def _written(polynomial: Polynomial) -> str:
    return " + ".join("*".join([str(size), *names]) for names, size in sorted(polynomial.items())) or "0"


@cache
def listed() -> Json:
    """obligations.json of this package: what the claims consist of."""
    found: Json = read_json(Path(__file__).with_name("obligations.json"))
    return found


def _consists_of_the_claim(claim: str, obligations: Mapping[str, Json], scenario: Json) -> None:
    """Every obligation of the claim is there, with its goal and no premise besides; also with numbers."""
    for name, (form, numbers) in _wanted(claim, scenario).items():
        holds("the obligation is there", name in obligations, "nothing", form["goal"], about=name)
        _is_the_listed_one(obligations[name], form, numbers)


def _wanted(claim: str, scenario: Json) -> dict[str, tuple[Json, dict[str, Fraction]]]:
    """What a claim consists of, by name: an entry of obligations.json, and the numbers to be put into it."""
    forms, control = listed()[claim], scenario["control"]
    constants = {
        "DWELL": rational(levels_of(scenario).dwell_s),
        "BOUND": rational(scenario["decision"]["min_inter_event_s"] or SHORTEST_S),
        "GAIN": rational(control["avoidance_gain_1_s"]),
        "PERIOD": rational(control["period_s"]),
    }
    found = {name: (form, constants) for name, form in forms.items() if name != ONLY_NUMBERED}
    for kind in kinds_of(scenario):
        for name in NUMBERED.get(claim, ()):
            base = name if kind.share == 1.0 or name in ONE_FORM else f"pair_{name}"
            found[f"{base}_{kind.name}"] = (forms[base], numbers_of(kind, scenario))
    return found


def rational(value: float) -> Fraction:
    """The decimal that a number prints as."""
    return Fraction(repr(float(value)))


def numbers_of(kind: Kind, scenario: Json) -> dict[str, Fraction]:
    """d, c, A, h, R and W, what the disturbances of a pair add up to, for a kind of pairs."""
    control = scenario["control"]
    values = {
        "d": kind.safe_m,
        "c": kind.closing_m_s,
        "A": control["avoidance_gain_1_s"],
        "h": control["period_s"],
        "R": control["sensing_range_m"],
        "W": disturbance_m_s(scenario) / kind.share,
    }
    return {name: rational(value) for name, value in values.items()}


def _is_the_listed_one(one: Json, form: Json, numbers: Mapping[str, Fraction]) -> None:
    goal = parse(form["goal"]).at(numbers)
    holds("the goal is the claim's", parse(one["goal"]) == goal, one["goal"], form["goal"], about=one["name"])
    for group, admissible in GROUPS.items():
        known = [parse(text).at(numbers) for text in form.get(admissible, ())]
        for text in one[group].values():
            premise = parse(text)
            holds("no further premise", premise in known, text, str(form.get(admissible, [])), about=one["name"])
            _number_is_true(premise.constant(), group, one["name"])


def _number_is_true(value: Fraction | None, group: str, name: str) -> None:
    """A premise that is a number is a true one: a false one would prove anything."""
    if value is not None:
        true = {"hypotheses": value >= 0, "strict": value > 0, "equations": value == 0}[group]
        holds("a premise that is a number is true", true, f"{value} in {group}", "a true premise", about=name)


def _gram_matrix(gram: Json) -> None:
    """Lagrange's difference is z.G z, and G = L diag(D) L^T with D >= 0: exactly.

    Raises:
        Disagreement: if it is not.
    """
    monomials = [parse(text) for text in gram["monomials"]]
    lower = [[number(text) for text in row] for row in gram["lower"]]
    diagonal = [number(text) for text in gram["diagonal"]]
    size = range(len(monomials))
    form = Polynomial()
    for i in size:
        holds("the diagonal is not negative", diagonal[i] >= 0, str(diagonal[i]), "0 or more", about="gram.json")
        for j in size:
            entry = sum((lower[i][k] * diagonal[k] * lower[j][k] for k in size), Fraction())
            same("G = L D L^T", gram["gram"][i][j], str(entry), about=f"gram.json, {i}, {j}")
            form += monomials[i] * monomials[j] * Polynomial.of({(): entry})
    goal = listed()["SAFE-LEMMA"]["lagrange"]["goal"]
    holds("z.G z is Lagrange's difference", form == parse(goal), _written(form), goal, about="gram.json")


def _recorded_of_inv(claim: Json, scenario: Json) -> Found:
    """The margin is what rounding leaves of the tolerance; the running code and its wiring were found to conform."""
    evidence = claim["evidence"]
    same("the running code conforms", evidence["conformance"]["agrees"], True)
    same("the running composition met its inequalities", evidence["composition"]["met"], True)
    same("inequalities missed by the composition", evidence["composition"]["missed"], 0)
    _wiring(evidence["wiring"], scenario)
    h, reach = rational(scenario["control"]["period_s"]), rational(scenario["control"]["sensing_range_m"])
    spare = {
        kind.name: float(reach - rational(kind.safe_m) - rational(kind.closing_m_s) * h) for kind in kinds_of(scenario)
    }
    agrees("spare of the sensing range", evidence["sensing_range_spare_m"], spare, within=SMALL)
    lost = {kind.name: rounding_m(scenario, kind) for kind in kinds_of(scenario)}
    _rounding(evidence["rounding"], lost, scenario)
    left = SMALL - max(lost.values())
    if not math.isfinite(left):
        return Found("inconclusive")
    worst = lost.get(claim["where"]["pair"], -1.0)
    holds("where the margin is attained", worst >= max(lost.values()) * (1.0 - ALIKE), claim["where"], str(lost))
    found = Found.with_margin("proved" if left >= 0.0 else "inconclusive", left, within=1e-15)
    return found.also(**_CONFORMS, composition=_MET | {"composition": "augmented"}, wiring=_WIRED).having_judged(
        "where.pair", "evidence.wiring.composition", "evidence.wiring.views.*",
        "evidence.sensing_range_spare_m.*", "evidence.rounding.*.margin_of_a_step_m",
        "evidence.rounding.*.margin_with_restoring_m",
    )  # fmt: skip


ALIKE = 1e-9
"""Numbers that follow from the scenario alone differ by less, relative."""
_CONFORMS: Json = {"conformance": {"agrees": True, "first_difference": None}}
_MET: Json = {"met": True, "missed": 0, "first_missed": None}
_WIRED: Json = {"agrees": True, "differences": 0, "first_difference": None}
"""What the evidence says of running code that conforms."""


def _rounding(recorded: Json, lost_m: Mapping[str, float], scenario: Json) -> None:
    """What rounding may take from each kind of pairs, in a step and while the gain restores it."""
    same("kinds of pairs", sorted(recorded), sorted(lost_m))
    restored = scenario["control"]["avoidance_gain_1_s"] * scenario["control"]["period_s"]
    for name, lost in lost_m.items():
        if math.isfinite(lost):
            due = {"margin_of_a_step_m": lost * restored, "margin_with_restoring_m": lost}
            for key, value in due.items():
                close(f"rounding: {key}", recorded[name][key], value, within=ALIKE * value, about=name)


def _wiring(recorded: Json, scenario: Json) -> None:
    """The built diagram was compared for every robot and all that it must avoid, and did not differ."""
    same("the built diagram agrees with the scenario", [recorded["agrees"], recorded["differences"]], [True, 0])
    uav = scenario["uav"]["name"]
    counts = Counter(
        "obstacle" if view.share == 1.0 else "uav_ugv" if uav in (view.robot, view.other) else "ugv_ugv"
        for views in views_of(scenario).values()
        for view in views
    )
    same("robots and what they avoid", recorded["views"], dict(counts))
    for kind in counts:
        if kind != "obstacle":
            bound = recorded["least_times_bound"][kind]
            holds("an inequality of every two robots was seen to bind", bound > 0, bound, "1 or more", about=kind)


def _recorded_of_gate(claim: Json, scenario: Json) -> Found:
    """The proof is about the augmented composition; the running layer and controller missed no inequality."""
    evidence, compositions = claim["evidence"], claim["inputs"]["method_d"]["compositions"]
    same("the proof is about the composition in use", compositions, ["augmented"])
    same("method (d) in the evidence", evidence["method_d"], claim["inputs"]["method_d"])
    same("compositions attacked", [layer["composition"] for layer in evidence["layer"]], compositions)
    for layer in evidence["layer"]:
        same("the running layer met its inequalities", [layer["met"], layer["missed"]], [True, 0])
    same("compositions wired", [each["composition"] for each in evidence["wiring"]], compositions)
    for wired in evidence["wiring"]:
        _wiring(wired, scenario)
    for team in evidence["controller"]:
        same("inequalities missed by the running controller", team["missed"], 0)
    worst = min(layer["worst_slack_m_s"] for layer in evidence["layer"])
    lowest = [layer["composition"] for layer in evidence["layer"] if layer["worst_slack_m_s"] == worst]
    holds("where the margin is attained", claim["where"]["composition"] in lowest, claim["where"], str(lowest))
    found = Found.with_margin("proved", worst, within=0.0, layer=[_MET] * len(compositions))
    found = found.also(wiring=[_WIRED] * len(compositions))
    return found.having_judged(
        "where.composition", "evidence.method_d", "evidence.layer.*.composition", "evidence.layer.*.worst_slack_m_s",
        "evidence.wiring.*.composition", "evidence.wiring.*.views.*",
        "evidence.controller.*.missed",
    )  # fmt: skip


def _recorded_of_dist(claim: Json, scenario: Json) -> Found:
    """No disturbed run broke a bound; the margin is the worst of those whose inequalities were all met."""
    evidence, w = claim["evidence"], disturbance_m_s(scenario)
    same("the running code conforms", evidence["conformance"]["agrees"], True)
    gain = scenario["control"]["avoidance_gain_1_s"]
    bounds = {kind.name: kind.safe_m - w / kind.share / gain for kind in kinds_of(scenario)}
    agrees("least distances", evidence["least_distances_m"], bounds, within=SMALL)
    for row in evidence["runs"]:
        same("bounds broken by a disturbed run", row["broken"], 0, about=row["scene"])
        _worst_of_a_disturbed_run(row, {bounds[kind.name]: kind.safe_m for kind in kinds_of(scenario)})
    covered = [row["worst_margin_m"] for row in evidence["runs"] if not row["unmet"]]
    lowest = [row["where"] for row in evidence["runs"] if row["worst_margin_m"] == min(covered)]
    places = [{key: where[key] for key in ("scene", "attack", "robot", "t_s")} for where in lowest]
    holds("where the margin is attained", claim["where"] in places, claim["where"], str(places))
    found = Found.with_margin("proved", min(covered), within=0.0, disturbance_m_s=w, **_CONFORMS)
    return found.having_judged(
        "where.*", "evidence.least_distances_m.*", "evidence.runs.*.scene", "evidence.runs.*.broken",
        "evidence.runs.*.worst_margin_m",
        *(f"evidence.runs.*.where.{key}" for key in ("scene", "distance_m", "bound_m", "safe_distance_m")),
    )  # fmt: skip


def _worst_of_a_disturbed_run(row: Json, bounds_m: Mapping[float, float]) -> None:
    """The worst margin is that of the distance there, to a bound that is one of a kind of pairs.

    Args:
        row: the run.
        bounds_m: safe distance by bound.
    """
    where, about = row["where"], row["scene"]
    same("scene of the worst margin", where["scene"], row["scene"], about=about)
    close("worst margin", row["worst_margin_m"], where["distance_m"] - where["bound_m"], within=SMALL, about=about)
    both = [where["bound_m"], where["safe_distance_m"]]
    known = any(max(abs(both[0] - bound), abs(both[1] - safe)) <= SMALL for bound, safe in bounds_m.items())
    holds("bound of the worst margin", known, both, str(bounds_m), about=about)


def _recorded_of_zeno(claim: Json, scenario: Json) -> Found:
    """The running trigger conforms; the margin is what rounding `triggered_at + dwell` leaves of 1e-9 s."""
    evidence = claim["evidence"]
    same("the proof is about the trigger in use", scenario["decision"]["trigger"], "automaton")
    same("states in which the running trigger does not conform", evidence["conformance"]["disagreements"], 0)
    same("an invariant exists for the scenario's numbers", evidence["spacer"], "an invariant exists")
    rounding = _rounding_of_the_dwell(evidence, scenario)
    bound = float(scenario["decision"]["min_inter_event_s"] or SHORTEST_S)
    agrees("where the margin is attained", claim["where"], {"bound_s": bound}, within=0.0)
    found = Found.with_margin("proved", SMALL - rounding, within=1e-16, bound_s=bound, conformance=_TRIGGER_CONFORMS)
    return found.having_judged("where.bound_s", "evidence.rounding_s", "evidence.spacer")


_TRIGGER_CONFORMS: Json = {"disagreements": 0, "first": None}
"""What the evidence says of a running trigger that conforms."""


def _rounding_of_the_dwell(evidence: Json, scenario: Json) -> float:
    """What rounding `triggered_at + dwell` may take from a gap, s; the evidence has the same."""
    dwell = levels_of(scenario).dwell_s
    meant, kept = rational(dwell), Fraction(float(dwell))
    error = Fraction(ROUNDOFF) * (Fraction(float(scenario["duration_s"])) + kept) + abs(meant - kept)
    rounding = math.nextafter(float(error), math.inf)
    close("rounding of the dwell", evidence["rounding_s"], rounding, within=1e-24)
    return rounding


def _recorded_of_live(claim: Json, scenario: Json) -> Found:
    """Differences contract; no run that was disturbed within the bound was given back; the margin is what it left."""
    evidence, gate, control = claim["evidence"], scenario["gatekeeper"], scenario["control"]
    gain = control["intervention_gain_1_s"]
    at_most("gain times period", gain * control["period_s"], 1.0)
    close("disturbance allowed", evidence["disturbance_m_s"], gain * gate["lag_m"], within=SMALL)
    holds("the running code was run", bool(evidence["runs"]), "no run", "some")
    for row in evidence["runs"]:
        same("given back before its time", row["given_back"], False)
        at_most("excess of a run's lag", row["largest_excess_m"], gate["lag_m"], within=SMALL)
    excess = max(row["largest_excess_m"] for row in evidence["runs"])
    return Found.with_margin("proved", gate["lag_m"] - excess, within=SMALL).having_judged(
        "evidence.disturbance_m_s", "evidence.runs.*.given_back"
    )


def _recorded_of_wait(claim: Json, scenario: Json) -> Found:
    """The bound is all tries to their ends; no attack on the running gatekeeper kept a UGV for longer."""
    evidence, gate = claim["evidence"], scenario["gatekeeper"]
    bound = gate["tries"] * (gate["longest_s"] + gate["period_s"])
    close("the bound", evidence["bound_s"], bound, within=SMALL)
    names = [row["attack"] for row in evidence["attacks"]]
    forged = ["favours to nobody", "favours to itself"]
    same("attacks", names, ["endless", "greedy", "random", "brief", "stuck", "favours", *forged])
    gone_along = [row["tries"] for row in evidence["attacks"] if row["attack"] in forged]
    same("favours that no UGV is asked for", gone_along, [0, 0])
    same(
        "answers that the tries left do not allow", [row["unexpected"] for row in evidence["attacks"]], [0] * len(names)
    )
    longest = [row["longest_between_rests_s"] for row in evidence["attacks"]]
    at_most("time that an attack takes between two rests", longest, bound, within=SMALL)
    tries = [row["longest_try_s"] for row in evidence["attacks"]]
    at_most("time that a try takes", tries, gate["longest_s"] + gate["period_s"], within=SMALL)
    reasons = {reason for row in evidence["attacks"] for reason in row["reasons"]}
    due = {"over", "exhausted", "no_progress"}
    same("reasons seen under attack", sorted(due & reasons), sorted(due))
    return Found.with_margin("proved", bound - max(longest), within=SMALL).having_judged(
        "evidence.bound_s", "evidence.attacks.*.attack", "evidence.attacks.*.unexpected"
    )


def _recorded_of_iso(claim: Json, scenario: Json) -> Found:
    """The running trigger missed nothing that was due in a step, and invented nothing."""
    compared = claim["evidence"]["conformance"]
    same("crossings missed or invented by the running trigger", [compared["missed"], compared["spurious"]], [0, 0])
    return Found("proved", facts={"conformance": {"missed": 0, "spurious": 0, "first": None}})


_RECORDED: dict[str, Any] = {
    "SAFE-INV": _recorded_of_inv,
    "SAFE-GATE": _recorded_of_gate,
    "SAFE-DIST": _recorded_of_dist,
    "ZENO-PROOF": _recorded_of_zeno,
    "LIVE-GATE": _recorded_of_live,
    "LIVE-WAIT": _recorded_of_wait,
    "THR-ISO": _recorded_of_iso,
}
