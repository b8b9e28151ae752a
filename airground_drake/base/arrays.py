"""The array type."""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]  # numbers in binary64; docstrings and comments give shapes and units
Flags = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]

# Largest size of a scenario's numbers and of a proposal's times and coordinates: their products stay finite.
LARGEST = 1e9
ROUNDOFF = 2.0**-53  # unit roundoff u of binary64: every operation returns its exact result times 1 + e, |e| <= u


def read_only(values: npt.ArrayLike) -> Array:
    """A read-only copy, in C order."""
    # Its memory is that of `bytes`, so that `setflags(write=True)` fails, too.
    array = np.asarray(values, dtype=np.float64)
    return np.ndarray(array.shape, np.float64, buffer=array.tobytes())
