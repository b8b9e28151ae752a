"""VerifAI's samplers behind `airground falsify`, in an environment that has the package `verifai` (pandas below 3).

airground falsify spec.yaml --sampler verifai_sampler.py:CrossEntropy --allow-plugins
"""

from __future__ import annotations

import random

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class CrossEntropy:
    """The cross-entropy method; a point is a counterexample to it if its value is below 0."""

    kind = "crossEntropySamplerFor"

    def __init__(self, dimensions: int, seed: int) -> None:
        """For points (n,)."""
        from verifai.features import Box, Feature, FeatureSpace
        from verifai.samplers.feature_sampler import FeatureSampler

        random.seed(seed)
        np.random.seed(seed)  # noqa: NPY002 - VerifAI draws from the generators that are global
        space = FeatureSpace({"point": Feature(Box(*[(0.0, 1.0)] * dimensions))})
        self._sampler, self._value = getattr(FeatureSampler, self.kind)(space), None

    def ask(self) -> Array:
        """One point (1, n) in [0, 1)."""
        point = self._sampler.nextSample(self._value).point
        return np.clip(np.atleast_2d(np.asarray(point, dtype=np.float64)), 0.0, np.nextafter(1.0, 0.0))

    def tell(self, points: Array, values: Array) -> None:
        """The margin there, (1,)."""
        self._value = float(values[0])


class MultiArmedBandit(CrossEntropy):
    """Upper confidence bounds on intervals of each coordinate."""

    kind = "multiArmedBanditSamplerFor"
