"""A PettingZoo parallel environment with an agent for each UGV."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from airground_drake.study.environments.sources import needed

with needed():
    from gymnasium.spaces import Box
    from gymnasium.utils import seeding
    from pettingzoo import ParallelEnv

from airground_drake.study.environments.encoding import Numbers
from airground_drake.study.environments.sources import Episodes, Rewards
from airground_drake.uav.policy import Observation


class TeamEnv(Episodes, ParallelEnv[str, Numbers, Numbers]):
    """The UAV's side of a run, with an agent for each UGV; each step leads to the next instant with a request.

    Observation and action: see `Encoding`. The first number of an observation says whether a proposal for that UGV is
    asked for, and so does `asked` in its info. Actions of the other agents are ignored. Agents that are asked at the
    same instant do not see each other's proposals of this instant. All else is as in `InterventionEnv`; each agent has
    the reward of its UGV, and all agents stay until the end.
    """

    _ignored = ("options",)  # which PettingZoo's own API test gives
    metadata = {"name": "airground_drake_team_v0", "render_modes": []}  # noqa: RUF012 - as PettingZoo has it

    def _prepare(self) -> None:
        self.possible_agents = list(self._source.ugvs)
        self.agents: list[str] = []
        self.render_mode = None
        low, high = self.encoding.low, self.encoding.high
        self.observation_spaces = {name: Box(low, high, dtype=np.float32) for name in self.possible_agents}
        self.action_spaces = {
            name: Box(-1.0, 1.0, (self.encoding.actions,), np.float32) for name in self.possible_agents
        }
        self._rng = seeding.np_random(None)[0]
        self._requests: dict[str, Observation] = {}

    def observation_space(self, agent: str) -> Box:
        """The space of an agent, the same for all agents."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Box:
        """The space of an agent, the same for all agents."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Numbers], dict[str, dict[str, Any]]]:
        """Begin an episode, and go to its first request; arguments and errors as of `InterventionEnv.reset`."""
        if seed is not None:
            self._rng = seeding.np_random(seed)[0]
        episode = self._begin(self._rng, options)
        self.agents = list(episode.stage.ugvs)
        self._requests = episode.requests()
        self._rewards = Rewards(episode)
        return self._observed(self.agents), self._infos(self.agents)

    def step(
        self, actions: Mapping[str, Numbers]
    ) -> tuple[
        dict[str, Numbers], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]],
    ]:  # fmt: skip
        """Answer the requests of this instant, and go to the next instant with any, or to the end.

        Raises:
            ValueError: if an agent that is asked has no action, or not finite numbers of the right shape.
            RuntimeError: before `reset`, or after the end of the episode.
            SimulationError: if Drake or a system stops.
        """
        episode, agents = self._going_on(), self.agents
        if missing := [name for name in self._requests if name not in actions]:
            raise ValueError(f"no action for {', '.join(missing)}; asked for now: {', '.join(self._requests)}")
        motions = {name: self.encoding.motion(actions[name], seen) for name, seen in self._requests.items()}
        for name, motion in motions.items():
            episode.answer(name, motion)
        self._requests = episode.requests()
        rewards = self._rewards.since()
        over = self._over = not self._requests
        self.agents = [] if over else agents
        return (
            self._observed(agents), {name: rewards[name] for name in agents}, dict.fromkeys(agents, over),
            dict.fromkeys(agents, False), self._infos(agents),
        )  # fmt: skip

    def _observed(self, agents: Sequence[str]) -> dict[str, Numbers]:
        return {
            name: self.encoding.observed(self._requests[name]) if name in self._requests else self.encoding.nothing()
            for name in agents
        }

    def _infos(self, agents: Sequence[str]) -> dict[str, dict[str, Any]]:
        t_s = self._begun().t
        return {name: {"number": self._number, "t_s": t_s, "asked": name in self._requests} for name in agents}
