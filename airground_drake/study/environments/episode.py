"""A run that stops at each request for a proposal until the request is answered."""

import copy
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, NoReturn, Self

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import SimulationError
from airground_drake.scenario.load import own
from airground_drake.scenario.schema import Policy, Scenario
from airground_drake.sim.batch.run import Batch, Going, LeftToDrakeError
from airground_drake.sim.blocks.ticks import Ticks
from airground_drake.sim.simulation import Recorder
from airground_drake.sim.trace import Trace
from airground_drake.uav.agent import Agent, Proposed
from airground_drake.uav.policy import Observation

AGENT = "agent"  # name of the policy that asks the agent of an environment
SETTLED_S = 1.0  # a run ends early when all robots have been at their targets for this long, s
ROUNDING = 1e-12  # relative rounding error of an instant at the end of a run


def with_agent(scenario: Scenario, run: str) -> Scenario:
    """A scenario of one run whose policies include `agent`; if they do not, it replaces them."""
    own_keys = own(scenario, run)
    policies = own_keys.intervention.policies
    if AGENT not in (policy.name for policy in policies):
        policies = [Policy(AGENT)]
    return replace(
        own_keys,
        intervention=replace(own_keys.intervention, policies=policies),
        runs={run: replace(own_keys.runs[run], set={})},
        reproduction=[],
        choices=[],
    )


class ByDrake:
    """A run in progress in Drake's Simulator, with the interface of `sim.batch.run.Going` for the compiled loop."""

    def __init__(self, recorder: Recorder, seed: int) -> None:
        self._recorder, self._seed = recorder, seed
        self._simulator = recorder.begin(seed)

    def __deepcopy__(self, memo: dict[int, Any]) -> NoReturn:
        wanted = "make a second environment and reset it with the same number: its episodes are the same"
        raise TypeError(f"this episode cannot be copied: its model is a Drake diagram; {wanted}")

    @property
    def t(self) -> float:
        """Time of the run, s."""
        return float(self._simulator.get_context().get_time())

    def positions(self) -> Array:
        """Positions of all r robots, UAVs last, (r, 3), m."""
        model = self._recorder.model
        port = model.diagram.GetOutputPort("bodies")
        bodies: Array = port.Eval(model.diagram.GetMyContextFromRoot(self._simulator.get_context()))
        return bodies.reshape(-1, 3)[: len(model.world.robots)]

    def plan_ahead(self) -> None:
        """Plan for this instant before its updates, which then use this result; the last call counts."""
        for planner in self._recorder.model.planners.values():
            planner.plan_ahead(planner.GetMyContextFromRoot(self._simulator.get_context()))

    def advance(self, until: float) -> None:
        """Advance to a time, s, before the updates of that instant."""
        self._recorder.advance(self._simulator, until)

    def trace(self) -> Trace:
        return self._recorder.trace(self._simulator, self._seed)


class Stage:
    """The model of one run, built once, for any number of episodes."""

    def __init__(self, scenario: Scenario, run: str) -> None:
        """Build the compiled loop, or Drake's diagram for what the loop cannot make; the scenario has an agent."""
        self.scenario, self.run = scenario, run
        self.begin: Callable[[int], Going | ByDrake]  # a run with a seed, at its initial state
        try:
            batch = Batch(scenario, run)
            self.begin, self.databases = batch.begin, [batch.database]
        except LeftToDrakeError:
            recorder = Recorder(scenario, run)
            self.begin = partial(ByDrake, recorder)
            self.databases = [planner.database for planner in recorder.model.planners.values()]
        policies = [policy for database in self.databases for _, policy in database.policies]
        self.agents = [policy for policy in policies if isinstance(policy, Agent)]  # one per UAV
        self.targets = np.array([robot.target_m for robot in scenario.robots.values()])
        self.ugvs = tuple(scenario.ugvs)
        self.instant = Ticks(scenario.intervention.period_s, scenario.control.period_s).instant


class Episode:
    """One run in steps; each leads to the next planning instant at which the policy `agent` is asked.

    `copy.deepcopy` copies an episode, for a search over what to propose, unless Drake makes it.
    """

    def __init__(self, stage: Stage, seed: int | None = None) -> None:
        # With policies that remember in themselves, a later episode on a stage ends this one.
        self.stage = stage
        self.seed = stage.scenario.seed if seed is None else seed
        self.ended = False
        self.away_s = dict.fromkeys(stage.ugvs, 0.0)  # time away from the target, counted at planning instants
        self._chosen: dict[str, Proposed] = {}
        self._requests: dict[str, Observation] = {}
        self._run = stage.begin(self.seed)
        self._instant, self._settled_s, self._end = 0, 0.0, stage.scenario.duration_s

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Share the stage, and copy the run; TypeError if Drake makes it."""
        copied = copy.copy(self)
        copied._run = copy.deepcopy(self._run, memo)
        copied.away_s, copied._chosen, copied._requests = {**self.away_s}, {**self._chosen}, {**self._requests}
        return copied

    @property
    def t(self) -> float:
        """Time of the run, s."""
        return self._run.t

    def positions(self) -> Array:
        """Positions of all r robots, UAVs last, (r, 3), m."""
        return self._run.positions()

    def distances_left(self) -> Array:
        """Distances of all r robots from their targets, UAVs last, (r,), m."""
        return np.asarray(np.linalg.norm(self.positions() - self.stage.targets, axis=1))

    def requests(self) -> dict[str, Observation]:
        """The requests of the next planning instant that has any, by UGV; empty at the end of the run."""
        # The instant stays the same until all requests have an answer. An answer may lead to another request.
        while not self.ended:
            self._ask()
            if self._requests:
                return dict(self._requests)
            self._advance()
        return {}

    def answer(self, robot: str, proposed: Proposed) -> None:
        """Answer the request for a UGV; what is proposed is checked and sent as of any policy."""
        if robot not in self._requests:
            asked = ", ".join(self._requests or ["none"])
            raise ValueError(f"no proposal for {robot} is asked for now; asked for: {asked}")
        del self._requests[robot]
        self._chosen[robot] = proposed

    def trace(self) -> Trace:
        return self._run.trace()

    def _ask(self) -> None:
        """Plan for this instant to collect the requests, without changing the run."""
        for agent in self.stage.agents:
            agent.chosen, agent.requests = self._chosen, {}
        self._run.plan_ahead()
        self._requests = {ugv: seen for agent in self.stage.agents for ugv, seen in agent.requests.items()}

    def _advance(self) -> None:
        """Go to the next planning instant or to the end of the run."""
        before = self.t
        self._instant += 1
        until = self.stage.instant(self._instant)
        until = self._end if until >= self._end * (1.0 - ROUNDING) else until
        for agent in self.stage.agents:
            agent.chosen = self._chosen
        try:
            self._run.advance(until)
        except LeftToDrakeError as error:
            raise SimulationError(self.stage.run, self.t, str(error)) from error
        self._chosen, self._requests = {}, {}
        away = self.distances_left() > self.stage.scenario.arrival_tolerance_m
        for ugv, far in zip(self.stage.ugvs, away[: len(self.stage.ugvs)], strict=True):
            self.away_s[ugv] += (until - before) * float(far)
        self._settled_s = 0.0 if away.any() else self._settled_s + until - before
        self.ended = until >= self._end or self._settled_s >= SETTLED_S
        if self.ended:
            for database in self.stage.databases:
                database.close()
