import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Climb:
    """Steps from the best point so far, longer after each that was better and shorter after each that was not."""

    def __init__(self, dimensions: int, seed: int) -> None:
        """Begins in the middle of the unit cube (n,)."""
        self.random, self.step = np.random.default_rng(seed), 0.3
        self.best, self.least = np.full(dimensions, 0.5), np.inf

    def ask(self) -> Array:
        """One point (1, n)."""
        tried = self.best + self.step * self.random.normal(size=(1, len(self.best)))
        return np.clip(tried, 0.0, np.nextafter(1.0, 0.0))

    def tell(self, points: Array, values: Array) -> None:
        """Its margin (1,)."""
        better = values[0] < self.least
        self.step *= 1.5 if better else 0.8
        if better:
            self.best, self.least = points[0], values[0]
