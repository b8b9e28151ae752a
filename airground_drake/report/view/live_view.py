"""A system that shows the robots in Meshcat while they are simulated."""

from pydrake.common.value import Value
from pydrake.geometry import Meshcat
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.framework import Context, LeafSystem, ValueProducer

from airground_drake.base.arrays import Array
from airground_drake.model.bodies.kinds import ROBOTS
from airground_drake.model.plants.plant import PLACE
from airground_drake.model.trigger.automaton import FIELDS
from airground_drake.report.view.draw import barrier_path, draw, robot_path, shadow_path, state_path
from airground_drake.report.view.stage import STATES, stage, states_of
from airground_drake.scenario.schema import Scenario
from airground_drake.scenario.world import make_world
from airground_drake.sim.blocks.lifetime import weakly
from airground_drake.sim.blocks.signals import declare_bodies


class LiveView(LeafSystem):
    """Draws a scenario in a Meshcat, and moves its bodies there as the simulation goes on.

    Input ports (n UGVs, M moving bodies), named like the output ports that they belong to: `bodies` (3M), m;
    `status` (4n), of the event trigger; `executing` (n), see `UgvController`; `plant_signals`, if there are any, see
    `World.signals`.

    It publishes at the ends of the simulator's steps, at most FRAMES_PER_S times per second of simulated time. It adds
    no step, so it does not change the run. `meshcat.StartRecording()` records the motion.
    """

    FRAMES_PER_S = 30.0

    def __init__(self, meshcat: Meshcat, scenario: Scenario) -> None:
        super().__init__()
        self.set_name("live_view")
        world = make_world(scenario)
        n, self._uavs = len(scenario.ugvs), world.select("uav")
        self._meshcat, self._robots = meshcat, world.select(*ROBOTS)
        self._bodies = declare_bodies(self, world)
        self._status = self.DeclareVectorInputPort("status", FIELDS * n)
        self._executing = self.DeclareVectorInputPort("executing", n)
        self._signals = None
        if world.signals:
            self._signals = self.DeclareVectorInputPort("plant_signals", len(world.signals))
        self._names, self._of = world.robots, {name: k for k, name in enumerate(world.signals)}
        nothing = ValueProducer(allocate=lambda: Value([]), calc=ValueProducer.NoopCalc)
        self._shown = self.DeclareCacheEntry("shown at, s", nothing, {self.nothing_ticket()}).cache_index()
        self.DeclareInitializationPublishEvent(weakly(self._publish))
        self.DeclarePerStepPublishEvent(weakly(self._publish))
        meshcat.Delete("/robots")
        scene = stage(scenario)
        draw(meshcat, scene)
        rows = {body.name: row for row, body in enumerate(world.moving)}
        self._barriers = [
            (k, rows[barrier.name], barrier.way_m[0]) for k, barrier in enumerate(scene.barriers) if len(barrier.way_m)
        ]

    def _place(self, signals: Array, positions: Array, headings: list[float]) -> None:
        """Put the bodies of robots that are not where the law steers them in place of the steered points."""
        for k, robot in enumerate(self._names):
            if f"{robot}.{PLACE[0]}" in self._of:
                positions[k] = [signals[self._of[f"{robot}.{name}"]] for name in PLACE]
            if f"{robot}.heading_rad" in self._of:
                headings[k] = float(signals[self._of[f"{robot}.heading_rad"]])

    def _publish(self, context: Context) -> None:
        t, entry = context.get_time(), self.get_cache_entry(self._shown)
        shown: list[float] = entry.get_mutable_cache_entry_value(context).GetMutableValueOrThrow()
        if shown and shown[0] <= t < shown[0] + 1.0 / self.FRAMES_PER_S - 1e-9:
            return
        shown[:] = [t]
        positions, headings = self._bodies.Eval(context).reshape(-1, 3).copy(), [0.0] * len(self._names)
        if self._signals is not None:
            self._place(self._signals.Eval(context), positions, headings)
        modes, executing = self._status.Eval(context)[::FIELDS], self._executing.Eval(context)
        for k, position in enumerate(positions[self._robots]):
            place = RigidTransform(RollPitchYaw(0.0, 0.0, headings[k]), position)
            self._meshcat.SetTransform(robot_path(k), place, t)
        for k, above in enumerate(positions[self._uavs], start=self._uavs.start):
            self._meshcat.SetTransform(shadow_path(k), RigidTransform(above * [1.0, 1.0, 0.0]), t)
        for k, row, start in self._barriers:
            self._meshcat.SetTransform(barrier_path(k), RigidTransform(positions[row] - start), t)
        for k, state in enumerate(states_of(executing, modes)):
            for mode in range(len(STATES)):
                self._meshcat.SetProperty(state_path(k, mode), "visible", bool(mode == state), t)
