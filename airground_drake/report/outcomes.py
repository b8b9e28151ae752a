"""Distances in words."""

from collections.abc import Sequence

SLACK_M = 1e-9  # a distance counts as kept if it falls short of the required one by less, as verdicts have it


def named(body: str, at_m: Sequence[float] | None = None) -> str:
    """The name of a body in words; of the map, which is everywhere, with the place that is meant, m."""
    return f"the map at ({', '.join(f'{axis + 0.0:.2f}' for axis in at_m)})" if at_m else body


def distance(value_m: float, required_m: float) -> str:
    """A distance in words, below 0 as an overlap."""
    apart = metres(value_m, required_m)
    return f"{apart} (overlap)" if apart.startswith("-") else apart


def metres(value_m: float, required_m: float) -> str:
    """A distance; if it falls short, with enough decimals to show a smaller number than the required one."""
    decimals = 3
    while value_m < required_m - SLACK_M and float(f"{value_m:.{decimals}f}") >= required_m and decimals < 9:
        decimals += 1
    return f"{round(value_m, decimals) + 0.0:.{decimals}f} m"  # + 0.0: no -0.000
