"""The array type of all computations."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
"""Numbers in binary64; every docstring gives the shape and the unit."""

LARGEST = 1e9
"""Largest size of a scenario's numbers and of a proposal's times and coordinates: their products stay finite."""
ROUNDOFF = 2.0**-53
"""Unit roundoff u of binary64: every operation returns its exact result times 1 + e, |e| <= u."""


def read_only(values: npt.ArrayLike) -> Array:
    """A copy of the values that cannot be written to, in C order.

    Its memory is that of `bytes`, so that `setflags(write=True)` fails, too.
    """
    array = np.asarray(values, dtype=np.float64)
    return np.ndarray(array.shape, np.float64, buffer=array.tobytes())
