"""SAFE-LEMMA, SAFE-INV, SAFE-GATE, SAFE-DIST, ZENO-PROOF, LIVE-GATE, LIVE-WAIT and THR-ISO, every certificate exactly.

An obligation says: wherever all hypotheses are >= 0, the strict ones > 0 and all equations 0, the goal is >= 0. Its
certificate is an identity of polynomials with rational coefficients,

    multiplier * goal = sum_j c_j * (product of hypotheses) * square_j^2 + sum_i q_i * equation_i,

with c_j >= 0 and a multiplier that is such a sum itself, one term of which is a positive number times strict
hypotheses only (or no multiplier: 1). Whoever expands both sides has done the proof again.

An identity may prove something else than the claim. What a claim consists of is therefore listed here, in
`obligations.json`: by claim and name of the obligation

    {"goal": polynomial, "nonnegative": [...], "positive": [...], "zero": [...]},

the goal to be shown and the premises that may be used, no others: hypotheses, strict ones and equations. There are no
other obligations: whatever is named as proved is what the claim is said to consist of. Names in capitals (DWELL, BOUND,
GAIN, PERIOD) are numbers of the scenario. That these obligations together make the claim is the argument in the claim's
own text. Some are there again with the scenario's numbers, `inside_obstacle` for `inside` between robots and obstacles
and so on: then the numbers are put into goal and premises, and a premise that has become a number must be a true one.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import cache, lru_cache, partial
from pathlib import Path

from .conformance import RECORDED, SHORTEST_S, TRIGGER_CONFORMS, rounding_of_the_dwell
from .files import Files, Json, content_of, parse_json, read_json
from .polynomials import Polynomial, number, parse, rational
from .rules import Disagreement, Found, NotEstablished, holds, same
from .scenario import Kind, disturbance_m_s, kinds_of, levels_of
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


def prove(claim: Json, files: Files, scenario: Json) -> Found:
    """A proof: its certificates prove their goals, the goals are the claim's, and the record of it is consistent."""
    if claim["status"] == "refuted":
        if claim["id"] == "ZENO-PROOF":
            bound = scenario["decision"]["min_inter_event_s"] or SHORTEST_S
            found = refuted_zeno_proof(claim, levels_of(scenario), bound).also(conformance=TRIGGER_CONFORMS)
            return found.judging(partial(rounding_of_the_dwell, claim["evidence"], scenario), "evidence.rounding_s")
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
        found = RECORDED[claim["id"]](claim, scenario)
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
    """The obligations of the claim are there, and no others, with their goals and no premise besides."""
    wanted = _wanted(claim, scenario)
    for name in obligations:
        holds("the obligation is one of the claim's", name in wanted, name, str([*wanted]), about=name)
    for name, (form, numbers) in wanted.items():
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
