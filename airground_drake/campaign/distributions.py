"""Distributions over the keys of a scenario, as functions of shares in [0, 1): of random, even or searched ones."""

from __future__ import annotations

import abc
import math
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import qmc, truncnorm

from airground_drake.base.arrays import Array
from airground_drake.scenarios.limits import MAX_SEED


class Distribution(abc.ABC):
    """A distribution, by the inverse of its distribution function."""

    size: int = 1
    """Number of shares that a value takes."""

    @abc.abstractmethod
    def at(self, shares: Array) -> Any:
        """The value at these shares (size,) in [0, 1): a number, a list of numbers, or what a scenario may have."""


@dataclass(frozen=True)
class Uniform(Distribution):
    """Uniform on [low, high), or on a box: low and high are numbers, or lists of as many."""

    low: Any
    high: Any

    def at(self, shares: Array) -> Any:
        """Entries independent."""
        low, high = np.asarray(self.low, dtype=np.float64), np.asarray(self.high, dtype=np.float64)
        return (low + np.reshape(shares, low.shape) * (high - low)).tolist()

    @property
    def size(self) -> int:  # type: ignore[override]
        """One for each entry."""
        return int(np.size(self.low))


@dataclass(frozen=True)
class LogUniform(Distribution):
    """Uniform in the logarithm, between low > 0 and high: for scales."""

    low: float
    high: float

    def at(self, shares: Array) -> Any:
        """low (high / low)^share."""
        return float(self.low * (self.high / self.low) ** shares[0])


@dataclass(frozen=True)
class Normal(Distribution):
    """Normal, cut to [low, high]."""

    mean: float
    sd: float
    low: float = -math.inf
    high: float = math.inf

    def at(self, shares: Array) -> Any:
        """At a share of 0 without a lower end: the value at 1e-9."""
        ends = (self.low - self.mean) / self.sd, (self.high - self.mean) / self.sd
        return float(truncnorm.ppf(np.clip(shares[0], 1e-9, 1.0 - 1e-9), *ends, loc=self.mean, scale=self.sd))


@dataclass(frozen=True)
class Integer(Distribution):
    """low <= whole number <= high, all equally likely."""

    low: int
    high: int

    def at(self, shares: Array) -> Any:
        """Both ends are values."""
        return self.low + min(int(shares[0] * (self.high - self.low + 1)), self.high - self.low)


@dataclass(frozen=True)
class Choice(Distribution):
    """One of some values, all equally likely."""

    values: tuple[Any, ...]

    def at(self, shares: Array) -> Any:
        """In the order of the list."""
        return self.values[min(int(shares[0] * len(self.values)), len(self.values) - 1)]


RANDOM, EVEN, IN_TURN = "random", "even", "in turn"


@dataclass(frozen=True)
class Key:
    """How a key is drawn: at random, evenly (all such keys are one Halton sequence), or its values in turn."""

    distribution: Distribution
    how: str = RANDOM


def values_of(drawn: Mapping[str, Key], seed: int, index: int) -> dict[str, Any]:
    """The values of one draw by key, in the order of the keys: a function of the seed and the index.

    The random numbers of a key depend on the seed, the key and the index: another key more or less changes none. Grids
    are gone through in all combinations.

    Args:
        drawn: by dotted key.
        seed: of the campaign.
        index: number of the draw, from 0.
    """
    values: dict[str, Any] = {}
    place = index
    even = _halton(sum(key.distribution.size for key in drawn.values() if key.how == EVEN), seed, index)
    for name, key in drawn.items():
        own = key.distribution
        if key.how == IN_TURN and isinstance(own, Choice):
            place, at = divmod(place, len(own.values))
            values[name] = own.values[at]
        elif key.how == EVEN:
            shares, even = np.split(even, [own.size])
            values[name] = own.at(shares)
        else:
            values[name] = own.at(stream(seed, name, index).random(own.size))
    return values


def values_at(drawn: Mapping[str, Key], shares: Array) -> dict[str, Any]:
    """The values by key at a point of the unit cube, (dimensions(drawn),), for a search."""
    values: dict[str, Any] = {}
    for name, key in drawn.items():
        own, shares = np.split(shares, [key.distribution.size])
        values[name] = key.distribution.at(own)
    return values


def dimensions(drawn: Mapping[str, Key]) -> int:
    """Of the unit cube of all shares."""
    return sum(key.distribution.size for key in drawn.values())


def stream(seed: int, key: str, index: int) -> np.random.Generator:
    """The random numbers of one key in one draw."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(zlib.crc32(key.encode()), index)))


def combinations(drawn: Mapping[str, Key]) -> int:
    """Number of combinations of the keys whose values are gone through in turn; 1 without any."""
    kept = [key.distribution for key in drawn.values() if key.how == IN_TURN]
    return math.prod(len(each.values) for each in kept if isinstance(each, Choice))


def _halton(size: int, seed: int, index: int) -> Array:
    if size == 0:
        return np.empty(0)
    points = qmc.Halton(size, rng=np.random.default_rng(seed))
    points.num_generated = index  # `fast_forward` makes all that it leaves out
    return np.asarray(points.random(1)[0])


def _uniform(given: Any) -> Uniform:
    low, high = given
    ends = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    if ends[0].shape != ends[1].shape or ends[0].ndim > 1 or not np.isfinite(ends).all() or (ends[0] > ends[1]).any():
        raise ValueError
    return Uniform(low, high)


def _log_uniform(given: Any) -> LogUniform:
    low, high = given
    if not (0.0 < low <= high < math.inf and high / low < math.inf):
        raise ValueError
    return LogUniform(float(low), float(high))


def _normal(given: Any) -> Normal:
    found = Normal(*map(float, given))
    if not (math.isfinite(found.mean) and 0.0 < found.sd < math.inf and found.low < found.high):
        raise ValueError
    return found


def _integer(given: Any) -> Integer:
    low, high = given
    if type(low) is not int or type(high) is not int or not -MAX_SEED <= low <= high <= MAX_SEED:
        raise ValueError
    return Integer(low, high)


def _choice(given: Any) -> Choice:
    if not isinstance(given, Sequence) or isinstance(given, str) or not given:
        raise ValueError
    return Choice(tuple(given))


_ENDS = "[low, high], numbers or lists of numbers"
KINDS: dict[str, tuple[str, Callable[[Any], Key]]] = {
    "uniform": (_ENDS, lambda given: Key(_uniform(given))),
    "halton": (_ENDS, lambda given: Key(_uniform(given), EVEN)),
    "log_uniform": ("[low, high] with 0 < low", lambda given: Key(_log_uniform(given))),
    "normal": ("[mean, standard deviation], and [..., low, high] to cut it", lambda given: Key(_normal(given))),
    "integer": (f"[low, high], whole numbers up to {MAX_SEED}", lambda given: Key(_integer(given))),
    "choice": ("a list of values", lambda given: Key(_choice(given))),
    "grid": ("a list of values, gone through in turn", lambda given: Key(_choice(given), IN_TURN)),
}
"""By name: what its parameters are, in words, and what makes a key of them."""


def made(name: str, given: Any) -> Key:
    """How a key is drawn, from a name and parameters.

    Raises:
        KeyError: if the name is unknown.
        ValueError: if the parameters are not what `KINDS` says.
    """
    wanted, make = KINDS[name]
    try:
        return make(given)
    except (ValueError, TypeError, OverflowError):
        raise ValueError(f"wanted: {wanted}") from None
