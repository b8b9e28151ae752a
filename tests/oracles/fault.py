"""A fault that an oracle finds."""

from typing import Any, NamedTuple


class Fault(NamedTuple):
    """What is wrong, about which robot, when (s), and what it should be or by how much it is off."""

    what: str
    robot: str = ""
    t_s: float = 0.0
    more: Any = None
