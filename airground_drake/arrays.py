"""The array type that everything computes with."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
"""Numbers in binary64; every docstring gives the shape and the unit."""
