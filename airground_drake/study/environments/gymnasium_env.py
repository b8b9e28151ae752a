"""A Gymnasium environment: one agent proposes for all UGVs, one request after the other."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from airground_drake.study.environments.sources import needed

with needed():
    import gymnasium

from airground_drake.base.arrays import Array, Flags
from airground_drake.scenario.schema import Scenario
from airground_drake.study.campaign.spec import Spec
from airground_drake.study.environments.encoding import Encoding, Numbers
from airground_drake.study.environments.sources import Episodes, Rewards
from airground_drake.uav.policy import Observation

# For `gymnasium.make` and `make_vec`, once this module is imported; arguments as of `InterventionEnv`.
ID = "AirgroundDrake/Intervention-v0"


class InterventionEnv(Episodes, gymnasium.Env[Numbers, Numbers]):
    """The UAV's side of a run: each step answers one request for a proposal, and leads to the next request.

    Observation and action: see `Encoding`. Requests of one planning instant are answered one after the other, without
    time between them; what has been proposed to one UGV is in the observation of the next. A proposal is checked, sent,
    and judged by the UGV's gatekeeper as that of any policy.

    Reward: see `Rewards`, summed over the UGVs. `terminated` when all robots have been at their targets for 1 s, or
    when the scenario's time is over; the time is in the observation. `truncated` never. If nothing is asked for in a
    run, the first step ends it, with the reward 0. `info` has `number` (of the episode), `t_s`, and `ugv`, for which
    is asked.
    """

    metadata = {"render_modes": []}  # noqa: RUF012 - as Gymnasium has it

    def _prepare(self) -> None:
        self.observation_space = gymnasium.spaces.Box(self.encoding.low, self.encoding.high, dtype=np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (self.encoding.actions,), np.float32)
        self._seen: Observation | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Numbers, dict[str, Any]]:
        """Begin an episode, and go to its first request.

        Args:
            seed: of the numbers of this and later episodes.
            options: `number`: that of the episode, in place of a drawn one.

        Raises:
            ValueError: if the number is not a whole number from 0, or there are other options.
            ScenarioError: if the draw is not a valid scenario.
            SimulationError: if Drake or a system stops.
        """
        super().reset(seed=seed)
        episode = self._begin(self.np_random, options)
        self._look()
        self._rewards = Rewards(episode)  # of the time from the first request on
        return self._observed(), self._info()

    def step(self, action: Numbers) -> tuple[Numbers, float, bool, bool, dict[str, Any]]:
        """Answer the request, and go to the next one or to the end.

        Raises:
            ValueError: if the action is not finite numbers of the right shape.
            RuntimeError: before `reset`, or after the end of the episode.
            SimulationError: if Drake or a system stops.
        """
        episode = self._going_on()
        if self._seen is not None:
            episode.answer(self._seen.robot, self.encoding.motion(action, self._seen))
        self._look()
        reward = sum(self._rewards.since().values())
        self._over = self._seen is None
        return self._observed(), reward, self._over, False, self._info()

    def _look(self) -> None:
        """Go to the next request, and keep it."""
        self._seen = next(iter(self._begun().requests().values()), None)

    def _observed(self) -> Numbers:
        return self.encoding.nothing() if self._seen is None else self.encoding.observed(self._seen)

    def _info(self) -> dict[str, Any]:
        info = {"number": self._number, "t_s": self._begun().t}
        return info if self._seen is None else info | {"ugv": self._seen.robot}


class InterventionVectorEnv(gymnasium.vector.SyncVectorEnv):
    """Several `InterventionEnv` side by side in one process, whose arrays are stacked.

    An episode that is over is followed by another one at the next step, which ignores that action (`NEXT_STEP`). Models
    are shared unless the scenario has policies beside the agent's, which may remember something of their own.
    """

    def __init__(
        self,
        num_envs: int = 1,
        given: Scenario | Spec | None = None,
        run: str | None = None,
        numbers: Sequence[int] | None = None,
        encoding: Encoding | None = None,
    ) -> None:
        """The number of environments, and arguments as in `Episodes`; ValueError if it is not positive."""
        if num_envs < 1:
            raise ValueError(f"num_envs is {num_envs!r}; allowed: a whole number from 1")
        first = InterventionEnv(given, run, numbers, encoding)

        def another() -> InterventionEnv:
            return first.beside() if first.is_alone else InterventionEnv(given, run, numbers, encoding)

        super().__init__([lambda: first, *[another] * (num_envs - 1)])

    def step(self, actions: Numbers) -> tuple[Any, Array, Flags, Flags, dict[str, Any]]:
        """A step of each environment; ValueError, before any of them has made one, if an action is missing."""
        if len(actions) != self.num_envs:
            raise ValueError(f"{len(actions)} actions; wanted: {self.num_envs}")
        return super().step(actions)


gymnasium.register(
    id=ID,
    entry_point=f"{__name__}:{InterventionEnv.__name__}",
    vector_entry_point=f"{__name__}:{InterventionVectorEnv.__name__}",
)
