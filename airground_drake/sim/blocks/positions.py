"""What UGVs know of each other's positions: announcements, receipts, own measurements, and controllers that use them.

Under the shared law a robot publishes at a control sample its position at the next one, so messages have a period to
arrive. If a UGV misses this sample's message of another UGV, it stands still, unless the other one is certainly far;
then it ignores it. Under the asynchronous law a UGV publishes its current position, and others act on the last received
position.
"""

import random
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem, System

from airground_drake.base.arrays import Array, Flags
from airground_drake.model.bodies.motion import SAME_S
from airground_drake.model.bodies.world import Neighbours, World
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.scenario.rounding import SPARE_S
from airground_drake.scenario.schema import Faults, Scenario
from airground_drake.sim.blocks.controllers import UgvController, asked_at
from airground_drake.sim.blocks.lifetime import declare_output, weakly
from airground_drake.sim.blocks.signals import declare_bodies
from airground_drake.uav.channel import lost
from airground_drake.uav.policy import Proposal

# fields of `Neighbours` with a row per robot
OF_ROBOTS = ("members", "others", "distance", "share", "mobility", "max_speed")


class Announcements(LeafSystem):
    """Positions that UGVs announced a control period ago: exact if they follow their commands.

    Ports (n UGVs, M bodies that move, world frame):
        in  `bodies` (3M) m; `ugv_command` (3n) m/s, held.
        out `announced` (3M) m; of bodies that are no UGVs, and before the second sample, where they are.
    State: discrete, the places at the last sample, (3M), and 1 once there was one.
    Rate: one update per control period, from t = 0.
    """

    def __init__(self, world: World, period: float, late: float = 0.0, seed: int = 1) -> None:
        """`late` is the share of samples, drawn by the seed, at which all have the announcements of a period before."""
        super().__init__()
        self._ugvs, self._period, size = world.select("ugv"), period, 3 * len(world.moving)
        self._late, self._seed = late, seed
        self._bodies = declare_bodies(self, world)
        self._command = self.DeclareVectorInputPort("ugv_command", 3 * len(world.names("ugv")))
        self.DeclareDiscreteState(size + 1)
        declare_output(self, "announced", size, type(self)._announced)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, weakly(self._update))

    def _announced(self, context: Context) -> Array:
        places: Array = self._bodies.Eval(context).reshape(-1, 3).copy()
        *last, begun = context.get_discrete_state(0).value()
        if begun:
            sample = int((context.get_time() + SAME_S) / self._period)
            on_time = random.Random(f"{self._seed}/late/{sample}").random() >= self._late
            led = on_time * self._period * self._command.Eval(context).reshape(-1, 3)
            places[self._ugvs] = np.reshape(last, (-1, 3))[self._ugvs] + led
        return places.ravel()

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        discrete.set_value(0, np.append(self._bodies.Eval(context), 1.0))


class Hearing(LeafSystem):
    """What UGVs have heard of each other's positions.

    Ports (n UGVs, M bodies that move, world frame):
        in  `bodies` (3M) m: what is published.
        out `heard_s` (n n), by receiver and sender: the control sample, s, of the last position that arrived;
            `last_places` (3 n n) m, that position.
    State: discrete, the same, and the positions (3n) of the last `late` samples, which are on their way.
    Rate: one update per control period, from t = 0.
    """

    def __init__(self, world: World, seed: int, loss: float, period: float, late: int = 0) -> None:
        super().__init__()
        self._ugvs, self._seed, self._loss, self._period = world.select("ugv"), seed, loss, period
        self._late = late
        self._bodies = declare_bodies(self, world)
        n = len(world.names("ugv"))
        self.DeclareDiscreteState(np.zeros(n * n))
        self.DeclareDiscreteState(np.tile(world.starts[self._ugvs], (n, 1)).ravel())
        self.DeclareDiscreteState(np.tile(world.starts[self._ugvs], (late, 1)).ravel())
        declare_output(self, "heard_s", n * n, lambda self, context: self._now(context)[0].ravel())
        declare_output(self, "last_places", 3 * n * n, lambda self, context: self._now(context)[1].ravel())
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, weakly(self._update))

    def _now(self, context: Context) -> tuple[Array, Array]:
        """Times, (n, n), s, and places, (n, n, 3), m, with the messages of this instant."""
        published = self._bodies.Eval(context).reshape(-1, 3)[self._ugvs]
        n, t = len(published), context.get_time()
        heard, places = (context.get_discrete_state(k).value().copy() for k in (0, 1))
        heard, places, sample = heard.reshape(n, n), places.reshape(n, n, 3), round(t / self._period)
        if abs(t - sample * self._period) <= SAME_S and sample >= self._late:
            arrived, own = ~lost(self._seed, self._loss, n, sample - self._late), np.eye(n, dtype=np.bool_)
            sent = context.get_discrete_state(2).value()[: 3 * n].reshape(n, 3) if self._late else published
            heard[arrived] = t - self._late * self._period
            places[arrived] = np.broadcast_to(sent, (n, n, 3))[arrived]
            heard[own], places[own] = t, published
        return heard, places

    def _update(self, context: Context, discrete: DiscreteValues) -> None:
        for k, now in enumerate(self._now(context)):
            discrete.set_value(k, now.ravel())
        if self._late:
            published = self._bodies.Eval(context).reshape(-1, 3)[self._ugvs]
            under_way = context.get_discrete_state(2).value()[published.size :]
            discrete.set_value(2, np.append(under_way, published))


class SeparateUgvController(UgvController):
    """A `UgvController` whose UGVs know different positions."""

    def _alone(
        self, i: int, known: Array, near: Neighbours, t: float, reference: Array, rate: Array,
        accepted: Sequence[Proposal | None], headings: Array | None, law: UgvLaw,
    ) -> Array:  # fmt: skip
        """The command of UGV i, (3,), m/s, from the positions that it knows, (M, 3), m, and its row of `near`."""
        row = slice(i, i + 1)
        near = near._replace(**{name: getattr(near, name)[row] for name in OF_ROBOTS})
        steering, motion = self._world.steering, accepted[i]
        steered = None if steering is None or headings is None else (headings[row], steering[row])
        asked = [None if motion is None else asked_at(motion, t)]
        velocity: Array = law.velocity(known, near, reference[row], rate[row], asked, steered)[0]
        return velocity


class ViewsUgvController(SeparateUgvController):
    """UGVs that measure each other: with the input ports `view_of_<ugv>` (3M) m for each UGV, see `PositionSensing`."""

    def __init__(self, world: World, law: UgvLaw, views: Sequence[str]) -> None:
        super().__init__(world, law)
        self._views = [self.DeclareVectorInputPort(view, 3 * len(world.moving)) for view in views]

    def _commanded(self, context: Context, t: float, positions: Array, *about: Any) -> Array:
        near, velocity = self._world.at(self._near, t), np.empty((len(self._views), 3))
        for i, view in enumerate(self._views):
            velocity[i] = self._alone(i, view.Eval(context).reshape(-1, 3), near, t, *about)
        return velocity


class HearingUgvController(SeparateUgvController):
    """A `UgvController` with the further input ports `heard_s` and `last_places`, see `Hearing`."""

    def __init__(self, world: World, law: UgvLaw) -> None:
        super().__init__(world, law)
        n = len(world.names("ugv"))
        self._heard = self.DeclareVectorInputPort("heard_s", n * n)
        self._last_places = self.DeclareVectorInputPort("last_places", 3 * n * n)


class AsynchronousUgvController(HearingUgvController):
    """UGVs that act on the last received positions of each other, by the asynchronous law."""

    def _commanded(self, context: Context, t: float, positions: Array, *about: Any) -> Array:
        near, n = self._world.at(self._near, t), len(self._near.members)
        heard = self._heard.Eval(context).reshape(n, n)
        last = self._last_places.Eval(context).reshape(n, n, 3)
        carried, velocity = near.carrier[near.others], np.empty((n, 3))
        share, still = near.share.copy(), near.share.shape[1] - near.others.shape[1]
        for i in range(n):
            known = positions.copy()
            known[near.members] = last[i]
            known[near.members[i]] = positions[near.members[i]]
            of_ugvs = np.flatnonzero(carried[i] < n)
            senders = carried[i, of_ugvs]
            unsure_s = t - heard[i, senders] + self.avoidance.period + SPARE_S
            share[i, still + of_ugvs] = -near.max_speed[senders] * unsure_s
            velocity[i] = self._alone(i, known, near._replace(share=share), t, *about)
        return velocity


class WaryUgvController(HearingUgvController):
    """UGVs that stand if they miss a message, or ignore UGVs that are certainly far."""

    def __init__(self, world: World, law: UgvLaw) -> None:
        super().__init__(world, law)
        n = len(world.names("ugv"))
        speed = np.array([body.max_speed_m_s for body in world.moving[:n]])
        error = np.array([body.bounds.error_m for body in world.moving[:n]])
        step = speed * law.avoidance.period + error
        self._speed, self._far = speed, _distances(self._near, n) + step[:, None] + step

    def _commanded(self, context: Context, t: float, positions: Array, *about: Any) -> Array:
        """The law's commands; UGVs that miss a message stand, or ignore UGVs that are certainly far."""
        velocity = super()._commanded(context, t, positions, *about)
        n = len(velocity)
        heard = self._heard.Eval(context).reshape(n, n)
        last = self._last_places.Eval(context).reshape(n, n, 3)
        unheard = heard < t - SAME_S
        apart = np.linalg.norm(positions[self._near.members][:, None] - last, axis=2)
        far = apart - self._speed * (t - heard) > self._far
        velocity[(unheard & ~far).any(axis=1)] = 0.0
        for i in np.flatnonzero(unheard.any(axis=1) & (far | ~unheard).all(axis=1)).tolist():
            velocity[i] = self._without(i, unheard[i], t, positions, *about)
        return velocity

    def _without(self, i: int, left_out: Flags, t: float, positions: Array, *about: Any) -> Array:
        """The law's command of UGV i, (3,), m/s, ignoring some UGVs."""
        known, members = positions.copy(), self._near.members
        known[members[left_out]] = known[members[i]] + [2.0 * self.avoidance.sensing_range, 0.0, 0.0]
        return self._alone(i, known, self._world.at(self._near, t), t, *about)


def _distances(near: Neighbours, n: int) -> Array:
    """The distances that the law keeps between n UGVs, (n, n), m."""
    others, still = near.carrier[near.others], near.distance.shape[1] - near.others.shape[1]
    kept = np.zeros((n, n))
    for i in range(n):
        of_ugvs = others[i] < n
        kept[i, others[i, of_ugvs]] = near.distance[i, still:][of_ugvs]
    return kept


class Between(NamedTuple):
    """The blocks between the positions of robots and the controller of the UGVs."""

    controller: UgvController
    parts: Mapping[str, LeafSystem]  # of the diagram, by name
    renamed: Mapping[System, Mapping[str, str]]  # what feeds their port `bodies`
    published: str  # name of the output port with the positions that robots act on
    seen: str  # and of that with those with which UAVs plan
    views: Mapping[str, str] = MappingProxyType({})  # and of those where robots that measure the others see them


def positions_between(scenario: Scenario, world: World, law: UgvLaw) -> Between:
    """The positions for the controllers: true or measured ones, sent over the links between UGVs if there are any."""
    if scenario.asynchronous and scenario.channel and scenario.ugv_links:
        seed, loss = scenario.channel.seed, scenario.ugv_links.loss
        hearing = Hearing(world, seed, loss, scenario.control.period_s, scenario.late_samples)
        return Between(AsynchronousUgvController(world, law), {"hearing": hearing}, {}, "bodies", "bodies")
    link, period = scenario.ugv_links, scenario.control.period_s
    published, seen = ("published", "seen_by_uav") if scenario.sensing else ("bodies", "bodies")
    parts, renamed = dict[str, LeafSystem](), dict[System, Mapping[str, str]]()
    if scenario.announces:
        late, seed = (scenario.faults or Faults()).late, scenario.channel.seed if scenario.channel else 1
        parts["announcements"] = Announcements(world, period, late, seed)
        renamed[parts["announcements"]], published = {"bodies": published}, "announced"
    if scenario.own_views:
        views = {robot: f"view_of_{robot}" for robot in world.robots}
        controller = ViewsUgvController(world, law, [views[ugv] for ugv in world.names("ugv")])
        return Between(controller, parts, renamed, published, seen, views)
    if not (scenario.channel and link and link.loss):
        return Between(UgvController(world, law), parts, renamed, published, seen)
    parts["hearing"] = Hearing(world, scenario.channel.seed, link.loss, period)
    renamed[parts["hearing"]] = {"bodies": published}
    return Between(WaryUgvController(world, law), parts, renamed, published, seen)
