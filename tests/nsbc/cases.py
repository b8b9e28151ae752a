"""Positions as Hypothesis draws them."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

COORDINATE = st.floats(-20.0, 20.0, allow_subnormal=False).map(lambda x: round(x, 3))
POSITIONS = st.integers(1, 4).flatmap(lambda n: arrays(np.float64, (n, 3), elements=COORDINATE))
VECTOR = arrays(np.float64, 3, elements=COORDINATE)
