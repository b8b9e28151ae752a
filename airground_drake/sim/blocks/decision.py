"""The decision layer: the decision variable of (15) and the event trigger (20)."""

from collections.abc import Sequence
from contextlib import suppress
from itertools import pairwise
from typing import Any

import numpy as np
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    EventStatus,
    LeafSystem,
    State,
    WitnessFunction,
    WitnessFunctionDirection,
)

from airground_drake.base.arrays import Array
from airground_drake.base.errors import PluginError, short
from airground_drake.model.bodies.world import World
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.trigger.automaton import NEW, Trigger, advance, anything_due, are_numbers, begin
from airground_drake.model.trigger.excursion import Corners, bends, extremes, gathered, ranges, stretches, variables
from airground_drake.sim.blocks.lifetime import declare_cached, declare_output, weakly
from airground_drake.sim.blocks.signals import TriggerLevels, components_of, declare_bodies

NOT_BEGUN = -1.0  # stands for the beginning of a run or a step, s, before the first one

ACCURACY = 1e-6  # of the Context of a run: events are isolated to this, relative to the time scale of 1 s
# Events are not isolated within steps shorter than this, s; they happen at the step's end. Ticks of different periods
# can be one unit in the last place apart, and Drake stops when it must isolate an event in such a step.
SHORTEST_S = 1e-9
# A shorter step is short, in sampling periods. Isolating an event takes about twenty, each half as long as before.
SHORT = 0.01
MOST_SHORT = 1000  # largest number of short steps in a row without a transition


class DecisionBlock(LeafSystem):
    """Base class of blocks that compute the decision variables x of n UGVs.

    Within a step of the simulator, positions, references and noise are linear in time, except at corners of the
    presets. So the block keeps their values at the beginning of the step and outputs the range of x since then: the
    trigger needs it to miss nothing between two updates. A subclass defines `value`, and `extremes` if x can be smaller
    or larger within a straight stretch than at its ends.

    Ports (n UGVs, M bodies that move):
        in  `bodies` (3M) m; `reference` (6n), positions first; `noise` (n) m.
        out `decision_variable` (n) m, x now; `decision_range` (2n) m, the smallest x since the step began, then the
            largest. Both are continuous in time.
    State (1 + 5n): the time at which the step began, s; then for each UGV its task error (3), noise and x at that time,
        m.
    Rate: one update per step of the simulator.
    """

    def __init__(self, world: World, presets: Sequence[Motion] = ()) -> None:
        """Declare ports, state and events for the UGVs of a world. References have corners where their presets do."""
        super().__init__()
        count = len(world.names("ugv"))
        self._ugvs = components_of(world, "ugv")
        self._corners = Corners.of(presets)
        self._bodies = declare_bodies(self, world)
        self._reference = self.DeclareVectorInputPort("reference", 6 * count)
        self._noise = self.DeclareVectorInputPort("noise", count)
        self.DeclareDiscreteState(np.array([NOT_BEGUN, *([0.0] * 5 * count)]))
        given = {self._bodies.ticket(), self._reference.ticket(), self._noise.ticket(), self.time_ticket()}
        self._cached = declare_cached(self, "signals", np.zeros(0), type(self)._signals_now, given)
        declare_output(self, "decision_variable", count, lambda self, context: self._signals(context)[5::5], given)
        declare_output(self, "decision_range", 2 * count, type(self)._range, {*given, self.xd_ticket()})
        self.DeclareInitializationDiscreteUpdateEvent(weakly(self._begin_step))
        self.DeclarePerStepDiscreteUpdateEvent(weakly(self._begin_step))

    def value(self, t: float, parts: Array) -> Array | Sequence[float]:
        """x of every UGV, (n,), m. It may depend on nothing but the arguments; `t` in s; `parts` (n, 4), m."""
        raise NotImplementedError(f"{type(self).__name__} does not define `value`")

    def extremes(self, begin: float, before: Array, end: float, after: Array, ends: Array) -> Array:
        """Smallest and largest x, (2, n), m, over a straight stretch; by default those at its ends."""
        # begin, end: s; before: (n, 4), m
        return np.sort(ends, axis=0)

    def _signals_now(self, context: Context) -> Array:
        """The numbers that the state keeps, at this instant."""
        position, reference = self._bodies.Eval(context)[self._ugvs], self._reference.Eval(context)
        return self._with_variable(gathered(context.get_time(), position, reference, self._noise.Eval(context)))

    def _signals(self, context: Context) -> Array:
        return np.asarray(self.get_cache_entry(self._cached).Eval(context))

    def _with_variable(self, signals: Array) -> Array:
        """Signals whose x of (15) is replaced by that of this block."""
        rows = signals[1:].reshape(-1, 5)
        rows[:, 4] = self._valued(signals[0], rows[:, :4].copy())
        return signals

    def _valued(self, t: float, parts: Array) -> Array:
        """`value`, checked to be finite: otherwise the trigger would see no crossing."""
        return self._numbers(self.value(t, parts), (len(parts),), "x")

    def _numbers(self, given: object, shape: tuple[int, ...], what: str) -> Array:
        with suppress(TypeError, ValueError):
            numbers = np.asarray(given, dtype=np.float64)
            if numbers.shape == shape and np.isfinite(numbers).all():
                return numbers
        wanted = f"wanted: {' times '.join(map(str, shape))} finite numbers, m"
        raise PluginError(f"decision block {type(self).__name__} returned {short(repr(given))} as {what}; {wanted}")

    def _range(self, context: Context) -> Array:
        begun, now = context.get_discrete_state(0).value(), self._signals(context)
        return self._ranges(now if begun[0] == NOT_BEGUN else begun, now)

    def _ranges(self, begun: Array, now: Array) -> Array:
        """Smallest x over a step, then the largest, (2n,), m, from the signals at its ends."""
        before, after = begun[1:].reshape(-1, 5), now[1:].reshape(-1, 5)
        ends = np.stack([before[:, 4], after[:, 4]])
        of_step = self.extremes(begun[0], before[:, :4], now[0], after[:, :4], ends)
        extremes = self._numbers(of_step, ends.shape, "the range of x")
        first, last = bends(self._corners, begun[0], now[0])
        if last > first:
            times, parts, bent = stretches(begun, now, self._corners)
            x = [self._valued(t, part) for t, part in zip(times, parts, strict=True)]
            pieces = pairwise(zip(times, parts, x, strict=True))
            found_in = np.array(
                [self.extremes(t0, p0, t1, p1, np.array([x0, x1])) for (t0, p0, x0), (t1, p1, x1) in pieces]
            )
            extremes = np.where(bent, [found_in[:, 0].min(axis=0), found_in[:, 1].max(axis=0)], extremes)
        return extremes.ravel()

    def _begin_step(self, context: Context, discrete: DiscreteValues) -> EventStatus:
        """Keep the signals of this instant: the end of a step, or the start of a simulator."""
        discrete.set_value(0, self._signals(context))
        return EventStatus.Succeeded()


class DecisionVariable(DecisionBlock):
    """x_j = ||rho_rd,j - rho_j|| + n_j, the solution of (15) with integrated noise n_j; its range is exact.

    Ports, state and rate: see `DecisionBlock`.
    """

    def value(self, t: float, parts: Array) -> Array:
        """The norms of the task errors plus the noise, (n,), m."""
        return variables(parts)

    def extremes(self, begin: float, before: Array, end: float, after: Array, ends: Array) -> Array:
        """Exact: see `model.trigger.excursion`."""
        return extremes(before, after, ends)

    def _with_variable(self, signals: Array) -> Array:
        """Signals already contain this x, unless a subclass defines another."""
        return signals if type(self).value is DecisionVariable.value else super()._with_variable(signals)

    def _ranges(self, begun: Array, now: Array) -> Array:
        own = type(self).value is not DecisionVariable.value or type(self).extremes is not DecisionVariable.extremes
        return super()._ranges(begun, now) if own else ranges(begun.copy(), now, self._corners)


class EventTrigger(LeafSystem):
    """The automaton of `model.trigger.automaton` for every UGV; a witness function isolates its events.

    The trigger sees decision variables only, whatever block computes them. The witness uses the range of x since the
    step began, not only x at its end. It changes its sign once a transition has become due anywhere in the step and
    cannot change it back within the step. So a dip below the release level and back within a step is isolated like any
    other crossing. At the isolated time the step ends and the per-step update makes the transition; transitions due at
    the beginning of a run are made at once.

    All per-step updates of a diagram see the signals before any of them: the trigger sees the range of the step that
    ends while the block that computes it begins another. The Context needs an accuracy (`Context.SetAccuracy`).
    Without it Drake stops at the first event or, with fixed steps, reports it at the end of a step. A Simulator that is
    initialised in the middle of a run, such as one for a clone of its Context, continues the run. One that is
    initialised again before its first step, or for an earlier time, starts a new run.

    Ports (n UGVs):
        in  `decision_variable` (n) m; `decision_range` (2n) m, the smallest since the step began, then the largest.
        out `status` (4n): a `Status` per UGV.
    State: the status; the times at which the step and the run began, s; the number of short steps in a row.
    Parameters: `TriggerLevels`; by default those of the trigger.
    Rate: one update per step of the simulator. No step is longer than the `period` of the constructor.
    Raises: PluginError if a decision variable is not a number. RuntimeError at the initialisation of a Simulator whose
    Context has no accuracy, and after `MOST_SHORT` short steps in a row
    without a transition. While an event is isolated, steps become so short that robots far from the origin no longer
    move in them: their coordinates are rounded. Then x never gets to its level.
    """

    def __init__(self, count: int, trigger: Trigger, period: float = 1e-3) -> None:
        """Declare ports, state and events for `count` UGVs.

        Args:
            count: n.
            trigger: has the levels, by default.
            period: longest step of the simulator, s: the shortest period of the diagram costs no further steps. Without
                it, and without other sampled systems, a step could be as long as a run.
        """
        super().__init__()
        self._count, self._short = count, SHORT * period
        self.DeclareNumericParameter(BasicVector(trigger.levels))
        self._variable = self.DeclareVectorInputPort("decision_variable", count)
        self._range = self.DeclareVectorInputPort("decision_range", 2 * count)
        status = self.DeclareDiscreteState(np.tile(NEW, count))
        self.DeclareDiscreteState([NOT_BEGUN])
        self.DeclareDiscreteState([NOT_BEGUN])
        self.DeclareDiscreteState([0.0])
        self.DeclareStateOutputPort("status", status)
        self.DeclareInitializationUnrestrictedUpdateEvent(weakly(self._start))
        self.DeclarePerStepDiscreteUpdateEvent(weakly(self.update))
        self.DeclarePeriodicPublishEvent(period, 0.0, lambda context: EventStatus.DidNothing())  # ends a step
        direction = WitnessFunctionDirection.kPositiveThenNonPositive
        self._witness = self.MakeWitnessFunction("a transition is due", direction, weakly(self.nothing_due))

    def levels(self, context: Context) -> Any:
        """The levels in force, a `TriggerLevels`."""
        return TriggerLevels(context.get_numeric_parameter(0).value())

    def mutable_levels(self, context: Context) -> Any:
        """A view of the levels in force; assigning to it changes them in this Context."""
        return TriggerLevels(context.get_mutable_numeric_parameter(0).get_mutable_value())

    def _checked_levels(self, context: Context) -> Array:
        """The levels in force, (3,); ValueError if no trigger can have them."""
        return Trigger(*context.get_numeric_parameter(0).value().tolist()).levels

    def DoGetWitnessFunctions(self, context: Context) -> list[WitnessFunction]:
        return [self._witness]

    def _start(self, context: Context, state: State) -> EventStatus:
        if context.get_accuracy() is None:
            raise RuntimeError("the Context has no accuracy, so no event can be isolated; call SetAccuracy(1e-6) on it")
        discrete, t, x = state.get_mutable_discrete_state(), context.get_time(), self._variable.Eval(context)
        begun, run_begun = discrete.value(1), discrete.value(2)
        levels = self._checked_levels(context)
        if run_begun[0] < begun[0] <= t:  # another simulator goes on with a run
            status = discrete.value(0).copy()
            advance(status, t, x, np.tile(x, 2), levels)
        else:
            status = np.tile(NEW, self._count)
            begin(status, t, x, levels)
            discrete.set_value(2, [t])
        discrete.set_value(0, status)
        discrete.set_value(1, [t])
        return EventStatus.Succeeded()

    def nothing_due(self, context: Context) -> float:
        """The witness: 1 at the beginning of a step and until a transition is due in it, then -1."""
        t = context.get_time()
        if t - context.get_discrete_state(1)[0] < SHORTEST_S:
            return 1.0
        status, levels = self._copied(context)
        return -1.0 if anything_due(status, t, self._range.Eval(context), levels) else 1.0

    def _copied(self, context: Context) -> tuple[Array, Array]:
        """Status and levels, in arrays that can be written, as in the loop: functions are compiled for these alone."""
        return context.get_discrete_state(0).value().copy(), context.get_numeric_parameter(0).value().copy()

    def update(self, context: Context, discrete: DiscreteValues) -> EventStatus:
        """The per-step update: make the transitions that became due in the step that ends, and begin another step."""
        t, spans = context.get_time(), self._range.Eval(context)
        status, levels = self._copied(context)
        if not are_numbers(spans):
            source = "from a decision block, a plant or a disturbance"
            raise PluginError(f"decision_range is not a number, {source}: {short(repr(spans.tolist()))}")
        if anything_due(status, t, spans, levels):
            advance(status, t, self._variable.Eval(context), spans, self._checked_levels(context))
            discrete.set_value(0, status)
            discrete.set_value(3, [0.0])
        else:
            self._count_short(t - context.get_discrete_state(1)[0], discrete)
        discrete.set_value(1, [t])
        return EventStatus.Succeeded()

    def _count_short(self, lasted: float, discrete: DiscreteValues) -> None:
        """Count a step without a transition, which lasted so long, s, if it was short."""
        before = discrete.value(3)[0]
        short = before + 1.0 if lasted < self._short else 0.0
        if short > MOST_SHORT:
            raise RuntimeError(
                "an event cannot be isolated: coordinates are rounded too coarsely for so slow a motion; wanted: "
                "coordinates nearer to the origin"
            )
        if short != before:
            discrete.set_value(3, [short])
