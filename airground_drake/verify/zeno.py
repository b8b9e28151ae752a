"""ZENO-PROOF: two triggers are never closer than the minimum inter-event time, whatever the decision variable does.

The transition relation is not written down a second time: `relation` runs the methods of the running `Trigger` on
symbols, once for every way in which their comparisons can come out. An observer that sees nothing but entries into
INTERVENING is added to it: k triggers so far, the last of them at l; what the automaton itself remembers, n triggers
and the last at a, is not trusted. t is the time of the last event or wait, s >= t now, x any number. The invariant:

    n = k; SUPERVISING: k = 0 or t >= l + dwell; INTERVENING and REFRACTORY: k >= 1 and a = l

Certificates: `relation.json` (transitions with the scenario's numbers: guards `form` >= 0 or > 0, values after it;
source 'START' has no state before), `obligations.json` (for all zeta > 0, release <= zeta, dwell >= 0: of every
transition that it keeps n = k and a = l, `*_memory`, and the rest of the invariant, `*_phase`, and at every trigger
that s - l >= dwell, `*_claim`; "k = 0 or" is a factor k there, k >= 0 because it counts), `zeno_horn.smt2`
(the numbers again, for Spacer: satisfiable if some invariant P exists), `inv_initiation.smt2`, `inv_consecution.smt2`
and `inv_safety.smt2` (the invariant above, for any solver: each must be unsatisfiable).
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from airground_drake.decision.trigger import Mode, Trigger, TriggerState
from airground_drake.diagram import make_trigger, threshold
from airground_drake.scenarios.schema import Scenario
from airground_drake.smt import solve
from airground_drake.systems.decision import FIELDS, EventTrigger
from airground_drake.verify.obligation import Obligation, Term, rational
from airground_drake.verify.prover import discharge, finding
from airground_drake.verify.verdict import TIME_TOLERANCE_S, Finding, ModelClaim, Status

SHORTEST_S = 1e-3
"""Bound that is tried where the scenario has none (0 s), s: any number would do, the counterexample scales with it."""
DEPTH = 6
"""Longest counterexample looked for, events after the start."""
LIMIT_S = 20.0
UNIT_ROUNDOFF = Fraction(1, 2**53)
SYMBOLS = ("n", "k", "s", "t", "a", "l", "r", "x", "zeta", "release", "dwell")
"""Of the relation, in the order of print: r is the automaton's time of the last release; the others as above."""
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


class Linear:
    """A linear form in symbols, exact; `path` decides how a comparison of two forms comes out."""

    def __init__(self, path: Path, parts: dict[str, Fraction]) -> None:
        """`parts`: coefficient by symbol, the constant under ''."""
        self.path, self.parts = path, {name: value for name, value in parts.items() if value}

    def __add__(self, other: Linear | float) -> Linear:
        theirs = other.parts if isinstance(other, Linear) else {"": Fraction(rational(other))}
        names = {*self.parts, *theirs}
        return Linear(self.path, {name: self.parts.get(name, Fraction()) + theirs.get(name, 0) for name in names})

    def __neg__(self) -> Linear:
        return Linear(self.path, {name: -value for name, value in self.parts.items()})

    def __sub__(self, other: Linear | float) -> Linear:
        return self + -other

    def __ge__(self, other: Linear | float) -> bool:
        return self.path.decide(self - other)

    def __le__(self, other: Linear | float) -> bool:
        return self.path.decide(-self + other)

    def __gt__(self, other: Linear | float) -> bool:
        return not self <= other

    def __lt__(self, other: Linear | float) -> bool:
        return not self >= other

    def __bool__(self) -> bool:
        return self > 0  # of a count

    def __str__(self) -> str:
        text = ""
        for name in (*SYMBOLS, ""):
            if value := self.parts.get(name):
                size = name if name and abs(value) == 1 else "*".join(filter(None, (str(abs(value)), name)))
                text += f" {'-' if value < 0 else '+'} {size}" if text else f"{'-' if value < 0 else ''}{size}"
        return text or "0"

    def smt(self, sort: str = "Real") -> str:
        """As an SMT-LIB term; n and k are integers, all other symbols real."""

        def number(value: Fraction) -> str:
            size = str(abs(value)) if sort == "Int" else f"(/ {abs(value.numerator)}.0 {value.denominator}.0)"
            return size if value >= 0 else f"(- {size})"

        terms = [
            number(value) if not name else name if value == 1 else f"(* {number(value)} {name})"
            for name, value in self.parts.items()
        ]
        return terms[0] if len(terms) == 1 else f"(+ {' '.join(terms)})" if terms else number(Fraction())

    def at(self, point: dict[str, Fraction]) -> Fraction:
        """Value at a point, exact."""
        return sum((value * (point[name] if name else 1) for name, value in self.parts.items()), Fraction())


class Path:
    """One way through a function of symbols: the outcomes of its comparisons, `guards` that make them so."""

    def __init__(self, outcomes: Sequence[bool]) -> None:
        """Comparisons beyond `outcomes` come out true."""
        self.outcomes, self.guards = list(outcomes), list[tuple[Linear, bool]]()

    def decide(self, form: Linear) -> bool:
        """Whether form >= 0 on this path; its guard is (form, strict?)."""
        if not set(form.parts) - {""}:
            return form.at({}) >= 0
        place = len(self.guards)
        if place == len(self.outcomes):
            self.outcomes.append(True)
        outcome = self.outcomes[place]
        self.guards.append((form, False) if outcome else (-form, True))
        return outcome

    def symbol(self, name: str) -> Any:
        """A symbol, to be passed where a float is expected."""
        return Linear(self, {name: Fraction(1)})


def _paths(function: Callable[[Path], TriggerState]) -> list[tuple[Path, TriggerState]]:
    """All ways through a function; those that end in a ValueError (refused parameters) lead nowhere."""
    found: list[tuple[Path, TriggerState]] = []
    todo: list[list[bool]] = [[]]
    while todo:
        given = todo.pop()
        path = Path(given)
        with suppress(ValueError):
            found.append((path, function(path)))
        todo += [[*path.outcomes[:i], False] for i in range(len(given), len(path.outcomes))]
    return found


@dataclass(frozen=True)
class Transition:
    """One transition; forms are in the state before it, the time s and the decision variable x."""

    name: str
    source: Mode | None
    target: Mode
    guards: tuple[tuple[Linear, bool], ...]
    after: dict[str, Linear]

    @property
    def triggers(self) -> bool:
        """Whether an observer sees a trigger."""
        return self.target is Mode.INTERVENING and self.source is not Mode.INTERVENING

    def to_json(self) -> dict[str, Any]:
        """Names of modes, forms as text."""
        return {
            "name": self.name,
            "source": self.source.name if self.source is not None else "START",
            "target": self.target.name,
            "guards": [{"form": str(form), "relation": ">" if strict else ">="} for form, strict in self.guards],
            "after": {name: str(form) for name, form in self.after.items()},
        }


def step(trigger: Trigger, state: TriggerState, t: float, x: float) -> TriggerState:
    """What `EventTrigger` does with a UGV at an event: its guard for the mode, then the trigger's transition."""
    if state.mode is Mode.SUPERVISING and x >= trigger.zeta:
        return trigger.rise(state, t)
    if state.mode is Mode.INTERVENING and x <= trigger.release:
        return trigger.fall(state, t)
    if state.mode is Mode.REFRACTORY and t >= trigger.dwell_end(state):
        return trigger.recover(state, t, x)
    return state


def relation(make: Callable[[Path], Trigger]) -> list[Transition]:
    """All transitions of a trigger, the start and waiting included.

    Args:
        make: the trigger, whose parameters may be symbols of the path.
    """
    found: list[Transition] = []

    def add(name: str, source: Mode | None, path: Path, after: TriggerState) -> None:
        def form(value: Any) -> Linear:
            return value if isinstance(value, Linear) else Linear(path, {}) + value

        name += "_untriggered" * any(str(guard) == "-n" for guard, _ in path.guards)
        known = sum(each.name.rstrip("_0123456789") == name for each in found)
        forms = {"n": form(after.triggers), "a": form(after.triggered_at), "r": form(after.released_at)}
        new = Transition(name + f"_{known}" * (known > 0), source, after.mode, tuple(path.guards), forms)
        count, last = (path.symbol("k"), path.symbol("l")) if source is not None else (form(0), form(-1.0))
        if new.triggers:
            count, last = count + 1, path.symbol("s")
        new.after.update(k=count, l=last, t=path.symbol("s"))
        found.append(new)

    for path, after in _paths(lambda path: make(path).start(path.symbol("s"), path.symbol("x"))):
        add(f"start_{after.mode.name.lower()}", None, path, after)
    for mode in Mode:

        def event(path: Path, mode: Mode = mode) -> TriggerState:
            trigger = make(path)
            before = TriggerState(mode, *map(path.symbol, "nar"))
            return step(trigger, before, path.symbol("s"), path.symbol("x"))

        def wait(path: Path, mode: Mode = mode) -> TriggerState:
            make(path)
            return TriggerState(mode, *map(path.symbol, "nar"))

        for path, after in _paths(event):
            if after.mode is not mode:
                add(f"{mode.name.lower()}_{after.mode.name.lower()}", mode, path, after)
        for path, after in _paths(wait):
            add(f"{mode.name.lower()}_waits", mode, path, after)
    return found


_WAITED = (Term(factors=("spaced",)), Term(factors=("count", "waited")))
"""k (s - l - dwell) = k (t - l - dwell) + k (s - t)."""


def obligations(transitions: Sequence[Transition]) -> list[Obligation]:
    """That every transition keeps the invariant and the invariant implies the claim, for symbolic parameters."""
    found = []
    for each in transitions:
        supervised, remembers = each.source is Mode.SUPERVISING, each.source in (Mode.INTERVENING, Mode.REFRACTORY)
        if remembers and any(str(form) == "-n" for form, _ in each.guards):
            continue  # n <= 0 against k >= 1 and n = k: never taken (Spacer is given it all the same)
        after = each.after
        if each.target is Mode.SUPERVISING:
            terms = _WAITED if supervised else (Term(factors=("count", "dwell_over")),) if remembers else ()
            says = "in SUPERVISING the dwell since the last trigger, if any, is over"
            text = f"({after['k']})*(s - ({after['l']}) - dwell)"
            found.append(_obligation(each, "phase", says, text, terms, {"same_time": "k"} if remembers else {}))
        else:
            terms = (Term(factors=("count" if each.triggers else "triggered",)),) if each.source is not None else ()
            says = "outside SUPERVISING there has been a trigger"
            found.append(_obligation(each, "phase", says, f"{after['k']} - 1", terms, {}))
        differences = [after["n"] - after["k"]] + [after["a"] - after["l"]] * (each.target is not Mode.SUPERVISING)
        names = {"n - k": "same_count", "a - l": "same_time"}
        multipliers = {names[str(form)]: f"-({form})" for form in differences if str(form) in names}
        text = " ".join(f"- ({form})**2" for form in differences)
        found.append(_obligation(each, "memory", "the automaton remembers what was observed", text, (), multipliers))
        if each.triggers and each.source is not None:
            terms = _WAITED if supervised else (Term(factors=("dwell_over",)),)
            multipliers = {} if supervised else {"same_time": "1"}
            says = "a trigger comes no earlier than the dwell after the last one"
            found.append(_obligation(each, "claim", says, "s - l - dwell", terms, multipliers))
    return found


def _obligation(
    each: Transition, goal: str, says: str, text: str, terms: tuple[Term, ...], multipliers: dict[str, str]
) -> Obligation:
    """A goal after a transition from the invariant, its guards and time not running backwards."""
    hypotheses, strict, equations = {"waited": "s - t", "count": "k"}, dict[str, str](), dict[str, str]()
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
        positive = (Term(factors=("triggered_before",)),) if terms == _WAITED else ()
    known = {*hypotheses, *strict}
    proven = all(set(term.factors) <= known for term in terms) and set(multipliers) <= set(equations)
    return Obligation(
        f"{each.name}_{goal}",
        f"{each.name.replace('_', ' ')}: {says}",
        SYMBOLS,
        text,
        hypotheses,
        strict,
        equations,
        certificate=terms if proven else (),
        multiplier=positive if proven else (),
        equation_multipliers=multipliers if proven else {},
    )


def remarks(trigger: Trigger, bound: float) -> list[Obligation]:
    """That the dwell is the bound claimed, what rounding costs, and what a rate bound of x would add."""
    return [
        Obligation(
            "dwell_is_the_bound",
            "the dwell of the running trigger is at least the minimum inter-event time of the scenario",
            ("dwell", "bound"),
            "dwell - bound",
            equations={"dwell": f"dwell - {rational(trigger.dwell)}", "bound": f"bound - {rational(bound)}"},
            certificate=(Term(str(max(Fraction(), Fraction(rational(trigger.dwell)) - Fraction(rational(bound))))),),
            equation_multipliers={"dwell": "1", "bound": "-1"},
        ),
        Obligation(
            "rounded_dwell",
            "if the end of the dwell is computed with an error of at most e, two triggers are dwell - e apart or more",
            ("s", "l", "end", "dwell", "e"),
            "s - l - dwell + e",
            hypotheses={"rounded": "end - l - dwell + e", "dwell_over": "s - end"},
            certificate=(Term(factors=("rounded",)), Term(factors=("dwell_over",))),
        ),
        Obligation(
            "rate_bound",
            "if |dx/dt| <= R, two triggers (release at f between them) are also 2 (zeta - release) / R apart or more",
            ("s", "f", "l", "x_l", "x_f", "x_s", "zeta", "release", "R"),
            "R*(s - l) - 2*(zeta - release)",
            hypotheses={
                "trigger": "x_l - zeta",
                "at_release": "release - x_f",
                "next_trigger": "x_s - zeta",
                "falls_no_faster": "R*(f - l) - (x_l - x_f)",
                "rises_no_faster": "R*(s - f) - (x_s - x_f)",
            },
            certificate=(
                *(Term(factors=(name,)) for name in ("trigger", "next_trigger", "falls_no_faster", "rises_no_faster")),
                Term("2", ("at_release",)),
            ),
        ),
    ]


_STATE = {"m": "Int", "n": "Int", "k": "Int", "a": "Real", "l": "Real", "r": "Real", "t": "Real"}
"""Sorts of the state in SMT-LIB: m is the mode, 0 SUPERVISING, 1 INTERVENING, 2 REFRACTORY."""
_EVENT = {"s": "Real", "x": "Real"}
_NAMES, _NOW = " ".join(_STATE), " ".join([*_STATE, *_EVENT])


def _declared(sorts: dict[str, str], mark: str = "") -> str:
    return " ".join(f"({name}{mark} {sort})" for name, sort in sorts.items())


def _taken(each: Transition) -> str:
    """That a transition is possible, as SMT-LIB terms."""
    terms = [] if each.source is None else [f"(= m {int(each.source)})", "(>= s t)"]
    for form, strict in each.guards:
        sort = "Int" if set(form.parts) <= {"n", "k", ""} else "Real"
        terms.append(f"({'>' if strict else '>='} {form.smt(sort)} {'0' if sort == 'Int' else '0.0'})")
    return " ".join(terms) or "true"


def _after(each: Transition) -> list[str]:
    """The state after a transition, in the order of _STATE, as SMT-LIB terms."""
    return [str(int(each.target)), *(each.after[name].smt(_STATE[name]) for name in list(_STATE)[1:])]


def _number(value: float) -> str:
    return (Linear(Path([]), {}) + value).smt()


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
    event, state, later = _declared(_EVENT), _declared(_STATE), _declared(_STATE, "2")
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


def replay(trigger: Trigger, events: Sequence[tuple[float, float]]) -> list[dict[str, Any]]:
    """Run the running trigger through events (t in s, x in m): the state after each."""
    state, rows = TriggerState(), list[dict[str, Any]]()
    for i, (t, x) in enumerate(events):
        before, state = state.mode, trigger.start(t, x) if i == 0 else step(trigger, state, t, x)
        fired = state.mode is Mode.INTERVENING and before is not Mode.INTERVENING
        rows.append({"t_s": t, "x_m": x, "mode": state.mode.name, "trigger": fired})
    return rows


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


def rounding(trigger: Trigger, duration: float) -> float:
    """Largest error of the running automaton's end of dwell in a run, s.

    triggered_at + dwell is rounded once, by at most the unit roundoff times itself, and the float that stands for
    the dwell is not quite the decimal number meant.
    """
    meant, kept = Fraction(rational(trigger.dwell)), Fraction(trigger.dwell)
    return math.nextafter(float(UNIT_ROUNDOFF * (Fraction(duration) + kept) + abs(meant - kept)), math.inf)


def conformance(trigger: Trigger, transitions: Sequence[Transition], duration: float) -> dict[str, Any]:
    """The relation against the running `EventTrigger` on random states, most of them next to a guard's border.

    All UGVs of an EventTrigger share the time, so that one update decides many states. The relation is evaluated
    exactly at the floats' values (x and the levels as the decimals that they print as). A disagreement is excused
    only if the time is within `rounding` of the end of the dwell.
    """
    count, rng = 320, np.random.default_rng(1)
    system = EventTrigger(count, trigger)
    context = system.CreateDefaultContext()
    rows = wrong = excused = 0
    first: dict[str, Any] | None = None
    moved = dict[str, int]()
    for now in rng.uniform(0.0, duration, 8):
        context.SetTime(now)
        near = now - trigger.dwell + np.spacing(now) * rng.integers(-3, 4, count)
        triggered_at = np.where(rng.random(count) < 0.5, near, rng.uniform(0.0, now, count))
        levels = np.array([trigger.zeta, trigger.release])[rng.integers(0, 2, count)]
        x = np.select(
            [rng.random(count) < 0.3, rng.random(count) < 0.5],
            [levels, levels + np.spacing(levels) * rng.integers(-2, 3, count)],
            rng.uniform(trigger.release - 1.0, trigger.zeta + 1.0, count),
        )
        modes, triggers = rng.integers(0, 3, count), rng.integers(0, 4, count)
        released_at = rng.uniform(-1.0, now, count)
        before = np.column_stack([modes, triggers, np.where(triggers > 0, triggered_at, -1.0), released_at])
        after = np.empty_like(before)
        system.GetInputPort("decision_variable").FixValue(context, x)
        for mode in Mode:
            context.SetDiscreteState(before.ravel())
            system._leave(mode, context, context.get_mutable_state())
            chosen = modes == mode
            after[chosen] = context.get_discrete_state_vector().value().reshape(count, FIELDS)[chosen]
        for was, became, value in zip(before, after, x, strict=True):
            names = ("n", "a", "r", "s", "x")
            point = dict(zip(names, map(Fraction, (*was[1:], now)), strict=False)) | {"x": Fraction(rational(value))}
            predicted, taken = _predict(transitions, Mode(int(was[0])), point)
            rows += 1
            moved[taken] = moved.get(taken, 0) + 1
            if predicted != [Fraction(v) for v in became] and predicted:
                off = abs(point["s"] - point["a"] - Fraction(rational(trigger.dwell)))
                if point["n"] > 0 and off <= Fraction(rounding(trigger, duration)):
                    excused += 1
                    continue
                wrong += 1
                states = {"before": was.tolist(), "after": became.tolist()}
                first = first or {"t_s": float(now), "x_m": float(value), **states}
    return {"states": rows, "disagreements": wrong, "within_rounding": excused, "first": first, "transitions": moved}


def _predict(transitions: Sequence[Transition], mode: Mode, point: dict[str, Fraction]) -> tuple[list[Fraction], str]:
    """Mode, n, a and r after the one transition that is possible at a point, and its name; waiting if none is."""
    possible = [
        each
        for each in transitions
        if each.source is mode
        and not each.name.endswith("waits")
        and all(form.at(point) > 0 if strict else form.at(point) >= 0 for form, strict in each.guards)
    ]
    if not possible:
        return [Fraction(int(mode)), point["n"], point["a"], point["r"]], "waits"
    if len(possible) > 1:
        return [], "ambiguous"
    return [Fraction(int(possible[0].target)), *(possible[0].after[name].at(point) for name in "nar")], possible[0].name


class ZenoProof(ModelClaim):
    """ZENO-PROOF."""

    id = "ZENO-PROOF"
    statement = (
        "Two triggers of a UGV are never closer than the minimum inter-event time, whatever the decision variable "
        "does, so that no run is Zeno."
    )
    formula = (
        "for every x: [0, inf) -> R, consecutive triggers satisfy t_(k+1) - t_k >= min_inter_event_s - e, where e, "
        "about 1e-15 s, is the rounding error of triggered_at + dwell"
    )
    method = (
        "The transition relation is read off the running `Trigger` by running its methods on symbols. Its invariant "
        "is proved for symbolic parameters, transition by transition, by polynomial implications with exact "
        "certificates, z3 and cvc5 besides; with the scenario's numbers Spacer finds an invariant of its own "
        "(constrained Horn clauses), and z3 and cvc5 check ours. The relation is compared with the running "
        "`EventTrigger` on random states. The margin is what rounding leaves of ZENO-TRACE's tolerance, 1e-9 s. A "
        "refuted claim comes with a run of the automaton, replayed on the running code."
    )
    equations = "(20)"
    assumptions = (
        "Time never runs backwards, and the trigger's methods are called only under the guards of `EventTrigger`.",
        "x is any number at any time: no bound on the noise or its rate is used.",
        "Triggers are the times at which the automaton enters INTERVENING. The simulator's event isolation, 1e-6 s, "
        "delays them against the crossings of x; it brings no two of them closer than the dwell, because guards and "
        "triggered_at use the time of the event itself.",
    )
    does_not_establish = (
        "That a trigger comes when it should (THR-TRIG), or that the bare threshold is Zeno (ZENO-REFINE shows how its "
        "events multiply; here it is refuted by a run with two triggers closer than the bound). With a rate bound "
        "|dx/dt| <= R (not Wiener noise) 2 (zeta - release)/R would bound the inter-event time as well: `rate_bound`."
    )

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """The running trigger's levels, m, and dwell, s; the bound claimed, s; the time within which to be exact, s."""
        trigger = make_trigger(scenario, threshold(scenario))
        return {
            "zeta_m": float(trigger.zeta),
            "release_m": float(trigger.release),
            "dwell_s": float(trigger.dwell),
            "min_inter_event_s": float(scenario.decision.min_inter_event_s),
            "duration_s": float(scenario.duration_s),
        }

    def check(self, inputs: dict[str, Any]) -> Finding:
        """Prove it for these constants, or find a run that breaks it."""
        return prove(Trigger(inputs["zeta_m"], inputs["release_m"], inputs["dwell_s"]), inputs)


def prove(trigger: Trigger, inputs: dict[str, Any]) -> Finding:
    """The finding for a trigger, the scenario's or a mutant of it."""
    bound, duration = inputs["min_inter_event_s"] or SHORTEST_S, inputs["duration_s"]
    numeric = relation(lambda _: trigger)
    files = {"zeno_horn.smt2": horn(numeric, trigger, bound), **invariant(numeric, trigger, bound)}
    described = json.dumps({"bound_s": rational(bound), "transitions": [each.to_json() for each in numeric]}, indent=1)
    spacer, *z3 = solve(list(files.values()), "z3", LIMIT_S)
    evidence: dict[str, Any] = {
        "bound_s": bound,
        "spacer": {"sat": "an invariant exists", "unsat": "violated"}.get(spacer.answer, spacer.answer),
        "conformance": conformance(trigger, numeric, duration),
        "rounding_s": rounding(trigger, duration),
    }
    saved = {"relation.json": described + "\n", **files}
    if spacer.answer == "unsat":
        broken = counterexample(numeric, trigger, bound)
        status: Status = "refuted" if broken else "error"
        margin = broken["gap_s"] - bound if broken else None
        return Finding(status, margin, "s", {}, broken, evidence, saved)
    cvc5 = solve(list(files.values())[1:], "cvc5", LIMIT_S)
    general = relation(lambda path: type(trigger)(*map(path.symbol, ("zeta", "release", "dwell"))))
    found = finding(discharge([*obligations(general), *remarks(trigger, bound)]))
    ours = {name: [a.answer, b.answer] for name, a, b in zip(list(files)[1:], z3, cvc5, strict=True)}
    status = found.status
    if any("sat" in answers for answers in ours.values()) or evidence["conformance"]["disagreements"]:
        status = "error"  # the invariant or the relation is not the running code's
    elif status == "proved" and (spacer.answer != "sat" or any(pair != ["unsat", "unsat"] for pair in ours.values())):
        status = "inconclusive"
    return replace(
        found,
        status=status,
        margin=TIME_TOLERANCE_S - evidence["rounding_s"],
        unit="s",
        where={"bound_s": bound},
        evidence={**evidence, "invariant": ours, **found.evidence},
        certificates={**saved, **found.certificates},
    )


class _NoDwell(Trigger):
    """The dwell is over at once."""

    def dwell_end(self, state: TriggerState) -> float:
        return state.triggered_at


class _NoRefractory(Trigger):
    """A release always leads back to SUPERVISING."""

    def fall(self, state: TriggerState, t: float) -> TriggerState:
        return replace(super().fall(state, t), mode=Mode.SUPERVISING)


class _RecoversAtOnce(Trigger):
    """REFRACTORY is over as soon as it begins."""

    def dwell_end(self, state: TriggerState) -> float:
        return state.released_at if state.mode is Mode.REFRACTORY else super().dwell_end(state)


class _Forgets(Trigger):
    """A trigger at the end of REFRACTORY keeps the time of the one before."""

    def recover(self, state: TriggerState, t: float, x: float) -> TriggerState:
        return replace(super().recover(state, t, x), triggered_at=state.triggered_at)


def _mutant(kind: type[Trigger]) -> Callable[[dict[str, Any]], Finding]:
    return lambda inputs: prove(kind(inputs["zeta_m"], inputs["release_m"], inputs["dwell_s"]), inputs)


MUTANTS: dict[str, Callable[[dict[str, Any]], Finding]] = {
    "no dwell": _mutant(_NoDwell),
    "no refractory mode": _mutant(_NoRefractory),
    "recovers at once": _mutant(_RecoversAtOnce),
    "forgets a trigger after the dwell": _mutant(_Forgets),
    "no hysteresis, no dwell": lambda inputs: prove(Trigger.bare(inputs["zeta_m"]), inputs),
}
"""Broken triggers; each must be refuted by a run that is replayed on it."""
