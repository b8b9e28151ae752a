"""What LIVE-GATE proves.

Symbols: E, F length of the difference between run and prediction at a sample and at the next one, B a bound of E; w
length of the disturbance, q their inner product; r the lag allowed, g the gain Lambda, h the period; D, P distances to
a point in the run and in the prediction, d the safe one, v the speed limit, x the rate at which the point is left; l, p
lag and predicted lag; t, s samples, o last on time, W time behind; u, m end of the try and of the motion, a its begin,
y its length, z its speed, H the period of the gatekeeper.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from airground_drake.gatekeeper.patience import Patience
from airground_drake.verify.engines.obligation import Obligation, Term
from airground_drake.verify.engines.rewriting import terms
from airground_drake.verify.engines.symbolic_execution import branches
from airground_drake.verify.model.patience.relation import SYMBOLS as PATIENCE_SYMBOLS
from airground_drake.verify.model.patience.relation import symbolic

SYMBOLS = ("E", "F", "w", "q", "r", "g", "h", "D", "P", "d", "v", "x", "l", "p", "t", "s", "o", "W", "u", "m", "a", "y",
           "z", "H", "B")  # fmt: skip


@dataclass(frozen=True)
class Tracking:
    """What is assumed of the way and of the law; mutants change it.

    Attributes:
        disturbance: largest, as a polynomial in g, r, h.
        contraction: factor of the difference in one period: in every direction in which the UGV moves, so that J_int
            must leave none out.
        room: what predicted distances have beyond d.
    """

    disturbance: str = "g*r"
    contraction: str = "1 - g*h"
    room: str = "v*h + r"


def obligations(tracking: Tracking, kind: type[Patience]) -> list[Obligation]:
    """That the run stays near the prediction, has room, is never late and ends."""
    return [*_stays_near(tracking), *_stays_below(tracking), *_has_room(tracking), *_is_on_time(kind)]


def _obligation(
    name: str, says: str, goal: str, hypotheses: dict[str, str], proof: tuple[Term, ...],
    strict: dict[str, str] | None = None, equations: dict[str, str] | None = None,
    multipliers: dict[str, str] | None = None,
) -> Obligation:  # fmt: skip
    return Obligation(name, says, SYMBOLS, goal, hypotheses, strict or {}, equations or {}, certificate=proof,
                      equation_multipliers=multipliers or {})  # fmt: skip


def _stays_near(tracking: Tracking) -> Iterator[Obligation]:
    """The difference never leaves the ball: F^2 = k^2 E^2 + 2 k h q + h^2 w^2 <= (k E + h w)^2 <= r^2, k = 1 - g h."""
    k = tracking.contraction
    yield _obligation(
        "stays_near",
        "run and prediction differ by no more than r at the next sample, if they do at this one",
        "r**2 - F**2",
        {
            "length": "E", "disturbed": "w", "radius": "r", "contracts": k, "inside": "r - E",
            "bounded": f"{tracking.disturbance} - w", "cauchy": "E*w - q",
        },
        terms(
            "contracts inside radius", "contracts contracts inside length", "contracts inside period disturbed",
            "period bounded radius", "period bounded contracts length", "period period bounded disturbed",
            "2 contracts period cauchy",
        ),
        {"period": "h", "gain": "g"},
        {"step": f"F**2 - ({k})**2*E**2 - 2*({k})*h*q - h**2*w**2"},
        {"step": "-1"},
    )  # fmt: skip


def _stays_below(tracking: Tracking) -> Iterator[Obligation]:
    """Whatever the disturbance is: where E <= B, F <= k B + h w, k = 1 - g h. A run is judged by this bound."""
    k = tracking.contraction
    yield _obligation(
        "stays_below",
        "run and prediction differ by k B + h w at most at the next sample, if by B at most at this one",
        f"(({k})*B + h*w)**2 - F**2",
        {"length": "E", "disturbed": "w", "bound": "B", "contracts": k, "below": "B - E", "cauchy": "E*w - q"},
        terms(
            "contracts contracts below bound", "contracts contracts below length",
            "2 contracts period below disturbed", "2 contracts period cauchy",
        ),
        {"period": "h", "gain": "g"},
        {"step": f"F**2 - ({k})**2*E**2 - 2*({k})*h*q - h**2*w**2"},
        {"step": "-1"},
    )  # fmt: skip


def _has_room(tracking: Tracking) -> Iterator[Obligation]:
    """Within the ball no inequality binds, whatever the command up to the speed limit."""
    near = {"inside": "r - E", "moved": "D - P + E", "limit": "x + v"}
    yield _obligation(
        "room_from_obstacles", "no inequality of an obstacle binds: n.v >= -(D - d)/h", "h*x + D - d",
        {**near, "room": f"P - d - ({tracking.room})"}, terms("inside", "moved", "room", "period limit"),
        {"period": "h"},
    )  # fmt: skip
    yield _obligation(
        "room_from_robots", "no inequality of a robot binds: n.v >= -(D - d)/(2 h)", "2*h*x + D - d",
        {**near, "room": f"P - d - ({tracking.room}) - v*h"}, terms("inside", "moved", "room", "2 period limit"),
        {"period": "h"},
    )  # fmt: skip


def _is_on_time(kind: type[Patience]) -> Iterator[Obligation]:
    """A UGV that near is on time at every sample, which is never late, and the try is over when the motion is."""
    yield _obligation(
        "on_time", "the lag is no more than the predicted one and r", "p + r - l",
        {"inside": "r - E", "triangle": "p + E - l"}, terms("inside", "triangle"),
    )  # fmt: skip
    for path, late in branches(
        lambda path: symbolic(kind)(path).late(path.symbol("o"), path.symbol("t")), PATIENCE_SYMBOLS
    ):
        if late:
            (guard, _), *_ = [(form, strict) for form, strict in path.guards if "t" in form.parts or "o" in form.parts]
            yield _obligation(
                "never_late", "who is on time now is not late: the guard of being late is not met",
                f"-({guard})", {}, terms("patient"), {"patient": "W"}, {"now": "o - t"}, {"now": "1"},
            )  # fmt: skip
    yield _obligation(
        "ends", "the try is over one period after the motion at the latest: length over speed after the begin",
        "z*(a + H - s) + y", {"sample": "u + H - s", "until": "m - u"}, terms("speed sample", "speed until"),
        {"speed": "z"}, {"motion": "z*(m - a) - y"}, {"motion": "-1"},
    )  # fmt: skip
