"""The running automata make the transitions of the theorems' models (verify/coq/Trigger.v, Patience.v).

Both compare times and levels only. So every order of the values, ties and next floats included, is every case.
"""

import itertools
import math
from fractions import Fraction
from typing import Any

from airground_drake.model.trigger.automaton import Mode, Trigger, TriggerState
from airground_drake.ugv.patience import Commitment, Patience

SUPERVISING, INTERVENING, REFRACTORY = Mode.SUPERVISING, Mode.INTERVENING, Mode.REFRACTORY
LEVELS = [(3.0, 1.5, 0.5), (3.0, 3.0, 0.0), (3.0, 3.0, 0.5), (1.5, -0.5, 2.0)]
"""Threshold, release level and dwell."""


def around(*values: float) -> list[float]:
    found = {value for each in values for value in (each, math.nextafter(each, -9e9), math.nextafter(each, 9e9))}
    return sorted(found | {min(values) - 1.0, max(values) + 1.0})


def model_step(
    levels: tuple[float, float, float], state: tuple[Mode, int, float], t: float, x: float
) -> tuple[Mode, int, float]:
    """`step` of Trigger.v: mode, number of triggers, time of the last one."""
    zeta, release, dwell = levels
    now, triggers, at = state
    end = Fraction(at) + Fraction(dwell) if triggers else Fraction(0)
    risen = (INTERVENING, triggers + 1, t)
    if now is SUPERVISING:
        return risen if zeta <= x else state
    if now is INTERVENING:
        if x <= release and x < zeta:
            return (SUPERVISING if end <= t else REFRACTORY), triggers, at
        return state
    if end <= t:
        return risen if zeta <= x else (SUPERVISING, triggers, at)
    return state


def seen(state: TriggerState) -> tuple[Mode, int, float]:
    return state.mode, state.triggers, state.triggered_at


def differing(kind: type[Trigger]) -> list[Any]:
    found: list[Any] = []
    for levels in LEVELS:
        trigger, (zeta, release, dwell) = kind(*levels), levels
        for x in around(zeta, release):
            start = (INTERVENING, 1, 0.0) if zeta <= x else (SUPERVISING, 0, -1.0)
            if seen(trigger.start(0.0, x)) != start:
                found.append((levels, x))
        for mode, count, x in itertools.product(Mode, (0, 1, 7), around(zeta, release)):
            last = 4.0 if count else -1.0
            for t in around(4.0 + dwell):
                state = TriggerState(mode, count, last, -1.0)
                if seen(trigger.step(state, t, x)) != model_step(levels, (mode, count, last), t, x):
                    found.append((levels, state, t, x))
    return found


def test_the_trigger_makes_the_transitions_of_the_theorem() -> None:
    assert differing(Trigger) == []


TIMES = (2, 5.0, 3.0)
"""Tries, rest and longest try."""


def impatient(kind: type[Patience]) -> list[str]:
    most, rest, longest = TIMES
    patience, found = kind(*TIMES), set[str]()
    for executing, tries, t in itertools.product((False, True), (0, 1, 2, 3), around(10.0, 10.0 + rest)):
        turn = Commitment(executing, tries, 10.0, 12.0)
        over = not executing and 10.0 + rest <= t
        if patience.rested(turn, t) != (Commitment(executing, 0, 10.0, 12.0) if over else turn):
            found.add("rested")
        if patience.exhausted(turn) != (not tries < most):
            found.add("exhausted")
        for end in around(t, t + longest):
            until = end if end <= t + longest else t + longest
            if patience.accept(turn, t, end) != Commitment(True, tries + 1, t, until):
                found.add("accept")
        if patience.stop(turn, t) != Commitment(False, tries, t, 12.0):
            found.add("stop")
    for t in around(12.0):
        if patience.over(Commitment(True, 1, 10.0, 12.0), t) != (t >= 12.0):
            found.add("over")
    return sorted(found)


def test_patience_makes_the_transitions_of_the_theorem() -> None:
    assert impatient(Patience) == []
