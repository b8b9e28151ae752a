"""A policy that is trained in the step-wise environment, and then proposes like any other.

`python learned_policy.py` trains it by the cross-entropy method, and writes learned_policy.json. It scores directions
by the free way in them, those beside them, and how they lead to the target. It proposes a way in the best one, then a
stretch in parallel to the line to the target, then the target. After a refusal it proposes the next best.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from airground_drake.environments.encoding import Encoding
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.policy import Observation, Policy

HERE = Path(__file__).parent
WEIGHTS = Path(__file__).with_suffix(".json")
CODE = Encoding(rays=24)
START = np.array([1.0, 0.0, 1.0, 0.0, 0.0, 0.0])
"""Before training: free ways that lead on."""


def act(weights: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """An action of the environment, for an observation of it."""
    refusals, left, free = int(seen[2]), seen[3], seen[4 : 4 + CODE.rays].astype(float)
    turns = 2.0 * np.pi * np.arange(CODE.rays) / CODE.rays
    beside = np.minimum(np.roll(free, 1), np.roll(free, -1))
    score = np.column_stack([free, beside, free * np.cos(turns), left * np.cos(turns)]) @ weights[:4]
    best = np.argsort(-score)[min(refusals, CODE.rays - 1)]
    share, along = 1.0 / (1.0 + np.exp(-weights[4:]))
    corner = share * free[best] * np.array([np.cos(turns[best]), np.sin(turns[best])])
    beyond = corner + [along * max(0.0, left - corner[0]), 0.0]
    return np.concatenate([[1.0], corner, beyond]) / [1.0, *[CODE.reach_m] * 4]


class Learned(Policy):
    """Proposes what was learnt."""

    def __init__(self, *, speed_m_s: float) -> None:
        """Along the way, m/s."""
        self.speed, self.weights = speed_m_s, np.array(json.loads(WEIGHTS.read_text()))

    def propose(self, seen: Observation) -> Motion | None:
        return CODE.motion(act(self.weights, CODE.observed(seen)), seen, self.speed)


def train(rounds: int = 4, size: int = 8, courses: int = 6, seed: int = 1) -> tuple[np.ndarray, list[float]]:
    """The mean of the last round (6,), and the mean return, s, of the best quarter of each round."""
    from airground_drake.campaign.spec import load_spec
    from airground_drake.environments.gymnasium_env import InterventionEnv

    env = InterventionEnv(load_spec(HERE / "learned.yaml"), encoding=CODE)
    stuck = (number for number in range(1000, 2000) if "ugv" in env.reset(options={"number": number})[1])
    numbers = [next(stuck) for _ in range(courses)]

    def value(weights: np.ndarray) -> float:
        total = 0.0
        for number in numbers:
            seen, _ = env.reset(options={"number": number})
            over = False
            while not over:
                seen, reward, over, _, _ = env.step(act(weights, seen))
                total += reward
        return total / courses

    rng, mean, spread, history = np.random.default_rng(seed), START, np.ones(len(START)), []
    for _ in range(rounds):
        drawn = mean + spread * rng.standard_normal((size, len(mean)))
        values = np.array([value(each) for each in drawn])
        best = np.argsort(-values)[: size // 4]
        mean, spread = drawn[best].mean(axis=0), drawn[best].std(axis=0) + 0.05
        history.append(float(values[best].mean()))
        print(f"round {len(history)}: {history[-1]:.2f} s")
    return mean, history


if __name__ == "__main__":
    weights, _ = train()
    WEIGHTS.write_text(json.dumps(weights.round(4).tolist()) + "\n")
