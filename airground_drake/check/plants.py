"""Plants whose bodies are off their steered points: cost in distance, and motion.

The law steers a point that moves straight from row to row. The body moves according to the plant:

    unicycle   the axle is l behind the hand point, which goes along an arc with the same ends in each control period
    ackermann  the same of the rear axle of a car
    delay      the body is where the steered point was
    lag        tau v' = u - v; the steered point is p + tau v

The class of a user's plant is not available here. Its drift and cover are declared; the recorded values of both are
compared with the recorded positions.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .files import Json
from .rules import SMALL, Array, close

Rows = npt.NDArray[np.intp]

DRIVES = ("unicycle", "ackermann")  # those steered by a hand point
KINDS = ("first_order", *DRIVES, "lag", "delay")  # kinds of plants; any other is the name of a class
STRAIGHT_M = 1e-10  # largest deviation from a straight line of parts that count as straight, m
MOST_PARTS = 5000


class Taken(NamedTuple):
    """The numbers of a robot's plant: lengths, m; lag and delay, s; and the limit of its commands, m/s."""

    # A drift costs the distance `drift_m`, and `slip_m` in one period. `drawn_m` is the part of `body_m` by which a
    # robot that never drives backwards is behind its steered point.

    body_m: float
    lag_s: float
    delay_s: float
    most_m_s: float
    drift_m: float = 0.0
    slip_m: float = 0.0
    drawn_m: float = 0.0

    @property
    def cover_m(self) -> float:
        """How far the body may be from the steered point, m."""
        return self.body_m + self.most_m_s * (self.lag_s + self.delay_s)


def plants_of(robot: Json) -> list[Json]:
    """The plants of a robot, without first-order ones."""
    return [plant for plant in robot["plant"] if plant["kind"] != "first_order"]


def unicycle_of(robot: Json) -> Json | None:
    """The unicycle or car among a robot's plants."""
    return next((plant for plant in robot["plant"] if plant["kind"] in DRIVES), None)


def only_ahead(drive: Json) -> bool:
    """Whether a unicycle never drives backwards; a car does not."""
    return drive["kind"] != "unicycle" or not drive["backwards"]


def least_radius_m(drive: Json) -> float:
    """Least turning radius of a car, m; 0 of a unicycle."""
    return float(drive["wheelbase_m"]) / math.tan(drive["max_steering_rad"]) if drive["kind"] != "unicycle" else 0.0


def own_of(robot: Json) -> Json | None:
    """The user's own class among a robot's plants."""
    return next((plant for plant in robot["plant"] if plant["kind"] not in KINDS), None)


def taken(robot: Json, control: Json) -> Taken:
    most, period_s = float(robot["max_speed_m_s"]), float(control["period_s"])
    if own := own_of(robot):
        drift = float(own["drift_m_s"])
        restored = drift / float(control["avoidance_gain_1_s"]) if drift else 0.0
        return Taken(float(own["cover_m"]), 0.0, 0.0, most, restored, drift * period_s)
    lag_s, delay_s = (sum(plant.get(key, 0.0) for plant in plants_of(robot)) for key in ("time_constant_s", "delay_s"))
    drive = unicycle_of(robot)
    body = drive["hand_point_m"] + _dip_m(drive, most * period_s, period_s) if drive else 0.0
    drawn = float(drive["hand_point_m"]) if drive and only_ahead(drive) else 0.0
    return Taken(body, lag_s, delay_s, most, drawn_m=drawn)


def _dip_m(drive: Json, chord_m: float, period_s: float) -> float:
    """|omega| ||w|| h^2 / 8 for the largest turn, when the hand point moves ||w|| h along an arc with this chord."""
    turns = [drive["max_turn_rad_s"]] if drive.get("max_turn_rad_s") else []
    if drive.get("wheel_base_m"):
        turns.append(2.0 * drive["max_wheel_speed_m_s"] / drive["wheel_base_m"])
    turned = [turn * period_s for turn in turns]
    if chord_m <= 2.0 * drive["hand_point_m"]:
        turned.append(2.0 * math.asin(0.5 * chord_m / drive["hand_point_m"]))
    angle = min(turned)
    return angle * chord_m * (0.5 * angle) / math.sin(0.5 * angle) / 8.0 if angle else 0.0


def law_m(safe_m: float, own: Taken, other: Taken | None, *, passive: bool) -> float:
    """Distance that the law keeps so that the bodies keep `safe_m`, m; `other` is None beside an obstacle."""
    if passive:
        return safe_m + own.cover_m + own.drift_m
    if other is None and own.drawn_m:
        return math.sqrt(safe_m**2 + own.drawn_m**2) + (own.body_m - own.drawn_m)
    both = (own, other) if other else (own, Taken(0.0, own.lag_s, own.delay_s, 0.0))
    late = safe_m + abs(both[0].delay_s - both[1].delay_s) * min(plant.most_m_s for plant in both)
    closing, bodies = sum(plant.most_m_s for plant in both), sum(plant.body_m + plant.drift_m for plant in both)
    if not any(plant.lag_s for plant in both):
        return late + bodies
    bounds_m = []
    for tau in {0.0, both[0].lag_s, both[1].lag_s}:
        unlike = sum(abs(plant.lag_s - tau) * plant.most_m_s for plant in both)
        bounds_m.append(unlike + math.sqrt(late**2 + (tau * closing) ** 2))
    return min(bounds_m) + bodies


class Way(NamedTuple):
    """The recorded motion of a body: places, (T, 3), m, at times (T,), s; its headings, rad, or velocities, m/s."""

    t_s: Array
    place_m: Array
    heading_rad: Array | None = None
    velocity_m_s: Array | None = None
    lag_s: float = 0.0

    def bent_m(self) -> float:
        """The largest distance from the straight line between two rows, m."""
        chord, lasting = np.diff(self.place_m, axis=0), np.diff(self.t_s)
        if self.heading_rad is not None:
            sagitta = 0.5 * np.linalg.norm(chord, axis=1) * np.abs(np.tan(0.25 * np.diff(self.heading_rad)))
            return float(sagitta.max(initial=0.0))
        if self.velocity_m_s is not None:
            fades = 1.0 - np.exp(-lasting / self.lag_s)
            change = np.linalg.norm(np.diff(self.velocity_m_s, axis=0), axis=1)
            push = np.divide(change, fades, out=np.zeros_like(fades), where=fades > 0.0) / self.lag_s
            return float((push * lasting**2 / 8.0).max(initial=0.0))
        return 0.0

    def within(self, row: int, parts: int) -> Array:
        """Positions at equal time steps between two rows, (parts + 1, 3), m."""
        begin, end = self.place_m[row], self.place_m[row + 1]
        share = np.linspace(0.0, 1.0, parts + 1)
        if self.heading_rad is not None and (turn := float(self.heading_rad[row + 1] - self.heading_rad[row])):
            chord = complex(*(end - begin)[:2])
            spot = chord * np.sin(0.5 * turn * share) / math.sin(0.5 * turn) * np.exp(0.5j * turn * (share - 1.0))
            flat = np.column_stack([spot.real, spot.imag, share * (end - begin)[2]])
            return np.asarray(begin + flat)
        if self.velocity_m_s is not None and (lasting := float(self.t_s[row + 1] - self.t_s[row])) > 0.0:
            before, after = self.velocity_m_s[row], self.velocity_m_s[row + 1]
            fades = -math.expm1(-lasting / self.lag_s)
            bend = self.lag_s * (after - before)
            return np.asarray(
                begin
                + np.outer(share, end - begin + bend)
                - np.outer(-np.expm1(-share * lasting / self.lag_s), bend) / fades
            )
        return np.asarray(begin + np.outer(share, end - begin))


def moves_as_its_plant(robot: str, spec: Json, way: Way, steered: Array, command: Array, period_s: float) -> None:
    """Check a recorded body against its plant; `steered` (T, 3), m."""
    # command: in force up to each row, (T, 3), m/s; 0 at the first.
    t_s = way.t_s
    point = steered
    rate = command
    for plant in plants_of(spec):
        if plant["kind"] == "delay":
            then = t_s - plant["delay_s"]
            point = np.stack([np.interp(then, t_s, axis) for axis in point.T], axis=1)
            row = np.searchsorted(t_s, then - SMALL)  # the first row at or after that time
            rate = np.where((then > SMALL)[:, None], rate[np.minimum(row, len(t_s) - 1)], 0.0)
        elif plant["kind"] == "lag":
            tau, expected = plant["time_constant_s"], np.zeros_like(rate)
            for k, kept in enumerate(np.exp(-np.diff(t_s) / tau), start=1):
                expected[k] = rate[k] + kept * (expected[k - 1] - rate[k])
            close("velocity of a body", way.velocity_m_s, expected, within=SMALL, about=robot, t_s=t_s)
            point = point - tau * expected
        else:
            heading, point = _axle(plant, way, point, rate, period_s)
            close("heading of a body", way.heading_rad, heading, within=SMALL, about=robot, t_s=t_s)
    close("place of a body", way.place_m, point, within=SMALL, about=robot, t_s=t_s)


def misses_as_recorded(
    robot: str, way: Way, steered: Array, command: Array, rows: Rows, recorded: tuple[Array, Array]
) -> None:
    """Check the recorded drift and cover of a user's plant, period by period."""
    # steered: (T, 3), m; command: (S, 3), m/s; rows: (S + 1,)
    # recorded: drift, m/s, and cover, m, (S,) each.
    lasting, t_s = np.diff(way.t_s[rows]), way.t_s[rows[:-1]]
    missed = np.linalg.norm(np.diff(steered[rows], axis=0) - lasting[:, None] * command, axis=1)
    close("drift of a plant", recorded[0] * lasting, missed, within=SMALL, about=robot, t_s=t_s)
    off = []
    for begin, end, whole in zip(rows[:-1], rows[1:], lasting, strict=True):
        part = (way.t_s[begin : end + 1, None] - way.t_s[begin]) / whole
        line = (1.0 - part) * steered[begin] + part * steered[end]
        off.append(float(np.linalg.norm(way.place_m[begin : end + 1] - line, axis=1).max()))
    close("cover of a plant", recorded[1], off, within=SMALL, about=robot, t_s=t_s)


def _axle(drive: Json, way: Way, steered: Array, command: Array, period_s: float) -> tuple[Array, Array]:
    """Headings, (T,), and axles, (T, 3), of a unicycle, from its start heading."""
    hand = float(drive["hand_point_m"])
    begun = 0
    heading = float(drive["heading_rad"])
    headings, axles = np.empty(len(steered)), np.empty_like(steered)
    headings[0] = heading
    axles[0] = steered[0] - hand * np.array([math.cos(heading), math.sin(heading), 0.0])
    for k in range(1, len(steered)):
        since = way.t_s[k] - way.t_s[begun]
        u = complex(command[k, 0], command[k, 1]) * np.exp(-1j * heading)  # in the frame of the body
        half = float(np.angle(2.0 * hand + u * period_s)) if u.imag else 0.0
        whole = u * period_s + hand * (1.0 - np.exp(2j * half))  # of the axle in a period
        part = since / period_s
        gone = whole * (math.sin(half * part) / math.sin(half) if half else part) * np.exp(1j * half * (part - 1.0))
        spot = gone * np.exp(1j * heading)
        headings[k] = heading + 2.0 * half * part
        base = steered[k] - since * command[k]
        axles[k] = base + np.array([spot.real, spot.imag, 0.0])
        axles[k, :2] -= hand * np.array([math.cos(heading), math.sin(heading)])
        if abs(since - period_s) <= SMALL:
            begun, heading = k, float(headings[k])
    return headings, axles
