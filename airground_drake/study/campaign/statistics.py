"""Bounds of the probability of a violation, for any distribution.

k of n independent runs violated a claim. Both intervals contain the probability p of a violation with the stated
confidence: the first for an n fixed beforehand, the second for all n at once, so that a campaign may stop at any time.
"""

import math
from collections.abc import Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import NamedTuple

from scipy.optimize import brentq
from scipy.special import betaln
from scipy.stats import beta

CONFIDENCE = 0.95
DIGITS = 2  # of bounds in words


class Interval(NamedTuple):
    """Bounds of a probability."""

    low: float
    high: float


def outward(bounds: Sequence[float]) -> Interval:
    """The bounds with DIGITS digits: the lower one is rounded down and the upper one up."""
    ways = zip(bounds, (ROUND_FLOOR, ROUND_CEILING), strict=True)
    return Interval(*(float(Context(DIGITS, rounding=way).create_decimal(bound)) for bound, way in ways))


def clopper_pearson(k: int, n: int, confidence: float = CONFIDENCE) -> Interval:
    """The exact binomial interval (Clopper and Pearson 1934); [0, 1] for n = 0."""
    if n == 0:
        return Interval(0.0, 1.0)
    tail = (1.0 - confidence) / 2.0
    low = float(beta.ppf(tail, k, n - k + 1)) if k > 0 else 0.0
    high = float(beta.ppf(1.0 - tail, k + 1, n - k)) if k < n else 1.0
    return Interval(low, high)


def confidence_sequence(k: int, n: int, confidence: float = CONFIDENCE) -> Interval:
    """The anytime-valid interval of the uniform mixture (Robbins 1970): p with M_n(p) < 1/(1 - confidence)."""
    # M_n(p) = B(k + 1, n - k + 1) / (p^k (1 - p)^(n - k)), the likelihood ratio of a uniform prior against p, is a
    # non-negative martingale with mean 1 under p; by Ville's inequality it ever reaches 1/alpha with probability alpha
    # at most. It is convex in the log-odds, least at k/n.
    if n == 0:
        return Interval(0.0, 1.0)
    wealth = betaln(k + 1, n - k + 1)
    most = -math.log(1.0 - confidence)
    at = k / n

    def excess(p: float) -> float:
        taken = (k * math.log(p) if k else 0.0) + ((n - k) * math.log1p(-p) if n > k else 0.0)
        return float(wealth - taken - most)

    tiny = 1e-15
    low = 0.0 if k == 0 or excess(tiny) < 0.0 else float(brentq(excess, tiny, at, xtol=1e-15))
    high = 1.0 if k == n or excess(1.0 - tiny) < 0.0 else float(brentq(excess, at, 1.0 - tiny, xtol=1e-15))
    return Interval(low, high)
