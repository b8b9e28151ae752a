"""Runs a model with Drake's Simulator and turns its log into a Trace."""

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from functools import cache
from typing import Any, Literal, get_args

import numpy as np
from pydrake.common import RandomGenerator
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem, System
from pydrake.systems.primitives import LogVectorOutput

from airground_drake.base.errors import SimulationError, UnknownNameError, described, raised_as
from airground_drake.base.registry import UGV_CONTROLLERS
from airground_drake.model.bodies.world import Body, World
from airground_drake.model.geometry import convex, outline
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.law.avoidance import Avoidance, Composition
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.model.plants.first_order import FirstOrder
from airground_drake.model.trigger.excursion import Corners, ranges
from airground_drake.scenario.load import load, own
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.batch.run import Batch, LeftToDrakeError
from airground_drake.sim.blocks.decision import ACCURACY, DecisionVariable
from airground_drake.sim.blocks.lifetime import untie
from airground_drake.sim.blocks.own_controller import ControllerFactory
from airground_drake.sim.blocks.plant import OwnPlant, code_of, declared, own_code
from airground_drake.sim.blocks.signals import inputs_of
from airground_drake.sim.components import GatekeepersFactory, make_gatekeepers
from airground_drake.sim.diagram import NO_PLANTS, DecisionFactory, Model, build_diagram, build_model, together
from airground_drake.sim.recording import Done, trace_of
from airground_drake.sim.trace import Trace
from airground_drake.uav.channel import Transit
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.answer import GatekeeperDecision
from airground_drake.ugv.outcome import Outlook, outcomes, way_left
from airground_drake.ugv.problem import Horizon, Problem, predicted_problem
from airground_drake.ugv.rollout import View
from airground_drake.ugv.routes.mixed_integer import MixedIntegerRoute

Engine = Literal["drake", "batch"]
ENGINES: tuple[Engine, ...] = get_args(Engine)
OWN_ACCURACY = 1e-6  # accuracy of integration where a robot has a user's plant: about this many metres in a step


class Recorder:
    """A model in a diagram that logs its outputs at every step, for runs with one or several seeds."""

    def __init__(
        self,
        scenario: Scenario,
        name: str,
        decision_block: DecisionFactory = DecisionVariable,
        observers: Sequence[LeafSystem] = (),
        *,
        plants: Mapping[str, OwnPlant] = NO_PLANTS,
        ugv_controller: ControllerFactory | None = None,
        make_gatekeepers: GatekeepersFactory = make_gatekeepers,
    ) -> None:
        """Build the model of a run of the scenario and its logger.

        `scenario` is valid and declares `plants` and `ugv_controller` (`sim.blocks.plant.declared`). These,
        `decision_block` and `observers` as in `simulate`, `make_gatekeepers` as in `build_model`; raises as `simulate`.
        """
        self._scenario, self._name = scenario, name
        if name not in self._scenario.runs:
            raise UnknownNameError("run", name, self._scenario.runs)
        self._run = self._scenario.runs[name]
        composition: Composition = self._run.composition  # type: ignore[assignment]
        self._own = own(self._scenario, name)
        self.model = build_model(
            self._own,
            self._run.method,
            composition,
            plants,
            decision_block=decision_block,
            ugv_controller=ugv_controller,
            disturbed=False,
            make_gatekeepers=make_gatekeepers,
        )
        self._own_plants = own_code(self._own, plants)
        self._own_code = dict(self._own_plants)
        if given := self._own.ugv_controller:
            make = ugv_controller or UGV_CONTROLLERS.load(given.kind, System)
            self._own_code["the UGVs"] = code_of(given.kind, make)
        if (block := type(self.model.decision_block)) is not DecisionVariable:
            self._own_code["the trigger"] = code_of(block.__qualname__, block)
        builder = DiagramBuilder()
        builder.AddSystem(self.model.diagram)
        ports = [self.model.diagram.GetOutputPort(name) for name in self.model.recorded]
        # One log for all: each costs a step 10 us.
        self._log = LogVectorOutput(together(builder, "recorded_signals", ports), builder)
        for observer in observers:
            builder.AddSystem(observer)
            for port in inputs_of(observer):
                builder.Connect(self.model.diagram.GetOutputPort(port.get_name()), port)
        self._root = builder.Build()
        self._root.set_name("recorded")
        untie(self._root)
        warm_up()

    def simulate(
        self,
        seed: int | None = None,
        duration: float | None = None,
        watch: Callable[[float], None] | None = None,
        speed: float = 0.0,
    ) -> Trace:
        """One run from the initial state.

        Args:
            seed: of the decision noise; default: the scenario's.
            duration: s; default: the scenario's.
            watch: is told the time, s, at every step.
            speed: simulated seconds per second at most; 0: no limit.

        Raises:
            SimulationError: if Drake or a system stops; names the run and the time.
        """
        started = time.perf_counter()
        try:
            simulator = self.begin(seed, watch, speed)
            self.advance(simulator, self._scenario.duration_s if duration is None else duration)
        finally:
            for planner in self.model.planners.values():
                planner.database.close()
        return self.trace(simulator, seed, time.perf_counter() - started)

    def begin(
        self, seed: int | None = None, watch: Callable[[float], None] | None = None, speed: float = 0.0
    ) -> Simulator:
        """A simulator of the run at its initial state; arguments and errors as of `simulate`."""
        context = self._root.CreateDefaultContext()
        self._root.SetRandomContext(context, RandomGenerator(self._scenario.seed if seed is None else seed))
        context.SetAccuracy(ACCURACY)
        simulator = Simulator(self._root, context)
        period = self._scenario.control.period_s
        # velocities are held between samples: Euler's method is exact for the straight motion of steered points
        config = SimulatorConfig(integration_scheme="explicit_euler", max_step_size=period, use_error_control=False)
        if self._own_plants:
            config.integration_scheme, config.use_error_control = "runge_kutta3", True
            config.accuracy = OWN_ACCURACY
        ApplySimulatorConfig(config, simulator)
        simulator.set_target_realtime_rate(speed)
        if watch is not None:
            simulator.set_monitor(lambda root: watch(root.get_time()))
        with self._reported(context):
            simulator.Initialize()
        return simulator

    def advance(self, simulator: Simulator, until: float) -> None:
        """Advance a simulator to a time, s; updates of that instant are still to be made; errors as of `simulate`."""
        with self._reported(simulator.get_context()):
            simulator.AdvanceTo(until)

    def _reported(self, context: Context) -> AbstractContextManager[None]:
        """Convert any error of Drake or a system in the body to a SimulationError."""
        return raised_as(lambda error: SimulationError(self._name, context.get_time(), self._what(error)))

    def _what(self, error: BaseException) -> str:
        """An error's message, with the name and line of a user's plant or controller."""
        own = self._own_code
        what = max((described(error, code.function) for code in own.values()), key=len, default=described(error))
        if not own or any(code.name in what for code in own.values()):
            return what
        return f"{what} (users' code: {', '.join(f'{code.name} of {robot}' for robot, code in own.items())})"

    def trace(self, simulator: Simulator, seed: int | None, wall: float = 0.0) -> Trace:
        """The trace of what a simulator has simulated: of a run that lasts until now.

        Args:
            simulator: from `begin`, advanced.
            seed: as given to `begin`.
            wall: duration by the clock, s.
        """
        context, model = simulator.get_context(), self.model
        log = self._log.FindLog(context)
        ends = np.cumsum([model.diagram.GetOutputPort(name).size() for name in model.recorded])
        decided: Sequence[GatekeeperDecision] = ()
        if (gatekeeper := model.gatekeeper) is not None:
            decided = gatekeeper.decisions(gatekeeper.GetMyContextFromRoot(context))
        done = Done(
            t=log.sample_times(),
            logged=dict(zip(model.recorded, np.split(log.data(), ends[:-1]), strict=True)),
            memories={
                uav: planner.memory(planner.GetMyContextFromRoot(context)) for uav, planner in model.planners.items()
            },
            decided=decided,
            seed=self._scenario.seed if seed is None else seed,
            until_s=context.get_time(),
            wall_s=wall,
            meta={
                **read_back(model, context),
                "decision_block": "" if (kind := type(model.decision_block)) is DecisionVariable else kind.__qualname__,
            },
            carried=carried_by(model, context),
        )
        return trace_of(self._scenario, self._name, model.world, done, model.signals, self._own_plants)


def carried_by(model: Model, root: Context) -> list[tuple[Transit, Sequence[float]]]:
    """Messages carried by each link of the channel, and times of reading, s; empty without a channel."""
    if model.links is None or model.answering is None:
        return []
    down, up = model.links
    there = down.now(down.GetMyContextFromRoot(root))
    desk = model.answering.desk(model.answering.GetMyContextFromRoot(root))
    return [(there.transit, desk.read_s), (up.now(up.GetMyContextFromRoot(root)), there.read_s)]


def read_back(model: Model, root: Context) -> dict[str, Any]:
    """Parameters in force in a Context, for `Trace.meta`: `zeta_m`, and `controllers` (see `controllers.read_back`)."""
    levels = model.trigger.levels(model.trigger.GetMyContextFromRoot(root))
    ran = {part.get_name(): part.parameters(part.GetMyContextFromRoot(root)) for part in model.controllers}
    return {"zeta_m": float(levels.zeta_m), "controllers": ran}


@cache
def warm_up() -> None:
    """Load the compiled kernels and the solver, once per process, so that no run's time includes loading."""
    ones, motion = np.ones((1, 3)), Motion(np.array([0.0, 1.0]), np.zeros((2, 3)))
    rows = outline.balls(ones)
    convex.news_within(rows, ones, 1.0, True, convex.within(rows, ones, 1.0, True))
    avoidance = Avoidance(gain=1.0, period=0.1)
    plant = FirstOrder()
    world = World((Body("a", "ugv", ones[0], plant=plant), Body("b", "uav", ones[0], plant=plant)), {})
    near = world.around(slice(0, 1))
    avoidance.command(ones, world.starts, near)
    seen = View(0.0, ones[0], motion, rows, rows, ones, ones, np.ones(2), np.ones(2), 1.0, (None,))
    law, horizon = UgvLaw(avoidance, 1.0, 1.0, False), Horizon(2, 1, 1.0, 1.0)
    law.velocity(world.starts, near, ones, ones, [None])
    MixedIntegerRoute().solve(predicted_problem(seen, law, Proposal("", 0.0, motion), horizon))
    outcomes(seen, law, Proposal("", 0.0, motion), Outlook(longest=1.0))
    simulator = Simulator(build_diagram(load("minimal"), "a"))
    simulator.get_mutable_context().SetAccuracy(ACCURACY)
    simulator.AdvanceTo(0.1)


def warm_up_beside() -> None:
    """Compile the functions that need no law, in a parallel process: this halves the wait for the first run."""
    here, there = np.zeros(3), np.array([2.0, 0.0, 0.0])
    way_left(here, there, outline.balls(0.5 * there[None]), np.ones(1))
    ways = np.ones((2, 3))
    MixedIntegerRoute().solve(Problem(1.0, here, ways, -ways, ways, np.ones((2, 1, 3)), np.ones(1), 1.0, 1.0))
    ranges(np.zeros(6), np.ones(6), Corners.of([Motion(np.array([0.0, 1.0]), ways)]))


def simulate(
    scenario: Scenario,
    run: str,
    seed: int | None = None,
    watch: Callable[[float], None] | None = None,
    decision_block: DecisionFactory = DecisionVariable,
    observers: Sequence[LeafSystem] = (),
    speed: float = 0.0,
    plants: Mapping[str, OwnPlant] = NO_PLANTS,
    ugv_controller: ControllerFactory | None = None,
    engine: Engine = "drake",
) -> Trace:
    """Simulate one run of a scenario.

    Args:
        scenario: from a file or made in Python.
        run: name of one of its runs.
        seed: of the decision noise, in place of the scenario's.
        watch: is told the time, s, at every step, by the loop at the end only.
        decision_block: makes the block that drives the trigger; see `build_diagram`.
        observers: systems that watch the run, such as `report.view.live_view.LiveView`: their input ports have the
            names of the model's output ports, and each has a name of its own. The run does not see them.
        speed: simulated seconds per second at most, for watching; 0: no limit.
        plants: plants of your own, by robot, in place of those of the scenario: as if the scenario named them
            (`plant.kind`).
        ugv_controller: makes a controller of your own for all UGVs, as if the scenario named it; see `build_diagram`.
        engine: 'drake' is Drake's Simulator; 'batch' makes the same trace, bit by bit, in a compiled loop, several
            times faster. What the loop cannot make (see docs/commands.md) Drake makes, and a line on stderr says why.

    Raises:
        ScenarioError: if the scenario, or the seed, is not valid.
        UnknownNameError: if it has no such run, or there is no such engine.
        PluginError: if it names a policy, route, task, plant or controller that cannot be made, or the decision block
            or the controller has other ports.
        SimulationError: if Drake or a system stops; names the run and the time.
    """
    if engine not in ENGINES:
        raise UnknownNameError("engine", engine, ENGINES)
    valid = declared(scenario, plants, ugv_controller, seed)
    if engine == "batch" and run in valid.runs:
        try:
            if decision_block is not DecisionVariable or observers or speed:
                raise LeftToDrakeError("a decision block of your own, observers or a speed")
            trace = Batch(valid, run).simulate()
            if watch is not None:
                watch(valid.duration_s)
            return trace
        except LeftToDrakeError as error:
            print(f"note: Drake's Simulator makes run {run}, not the compiled loop: it has {error}", file=sys.stderr)
    recorder = Recorder(valid, run, decision_block, observers, plants=plants, ugv_controller=ugv_controller)
    return recorder.simulate(watch=watch, speed=speed)
