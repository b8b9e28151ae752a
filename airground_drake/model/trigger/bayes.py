"""Decision time, error rate and Bayes-optimal threshold of the drift-diffusion model, eqs (16)-(19).

Formulas after Bogacz et al., Psychological Review 113(4), 2006, in physical units: threshold zeta and initial
deviation in m, drift in m/s, noise intensity in m/sqrt(s). The paper's (17)-(18) are these with the initial
deviation divided by the drift, that is in seconds; its (19) has the right-hand side upside down.
"""

import math


def decision_time(zeta: float, drift: float, noise: float, deviation: float = 0.0) -> float:
    """Mean time to reach +-zeta from `deviation`, (17), s; |deviation| < zeta, or ValueError."""
    _check(zeta, drift, noise, deviation)
    time = zeta / drift * math.tanh(zeta * drift / noise**2)
    return time + 2.0 * zeta / drift * _bias(zeta, drift, noise, deviation) - deviation / drift


def error_rate(zeta: float, drift: float, noise: float, deviation: float = 0.0) -> float:
    """Probability to reach -zeta first from `deviation`, (18); |deviation| < zeta, or ValueError."""
    _check(zeta, drift, noise, deviation)
    unbiased = 0.5 * (1.0 - math.tanh(zeta * drift / noise**2))
    return unbiased - _bias(zeta, drift, noise, deviation)


def bayes_risk(zeta: float, drift: float, noise: float, c1: float, c2: float, deviation: float = 0.0) -> float:
    """B = c1 T + c2 E, (16); c1 in 1/s, c2 without unit. Raises ValueError as its parts do."""
    return c1 * decision_time(zeta, drift, noise, deviation) + c2 * error_rate(zeta, drift, noise, deviation)


def optimal_threshold(drift: float, noise: float, c1: float, c2: float) -> float:
    """Threshold, m, that minimises the Bayes risk without initial deviation: (19) with c2/c1 on the right."""
    _need_positive(drift=drift, noise=noise, c1=c1, c2=c2)
    scale = 2.0 * drift / noise**2
    level = c2 / c1 * drift**2 / noise**2

    from scipy.optimize import brentq  # takes long to import, and a fixed threshold needs none of it

    def residual(u: float) -> float:  # u = 2 zeta drift / noise^2
        return math.sinh(u) + u - level

    # u <= sinh u <= (sinh u + u), so that the root lies between these; in floating point it may be one of them
    low, high = math.asinh(level / 2.0), min(level / 2.0, math.asinh(level))
    if low >= high or residual(low) >= 0.0:
        return low / scale
    if residual(high) <= 0.0:
        return high / scale
    return float(brentq(residual, low, high, xtol=4e-16 * low, rtol=8.9e-16)) / scale


def printed_threshold(drift: float, noise: float, c1: float, c2: float) -> float:
    """Root of (19) as printed, with c1/c2 on the right, m: it minimises nothing unless c1 = c2. Raises as above."""
    return optimal_threshold(drift, noise, c2, c1)


# Rules that compute the threshold from drift, noise, c1 and c2.
COMPUTED = {"bayes": optimal_threshold, "printed": printed_threshold}


def threshold(rule: str, zeta_m: float, c1_1_s: float, c2: float, drift_m_s: float, noise_m_sqrt_s: float) -> float:
    """The threshold by a rule of a scenario, m: the fixed one, or what the rule computes."""
    return COMPUTED[rule](drift_m_s, noise_m_sqrt_s, c1_1_s, c2) if rule in COMPUTED else zeta_m


def _bias(zeta: float, drift: float, noise: float, deviation: float) -> float:
    """(1 - exp(-2 y0 a / s^2)) / (2 sinh(2 zeta a / s^2)), so that nothing overflows, and small y0 do not cancel."""
    u = 2.0 * zeta * drift / noise**2
    w = 2.0 * deviation * drift / noise**2
    share = math.exp(-u) * -math.expm1(-w) if abs(w) < 1.0 else math.exp(-u) - math.exp(-u - w)
    return share / -math.expm1(-2.0 * u)


def _need_positive(**numbers: float) -> None:
    for name, value in numbers.items():
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{name} must be positive and finite, got {value!r}")


def _check(zeta: float, drift: float, noise: float, deviation: float) -> None:
    _need_positive(zeta=zeta, drift=drift, noise=noise)
    if not abs(deviation) < zeta:
        raise ValueError(f"the initial deviation {deviation!r} m must lie inside the thresholds +-{zeta!r} m")
