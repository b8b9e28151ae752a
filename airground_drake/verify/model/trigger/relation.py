"""The transition relation of the running `Trigger`, read off its methods, and compared with `EventTrigger`."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from airground_drake.arrays import Array
from airground_drake.decision.trigger import Mode, Trigger, TriggerState
from airground_drake.systems.decision import EventTrigger
from airground_drake.verify.engines.obligation import rational
from airground_drake.verify.engines.rounding import ROUNDOFF
from airground_drake.verify.engines.symbolic_execution import Branch, Linear, branches

UGVS = 320
"""States compared at a time: all UGVs of an EventTrigger share the time, so that one update decides many."""
SYMBOLS = ("n", "k", "s", "t", "a", "l", "r", "x", "zeta", "release", "dwell")
"""Of the relation, in the order of print: r is the automaton's time of the last release; others as in `zeno_proof`."""


def _branches(function: Callable[[Branch], TriggerState]) -> list[tuple[Branch, TriggerState]]:
    return branches(function, order=SYMBOLS, counts=("n",))


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


def read_off(make: Callable[[Branch], Trigger]) -> list[Transition]:
    """All transitions of the trigger that `make` makes, whose parameters may be symbols of the path.

    The start and waiting are included.
    """
    found: list[Transition] = []

    def add(name: str, source: Mode | None, path: Branch, after: TriggerState) -> None:
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

    for path, after in _branches(lambda path: make(path).start(path.symbol("s"), path.symbol("x"))):
        add(f"start_{after.mode.name.lower()}", None, path, after)
    for mode in Mode:

        def event(path: Branch, mode: Mode = mode) -> TriggerState:
            trigger = make(path)
            before = TriggerState(mode, *map(path.symbol, "nar"))
            return trigger.step(before, path.symbol("s"), path.symbol("x"))

        def wait(path: Branch, mode: Mode = mode) -> TriggerState:
            make(path)
            return TriggerState(mode, *map(path.symbol, "nar"))

        for path, after in _branches(event):
            if after.mode is not mode:
                add(f"{mode.name.lower()}_{after.mode.name.lower()}", mode, path, after)
        for path, after in _branches(wait):
            add(f"{mode.name.lower()}_waits", mode, path, after)
    return found


def replay(trigger: Trigger, events: Sequence[tuple[float, float]]) -> list[dict[str, Any]]:
    """Run the running trigger through events (t in s, x in m): the state after each."""
    state, rows = TriggerState(), list[dict[str, Any]]()
    for i, (t, x) in enumerate(events):
        before = state.mode
        state = trigger.start(t, x) if i == 0 else trigger.step(state, t, x)
        fired = state.mode is Mode.INTERVENING and before is not Mode.INTERVENING
        rows.append({"t_s": t, "x_m": x, "mode": state.mode.name, "trigger": fired})
    return rows


def dwell_rounding(trigger: Trigger, duration: float) -> float:
    """Largest error of the running automaton's end of dwell in a run, s.

    triggered_at + dwell is rounded once, by at most the unit roundoff times itself, and the float that stands for
    the dwell is not quite the decimal number meant.
    """
    meant, kept = Fraction(rational(trigger.dwell)), Fraction(trigger.dwell)
    return math.nextafter(float(Fraction(ROUNDOFF) * (Fraction(duration) + kept) + abs(meant - kept)), math.inf)


def conformance(trigger: Trigger, transitions: Sequence[Transition], duration: float) -> dict[str, Any]:
    """The relation against the running `EventTrigger` on random states, most of them next to a guard's border.

    The relation is evaluated exactly at the floats' values (x and the levels as the decimals that they print as). A
    disagreement is excused only if the time is within `dwell_rounding` of the end of the dwell; where more than one
    transition is possible, the relation disagrees.
    """
    rng = np.random.default_rng(1)
    system = EventTrigger(UGVS, trigger)
    compared: list[tuple[str, str]] = []
    first: dict[str, Any] | None = None
    for now in rng.uniform(0.0, duration, 8):
        before, x = _random_states(trigger, float(now), rng)
        for was, became, value in zip(before, _left(system, float(now), before, x), x, strict=True):
            names = ("n", "a", "r", "s", "x")
            point = dict(zip(names, map(Fraction, (*was[1:], now)), strict=False)) | {"x": Fraction(rational(value))}
            predicted, taken = _predict(transitions, Mode(int(was[0])), point)
            outcome = "agrees"
            if predicted != [Fraction(v) for v in became]:
                off = abs(point["s"] - point["a"] - Fraction(rational(trigger.dwell)))
                close = point["n"] > 0 and off <= Fraction(dwell_rounding(trigger, duration))
                outcome = "within rounding" if close and predicted else "disagrees"
            if outcome == "disagrees" and first is None:
                states = {"before": was.tolist(), "after": became.tolist()}
                first = {"t_s": float(now), "x_m": float(value), **states}
            compared.append((outcome, taken))
    outcomes = Counter(outcome for outcome, _ in compared)
    return {
        "states": len(compared),
        "disagreements": outcomes["disagrees"],
        "within_rounding": outcomes["within rounding"],
        "first": first,
        "transitions": dict(Counter(taken for _, taken in compared)),
    }


def _random_states(trigger: Trigger, now: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """States of the UGVs of an EventTrigger, (UGVS, FIELDS), and decision variables (UGVS,), m, next to guards."""
    near = now - trigger.dwell + np.spacing(now) * rng.integers(-3, 4, UGVS)
    triggered_at = np.where(rng.random(UGVS) < 0.5, near, rng.uniform(0.0, now, UGVS))
    levels = np.array([trigger.zeta, trigger.release])[rng.integers(0, 2, UGVS)]
    x = np.select(
        [rng.random(UGVS) < 0.3, rng.random(UGVS) < 0.5],
        [levels, levels + np.spacing(levels) * rng.integers(-2, 3, UGVS)],
        rng.uniform(trigger.release - 1.0, trigger.zeta + 1.0, UGVS),
    )
    modes = rng.integers(0, 3, UGVS)
    triggers = rng.integers(0, 4, UGVS)
    released_at = rng.uniform(-1.0, now, UGVS)
    return np.column_stack([modes, triggers, np.where(triggers > 0, triggered_at, -1.0), released_at]), x


def _left(system: EventTrigger, now: float, before: Array, x: Array) -> Array:
    """The states (UGVS, FIELDS) after the running system's event at time `now`, s, for the mode of each."""
    context, count = system.CreateDefaultContext(), len(x)
    context.SetTime(now)
    for name, size in (("team_position", 3 * count + 3), ("reference", 6 * count)):
        system.GetInputPort(name).FixValue(context, np.zeros(size))  # no task error: x is the noise
    system.GetInputPort("noise").FixValue(context, x)
    context.SetDiscreteState(0, before.ravel())
    context.SetDiscreteState(1, np.concatenate([[now], np.zeros(6 * count), x]))  # a step that has just begun
    updated = system.AllocateDiscreteVariables()
    updated.SetFrom(context.get_discrete_state())
    system.update(context, updated)
    return np.array(updated.value(0).reshape(before.shape))


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
