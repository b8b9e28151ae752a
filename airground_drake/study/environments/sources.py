"""The source of an environment's episodes: one scenario, or the draws of a campaign."""

import copy
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache, partial
from numbers import Integral
from typing import Any, Self

import numpy as np

from airground_drake.base.errors import ScenarioError, UnknownNameError
from airground_drake.base.limits import MAX_SEED
from airground_drake.base.registry import METHODS
from airground_drake.scenario.load import load, validated
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.study.campaign.spec import Spec
from airground_drake.study.environments.encoding import Encoding
from airground_drake.study.environments.episode import AGENT, Episode, Stage, with_agent


class Rewards:
    """Rewards of the UGVs of an episode.

    The reward of a UGV for a step is minus the time, s, for which it was away from its target since the request before.
    At the end of the run a UGV that is still away also loses the time, s, that the straight way left would take at the
    speed of its preset. Rewards ignore safety: `judge` says what is proved.
    """

    def __init__(self, episode: Episode) -> None:
        self._episode, self._before = episode, dict(episode.away_s)

    def since(self) -> dict[str, float]:
        """Rewards by UGV since the last call."""
        now, self._before = self._before, dict(self._episode.away_s)
        reward = {ugv: now[ugv] - away for ugv, away in self._before.items()}
        if self._episode.ended:
            scenario = self._episode.stage.scenario
            for ugv, left in zip(reward, self._episode.distances_left().tolist(), strict=False):
                if left > scenario.arrival_tolerance_m:
                    reward[ugv] -= left / scenario.ugvs[ugv].preset.speed_m_s
        return reward


DEFAULT = "minimal"
MOST_STAGES = 64  # models that are kept; one takes about 0.5 MB


class Source:
    """Makes episodes by number: with a scenario the number is the seed of the noise, with a campaign that of the draw.

    Attributes:
        is_alone: whether no policy beside the agent's is asked.
        ugvs: names of all UGVs that an episode may have.
        numbers: of the episodes that are drawn.
    """

    def __init__(self, given: Scenario | Spec, run: str | None = None, numbers: Sequence[int] | None = None) -> None:
        """Choose a run.

        Args:
            given: a scenario, or a campaign, whose draws have courses.
            run: default: the last one in which the UAV intervenes.
            numbers: default: all seeds or draws.

        Raises:
            ScenarioError: if the scenario is not valid, or no run of it has interventions.
            UnknownNameError: if it has no such run.
        """
        self._given = given if isinstance(given, Spec) else validated(given)
        self.numbers = range(MAX_SEED) if numbers is None else numbers
        first = self._given.draw(self.numbers[0]) if isinstance(self._given, Spec) else self._given
        self._run = _chosen(first, run)
        policies = with_agent(first, self._run).intervention.policies
        self.is_alone = [policy.name for policy in policies] == [AGENT]
        if isinstance(self._given, Spec):
            self._given = replace(self._given, runs=(self._run,))
        self.ugvs = tuple(first.ugvs)
        if isinstance(given, Spec) and given.course is not None:
            self.ugvs = given.course.names
        self._stage = lru_cache(MOST_STAGES)(partial(_stage, self._given, self._run))

    def drawn(self, rng: np.random.Generator) -> int:
        return int(self.numbers[int(rng.integers(len(self.numbers)))])

    def episode(self, number: int) -> Episode:
        """Begin an episode.

        Raises:
            ScenarioError: if the draw is not a valid scenario.
            SimulationError: if Drake or a system stops.
        """
        if not isinstance(self._given, Spec):
            return Episode(self._stage(0), number)
        return Episode(self._stage(number))


def _stage(given: Scenario | Spec, run: str, number: int) -> Stage:
    scenario = given.draw(number) if isinstance(given, Spec) else given
    return Stage(with_agent(scenario, run), run)


class Episodes:
    """Code shared by both environments: the present episode and its source.

    Attributes:
        encoding: of observations and actions.
    """

    _ignored: tuple[str, ...] = ()  # options of `reset` that are neither used nor refused

    def __init__(
        self,
        given: Scenario | Spec | None = None,
        run: str | None = None,
        numbers: Sequence[int] | None = None,
        encoding: Encoding | None = None,
    ) -> None:
        """Arguments and errors as of `Source`; the encoding is that of observations and actions.

        Without a scenario, it is the shipped one called `DEFAULT`.
        """
        self.encoding = Encoding() if encoding is None else encoding
        self._source = Source(load(DEFAULT) if given is None else given, run, numbers)
        self._episode: Episode | None = None
        self._over = False
        self._prepare()

    def _prepare(self) -> None:
        """Define the spaces of observations and actions."""

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Share the source and copy the rest, including the present episode; TypeError if Drake makes it."""
        copied = copy.copy(self)
        memo[id(self)] = copied
        for name, value in vars(self).items():
            if name not in ("_source", "encoding"):
                setattr(copied, name, copy.deepcopy(value, memo))
        return copied

    @property
    def is_alone(self) -> bool:
        """Whether the agent of the environment is the only policy of its episodes."""
        return self._source.is_alone

    def beside(self) -> Self:
        """Another environment with episodes of its own that shares the models of this one."""
        return copy.copy(self)

    def trace(self) -> Trace:
        """The trace of the episode until now, for `judge`.

        Raises:
            RuntimeError: before `reset`.
        """
        return self._begun().trace()

    def _begin(self, rng: np.random.Generator, options: Mapping[str, Any] | None) -> Episode:
        if unknown := [repr(name) for name in options or {} if name not in ("number", *self._ignored)]:
            raise ValueError(f"unknown options of reset: {', '.join(unknown)}; allowed: 'number'")
        number = (options or {}).get("number")
        if number is None:
            number = self._source.drawn(rng)
        if not isinstance(number, Integral) or int(number) not in range(MAX_SEED + 1):
            raise ValueError(f"number of the episode: {number!r}; allowed: a whole number from 0 to {MAX_SEED}")
        self._number = int(number)
        self._episode, self._over = self._source.episode(self._number), False
        return self._episode

    def _begun(self) -> Episode:
        if self._episode is None:
            raise RuntimeError("call reset first")
        return self._episode

    def _going_on(self) -> Episode:
        episode = self._begun()
        if self._over:
            raise RuntimeError("the episode is over: call reset")
        return episode


def _chosen(scenario: Scenario, run: str | None) -> str:
    having = [name for name, run in scenario.runs.items() if METHODS[run.method].intervenes]
    if run is None and having:
        return having[-1]
    if run is None:
        raise ScenarioError(scenario.name, "runs", list(scenario.runs), "wanted: a run of method b, c or d")
    if run not in having:
        raise UnknownNameError("run with interventions", run, having)
    return run


@contextmanager
def needed() -> Iterator[None]:
    """Convert an ImportError of the body to a message that names the missing extra."""
    try:
        yield
    except ModuleNotFoundError as error:
        hint = f"environments need the package {error.name}: pip install 'airground_drake[gym]'"
        raise ModuleNotFoundError(hint, name=error.name) from None
