"""The induction of ZENO-PROOF: with symbols as obligations, with numbers in SMT-LIB; or a run that breaks it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any

from airground_drake.decision.trigger import Mode, Trigger
from airground_drake.verify.engines.obligation import Obligation, Term, rational
from airground_drake.verify.engines.prover import LIMIT_S
from airground_drake.verify.engines.rewriting import terms
from airground_drake.verify.engines.smt import solve
from airground_drake.verify.engines.symbolic_execution import Branch, Linear
from airground_drake.verify.model.trigger.relation import SYMBOLS, Transition, replay

_GUARDS = {
    "zeta": "threshold_positive",
    "-release + zeta": "release_below",
    "dwell": "dwell_not_negative",
    "x - zeta": "above_threshold",
    "-x + zeta": "below_threshold",
    "-x + release": "at_release",
    "n": "has_triggered",
    "s - a - dwell": "dwell_over",
    "-s + a + dwell": "dwell_not_over",
}
"""Names of hypotheses; a guard that is not here is called by its position."""
_WAITED = terms("spaced", "count waited")
"""k (s - l - dwell) = k (t - l - dwell) + k (s - t)."""
DEPTH = 6
"""Longest counterexample looked for, events after the start."""
_STATE = {"m": "Int", "n": "Int", "k": "Int", "a": "Real", "l": "Real", "r": "Real", "t": "Real"}
"""Sorts of the state in SMT-LIB: m is the mode, 0 SUPERVISING, 1 INTERVENING, 2 REFRACTORY."""
_EVENT = {"s": "Real", "x": "Real"}
_NAMES, _NOW = " ".join(_STATE), " ".join([*_STATE, *_EVENT])


def obligations(transitions: Sequence[Transition]) -> list[Obligation]:
    """That every transition keeps the invariant and the invariant implies the claim, for symbolic parameters."""
    found = []
    for each in transitions:
        supervised = each.source is Mode.SUPERVISING
        remembers = each.source in (Mode.INTERVENING, Mode.REFRACTORY)
        if remembers and any(str(form) == "-n" for form, _ in each.guards):
            continue  # n <= 0 against k >= 1 and n = k: never taken (Spacer is given it all the same)
        after = each.after
        if each.target is Mode.SUPERVISING:
            proof = _WAITED if supervised else terms("count dwell_over") if remembers else ()
            says = "in SUPERVISING the dwell since the last trigger, if any, is over"
            text = f"({after['k']})*(s - ({after['l']}) - dwell)"
            found.append(_obligation(each, "phase", says, text, proof, {"same_time": "k"} if remembers else {}))
        else:
            proof = terms("count" if each.triggers else "triggered") if each.source is not None else ()
            says = "outside SUPERVISING there has been a trigger"
            found.append(_obligation(each, "phase", says, f"{after['k']} - 1", proof, {}))
        differences = [after["n"] - after["k"]] + [after["a"] - after["l"]] * (each.target is not Mode.SUPERVISING)
        names = {"n - k": "same_count", "a - l": "same_time"}
        multipliers = {names[str(form)]: f"-({form})" for form in differences if str(form) in names}
        text = " ".join(f"- ({form})**2" for form in differences)
        found.append(_obligation(each, "memory", "the automaton remembers what was observed", text, (), multipliers))
        if each.triggers and each.source is not None:
            proof = _WAITED if supervised else terms("dwell_over")
            multipliers = {} if supervised else {"same_time": "1"}
            says = "a trigger comes no earlier than the dwell after the last one"
            found.append(_obligation(each, "claim", says, "s - l - dwell", proof, multipliers))
    return found


def _obligation(
    each: Transition, goal: str, says: str, text: str, proof: tuple[Term, ...], multipliers: dict[str, str]
) -> Obligation:
    """A goal after a transition from the invariant, its guards and time not running backwards."""
    hypotheses = {"waited": "s - t", "count": "k"}
    strict = dict[str, str]()
    equations = dict[str, str]()
    if each.source is not None:
        equations["same_count"] = "n - k"
    if each.source is Mode.SUPERVISING:
        hypotheses["spaced"] = "k*(t - l - dwell)"
    elif each.source is not None:
        hypotheses["triggered"] = "k - 1"
        equations["same_time"] = "a - l"
    for i, (form, is_strict) in enumerate(each.guards):
        (strict if is_strict else hypotheses)[_GUARDS.get(str(form), f"guard_{i}")] = str(form)
    positive: tuple[Term, ...] = ()
    if goal == "claim":
        strict["triggered_before"] = "k"
        positive = terms("triggered_before") if proof == _WAITED else ()
    known = {*hypotheses, *strict}
    proven = all(set(term.factors) <= known for term in proof) and set(multipliers) <= set(equations)
    return Obligation(
        f"{each.name}_{goal}", f"{each.name.replace('_', ' ')}: {says}", SYMBOLS, text, hypotheses, strict, equations,
        certificate=proof if proven else (), multiplier=positive if proven else (),
        equation_multipliers=multipliers if proven else {},
    )  # fmt: skip


def remarks(trigger: Trigger, bound: float) -> list[Obligation]:
    """That the dwell is the bound claimed, what rounding costs, and what a rate bound of x would add."""
    spare = Fraction(rational(trigger.dwell)) - Fraction(rational(bound))
    return [
        Obligation(
            "dwell_is_the_bound",
            "the dwell of the running trigger is at least the minimum inter-event time of the scenario",
            ("dwell", "bound"), "dwell - bound",
            equations={"dwell": f"dwell - {rational(trigger.dwell)}", "bound": f"bound - {rational(bound)}"},
            certificate=(Term(str(spare)),) if spare > 0 else (),
            equation_multipliers={"dwell": "1", "bound": "-1"},
        ),
        Obligation(
            "rounded_dwell",
            "if the end of the dwell is computed with an error of at most e, two triggers are dwell - e apart or more",
            ("s", "l", "end", "dwell", "e"), "s - l - dwell + e",
            hypotheses={"rounded": "end - l - dwell + e", "dwell_over": "s - end"},
            certificate=terms("rounded", "dwell_over"),
        ),
        Obligation(
            "rate_bound",
            "if |dx/dt| <= R, two triggers (release at f between them) are also 2 (zeta - release) / R apart or more",
            ("s", "f", "l", "x_l", "x_f", "x_s", "zeta", "release", "R"), "R*(s - l) - 2*(zeta - release)",
            hypotheses={
                "trigger": "x_l - zeta", "at_release": "release - x_f", "next_trigger": "x_s - zeta",
                "falls_no_faster": "R*(f - l) - (x_l - x_f)", "rises_no_faster": "R*(s - f) - (x_s - x_f)",
            },
            certificate=terms("trigger", "next_trigger", "falls_no_faster", "rises_no_faster", "2 at_release"),
        ),
    ]  # fmt: skip


def _declared(sorts: dict[str, str], mark: str = "") -> str:
    return " ".join(f"({name}{mark} {sort})" for name, sort in sorts.items())


def _taken(each: Transition) -> str:
    """That a transition is possible, as SMT-LIB terms."""
    parts = [] if each.source is None else [f"(= m {int(each.source)})", "(>= s t)"]
    for form, strict in each.guards:
        sort = "Int" if set(form.parts) <= {"n", "k", ""} else "Real"
        parts.append(f"({'>' if strict else '>='} {form.smt(sort)} {'0' if sort == 'Int' else '0.0'})")
    return " ".join(parts) or "true"


def _after(each: Transition) -> list[str]:
    """The state after a transition, in the order of _STATE, as SMT-LIB terms."""
    return [str(int(each.target)), *(each.after[name].smt(_STATE[name]) for name in list(_STATE)[1:])]


def _number(value: float) -> str:
    return (Linear(Branch(), {}) + value).smt()


def _definitions(transitions: Sequence[Transition], trigger: Trigger, bound: float) -> list[str]:
    """Start and Step (state, s, x, next state), Early (a trigger now comes too early) and Inv, in SMT-LIB."""
    cases: dict[bool, list[str]] = {True: ["false"], False: ["false"]}
    for each in transitions:
        moved = [f"(= {name}2 {term})" for name, term in zip(_STATE, _after(each), strict=True)]
        cases[each.source is None].append(f"(and {_taken(each)} {' '.join(moved)})")
    early = [f"(and {_taken(each)})" for each in transitions if each.triggers and each.source is not None]
    number, dwell = _number(bound), _number(trigger.dwell)
    break_line = "\n  "
    return [
        f"(define-fun Start ({_declared(_EVENT)} {_declared(_STATE, '2')}) Bool (or {break_line.join(cases[True])}))",
        f"(define-fun Step ({_declared({**_STATE, **_EVENT})} {_declared(_STATE, '2')}) Bool",
        f"  (or {break_line.join(cases[False])}))",
        f"(define-fun Early ({_declared({**_STATE, **_EVENT})}) Bool",
        f"  (and (>= k 1) (< (- s l) {number}) (or {break_line.join(['false', *early])})))",
        f"(define-fun Inv ({_declared(_STATE)}) Bool (and (<= 0 m) (<= m 2) (= n k) (>= k 0)",
        f"  (=> (= m 0) (or (= k 0) (>= t (+ l {dwell})))) (=> (not (= m 0)) (and (>= k 1) (= a l)))))",
    ]


def horn(transitions: Sequence[Transition], trigger: Trigger, bound: float) -> str:
    """Constrained Horn clauses: satisfiable exactly if an invariant P excludes triggers closer than the bound, s."""
    event = _declared(_EVENT)
    state = _declared(_STATE)
    later = _declared(_STATE, "2")
    after = " ".join(f"{name}2" for name in _STATE)
    lines = [
        "(set-logic HORN)",
        *_definitions(transitions, trigger, bound),
        f"(declare-fun P ({' '.join(_STATE.values())}) Bool)",
        f"(assert (forall ({event} {later}) (=> (Start s x {after}) (P {after}))))",
        f"(assert (forall ({state} {event} {later}) (=> (and (P {_NAMES}) (Step {_NOW} {after})) (P {after}))))",
        f"(assert (forall ({state} {event}) (=> (and (P {_NAMES}) (Early {_NOW})) false)))",
        "(check-sat)",
    ]
    return "\n".join(lines) + "\n"


def invariant(transitions: Sequence[Transition], trigger: Trigger, bound: float) -> dict[str, str]:
    """The three obligations of the invariant, negated: SMT-LIB 2 by file name, each to be unsatisfiable."""
    head = ["(set-logic QF_LIRA)", *_definitions(transitions, trigger, bound)]
    head += [f"(declare-const {name}{mark} {sort})" for mark in ("", "2") for name, sort in _STATE.items()]
    head += [f"(declare-const {name} {sort})" for name, sort in _EVENT.items()]
    later = " ".join(f"{name}2" for name in _STATE)
    goals = {
        "initiation": f"(Start s x {later}) (not (Inv {later}))",
        "consecution": f"(Inv {_NAMES}) (Step {_NOW} {later}) (not (Inv {later}))",
        "safety": f"(Inv {_NAMES}) (Early {_NOW})",
    }
    return {
        f"inv_{name}.smt2": "\n".join([*head, f"(assert (and {goal}))", "(check-sat)"]) + "\n"
        for name, goal in goals.items()
    }


def bounded(transitions: Sequence[Transition], trigger: Trigger, bound: float, depth: int) -> str:
    """A run whose event number `depth` is a trigger closer than the bound, s, to the last one, in SMT-LIB 2.

    Times and values of x are multiples of a power of 1/2, so that floats hold them exactly; time increases strictly
    from 0 and x is never at a level.
    """
    grid = f"{2 ** max(0, math.ceil(math.log2(16.0 / bound)))}.0"
    lines = ["(set-logic QF_LIRA)", *_definitions(transitions, trigger, bound)]
    for i in range(depth + 1):
        lines += [f"(declare-const {name}_{i} {sort})" for name, sort in {**_STATE, **_EVENT}.items()]
        for real, whole in (("s", "ticks"), ("x", "height")):
            lines.append(f"(declare-const {whole}_{i} Int)")
            lines.append(f"(assert (= {real}_{i} (/ (to_real {whole}_{i}) {grid})))")
        lines += [f"(assert (not (= x_{i} {level})))" for level in (_number(trigger.zeta), _number(trigger.release))]
        lines.append("(assert (= s_0 0.0))" if i == 0 else f"(assert (> s_{i} s_{i - 1}))")
        before, now = (" ".join(f"{name}_{j}" for name in _STATE) for j in (i - 1, i))
        event = f"s_{i} x_{i}"
        step_to = f"(Start {event} {now})" if i == 0 else f"(Step {before} {event} {now})"
        lines.append(f"(assert {step_to if i < depth else f'(Early {before} {event})'})")
    return "\n".join([*lines, "(check-sat)"]) + "\n"


def counterexample(transitions: Sequence[Transition], trigger: Trigger, bound: float) -> dict[str, Any] | None:
    """The shortest run with two triggers closer than the bound, s, replayed on the running trigger; None if none."""
    for target in (bound / 2.0, bound):  # at half the bound rounding plays no part, if there is such a run
        scripts = [bounded(transitions, trigger, target, depth) for depth in range(1, DEPTH + 1)]
        for depth, result in enumerate(solve(scripts, "z3", LIMIT_S), 1):
            if result.answer == "sat":
                model = {name: float(Fraction(value)) for name, value in result.model.items() if name[0] in "sx"}
                run = replay(trigger, [(model[f"s_{i}"], model[f"x_{i}"]) for i in range(depth + 1)])
                times = [row["t_s"] for row in run if row["trigger"]]
                gap = min((after - before for before, after in pairwise(times)), default=math.inf)
                return {"run": run, "gap_s": gap, "bound_s": bound, "replayed": True} if gap < bound else None
    return None
