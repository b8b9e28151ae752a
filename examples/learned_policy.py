"""A small learned policy: a net of two layers looks at the target and the nearest obstacles, and draws two corners.

Training is a search over its 84 weights by the evolution strategy that `airground falsify` has. What is made least, on
situations drawn at random, is the length of the way with a price on what lacks of the safe distance; nothing is
simulated. `python learned_policy.py` (two minutes of CPU time) writes learned_policy.json.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from airground_drake.campaign.search import CmaEs
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.policy import Observation, Policy

WEIGHTS = Path(__file__).with_suffix(".json")
SEEN, HIDDEN, DRAWN = 3, 7, 4
"""Obstacles that the net sees, its units, and the numbers that it gives: two corners of two coordinates."""
SHAPES = ((2 * SEEN + 1, HIDDEN), (HIDDEN,), (HIDDEN, DRAWN))
COUNT = sum(int(np.prod(shape)) for shape in SHAPES)
LARGEST_WEIGHT = 4.0
FAR_M, REACH_M, MARGIN_M = 30.0, 6.0, 0.1
"""Place of a missing obstacle, reach of corners, and margin beyond the safe distance, m."""
PRICE = 20.0
"""Of a metre that lacks, in lengths of the straight way."""


def corners(weights: np.ndarray, target: np.ndarray, obstacles: np.ndarray) -> np.ndarray:
    """Two corners (B, 2, 2), m, ahead and to the left, for B targets (B,), m ahead, and obstacles (B, SEEN, 2), m."""
    first, bias, second = (
        part.reshape(shape)
        for part, shape in zip(
            np.split(weights, np.cumsum([np.prod(shape) for shape in SHAPES])[:-1]), SHAPES, strict=True
        )
    )
    features = np.column_stack([target / 10.0, np.exp(-(obstacles[..., 0] ** 2) / 50.0), obstacles[..., 1] / 3.0])
    ahead_1, left_1, ahead_2, left_2 = (np.tanh(features @ first + bias) @ second).T
    share = target[:, None] / (1.0 + np.exp(-np.column_stack([ahead_1 - 1.0, ahead_2])))
    return np.stack([share, REACH_M * np.tanh(np.column_stack([left_1, left_2]))], axis=-1)


def frame(position: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Unit vectors ahead, towards the target, and to the left, (2, 2)."""
    ahead = (target - position)[:2] / max(float(np.linalg.norm((target - position)[:2])), 1e-9)
    return np.array([ahead, [-ahead[1], ahead[0]]])


class Learned(Policy):
    """By way of the two corners to the target."""

    counted = True

    def __init__(self, *, speed_m_s: float) -> None:
        """Along the way, m/s."""
        self.speed, self.weights = speed_m_s, np.array(json.loads(WEIGHTS.read_text()))

    def propose(self, seen: Observation) -> Motion | None:
        """In the frame that looks from the UGV to its target; robots are obstacles, too."""
        axes, away = frame(seen.position, seen.target), np.linalg.norm((seen.target - seen.position)[:2])
        if away < 1.0:
            return None
        points = (seen.obstacles[:, :2] - seen.position[:2]) @ axes.T
        nearest = points[np.argsort(np.linalg.norm(points, axis=1))][:SEEN]
        given = np.vstack([nearest, np.tile([FAR_M, 0.0], (SEEN - len(nearest), 1))])
        drawn = corners(self.weights, np.array([away]), given[None])[0] @ axes + seen.position[:2]
        way = np.vstack([seen.position[:2], drawn, seen.target[:2]])
        return Motion.at_speed(np.column_stack([way, np.zeros(len(way))]), self.speed, start=seen.start)


def situations(rng: np.random.Generator, count: int, d: float) -> tuple[np.ndarray, np.ndarray]:
    """Targets (B,), m ahead, and obstacles (B, SEEN, 2), m, nearest first: the first one holds the UGV up."""
    target, bearing = rng.uniform(5.0, 16.0, count), rng.uniform(-0.6, 0.6, count)
    obstacles = np.empty((count, SEEN, 2))
    obstacles[:, 0] = (d + 0.01) * np.column_stack([np.cos(bearing), np.sin(bearing)])
    for k in range(1, SEEN):
        place = np.column_stack([rng.uniform(0.0, target), rng.uniform(-5.0, 5.0, count)])
        bad = (np.linalg.norm(place, axis=1) < d) | (np.hypot(place[:, 0] - target, place[:, 1]) < d)
        obstacles[:, k] = np.where((bad | (rng.random(count) < 0.3))[:, None], [FAR_M, 0.0], place)
    order = np.argsort(np.linalg.norm(obstacles, axis=2), axis=1)
    return target, np.take_along_axis(obstacles, order[..., None], axis=1)


def price(weights: np.ndarray, target: np.ndarray, obstacles: np.ndarray, d: float) -> float:
    """Mean length of the way, in straight ways, and PRICE for each metre that lacks on a leg."""
    ends = np.stack([target, np.zeros(len(target))], axis=1)[:, None]
    way = np.concatenate([np.zeros((len(target), 1, 2)), corners(weights, target, obstacles), ends], axis=1)
    leg, start = np.diff(way, axis=1)[:, :, None], way[:, :-1, None]
    offset = obstacles[:, None] - start
    along = np.clip((offset * leg).sum(axis=3) / np.maximum((leg**2).sum(axis=3), 1e-9), 0.0, 1.0)
    apart = np.linalg.norm(offset - along[..., None] * leg, axis=3)
    lacking = np.maximum(0.0, np.minimum(d + MARGIN_M, np.linalg.norm(offset, axis=3)) - apart)
    length = np.linalg.norm(leg[:, :, 0], axis=2).sum(axis=1)
    return float((length / target + PRICE * lacking.max(axis=2).sum(axis=1) / target).mean())


def train(generations: int = 1500, seed: int = 1, d: float = 2.0) -> tuple[Any, list[float]]:
    """The best weights (COUNT,) and the price of each generation's best on situations of its own."""
    rng, strategy, history = np.random.default_rng(seed), CmaEs(COUNT, seed), []
    judged, best, least = situations(rng, 2000, d), np.zeros(COUNT), np.inf
    for _ in range(generations):
        points, drawn = strategy.ask(), situations(rng, 300, d)
        values = np.array([price(LARGEST_WEIGHT * (2.0 * point - 1.0), *drawn, d) for point in points])
        strategy.tell(points, values)
        found = LARGEST_WEIGHT * (2.0 * points[np.argmin(values)] - 1.0)
        history.append(price(found, *judged, d))
        if history[-1] < least:
            best, least = found, history[-1]
    return best, history


if __name__ == "__main__":
    weights, history = train()
    WEIGHTS.write_text(json.dumps(weights.round(4).tolist()) + "\n")
    print(f"price {history[0]:.3f} after one generation, {min(history):.3f} after {len(history)}")
