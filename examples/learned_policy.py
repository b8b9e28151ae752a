"""A policy that is trained in the step-wise environment, and then proposes like any other.

    python learned_policy.py train      # by the cross-entropy method, on two processors; writes learned_policy.json
    python learned_policy.py compare    # with the policies that plan, on maps that it was not trained on

It scores directions by the free way in them, those beside them, and how they lead to the target. It proposes a way in
the best one, then a stretch in parallel to the line to the target, then the target. After a refusal it takes the next
best direction.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial
from pathlib import Path

import numpy as np

from airground_drake.environments.encoding import Encoding
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.policy import Observation, Policy

HERE = Path(__file__).parent
WEIGHTS = Path(__file__).with_suffix(".json")
CODE = Encoding(rays=24)
START = np.array([1.0, 0.0, 1.0, 0.0, 0.0, 0.0])
"""Weights before training: free ways that lead on."""
TRAINING, HELD_BACK = 1000, 0
"""First numbers of the draws for training, and of those for the comparison."""


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


class Untrained(Learned):
    """Proposes by the weights before training."""

    def __init__(self, *, speed_m_s: float) -> None:
        """Along the way, m/s."""
        self.speed, self.weights = speed_m_s, START


@cache
def environment():
    """The environment: one in each process."""
    from airground_drake.campaign.spec import load_spec
    from airground_drake.environments.gymnasium_env import InterventionEnv

    return InterventionEnv(load_spec(HERE / "learned.yaml"), encoding=CODE)


def returns(many: np.ndarray, number: int) -> list[float]:
    """Return of the episode on a draw for each of some weights, s; empty if nothing is asked for in it."""
    env, found = environment(), []
    for weights in many:
        seen, info = env.reset(options={"number": number})
        if "ugv" not in info:
            return []
        over, total = False, 0.0
        while not over:
            seen, reward, over, _, _ = env.step(act(weights, seen))
            total += reward
        found.append(total)
    return found


def train(rounds: int = 5, size: int = 12, maps: int = 14, seed: int = 1, jobs: int = 2) -> tuple[np.ndarray, list]:
    """The mean of the last round, (6,), and for each round the mean return, s, of START and of its mean on its maps."""
    rng, mean, spread, history = np.random.default_rng(seed), START, np.ones(len(START)), []
    with ProcessPoolExecutor(jobs) as pool:
        for k in range(rounds):
            drawn = mean + spread * rng.standard_normal((size, len(mean)))
            numbers = TRAINING + maps * k + np.arange(maps)
            every = pool.map(partial(returns, np.vstack([START, mean, drawn])), numbers.tolist())
            values = np.mean([row for row in every if row], axis=0)
            history.append((values[0], values[1]))
            print(f"round {k + 1}: before training {values[0]:.1f} s, now {values[1]:.1f} s", flush=True)
            best = np.argsort(-values[2:])[: size // 3]
            mean, spread = drawn[best].mean(axis=0), drawn[best].std(axis=0) + 0.1
    return mean, history


def outcome(number: int) -> dict[str, tuple]:
    """By run of a draw: whether it needed help and arrived, its arrival, s, its proposals, how many were accepted."""
    from airground_drake import judge, simulate
    from airground_drake.campaign.spec import load_spec
    from airground_drake.report.interventions import interventions

    scenario, found = load_spec(HERE / "learned.yaml").draw(number), {}
    for run in scenario.runs:
        trace = simulate(scenario, run)
        verdicts = {each.claim.id: each.status for each in judge(trace, ["SAFE-TRACE", "LIVE-GOAL"])}
        assert verdicts["SAFE-TRACE"] == "holds"
        arrivals = [event["t_s"] for event in trace.events if (event["kind"], event["robot"]) == ("arrival", "ugv1")]
        sent = interventions(trace)
        accepted = sum(each["accepted_s"] is not None for each in sent)
        arrived = verdicts["LIVE-GOAL"] == "holds"
        found[run] = arrived, arrivals[-1] if arrived else scenario.duration_s, len(sent), accepted
    return found


def compare(number: int, jobs: int = 2) -> str:
    """A table in Markdown: what became of the runs on maps of which the policy has seen none."""
    with ProcessPoolExecutor(jobs) as pool:
        every = list(pool.map(outcome, range(HELD_BACK, HELD_BACK + number)))
    lines = ["| run | arrived | mean time, s | proposals | accepted |", "| --- | --- | --- | --- | --- |"]
    for run in every[0]:
        arrived, times_s, sent, accepted = zip(*(each[run] for each in every), strict=True)
        lines.append(f"| {run} | {sum(arrived)} of {number} | {np.mean(times_s):.1f} | {sum(sent)} | {sum(accepted)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("train", "compare"))
    parser.add_argument("-n", type=int, default=40, help="maps of the comparison (default: 40)")
    given, began = parser.parse_args(), time.perf_counter()
    if given.what == "train":
        WEIGHTS.write_text(json.dumps(train()[0].round(4).tolist()) + "\n")
    else:
        print(compare(given.n))
    print(f"{time.perf_counter() - began:.0f} s")
