"""The noise of a run, equal to Drake's RandomSource, without Drake's Simulator.

A diagram in which one RandomSource draws gets, by `SetRandomContext(context, RandomGenerator(seed))`, the first output
of mt19937(seed) as the seed of the source, which has an mt19937 of its own. libstdc++ makes normal numbers by
Marsaglia's polar method from doubles of two words each, and keeps the second number of a pair for the next call. The
first set of numbers is drawn by SetRandomContext and discarded. Other standard libraries use other methods; `gaussians`
then takes the numbers from Drake itself.
"""

import math
from functools import cache

import numpy as np
import numpy.typing as npt
from pydrake.common import RandomDistribution, RandomGenerator
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, RandomSource

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit

SHARE = 0.7  # of pairs of doubles that give a pair of numbers: pi / 4, with room
LOOK = 9  # sets of three numbers by which both streams are compared


def gaussians(seed: int, count: int, sets: int) -> Array:
    """The first `sets` samples of `count` standard normal numbers each that a run with a seed gets, (sets, count)."""
    return _made(seed, count, sets) if _is_drakes() else _of_drake(seed, count, sets)


def _made(seed: int, count: int, sets: int) -> Array:
    source = np.random.RandomState(_words(np.random.RandomState(seed), 1)[0])
    wanted = (sets + 1) * count
    values, made = np.empty(wanted + 1), 0
    left = np.zeros(0, dtype=np.uint32)
    while made < wanted:
        words = np.append(left, _words(source, 4 * (int((wanted - made) * 0.5 / SHARE) + 8)))
        made, used = _polar(words, values, made, wanted)
        left = words[used:]
    return values[count:wanted].reshape(sets, count)


def _words(source: np.random.RandomState, count: int) -> npt.NDArray[np.uint32]:
    """The next outputs of a mt19937 generator."""
    return source.randint(0, 2**32, size=count, dtype=np.uint32)


@njit(cache=True)
def _polar(words: npt.NDArray[np.uint32], values: Array, made: int, wanted: int) -> tuple[int, int]:
    """Convert words to normal numbers, until there are enough or words run out; returns both counts."""
    used = 0
    while made < wanted and used + 4 <= len(words):
        u = (float(words[used]) + float(words[used + 1]) * 4294967296.0) / 2.0**64
        v = (float(words[used + 2]) + float(words[used + 3]) * 4294967296.0) / 2.0**64
        used += 4
        x, y = 2.0 * min(u, 0.9999999999999999) - 1.0, 2.0 * min(v, 0.9999999999999999) - 1.0
        squared = x * x + y * y
        if 0.0 < squared <= 1.0:
            factor = math.sqrt(-2.0 * math.log(squared) / squared)
            values[made], values[made + 1] = y * factor, x * factor
            made += 2
    return made, used


def _of_drake(seed: int, count: int, sets: int) -> Array:
    """The numbers of `gaussians`, made by Drake itself."""
    builder = DiagramBuilder()
    source = builder.AddSystem(RandomSource(RandomDistribution.kGaussian, count, 1.0))
    log = LogVectorOutput(source.get_output_port(), builder, 1.0)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    diagram.SetRandomContext(context, RandomGenerator(seed))
    Simulator(diagram, context).AdvanceTo(float(sets))
    return np.ascontiguousarray(log.FindLog(context).data()[:, 1:].T)  # a row before each update


@cache
def _is_drakes() -> bool:
    """Whether the first numbers made here equal Drake's."""
    return np.array_equal(_made(0, 3, LOOK), _of_drake(0, 3, LOOK))
