"""Runs of a scenario in the compiled loop: set up once, then repeated with any seeds."""

from __future__ import annotations

import copy
import time
from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import Any, Self

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import SimulationError, described
from airground_drake.base.registry import UAV_TASKS, method_of
from airground_drake.model.bodies.motion import SAME_S, followed
from airground_drake.model.law.task import Task
from airground_drake.model.law.tasks import FormationTask
from airground_drake.model.plants.delay import Delay
from airground_drake.model.plants.first_order import FirstOrder
from airground_drake.model.plants.lag import Lag
from airground_drake.model.plants.scripted import Scripted
from airground_drake.model.plants.steering import NUMBERS
from airground_drake.model.plants.unicycle import Unicycle
from airground_drake.model.trigger.automaton import FIELDS, INTERVENING, NEW
from airground_drake.model.trigger.excursion import Corners
from airground_drake.scenario.load import own
from airground_drake.scenario.schema import Scenario
from airground_drake.scenario.world import make_world
from airground_drake.sim import components
from airground_drake.sim.batch import loop
from airground_drake.sim.batch.loop import Accepted, Around, Log, State, Team
from airground_drake.sim.batch.noise import gaussians
from airground_drake.sim.blocks.controllers import of_ugvs, read_back
from airground_drake.sim.blocks.decision import ACCURACY, SHORT
from airground_drake.sim.blocks.plant import vertices_of
from airground_drake.sim.blocks.ticks import Ticks
from airground_drake.sim.recording import Done, trace_of
from airground_drake.sim.trace import Trace
from airground_drake.uav.database import BehaviourDatabase
from airground_drake.uav.halts import NOT_WATCHED, room, standing, watched
from airground_drake.uav.messages import NOTHING, accepted_proposals, sightings
from airground_drake.uav.planner import Instant, PlannerState, sent_after
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.answer import GatekeeperDecision
from airground_drake.ugv.desk import obeyed
from airground_drake.ugv.mpc_gatekeeper import Gatekeepers, GatekeeperState, Inputs


class LeftToDrakeError(Exception):
    """The loop does not support this run, or it ends in an error that Drake will report; the message says why."""


class Batch:
    """A run of a valid scenario; raises LeftToDrakeError if the loop does not support it."""

    # Left to Drake: users' plants and controllers, channels, errors of positions, several UAVs, one that is lost, tasks
    # of the UAV that are not the package's, gatekeepers with a limit by the clock. Monitors, observers, decision blocks
    # and disturbances are no part of a scenario.

    def __init__(self, scenario: Scenario, name: str) -> None:
        """Prepare everything that does not depend on the seed."""
        self.scenario, self.name = scenario, name
        run, given = scenario.runs[name], own(scenario, name)
        self.given = given
        method, control = method_of(run.method), given.control
        self.world = world = make_world(given)
        n, r = len(world.names("ugv")), len(world.robots)
        for body in world.moving:
            if not isinstance(body.plant, FirstOrder | Unicycle | Lag | Delay | Scripted):
                raise LeftToDrakeError(f"the plant of {body.name}")
        (flown_by, uav), *more = given.aerial.items()
        left = {
            "errors of measured positions": given.sensing is not None,
            "faults": given.faults is not None,
            "a channel": given.channel is not None and method.intervenes,
            "positions of UGVs over links": given.ugv_links is not None,
            "several UAVs": bool(more),
            "a UAV that is lost": uav.lost_at_s > 0.0,
            "a gatekeeper with a limit by the clock": given.gatekeeper.budget == "wall_clock" and method.gated,
            "a controller of the user's": given.ugv_controller is not None,
        }
        reasons = [why for why, applies in left.items() if applies]
        if reasons:
            raise LeftToDrakeError(reasons[0])
        if UAV_TASKS.load(uav.task, of=Task) is not FormationTask:
            raise LeftToDrakeError(f"the task {uav.task} of the UAV")
        presets = components.make_presets(given)
        self.law = components.make_law(given, method, run.composition)  # type: ignore[arg-type]
        self.planner = components.make_planner(given, method, flown_by)
        self.gatekeepers: Gatekeepers | None = components.make_gatekeepers(given, self.law) if method.gated else None
        self._avoidance = components.make_avoidance(given)
        self.near = Around(world.around(world.select("ugv")), world.around(world.select("uav")))
        trigger, noise = components.make_trigger(given), given.decision
        breaks, places = components.stack_presets(presets)
        scripts = [vertices_of(body) for body in world.moving[r:]]
        gated, steering = self.gatekeepers is not None, world.steering
        periods = ((loop.PLAN, self.planner.period), *([(loop.GATE, given.gatekeeper.period_s)] if gated else []))
        changes = tuple(
            time for body in world.bodies for time in (body.appears_s, body.disappears_s) if 0.0 < time < np.inf
        )
        ticks, due = _schedule(scenario.duration_s, control.period_s, noise.noise_period_s, periods, changes)
        shortest = min(control.period_s, noise.noise_period_s)
        self.draws = int(scenario.duration_s / noise.noise_period_s) + 2
        self.team = Team(
            law=self.law.numbers,
            layer=self._avoidance.layer,
            uav=np.array([uav.altitude_m, control.formation_gain_1_s], dtype=np.float64),
            steering=np.zeros((n, NUMBERS)) if steering is None else steering,
            turns=steering is not None,
            levels=trigger.levels,
            corners=Corners.of(presets),
            breaks=breaks,
            holds=_holds(breaks, places),
            script_of=np.cumsum([0, *(len(times) for times, _ in scripts)], dtype=np.int64),
            script_breaks=np.concatenate([np.zeros(0), *(times for times, _ in scripts)]),
            script_holds=np.concatenate([np.zeros((0, 3, 2)), *(np.pad(_holds(*script), END) for script in scripts)]),
            room=room(self.planner.max_speed),
            numbers=np.array([
                control.period_s, SHORT * shortest, 0.01 * ACCURACY * control.period_s,
                noise.noise_m_sqrt_s / np.sqrt(noise.noise_period_s), noise.leak_1_s, control.sensing_range_m,
            ]),
            ticks=ticks,
            due=due,
            draws=np.zeros((0, n)),
            gated=gated,
            remembers=gated and not self.law.intervention_on_top,
        )  # fmt: skip
        self.headings = np.array([
            body.plant.heading_rad if isinstance(body.plant, Unicycle) else 0.0 for body in world.bodies[:n]
        ])  # fmt: skip
        self.rows = int(1.3 * len(ticks)) + 400
        self.zeta = float(trigger.zeta)

    @cached_property
    def meta(self) -> dict[str, Any]:
        """The metadata that only the simulation knows, for its traces."""
        r, sampling_s = len(self.world.robots), [self.given.control.period_s, 0.0]
        return {
            "zeta_m": self.zeta,
            "controllers": {
                "ugv_controller": of_ugvs(self.near.ugvs, self.law, r, sampling_s),
                "uav_controller": read_back(self.near.uav, self._avoidance, r, sampling_s),
            },
            "decision_block": "",
        }

    @property
    def database(self) -> BehaviourDatabase:
        return self.planner.database

    def simulate(self, seed: int | None = None) -> Trace:
        """The trace of the run with a seed, by default the scenario's.

        Raises:
            SimulationError: if planner or gatekeeper stop the run; names it and the time.
            LeftToDrakeError: if the run ends in another error.
        """
        return self.made(seed).trace()

    def made(self, seed: int | None = None) -> Going:
        """The run with a seed at its end; raises as `simulate`."""
        started = time.perf_counter()
        try:
            run = self.begin(seed)
            run.advance(self.scenario.duration_s)
        finally:
            self.database.close()
        run.wall_s = time.perf_counter() - started
        return run

    def begin(self, seed: int | None = None) -> Going:
        return Going(self, self.scenario.seed if seed is None else seed)

    def start(self) -> State:
        n, r, m = len(self.headings), len(self.world.robots), len(self.near.ugvs.still)
        due = int(self.team.due[0])
        return State(
            time=np.array([0.0, 0.0, 0.0, np.inf, np.inf]),
            counts=np.array([1, 0, 0, due, 0], dtype=np.int64),
            called=np.zeros(n, dtype=np.bool_),
            place=self.world.starts.copy(),
            noise=np.zeros(n),
            drawn=np.zeros(n),
            command=np.zeros((r, 3)),
            executing=np.full(n, NOTHING),
            share=np.ones(n),
            heading=self.headings.copy(),
            sampled=np.zeros(1),
            status=np.tile(NEW, n),
            halts=np.tile([0.0, 0.0, 0.0, NOT_WATCHED], n),
            begun=np.zeros(1 + 5 * n),
            now=np.zeros(1 + 5 * n),
            reference=np.zeros(6 * n),
            quiet=np.zeros((0, m), dtype=np.bool_),
        )

    def new_log(self, rows: int) -> Log:
        n, r, moving = len(self.headings), len(self.world.robots), len(self.world.moving)
        signals = loop.SIGNALS * int((self.team.steering[:, 0] > 0.0).sum())
        widths = 3 * moving, 3 * r, 6 * n, n, n, FIELDS * n, n, signals, n * self.team.turns
        return Log(np.empty(rows), *(np.empty((rows, width)) for width in widths))


class Going:
    """A run in progress. `deepcopy` copies it, except for state that policies keep in themselves."""

    def __init__(self, batch: Batch, seed: int) -> None:
        n = len(batch.headings)
        self._batch, self._seed = batch, seed
        self._team = batch.team._replace(draws=gaussians(seed, n, batch.draws))
        self._around = batch.near
        self._state, self._log, self._enter = batch.start(), batch.new_log(batch.rows), loop.BEGIN
        self._memory, self._answering = batch.planner.start(), GatekeeperState.empty(n)
        self._judged_to = 0  # ticks at which all decisions are made
        self._executed: list[Proposal | None] = [None] * n
        self._accepted = _accepted(self._executed)
        self._ahead: PlannerState | None = None
        self.wall_s = 0.0  # its duration by the clock, if it was made at one go
        self.advance(0.0)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Arrays that change are copied; all else is shared."""
        copied = copy.copy(self)
        copied._state, copied._log = copy.deepcopy((self._state, self._log))
        return copied

    @property
    def t(self) -> float:
        """Time of the run, s."""
        return float(self._state.time[0])

    def positions(self) -> Array:
        """Positions of all r robots, (r, 3), m."""
        return self._state.place[: len(self._batch.world.robots)].copy()

    def advance(self, until: float) -> None:
        """Advance to a time, s, before the updates of that instant; raises as `Batch.simulate`."""
        while True:
            code = loop.advance(self._team, self._around, self._accepted, self._state, self._log, until, self._enter)
            self._enter = loop.AGAIN if code == loop.FULL else loop.GO_ON
            if code == loop.DONE:
                return
            if code == loop.FULL:
                more = self._batch.new_log(len(self._log.t))
                self._log = Log(*(np.concatenate(both) for both in zip(self._log, more, strict=True)))
            elif code == loop.PYTHON:
                self._update()
            else:
                raise LeftToDrakeError("an error at its end")

    def plan_ahead(self) -> None:
        """Plan for this instant before its updates, which then use this result; the last call counts."""
        self._ahead = self._planned()

    @property
    def log(self) -> Log:
        return Log(*(column[: self._state.counts[1]] for column in self._log))

    @property
    def memory(self) -> PlannerState:
        return self._memory

    @property
    def decided(self) -> Sequence[GatekeeperDecision]:
        self._catch_up(int(self._state.counts[0]) - (self._state.counts[3] != 0))  # what is due is still to be made
        return self._answering.made

    def _catch_up(self, tick: int) -> None:
        """Add the decisions of skipped ticks before a tick, which only repeat the answers."""
        if self._batch.gatekeepers is not None and any(self._memory.proposals):
            slept = slice(self._judged_to, tick)
            times = self._team.ticks[slept][(self._team.due[slept] & loop.GATE) > 0].tolist()
            self._answering = self._batch.gatekeepers.kept(times, self._memory.proposals, self._answering)
        self._judged_to = tick

    def trace(self) -> Trace:
        batch, log = self._batch, self.log
        logged = {
            "bodies": log.bodies, "team_command": log.command, "reference": log.reference, "noise": log.noise,
            "decision_variable": log.x, "status": log.status, "executing": log.executing,
        }  # fmt: skip
        if batch.world.signals:
            logged |= {"plant_signals": self._signals(log)}
        if self._team.turns:
            logged |= {"command_share": log.share}
        done = Done(
            t=log.t,
            logged={name: rows.T for name, rows in logged.items()},
            memories={batch.planner.sender.uav: self.memory},
            decided=self.decided,
            seed=self._seed,
            until_s=self.t,
            wall_s=self.wall_s,
            meta=batch.meta,
        )
        return trace_of(batch.scenario, batch.name, batch.world, done, batch.world.signals)

    def _signals(self, log: Log) -> Array:
        """Signals of plants, (T, k); the loop has those of unicycles, the others are computed here."""
        batch, turning = self._batch, iter(np.split(log.signals, log.signals.shape[1] // loop.SIGNALS or 1, axis=1))
        ticks = self._team.ticks[(self._team.due & loop.CONTROL) > 0]
        samples = np.searchsorted(log.t, ticks[ticks <= log.t[-1]], side="right") - 1
        return np.concatenate([
            next(turning) if isinstance(body.plant, Unicycle)
            else followed(
                body.plant, log.t, log.bodies[:, 3 * i : 3 * i + 3], log.command[:, 3 * i : 3 * i + 3],
                {*samples.tolist()}, batch.given.control.period_s,
            )
            for i, body in enumerate(batch.world.bodies[: len(batch.world.robots)]) if body.plant and body.plant.signals
        ], axis=1)  # fmt: skip

    def _update(self) -> None:
        """Make the updates of planner and gatekeepers at an instant; both see the state before either."""
        batch, state, t = self._batch, self._state, self.t
        if state.counts[3] & loop.WATCH:
            self._around = Around(*(batch.world.at(near, t) for near in batch.near))
        self._catch_up(int(state.counts[0]) - 1)
        self._judged_to += 1
        try:
            ahead, self._ahead = self._ahead, None
            planned = (self._planned() if ahead is None else ahead) or self._memory
            answering = self._judged()
        except (Exception, SystemExit) as error:  # as Drake reports it
            raise SimulationError(batch.name, t, described(error)) from error
        if answering.quiet is not self._answering.quiet:
            self._state = state = state._replace(quiet=answering.quiet)
        self._memory, self._answering = planned, answering
        answers = self._answers()
        state.called[:] = state.status[::FIELDS] == INTERVENING
        state.time[3] = batch.planner.asleep_until(planned, state.called.tolist(), answers, answering.reports)
        if batch.gatekeepers is not None:
            state.time[4] = batch.gatekeepers.asleep_until(planned.proposals, answering)
        now = accepted_proposals(planned.proposals, np.array(answers))
        if any(one is not other for one, other in zip(now, self._executed, strict=True)):
            self._executed, self._accepted = now, _accepted(now)
        state.counts[4] = 1

    def _planned(self) -> PlannerState | None:
        """The planner's memory after planning at this instant; None at other times, or if nothing changes."""
        batch, state, t, memory = self._batch, self._state, self.t, self._memory
        intervening = (state.status[::FIELDS] == INTERVENING).tolist()
        answers, reports = self._answers(), self._answering.reports
        if not state.counts[3] & loop.PLAN or t < batch.planner.asleep_until(memory, intervening, answers, reports):
            return None
        places = state.place.copy()
        stands = standing(watched(state.halts, t, places.reshape(-1), self._team.room), t).tolist()
        moving, robots = sightings(batch.world, t, places), places[: len(batch.world.robots)]
        now = Instant(t, robots, intervening, np.array(answers), reports, stands, moving)
        return sent_after(memory, batch.planner.plan(memory, now), t, batch.planner.sender)

    def _judged(self) -> GatekeeperState:
        """The gatekeepers' memory after a sample."""
        batch, state, t, before = self._batch, self._state, self.t, self._answering
        proposals, places = self._memory.proposals, state.place.copy()
        gate = batch.gatekeepers if state.counts[3] & loop.GATE else None
        if gate is None:
            return before
        if (repeated := gate.repeated(t, proposals, places, before)) is not None:
            return repeated
        period = float(self._team.numbers[0])
        headings = loop.headings_at(t, state, self._team.steering, period) if self._team.turns else None
        velocities = batch.world.velocities(t, state.command.copy())
        return gate.sample(Inputs(t, proposals, places, velocities, batch.law, headings), before)

    def _answers(self) -> Sequence[float]:
        """The answers in force, (2n,); without gatekeepers every proposal is accepted at once."""
        return obeyed(self._memory.proposals) if self._batch.gatekeepers is None else self._answering.answers


@lru_cache(maxsize=8)
def _schedule(
    duration_s: float,
    control_s: float,
    noise_s: float,
    periods: tuple[tuple[int, float], ...],
    changes: tuple[float, ...],
) -> tuple[Array, loop.Ints]:
    """Times of all timed events, s, and the events due then, by Drake's arithmetic: k times the period."""
    ticks_at: dict[float, int] = {}
    for bit, period in ((loop.CONTROL, control_s), (loop.NOISE, noise_s)):
        for k in range(int(duration_s / period) + 2):
            ticks_at[k * period] = ticks_at.get(k * period, 0) | bit
    for bit, period in periods:
        ticks = Ticks(period, control_s)
        for k in range(int(duration_s / ticks.period) + 2):
            t = k * ticks.period
            ticks_at[t] = ticks_at.get(t, 0) | (bit if ticks.due(t) else 0)
    samples = [k * control_s for k in range(int(duration_s / control_s) + 2)]
    for time_s in (0.0, *changes) if changes else ():
        for sample in [t for t in samples if t + SAME_S >= time_s][:1]:
            ticks_at[sample] |= loop.WATCH
    times = sorted(ticks_at)
    return np.array(times), np.array([ticks_at[t] for t in times], dtype=np.int64)  # nothing writes to them


END = ((0, 1), (0, 0), (0, 0))  # an unused row after the pieces of a hold, which then has as many as breaks


def _holds(breaks: Array, places: Array) -> Array:
    """Value and slope of each piece of a first-order hold through (K, d) at (K,), s: (K - 1, d, 2)."""
    return np.stack([places[:-1], (places[1:] - places[:-1]) / (breaks[1:] - breaks[:-1])[:, None]], axis=2)


def _accepted(proposals: Sequence[Proposal | None]) -> Accepted:
    motions = [None if proposal is None else proposal.motion for proposal in proposals]
    return Accepted(
        executing=np.array([proposal is not None for proposal in proposals]),
        number=np.array([NOTHING if proposal is None else float(proposal.number) for proposal in proposals]),
        chosen=np.array([np.zeros((3, 3)) if proposal is None else proposal.chosen for proposal in proposals]),
        first=np.cumsum([0, *(0 if motion is None else len(motion.times) for motion in motions)], dtype=np.int64),
        times=np.concatenate([np.zeros(0), *(motion.times for motion in motions if motion)]),
        places=np.concatenate([np.zeros((0, 3)), *(motion.positions for motion in motions if motion)]),
        slopes=np.concatenate([
            np.zeros((0, 3)), *(np.append(motion.slopes, np.zeros((1, 3)), axis=0) for motion in motions if motion)
        ]),
    )  # fmt: skip
