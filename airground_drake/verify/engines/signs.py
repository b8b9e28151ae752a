"""Signs of (16)-(19) in ball arithmetic: rational arguments, values enclosed in 256 bits.

With u = 2 zeta drift / noise^2, k = noise^2 / drift^2 (s) and r = c2 / c1 (s), the threshold equation (19) with c2/c1
on the right is f(u) = k (sinh u + u) - r = 0.
"""

import threading
from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

import flint

PRECISION_BITS = 256
NARROW = Fraction(1, 10**12)  # enclosures are at most this wide, relative to their lower end
LARGEST_U = 10**6
_flint = threading.Lock()  # flint's precision is one for all threads

Function = Callable[[Any], Any]  # from a ball u to a ball that contains the value there


class RootInterval(NamedTuple):
    """Two rational numbers with a root between them, and the signs there: -1 or 1."""

    low: Fraction
    high: Fraction
    signs: tuple[int, int]


class ThresholdRule(NamedTuple):
    """The numbers of the threshold rule, as the decimals that they print as."""

    drift: Fraction
    noise: Fraction
    c1: Fraction
    c2: Fraction

    def zeta(self, u: Fraction) -> Fraction:
        """Threshold, m, at u."""
        return u * self.noise**2 / (2 * self.drift)

    def u(self, zeta: Fraction) -> Fraction:
        """2 zeta drift / noise^2 of a length, m."""
        return zeta * 2 * self.drift / self.noise**2

    def residual(self, ratio: Fraction) -> Function:
        """f for r = ratio, s."""
        scale = self.noise**2 / self.drift**2
        return lambda u: ball(scale) * (u.sinh() + u) - ball(ratio)

    @property
    def root(self) -> RootInterval:
        """The root of (19) with c2/c1, in u."""
        return enclose(self.residual(self.c2 / self.c1), Fraction(0))

    @property
    def printed_root(self) -> RootInterval:
        """The root of (19) as printed, with c1/c2, in u."""
        return enclose(self.residual(self.c1 / self.c2), Fraction(0))

    def risk(self, u: Any) -> Any:
        """The Bayes risk (16) without initial deviation, at a ball u."""
        scale = self.noise**2 / self.drift**2
        q = u.exp()
        return (ball(self.c1 * scale / 2) * u * (q - 1) + ball(self.c2)) / (q + 1)


def ball(value: Fraction) -> Any:
    return flint.arb(flint.fmpq(*value.as_integer_ratio()))


def value(function: Function, u: Fraction) -> Any:
    with _flint, flint.ctx.workprec(PRECISION_BITS):
        return function(ball(u))


def sign(function: Function, u: Fraction) -> int:
    """The sign of the function at u: -1 or 1; 0 if the ball contains 0, which leaves the sign open."""
    at_u = value(function, u)
    return int(bool(at_u > 0)) - int(bool(at_u < 0))


def enclose(function: Function, low: Fraction, high: Fraction | None = None) -> RootInterval:
    """Rational ends, NARROW apart or less, around a sign change of the function, by bisection."""
    # low: below the sign change; may be 0.
    # high: above it; None: found by doubling.

    def sure(u: Fraction) -> int:
        side = sign(function, u)
        if not side:
            raise ArithmeticError(f"the sign at u = {float(u):g} is open")
        return side

    if high is None:
        low, high = max(low, Fraction(1, 2**200)), max(2 * low, Fraction(1))
        while sure(high) == sure(low):
            low, high = high, 2 * high
            if high > LARGEST_U:
                raise ArithmeticError(f"no sign changes below u = {LARGEST_U}")
    before = sure(low)
    while high - low > NARROW * low:
        middle = (low + high) / 2
        low, high = (middle, high) if sure(middle) == before else (low, middle)
    return RootInterval(low, high, (before, sure(high)))
