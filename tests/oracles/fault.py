"""A fault that an oracle finds."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np


class Fault(NamedTuple):
    """What is wrong, about which robot, when (s), and what it should be or by how much it is off."""

    what: str
    robot: str = ""
    t_s: float = 0.0
    more: Any = None


def off(by: Any) -> float:
    """The largest absolute difference of an array of any shape; nan if one is not a number."""
    return float(np.abs(by).max(initial=0.0))
