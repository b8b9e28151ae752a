"""Distributions over the keys of a scenario, by their inverse distribution functions: of shares in [0, 1)."""

import math
import zlib
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import qmc, truncnorm

from airground_drake.base.arrays import Array
from airground_drake.base.limits import MAX_SEED

# Kinds with values that depend on the number of the draw, so that draws are not independent.
HALTON, GRID = "halton", "grid"


class Kind(NamedTuple):
    """A kind of distribution."""

    wanted: str  # its parameters, in words
    # Whether these parameters can be used; may raise ValueError, TypeError or OverflowError.
    allows: Callable[..., bool]
    at: Callable[..., Any]  # the value at shares (size,), for these parameters


def _is_box(low: Any, high: Any) -> bool:
    return np.shape(low) == np.shape(high) and np.ndim(low) <= 1 and bool(np.all(np.less_equal(low, high)))


def _in_box(shares: Array, low: Any, high: Any) -> Any:
    ends = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    return (ends[0] + np.reshape(shares, ends[0].shape) * (ends[1] - ends[0])).tolist()


def _is_normal(mean: float, sd: float, low: float = -math.inf, high: float = math.inf) -> bool:
    return 0.0 < sd < math.inf and low < high


def _normal(shares: Array, mean: float, sd: float, low: float = -math.inf, high: float = math.inf) -> float:
    share = np.clip(shares[0], 1e-9, 1.0 - 1e-9)  # finite also without ends
    return float(truncnorm.ppf(share, (low - mean) / sd, (high - mean) / sd, loc=mean, scale=sd))


def _choice(shares: Array, *values: Any) -> Any:
    return values[min(int(shares[0] * len(values)), len(values) - 1)]


KINDS: dict[str, Kind] = {
    "uniform": Kind("[low, high], numbers or lists of numbers", _is_box, _in_box),
    HALTON: Kind("[low, high], numbers or lists of numbers", _is_box, _in_box),
    "log_uniform": Kind(
        "[low, high] with 0 < low",
        lambda low, high: 0.0 < low <= high,
        lambda shares, low, high: float(low * (high / low) ** shares[0]),
    ),
    "normal": Kind("[mean, standard deviation], and [..., low, high] to cut it", _is_normal, _normal),
    "integer": Kind(
        f"[low, high], whole numbers up to {MAX_SEED}",
        lambda low, high: type(low) is int and type(high) is int and -MAX_SEED <= low <= high <= MAX_SEED,
        lambda shares, low, high: low + min(int(shares[0] * (high - low + 1)), high - low),
    ),
    "choice": Kind("a list of values", lambda *values: bool(values), _choice),
    GRID: Kind("a list of values, gone through in turn", lambda *values: bool(values), _choice),
}


@dataclass(frozen=True)
class Key:
    """How a key is drawn."""

    kind: str  # all halton keys of a campaign form one sequence; grids are gone through in turn
    given: list[Any]  # the parameters

    @property
    def size(self) -> int:
        """Number of shares that determine a value."""
        return int(np.size(self.given[0])) if self.kind in ("uniform", HALTON) else 1

    @property
    def choices(self) -> list[Any]:
        return self.given if self.kind in ("choice", GRID) else []

    def at(self, shares: Array) -> Any:
        """The value at shares (size,): a number, a list of numbers, or any other value of a scenario."""
        return KINDS[self.kind].at(shares, *self.given)

    @property
    def is_of_numbers(self) -> bool:
        """Whether the parameters are numbers or lists of them, and so are the least and the largest value."""
        ends = [self.at(np.full(self.size, share)) for share in (0.0, np.nextafter(1.0, 0.0))]
        kinds = {type(number) for number in np.asarray(self.given, dtype=object).flat}
        return self.size > 0 and kinds <= {int, float} and bool(np.isfinite(ends).all())


def made(kind: str, given: Any) -> Key:
    with suppress(ValueError, TypeError, ArithmeticError), np.errstate(all="ignore"):
        key = Key(kind, given)
        if isinstance(given, list) and KINDS[kind].allows(*given) and (key.choices or key.is_of_numbers):
            return key
    raise ValueError(f"wanted: {KINDS[kind].wanted}")


def values_of(drawn: Mapping[str, Key], seed: int, index: int) -> dict[str, Any]:
    """The values of one draw by key, in the order of the keys: a function of the seed and the index."""
    # The random numbers of a key depend on the seed, the key and the index only, so a further key changes none of them.
    # Grids are gone through in all combinations.
    values: dict[str, Any] = {}
    place = index
    even = _halton(sum(key.size for key in drawn.values() if key.kind == HALTON), seed, index)
    for name, key in drawn.items():
        if key.kind == GRID:
            place, at = divmod(place, len(key.given))
            values[name] = key.given[at]
        elif key.kind == HALTON:
            shares, even = np.split(even, [key.size])
            values[name] = key.at(shares)
        else:
            values[name] = key.at(stream(seed, name, index).random(key.size))
    return values


def values_at(drawn: Mapping[str, Key], shares: Array) -> dict[str, Any]:
    """The values by key at a point of the unit cube, (dimensions(drawn),), for a search."""
    values: dict[str, Any] = {}
    for name, key in drawn.items():
        own, shares = np.split(shares, [key.size])
        values[name] = key.at(own)
    return values


def dimensions(drawn: Mapping[str, Key]) -> int:
    return sum(key.size for key in drawn.values())


def combinations(drawn: Mapping[str, Key]) -> int:
    """Number of combinations of all grids; 1 without any."""
    return math.prod(len(key.given) for key in drawn.values() if key.kind == GRID)


def stream(seed: int, key: str, index: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(zlib.crc32(key.encode()), index)))


def _halton(size: int, seed: int, index: int) -> Array:
    if size == 0:
        return np.empty(0)
    points = qmc.Halton(size, rng=np.random.default_rng(seed))
    points.num_generated = index  # `fast_forward` computes all that it skips
    return np.asarray(points.random(1)[0])
