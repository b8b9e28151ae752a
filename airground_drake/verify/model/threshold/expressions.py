"""The functions of (16)-(19) whose signs and derivatives THR-ROOT and THR-OPT rest on.

With u = 2 zeta drift / noise^2, k = noise^2 / drift^2 (s) and r = c2 / c1 (s), (19) with its right-hand side the
right way up is f(u) = k (sinh u + u) - r = 0, and dB/dzeta is f(u) times something positive: both claims rest on
the signs of elementary functions at rational points and on a few identities. Certificates as in
`engines.ball_arithmetic`.
"""

from __future__ import annotations

from typing import Literal

from airground_drake.verify.engines.ball_arithmetic import Derivative

SINH = "((exp(u)-exp(-u))/2)"

RESIDUAL = f"k*({SINH}+u)-r"


def risk(u: str = "u") -> str:
    """B of (16) without initial deviation, at the argument of this name."""
    return f"c1*k/2*{u}*(exp({u})-1)/(exp({u})+1)+c2/(exp({u})+1)"


BIAS = "(1-exp(-w))*(c1*k*u-c2)/(exp(u)-exp(-u))-c1*k*w/2"
"""B with an initial deviation is `risk` plus this, w = 2 deviation drift / noise^2."""

SLOPE_AT_ROOT = "c1/drift*(1-exp(-w))*(exp(u)+1)/(exp(u)-1)"
"""dB/dzeta, 1/(m), where f(u) = 0: (c1/drift) (1 - exp(-w)) coth(u/2)."""

DRIFT_LEVEL = f"({SINH}+u)/u**2-m"

DRIFT_TURN = f"u*(exp(u)+exp(-u))/2-u-2*{SINH}"


def _factor(sign: Literal["+", "-"] = "+") -> str:
    return f"q/(q+1)**2*(c1*k*((q-1/q)/2{sign}u)-c2)"


INCREASING = Derivative(
    "increasing",
    "f' = k (exp(u) + 1)^2 / (2 exp(u)), which is positive: f has at most one root.",
    "k*((q-1/q)/2+u)-r",
    {"u": "1", "q": "q"},
    "k*(q+1)**2/(2*q)",
    {"k": 1, "r": 1, "u": 1, "q": 3},
)


def factorisation(sign: Literal["+", "-"] = "+") -> Derivative:
    """dB/du; with the other sign a mutant, sinh u - u."""
    return Derivative(
        "factorisation",
        "dB/du = c1 exp(u) / (exp(u) + 1)^2 f(u): dB/dzeta has the sign of f.",
        "c1*k/2*u*(q-1)/(q+1)+c2/(q+1)",
        {"u": "1", "q": "q"},
        _factor(sign),
        {"c1": 1, "c2": 1, "k": 1, "u": 1, "q": 4},
    )


BIASED = Derivative(
    "biased",
    "With b = 1 - exp(-w) for an initial deviation, dB/du is b c1 k coth(u/2) / 2 where f(u) = 0: not 0 unless b is.",
    "c1*k/2*u*(q-1)/(q+1)+c2/(q+1)+b*(c1*k*u-c2)/(q-1/q)",
    {"u": "1", "q": "q"},
    f"{_factor()}-(c1*k*((q-1/q)/2+u)-c2)*b*(q+1/q)/(q-1/q)**2+b*c1*k*(q+1)/(2*(q-1))",
    {"b": 1, "c1": 1, "c2": 1, "k": 1, "u": 1, "q": 12},
)

TURNING = Derivative(
    "turning",
    "(sinh u + u)/u^2 has the derivative (u cosh u - u - 2 sinh u)/u^3.",
    "((q-1/q)/2+u)/u**2",
    {"u": "1", "q": "q"},
    "(u*(q+1/q)/2-u-(q-1/q))/u**3",
    {"u": 6, "q": 4},
)

ONE_ROOT = (
    "f(0) = -r < 0, f is continuous, and f' > 0 by `increasing`: exactly one root in all u > 0.",
    "By `root_below` and `root_above` it lies between the ends of the enclosure of u; zeta = u noise^2 / (2 drift).",
)

MINIMUM = (
    "By `factorisation`, q = exp(u) and du/dzeta = 2 drift/noise^2 > 0, dB/dzeta has the sign of f at every u > 0; f "
    "increases: B falls up to the root and rises beyond it.",
    "`printed_*` enclose the root of the printed equation in v; `printed_slope` is f at the end of that enclosure "
    "next to the root, and `printed_risk` the difference in B of the ends next to each other: B is monotone between.",
    "By `biased`, dB/dzeta at the root with deviation y0, w = 2 y0 drift/noise^2, is (c1/drift) (1 - exp(-w)) "
    "coth(u/2), whose size falls with u: `ahead_*` (w > 0) and `behind_*` (w < 0) bound it on the whole enclosure.",
    "zeta in force solves the equation for the drift u noise^2/(2 zeta) where (sinh u + u)/u^2 = m, m = ratio "
    "noise^2/(4 zeta^2). By `turning` it falls or rises with u cosh u - u - 2 sinh u = -2 u + sum over j >= 1 of "
    "(2 j - 1)/(2 j + 1)! u^(2 j + 1), which divided by u increases: one minimum, by `turn_*`, so one root on each "
    "side of it if the minimum is below m and none if it is above.",
)
