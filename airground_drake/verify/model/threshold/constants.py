"""The numbers of the threshold rule, exactly."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from airground_drake.verify.engines.obligation import rational

FLOAT_TOLERANCE = 1e-12
"""The running threshold may be this far outside its enclosure, relative to it: rounding errs by some 1e-15."""


@dataclass(frozen=True)
class ThresholdRule:
    """The threshold rule's numbers as rationals (the decimals that they print as)."""

    drift: Fraction
    noise: Fraction
    c1: Fraction
    c2: Fraction

    @classmethod
    def of(cls, inputs: Mapping[str, Any]) -> ThresholdRule:
        """From a claim's inputs."""
        return cls(*(Fraction(rational(inputs[name])) for name in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2")))

    @property
    def values(self) -> dict[str, Fraction]:
        """By the names that the expressions use."""
        k = self.noise**2 / self.drift**2
        return {"k": k, "r": self.c2 / self.c1, "c1": self.c1, "c2": self.c2, "drift": self.drift}

    def zeta(self, u: Fraction) -> Fraction:
        """Threshold, m, at u."""
        return u * self.noise**2 / (2 * self.drift)

    def u(self, zeta: Fraction) -> Fraction:
        """2 zeta drift / noise^2 of a length, m."""
        return zeta * 2 * self.drift / self.noise**2

    def at(self, **more: Fraction) -> dict[str, Fraction]:
        """All values and some more."""
        return {**self.values, **more}


Rule = Callable[[float, float, float, float], float]
"""Threshold, m, from drift, noise, c1 and c2."""


def running_threshold(inputs: Mapping[str, Any], rule: Rule) -> Fraction:
    """The threshold, m, that the code computes, exactly as it stands in the computer."""
    return Fraction(rule(inputs["drift_m_s"], inputs["noise_m_sqrt_s"], inputs["c1_1_s"], inputs["c2"]))
