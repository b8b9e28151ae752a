"""Distributions over the keys of a scenario: the value of a draw is a function of its number, the key and a seed."""

from __future__ import annotations

import abc
import math
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import qmc, truncnorm

from airground_drake.arrays import Array


class Distribution(abc.ABC):
    """What a key is drawn from."""

    @abc.abstractmethod
    def value(self, rng: np.random.Generator) -> Any:
        """A value: a number, a list of numbers, or whatever a scenario file may have there."""


@dataclass(frozen=True)
class Interval:
    """low <= value < high, numbers or lists of as many numbers."""

    low: Any
    high: Any

    def at(self, share: Array | float) -> Any:
        """The value a share (a number, or one for each entry) of the way from low to high."""
        low, high = np.asarray(self.low, dtype=np.float64), np.asarray(self.high, dtype=np.float64)
        return (low + share * (high - low)).tolist()

    @property
    def size(self) -> int:
        """Number of entries."""
        return int(np.size(self.low))


@dataclass(frozen=True)
class Uniform(Distribution):
    """Uniform on an interval or a box."""

    interval: Interval

    def value(self, rng: np.random.Generator) -> Any:
        """Entries independent."""
        return self.interval.at(rng.random(np.shape(self.interval.low)))


@dataclass(frozen=True)
class LogUniform(Distribution):
    """Uniform in the logarithm, for scales."""

    low: float
    high: float

    def value(self, rng: np.random.Generator) -> Any:
        """Between low > 0 and high."""
        return float(math.exp(rng.uniform(math.log(self.low), math.log(self.high))))


@dataclass(frozen=True)
class Normal(Distribution):
    """Normal, cut to [low, high]."""

    mean: float
    sd: float
    low: float = -math.inf
    high: float = math.inf

    def value(self, rng: np.random.Generator) -> Any:
        """By the inverse of the distribution function."""
        ends = (self.low - self.mean) / self.sd, (self.high - self.mean) / self.sd
        return float(truncnorm.rvs(*ends, loc=self.mean, scale=self.sd, random_state=rng))


@dataclass(frozen=True)
class Integer(Distribution):
    """low <= whole number <= high, all equally likely."""

    low: int
    high: int

    def value(self, rng: np.random.Generator) -> Any:
        """Both ends are values."""
        return int(rng.integers(self.low, self.high, endpoint=True))


@dataclass(frozen=True)
class Choice(Distribution):
    """One of some values, all equally likely."""

    values: tuple[Any, ...]

    def value(self, rng: np.random.Generator) -> Any:
        """Any of them."""
        return self.values[int(rng.integers(len(self.values)))]


@dataclass(frozen=True)
class Grid(Distribution):
    """Each of some values in turn; several grids are gone through in all combinations."""

    values: tuple[Any, ...]

    def value(self, rng: np.random.Generator) -> Any:
        """Only `values_of` knows the place in the grid."""
        raise TypeError("a grid has no value of its own")


@dataclass(frozen=True)
class Halton(Distribution):
    """Low-discrepancy points of an interval or a box; all Halton keys together are one sequence."""

    interval: Interval

    def value(self, rng: np.random.Generator) -> Any:
        """Only `values_of` knows the place in the sequence."""
        raise TypeError("a Halton sequence has no value of its own")


def values_of(drawn: Mapping[str, Distribution], seed: int, index: int) -> dict[str, Any]:
    """The values of one draw by key, in the order of the keys.

    A key's random stream depends on the seed, the key and the index: another key more or less does not change it.

    Args:
        drawn: distribution by dotted key.
        seed: of the campaign.
        index: number of the draw, from 0.
    """
    values: dict[str, Any] = {}
    place = index
    halton = [each.interval for each in drawn.values() if isinstance(each, Halton)]
    shares = _halton(sum(each.size for each in halton), seed, index) if halton else np.empty(0)
    for key, distribution in drawn.items():
        if isinstance(distribution, Grid):
            place, at = divmod(place, len(distribution.values))
            values[key] = distribution.values[at]
        elif isinstance(distribution, Halton):
            own, shares = np.split(shares, [distribution.interval.size])
            values[key] = distribution.interval.at(own.reshape(np.shape(distribution.interval.low)))
        else:
            values[key] = distribution.value(stream(seed, key, index))
    return values


def stream(seed: int, key: str, index: int) -> np.random.Generator:
    """The random numbers of one key in one draw."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(zlib.crc32(key.encode()), index)))


def combinations(drawn: Mapping[str, Distribution]) -> int:
    """Number of combinations of all grids; 1 without any."""
    return math.prod(len(each.values) for each in drawn.values() if isinstance(each, Grid))


def _halton(dimensions: int, seed: int, index: int) -> Array:
    return np.asarray(qmc.Halton(dimensions, rng=np.random.default_rng(seed)).fast_forward(index).random(1)[0])


def _interval(given: Any) -> Interval:
    low, high = _pair(given)
    low_, high_ = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    if low_.shape != high_.shape or low_.ndim > 1 or not (np.isfinite([low_, high_]).all() and (low_ <= high_).all()):
        raise ValueError
    return Interval(low, high)


def _pair(given: Any) -> tuple[Any, Any]:
    low, high = given
    return low, high


def _log_uniform(given: Any) -> LogUniform:
    low, high = _pair(given)
    if not 0.0 < low <= high < math.inf:
        raise ValueError
    return LogUniform(float(low), float(high))


def _normal(given: Any) -> Normal:
    found = Normal(*map(float, given))
    if not (math.isfinite(found.mean) and 0.0 < found.sd < math.inf and found.low < found.high):
        raise ValueError
    return found


def _integer(given: Any) -> Integer:
    low, high = _pair(given)
    if type(low) is not int or type(high) is not int or low > high:
        raise ValueError
    return Integer(low, high)


def _values(given: Any) -> tuple[Any, ...]:
    if not isinstance(given, Sequence) or isinstance(given, str) or not given:
        raise ValueError
    return tuple(given)


KINDS: dict[str, tuple[str, Callable[[Any], Distribution]]] = {
    "uniform": ("[low, high], numbers or lists of numbers", lambda given: Uniform(_interval(given))),
    "log_uniform": ("[low, high] with 0 < low", _log_uniform),
    "normal": ("[mean, standard deviation], and [..., low, high] to cut it", _normal),
    "integer": ("[low, high], whole numbers", _integer),
    "choice": ("a list of values", lambda given: Choice(_values(given))),
    "grid": ("a list of values", lambda given: Grid(_values(given))),
    "halton": ("[low, high], numbers or lists of numbers", lambda given: Halton(_interval(given))),
}
"""By name: what its parameters are, in words, and what makes it of them."""


def made(name: str, given: Any) -> Distribution:
    """A distribution from its name and parameters.

    Raises:
        KeyError: if there is none of that name.
        ValueError: if the parameters are not what `KINDS` says.
    """
    wanted, make = KINDS[name]
    try:
        return make(given)
    except (ValueError, TypeError):
        raise ValueError(f"wanted: {wanted}") from None
