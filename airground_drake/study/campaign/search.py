"""Samplers, which choose points of the unit cube: at random, evenly, or by CMA-ES."""

import math
import warnings
from typing import Any, Protocol, runtime_checkable

import numpy as np
from scipy.stats import qmc

from airground_drake.base.arrays import Array

BATCH = 16  # points at a time, for samplers that do not learn
WORTHLESS = 1e6  # value of points without a measurement, for CMA-ES, which needs finite values


@runtime_checkable
class Sampler(Protocol):
    """Chooses the next points of a search, given the number of dimensions and a seed."""

    def ask(self) -> Array:
        """Return the next points (k, n) in [0, 1)."""

    def tell(self, points: Array, values: Array) -> None:
        """Take the objective at these points, (k,): smaller is better, infinite means not measured."""


class Uniform:
    """Independent points: the baseline."""

    def __init__(self, dimensions: int, seed: int) -> None:
        self._rng, self._dimensions = np.random.default_rng(seed), dimensions

    def ask(self) -> Array:
        return self._rng.random((BATCH, self._dimensions))

    def tell(self, points: Array, values: Array) -> None:
        """Ignored."""


class Halton(Uniform):
    """Points of low discrepancy."""

    def __init__(self, dimensions: int, seed: int) -> None:
        self._sequence = qmc.Halton(dimensions, rng=np.random.default_rng(seed))

    def ask(self) -> Array:
        return np.asarray(self._sequence.random(BATCH))


class CmaEs:
    """Evolution strategy with covariance matrix adaptation (Hansen 2016), restarted elsewhere when it converges."""

    def __init__(self, dimensions: int, seed: int) -> None:
        self._dimensions = dimensions
        self._rng = np.random.default_rng(seed)
        self.restarts = -1
        self._begin()

    def ask(self) -> Array:
        """The next candidates. The strategy needs two dimensions; a missing second one is added without effect."""
        self._asked = self._strategy.ask()
        return np.clip(np.array(self._asked)[:, : self._dimensions], 0.0, np.nextafter(1.0, 0.0))

    def tell(self, points: Array, values: Array) -> None:
        self._strategy.tell(self._asked, np.nan_to_num(values, nan=WORTHLESS, posinf=WORTHLESS).tolist())
        if self._strategy.stop():
            self._begin()

    def _begin(self) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of missing packages for plots
            import cma

        self.restarts += 1
        size = max(2, self._dimensions)
        options = {
            "bounds": [0.0, 1.0], "seed": int(self._rng.integers(1, 2**31)), "verbose": -9, "tolfun": 1e-9,
            "popsize": (4 + int(3 * math.log(size))) * min(2**self.restarts, 8),
        }  # fmt: skip
        start = self._rng.uniform(0.2, 0.8, size)
        self._strategy: Any = cma.CMAEvolutionStrategy(start, 0.3, options)
