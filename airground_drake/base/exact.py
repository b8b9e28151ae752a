"""Numbers of a scenario as exact decimals."""

from fractions import Fraction
from functools import lru_cache


@lru_cache(maxsize=1024)  # a scenario has few different numbers, and each is asked for often
def decimal(number: float) -> Fraction:
    """The decimal number that a float prints as, exactly: 0.1 is 1/10."""
    return Fraction(repr(float(number)))


def is_multiple(of: float, unit: float) -> bool:
    """Whether a number is a positive integer multiple of a unit, up to rounding."""
    ratio = of / unit
    return round(ratio) >= 1 and abs(ratio - round(ratio)) <= 1e-9 * ratio
