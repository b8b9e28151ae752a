"""A run of a scenario by the compiled loop: set up once, then as often as there are seeds."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import SimulationError, described
from airground_drake.base.registry import UAV_TASKS, method_of
from airground_drake.model.law.task import Task
from airground_drake.model.law.tasks import FormationTask
from airground_drake.model.plants.first_order import FirstOrder
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
from airground_drake.uav.halts import NOT_WATCHED, room, standing, watched
from airground_drake.uav.messages import ACCEPT, NOTHING, SILENT, accepted_proposals, sightings
from airground_drake.uav.planner import PlannerState, sent_after
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.mpc_gatekeeper import Gatekeepers, GatekeeperState, Inputs


class LeftToDrakeError(Exception):
    """The loop cannot make this run, or it ends in an error, which Drake then tells; the message says why."""


class Batch:
    """A run of a valid scenario; raises LeftToDrakeError at once where the loop cannot make it."""

    # Left to Drake: users' plants, lags and delays, and tasks of the UAV that are not the package's; monitors,
    # observers, decision blocks and disturbances are no part of a scenario.

    def __init__(self, scenario: Scenario, name: str) -> None:
        """Set it up: everything that does not depend on the seed."""
        self._scenario, self._name = scenario, name
        run, given = scenario.runs[name], own(scenario, name)
        method, control = method_of(run.method), given.control
        self._world = world = make_world(given)
        n, r = len(world.names("ugv")), len(world.robots)
        for body in world.moving:
            if not isinstance(body.plant, FirstOrder | Unicycle | Scripted):
                raise LeftToDrakeError(f"the plant of {body.name}")
        if UAV_TASKS.load(given.uav.task, of=Task) is not FormationTask:
            raise LeftToDrakeError(f"the task {given.uav.task} of the UAV")
        presets = components.make_presets(given)
        self._law = components.make_law(given, method, run.composition)  # type: ignore[arg-type]
        self._planner = components.make_planner(given, method)
        self._gatekeepers: Gatekeepers | None = components.make_gatekeepers(given, self._law) if method.gated else None
        self._avoidance = components.make_avoidance(given)
        self._near = Around(world.around(world.select("ugv")), world.around(world.select("uav")))
        zeta = components.threshold(given)
        trigger, noise = components.make_trigger(given, zeta), given.decision
        breaks, places = components.stack_presets(presets)
        scripts = [vertices_of(body) for body in world.moving[r:]]
        gated, steering = self._gatekeepers is not None, world.steering
        periods = {loop.PLAN: self._planner.period, **({loop.GATE: given.gatekeeper.period_s} if gated else {})}
        ticks, due = _schedule(scenario.duration_s, control.period_s, noise.noise_period_s, periods)
        shortest = min(control.period_s, noise.noise_period_s)
        self._draws = int(scenario.duration_s / noise.noise_period_s) + 2
        self._team = Team(
            law=self._law.numbers,
            layer=self._avoidance.layer,
            uav=np.array([given.uav.altitude_m, control.formation_gain_1_s], dtype=np.float64),
            steering=np.zeros((n, NUMBERS)) if steering is None else steering,
            turns=steering is not None,
            levels=trigger.levels,
            corners=Corners.of(presets),
            breaks=breaks,
            holds=_holds(breaks, places),
            script_of=np.cumsum([0, *(len(times) for times, _ in scripts)], dtype=np.int64),
            script_breaks=np.concatenate([np.zeros(0), *(times for times, _ in scripts)]),
            script_holds=np.concatenate([np.zeros((0, 3, 2)), *(_with_end(_holds(*script)) for script in scripts)]),
            room=room(self._planner.max_speed),
            numbers=np.array([
                control.period_s, SHORT * shortest, 0.01 * ACCURACY * control.period_s,
                noise.noise_m_sqrt_s / np.sqrt(noise.noise_period_s), noise.leak_1_s, control.sensing_range_m,
            ]),
            ticks=ticks,
            due=due,
            draws=np.zeros((0, n)),
            gated=gated,
            remembers=gated and not self._law.intervention_on_top,
            watchful=any(body.appears_s > 0.0 or body.disappears_s < np.inf for body in world.bodies),
        )  # fmt: skip
        self._headings = np.array([
            body.plant.heading_rad if isinstance(body.plant, Unicycle) else 0.0 for body in world.bodies[:n]
        ])  # fmt: skip
        self._rows = int(1.3 * len(ticks)) + 400
        sampling_s = [control.period_s, 0.0]
        self._meta: dict[str, Any] = {
            "zeta_m": float(zeta),
            "controllers": {
                "ugv_controller": of_ugvs(self._near.ugvs, self._law, r, sampling_s),
                "uav_controller": read_back(self._near.uav, self._avoidance, r, sampling_s),
            },
            "decision_block": "",
        }

    def simulate(self, seed: int | None = None) -> Trace:
        """The trace of the run with a seed, by default the scenario's.

        Raises:
            SimulationError: if planner or gatekeeper stop the run; names it and the time.
            LeftToDrakeError: if the run ends in another error.
        """
        started, seed = time.perf_counter(), self._scenario.seed if seed is None else seed
        try:
            log, memory, state = self._simulated(seed)
        finally:
            self._planner.database.close()
        logged = {
            "bodies": log.bodies, "team_command": log.command, "reference": log.reference, "noise": log.noise,
            "decision_variable": log.x, "status": log.status, "executing": log.executing,
        }  # fmt: skip
        if self._team.turns:
            logged |= {"plant_signals": log.signals, "command_share": log.share}
        done = Done(
            t=log.t,
            logged={name: rows.T for name, rows in logged.items()},
            memory=memory,
            decided=state.made,
            seed=seed,
            until_s=self._scenario.duration_s,
            wall_s=time.perf_counter() - started,
            meta=self._meta,
        )
        return trace_of(self._scenario, self._name, self._world, done, self._world.signals)

    def _simulated(self, seed: int) -> tuple[Log, PlannerState, GatekeeperState]:
        """The rows of a run, and what planner and gatekeepers remember at its end."""
        n = len(self._headings)
        team = self._team._replace(draws=gaussians(seed, n, self._draws))
        state, log, around = self._start(), self._new_log(self._rows), self._near
        memory, answering = self._planner.start(), GatekeeperState.empty(n)
        executed: list[Proposal | None] = [None] * n
        accepted, first, until = _accepted(executed), True, self._scenario.duration_s
        while (code := loop.advance(team, around, accepted, state, log, until, first)) != loop.DONE:
            first = first and code != loop.PYTHON
            if code == loop.FULL:
                self._rows *= 2
                return self._simulated(seed)
            if code != loop.PYTHON:
                raise LeftToDrakeError("the run ends in an error")
            t = float(state.time[0])
            if team.watchful:
                around = Around(*(self._world.at(near, t) for near in self._near))
            try:
                memory, answering = self._updated(t, state, memory, answering)
            except (Exception, SystemExit) as error:  # as Drake reports it
                raise SimulationError(self._name, t, described(error)) from error
            proposals, answers = memory.proposals, self._answers(memory, answering)
            state = state._replace(known=answering.sensed) if answering.sensed is not state.known else state
            state.called[:] = state.status[::FIELDS] == INTERVENING
            state.time[3] = self._planner.asleep_until(memory, state.called.tolist())
            state.answers[0] = team.gated and (any(proposals) or any(answers[::2]))
            now = accepted_proposals(proposals, np.array(answers))
            if any(one is not other for one, other in zip(now, executed, strict=True)):
                executed, accepted = now, _accepted(now)
            state.counts[4] = 1
        rows = int(state.counts[1])
        return Log(*(column[:rows] for column in log)), memory, answering

    def _updated(
        self, t: float, state: State, memory: PlannerState, answering: GatekeeperState
    ) -> tuple[PlannerState, GatekeeperState]:
        """Planner and gatekeepers after the updates of an instant, which see what both remembered before."""
        due, places, world = int(state.counts[3]), state.place.copy(), self._world
        planned, judged = memory, answering
        if due & loop.PLAN:
            intervening = (state.status[::FIELDS] == INTERVENING).tolist()
            if t >= self._planner.asleep_until(memory, intervening):
                stands = standing(watched(state.halts, t, places.reshape(-1), self._team.room), t).tolist()
                answers = np.array(self._answers(memory, answering))
                planned = self._planner.plan(
                    memory, t, places[: len(world.robots)], intervening, answers, answering.reports, stands,
                    sightings(world, t, places),
                )  # fmt: skip
                planned = sent_after(memory, planned, t)
        gate = self._gatekeepers if due & loop.GATE else None
        if gate is not None and not gate.idle(t, memory.proposals, places, answering):
            period = float(self._team.numbers[0])
            headings = loop.headings_at(t, state, self._team.steering, period) if self._team.turns else None
            velocities = world.velocities(t, state.command.copy())
            judged = gate.sample(Inputs(t, memory.proposals, places, velocities, self._law, headings), answering)
        return planned, judged

    def _answers(self, memory: PlannerState, answering: GatekeeperState) -> Sequence[float]:
        """The answers in force, (2n,); without gatekeepers every proposal is accepted at once."""
        if self._gatekeepers is not None:
            return answering.answers
        return [number for p in memory.proposals for number in ((SILENT, -1.0) if p is None else (ACCEPT, p.number))]

    def _start(self) -> State:
        n, r, m = len(self._headings), len(self._world.robots), len(self._near.ugvs.still)
        due = int(self._team.due[0])
        return State(
            time=np.array([0.0, 0.0, 0.0, np.inf]),
            counts=np.array([1, 0, 0, due, 0], dtype=np.int64),
            called=np.zeros(n, dtype=np.bool_),
            answers=np.zeros(1, dtype=np.bool_),
            place=self._world.starts.copy(),
            noise=np.zeros(n),
            drawn=np.zeros(n),
            command=np.zeros((r, 3)),
            executing=np.full(n, NOTHING),
            share=np.ones(n),
            heading=self._headings.copy(),
            sampled=np.zeros(1),
            status=np.tile(NEW, n),
            halts=np.tile([0.0, 0.0, 0.0, NOT_WATCHED], n),
            begun=np.zeros(1 + 5 * n),
            now=np.zeros(1 + 5 * n),
            reference=np.zeros(6 * n),
            known=np.zeros((0, m), dtype=np.bool_),
        )

    def _new_log(self, rows: int) -> Log:
        n, r, moving = len(self._headings), len(self._world.robots), len(self._world.moving)
        signals = loop.SIGNALS * int((self._team.steering[:, 0] > 0.0).sum())
        widths = 3 * moving, 3 * r, 6 * n, n, n, FIELDS * n, n, signals, n * self._team.turns
        return Log(np.empty(rows), *(np.empty((rows, width)) for width in widths))


def _schedule(
    duration_s: float, control_s: float, noise_s: float, periods: dict[int, float]
) -> tuple[Array, loop.Ints]:
    """Times of all timed events, s, and what is due then: with Drake's own arithmetic, k times the period."""
    found: dict[float, int] = {}
    for bit, period in ((loop.CONTROL, control_s), (loop.NOISE, noise_s)):
        for k in range(int(duration_s / period) + 2):
            found[k * period] = found.get(k * period, 0) | bit
    for bit, period in periods.items():
        ticks = Ticks(period, control_s)
        for k in range(int(duration_s / ticks.period) + 2):
            t = k * ticks.period
            found[t] = found.get(t, 0) | (bit if ticks.due(t) else 0)
    times = sorted(found)
    return np.array(times), np.array([found[t] for t in times], dtype=np.int64)


def _holds(breaks: Array, places: Array) -> Array:
    """Value and slope of each piece of a first-order hold through (K, d) at (K,), s: (K - 1, d, 2)."""
    return np.stack([places[:-1], (places[1:] - places[:-1]) / (breaks[1:] - breaks[:-1])[:, None]], axis=2)


def _with_end(holds: Array) -> Array:
    """The same with a row that is not used: as many as breaks."""
    return np.concatenate([holds, np.zeros((1, *holds.shape[1:]))])


def _accepted(proposals: Sequence[Proposal | None]) -> Accepted:
    """The motions of accepted proposals, for the loop."""
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
