"""The reward: time that UGVs are away from their targets."""

from airground_drake.study.environments.episode import Episode


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
