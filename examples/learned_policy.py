"""A policy that is trained in the step-wise environment, and then proposes like any other.

    python learned_policy.py train      # by CMA-ES, on two processors; writes learned_policy.json
    python learned_policy.py compare    # with the policies that plan, on maps that it was not trained on

For each request it looks at 512 ways to the target with two corners each, and proposes the one with the best score,
which is linear in what it sees of the way. After a refusal it proposes a way in another direction.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial
from pathlib import Path

import cma
import numpy as np

from airground_drake import Motion, Observation, Policy
from airground_drake.study.environments.encoding import Encoding

HERE = Path(__file__).parent
WEIGHTS = Path(__file__).with_suffix(".json")
CODE = Encoding(rays=32)
SHARES = np.array([0.25, 0.5, 0.75, 1.0])
"""Where the first corner is on a free way: shares of its length."""
ONWARD = np.array([0.0, 0.25, 0.5, 0.75])
"""Where the second corner is: shares of the way left, in parallel to the line to the target."""
START = np.array([0.0, 1.0, -1.0, 0.0, 0.0, 0.0])
"""Weights before training: ways that are seen to be free for long, and end near the target."""
TRAINING, HELD_BACK = 1000, 0
"""First numbers of the draws for training, and of those for the comparison."""


def ways(seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The two corners of each way, (W, 2, 2), m, in the UGV's frame, and its features, (W, 5), in units of 10 m.

    The features: length up to the first corner; length beyond it that is seen to be free; length that is not; how much
    farther the directions beside are free; distance of the first corner from the line to the target.
    """
    left, free = float(seen[3]), seen[4 : 4 + CODE.rays].astype(float)
    grid = np.meshgrid(np.arange(CODE.rays), SHARES, ONWARD, indexing="ij")
    ray, share, onward = (each.ravel() for each in grid)
    turns, length = 2.0 * np.pi * ray / CODE.rays, share * free[ray]
    first = length[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])
    second = first + np.outer(onward * np.maximum(0.0, left - first[:, 0]), [1.0, 0.0])
    target = np.broadcast_to([left, 0.0], first.shape)
    middle, last = np.hypot(*(second - first).T), np.hypot(*(target - second).T)
    share_of_middle = seen_share(free, first, second)
    known = share_of_middle * middle + (share_of_middle == 1.0) * seen_share(free, second, target) * last
    beside = np.clip(np.minimum(np.roll(free, 1), np.roll(free, -1))[ray] - length, -2.0, 2.0)
    features = np.column_stack([length, known, middle + last - known, beside, np.abs(first[:, 1])])
    return np.stack([first, second], axis=1), features / CODE.reach_m


def seen_share(free: np.ndarray, begins: np.ndarray, ends: np.ndarray, steps: int = 12) -> np.ndarray:
    """The share, from its beginning, of each straight stretch that lies within the free ways, (W,)."""
    along = np.linspace(0.0, 1.0, steps + 1)[1:]
    places = begins[:, None] + along[:, None] * (ends - begins)[:, None]
    between = np.arctan2(places[..., 1], places[..., 0]) / (2.0 * np.pi) * CODE.rays
    left = np.floor(between).astype(int)
    depth = np.minimum(free[left % CODE.rays], free[(left + 1) % CODE.rays])
    inside = np.hypot(places[..., 0], places[..., 1]) <= depth
    return np.cumprod(inside, axis=1).sum(axis=1) / steps


def act(weights: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """An action of the environment, for an observation of it."""
    corners, features = ways(seen)
    scores = (features @ weights[:5]).reshape(CODE.rays, -1)
    refusals, stride = int(seen[2]), 1.0 + 3.0 / (1.0 + np.exp(-weights[5]))
    ray = np.argsort(-scores.max(axis=1), kind="stable")[min(round(stride * refusals), CODE.rays - 1)]
    best = corners.reshape(CODE.rays, -1, 2, 2)[ray, scores[ray].argmax()]
    return np.clip(np.append(1.0, best.ravel() / CODE.reach_m), -1.0, 1.0)


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
    from airground_drake.study.campaign.spec import load_spec
    from airground_drake.study.environments.gymnasium_env import InterventionEnv

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


def train(rounds: int = 8, size: int = 12, maps: int = 18, seed: int = 1, jobs: int = 2) -> tuple[np.ndarray, list]:
    """The mean of the last round, (6,), and for each round the mean return, s, of START and of its mean on its maps."""
    search = cma.CMAEvolutionStrategy(START, 1.0, {"popsize": size, "seed": seed, "verbose": -9})
    history = []
    with ProcessPoolExecutor(jobs) as pool:
        for k in range(rounds):
            drawn = search.ask()
            numbers = TRAINING + maps * k + np.arange(maps)
            every = pool.map(partial(returns, np.vstack([START, search.mean, drawn])), numbers.tolist())
            values = np.mean([row for row in every if row], axis=0)
            history.append((values[0], values[1]))
            print(f"round {k + 1}: before training {values[0]:.1f} s, now {values[1]:.1f} s", flush=True)
            search.tell(drawn, -values[2:])
    return search.mean, history


def outcome(number: int) -> dict[str, tuple]:
    """By run of a draw: whether it needed help and arrived, its arrival, s, its proposals, how many were accepted."""
    from airground_drake import judge, simulate
    from airground_drake.report.interventions import interventions
    from airground_drake.study.campaign.spec import load_spec

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
    """A table in Markdown: how runs ended on maps that the policy was not trained on."""
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
