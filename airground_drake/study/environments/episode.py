"""A run that stops at each request for a proposal, until it is given one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydrake.systems.analysis import Simulator

from airground_drake.base.arrays import Array
from airground_drake.scenario.load import own
from airground_drake.scenario.schema import Policy, Scenario
from airground_drake.sim.simulation import Recorder
from airground_drake.sim.trace import Trace
from airground_drake.uav.agent import Agent, Proposed
from airground_drake.uav.policy import Observation

AGENT = "agent"  # name of the policy that asks the agent of an environment
SETTLED_S = 1.0  # a run ends early when all robots have been at their targets for this long, s
ROUNDING = 1e-12  # relative difference by which an instant may miss the end of a run through rounding


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


class Stage:
    """The model of one run, built once, for any number of episodes."""

    def __init__(self, scenario: Scenario, run: str) -> None:
        """Build the model.

        Args:
            scenario: from `with_agent`.
            run: name of its run.

        Raises:
            PluginError: if it names a policy, route, task or plant that cannot be made.
        """
        self.scenario, self.run = scenario, run
        self.recorder = Recorder(scenario, run)
        policies = self.recorder.model.planner.database.policies
        self.agent: Agent = next(policy for _, policy in policies if isinstance(policy, Agent))
        self.targets = np.array([robot.target_m for robot in scenario.robots.values()])
        self.ugvs = tuple(scenario.ugvs)


class Episode:
    """One run in steps; each leads to the next planning instant at which the policy `agent` is asked.

    Attributes:
        stage: the model.
        seed: of the decision noise.
        ended: whether the run is over.
        away_s: by UGV, for how long it has been away from its target, s, counted at planning instants.
    """

    def __init__(self, stage: Stage, seed: int | None = None) -> None:
        """Begin a run.

        Args:
            stage: the model; a later episode on it ends this one.
            seed: of the decision noise; default: the scenario's.

        Raises:
            SimulationError: if Drake or a system stops.
        """
        self.stage = stage
        self.seed = stage.scenario.seed if seed is None else seed
        self.ended = False
        self.away_s = dict.fromkeys(stage.ugvs, 0.0)
        stage.agent.chosen, stage.agent.requests = {}, {}
        self._simulator: Simulator = stage.recorder.begin(self.seed)
        self._instant, self._settled_s, self._end = 0, 0.0, stage.scenario.duration_s

    @property
    def t(self) -> float:
        """Time of the run, s."""
        return float(self._simulator.get_context().get_time())

    def positions(self) -> Array:
        """Positions of all robots, UAV last, (n + 1, 3), m."""
        model = self.stage.recorder.model
        port = model.diagram.GetOutputPort("bodies")
        bodies: Array = port.Eval(model.diagram.GetMyContextFromRoot(self._simulator.get_context()))
        return bodies.reshape(-1, 3)[: len(self.stage.targets)]

    def distances_left(self) -> Array:
        """Distances of all robots from their targets, UAV last, (n + 1,), m."""
        return np.asarray(np.linalg.norm(self.positions() - self.stage.targets, axis=1))

    def requests(self) -> dict[str, Observation]:
        """The requests of the next planning instant that has any, by UGV; empty at the end of the run.

        The instant stays the same until all requests have an answer. An answer may lead to another request.

        Raises:
            SimulationError: if Drake or a system stops.
        """
        while not self.ended:
            self._ask()
            if self.stage.agent.requests:
                return dict(self.stage.agent.requests)
            self._advance()
        return {}

    def answer(self, robot: str, proposed: Proposed) -> None:
        """Answer the request for a UGV; what is proposed is checked and sent as of any policy.

        Raises:
            ValueError: if there is no such request.
        """
        if robot not in self.stage.agent.requests:
            raise ValueError(f"no proposal for {robot} is asked for now; asked for: {', '.join(self._asked)}")
        del self.stage.agent.requests[robot]
        self.stage.agent.chosen[robot] = proposed

    def trace(self) -> Trace:
        """The trace of the run until now; its scenario has this time as its duration."""
        return self.stage.recorder.trace(self._simulator, self.seed)

    @property
    def _asked(self) -> list[str]:
        return list(self.stage.agent.requests) or ["none"]

    def _ask(self) -> None:
        """Let the planner plan for this instant, to find out what it asks for; the run does not change."""
        planner = self.stage.recorder.model.planner
        self.stage.agent.requests = {}
        planner.plan_ahead(planner.GetMyContextFromRoot(self._simulator.get_context()))

    def _advance(self) -> None:
        """Go to the next planning instant or to the end of the run."""
        before, planner = self.t, self.stage.recorder.model.planner
        self._instant += 1
        until = planner.instant(self._instant)
        until = self._end if until >= self._end * (1.0 - ROUNDING) else until
        self.stage.recorder.advance(self._simulator, until)
        self.stage.agent.chosen, self.stage.agent.requests = {}, {}
        away = self.distances_left() > self.stage.scenario.arrival_tolerance_m
        for ugv, far in zip(self.stage.ugvs, away[:-1], strict=True):
            self.away_s[ugv] += (until - before) * float(far)
        self._settled_s = 0.0 if away.any() else self._settled_s + until - before
        self.ended = until >= self._end or self._settled_s >= SETTLED_S
        if self.ended:
            planner.close()
