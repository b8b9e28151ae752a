"""Units that a log leaves open, from what it says: stamps since 1970, and motion that the scenario makes impossible."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import product

import numpy as np

from airground_drake.base.errors import LogError, one_line
from airground_drake.check.files import Json
from airground_drake.check.scenario import robots_of
from airground_drake.logs.stream import OF_MESSAGES, PER_M, PER_S, SINCE_1970, Stream

TOO_LONG = 1_000.0
"""Stamps that would make a log so many times longer than the scenario are not since 1970: they are of a finer unit."""
NEAR_M = 0.1
"""A log that begins so close to where a body starts begins there, m."""
LONG, SELDOM_S = 2.0, 4.0
"""Times so far apart, in a log so much longer than the scenario, are milliseconds if no robot is too fast then."""
IMPOSSIBLE = 20.0
"""So many times the speed limits, the duration or the size of a scenario are taken as a sign of another unit."""
NAMES = {
    "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds", "s": "seconds",
    "mm": "millimetres", "cm": "centimetres", "m": "metres",
}  # fmt: skip


def settle(streams: Mapping[str, Stream], scenario: Json, time_unit: str, length_unit: str) -> list[str]:
    """Give every stream its units, and say which ones were not seconds and metres.

    Args:
        streams: by body.
        scenario: as resolved.
        time_unit: of streams that do not say theirs; '' to find out.
        length_unit: of streams that do not say theirs; '' to find out.

    Returns:
        Remarks.

    Raises:
        LogError: if units that are not stated differ between bodies.
    """
    said = dict[str, None]()
    for stream in streams.values():
        stated = stream.time_unit, stream.length_unit
        for unit, stamps, what in ((stated[0], stream.clock, "times"), (stated[1], "", "lengths")):
            if unit not in ("", "s", "m") and not (unit == "ns" and stamps in OF_MESSAGES):
                said[f"{what} are in {NAMES[unit]}, as the file says"] = None
        stream.time_unit = stream.time_unit or time_unit or _since_1970(stream, float(scenario["duration_s"]))
        stream.length_unit = stream.length_unit or length_unit
        if stream.time_unit in ("ms", "us", "ns") and not stated[0]:
            why = "as chosen" if time_unit else "by their size, stamps since 1970"
            said[f"times are in {NAMES[stream.time_unit]}: {why}"] = None
    open_time = [each for each in streams.values() if not each.time_unit]
    open_length = [each for each in streams.values() if not each.length_unit]
    time, length = "s", "m"
    if open_time or open_length:
        judged = {name: each for name, each in streams.items() if name in robots_of(scenario) and len(each.whole) > 1}
        time, length = _likely(judged, scenario)
        _alike({name: each for name, each in judged.items() if not each.length_unit}, length, scenario)
    for each in open_time:
        each.time_unit = time
    for each in open_length:
        each.length_unit = length
    if open_time and time != "s":
        said[f"times are taken as {NAMES[time]}: as seconds, the log would be far longer than the scenario"] = None
    if open_length and length != "m":
        said[f"lengths are taken as {NAMES[length]}: as metres, no robot could be so far away, or so fast"] = None
    return list(said)


def _alike(streams: Mapping[str, Stream], length: str, scenario: Json) -> None:
    """Refuse a stream that begins where its body starts if it is in metres, where all are taken as in another unit."""
    for name, each in streams.items():
        start = np.array(robots_of(scenario)[name]["start_m"][:2])
        off = {unit: float(np.linalg.norm(each.places[0, :2] / PER_M[unit] - start)) for unit in ("m", length)}
        if off["m"] <= NEAR_M and off[length] > 5.0 * NEAR_M:
            raise LogError(
                one_line(f"lengths of {each.label} fit {name}'s start in metres, others only fit in {NAMES[length]}; "
                         "wanted: one unit for all, or units in the names of columns (x_mm)")
            )  # fmt: skip


def _since_1970(stream: Stream, duration_s: float) -> str:
    largest = float(np.abs(stream.whole).max(initial=0))
    unit = next((unit for unit, least in SINCE_1970 if largest >= least), "")
    return unit if unit and float(np.ptp(stream.ns(unit))) / 1e9 <= TOO_LONG * duration_s else ""


def _is_seldom(streams: Mapping[str, Stream], lasting: float) -> bool:
    """Whether a log in seconds would be much longer than the scenario, with its samples seconds apart."""
    steps = [np.diff(each.ns("s")) / 1e9 for each in streams.values() if not each.time_unit]
    return lasting > LONG and min(float(np.median(each)) for each in steps) >= SELDOM_S


def _likely(streams: Mapping[str, Stream], scenario: Json) -> tuple[str, str]:
    """The units of time and length that are still open, together: the first that make the motion possible."""
    robots = robots_of(scenario)
    starts = np.array([robots[name]["start_m"] for name in streams]).reshape(-1, 3)
    goals = np.array([each["target_m"] for each in scenario["ugvs"].values()] + starts.tolist())
    size_m = max(1.0, float(np.ptp(goals[:, :2], axis=0).max()))

    def found(time: str, length: str) -> tuple[float, float, float]:
        """Duration, speed and distance from the starts, as shares of what the scenario says."""
        lasting, speed, away = 0.0, 0.0, 0.0
        for (name, each), start in zip(streams.items(), starts, strict=True):
            t = each.ns(each.time_unit or time) / 1e9
            places = each.places[:, :2] / PER_M[each.length_unit or length]
            step_s = np.diff(t)
            moved = np.linalg.norm(np.diff(places, axis=0), axis=1)[step_s > 0.0] / step_s[step_s > 0.0]
            lasting = max(lasting, float(np.ptp(t)) / float(scenario["duration_s"]))
            if len(moved):
                speed = max(speed, float(np.percentile(moved, 90.0)) / float(robots[name]["max_speed_m_s"]))
            away = max(away, float(np.linalg.norm(places[0] - start[:2])) / size_m)
        return lasting, speed, away

    times = [""] if all(each.time_unit for each in streams.values()) else [*PER_S]
    lengths = [""] if all(each.length_unit for each in streams.values()) else [*PER_M]
    if streams and lengths[0]:
        fitting = [unit for unit in lengths if found(times[0], unit)[2] * size_m <= NEAR_M]
        lengths = lengths if lengths[0] in fitting else fitting[:1] or lengths
    possible = [both for both in product(times, lengths) if max(found(*both)) <= IMPOSSIBLE]
    usual = times[0], lengths[0]
    if not streams or not possible:
        return usual[0] or "s", usual[1] or "m"
    if usual in possible:
        if usual[0] and _is_seldom(streams, found(*usual)[0]) and found("ms", usual[1])[1] <= 1.0:
            return "ms", usual[1] or "m"
        return usual[0] or "s", usual[1] or "m"

    def oddness(both: tuple[str, str]) -> float:
        lasting, speed, away = found(*both)
        return abs(math.log(max(lasting, 1e-12))) + max(0.0, math.log(max(speed, 1e-12))) + away

    time, length = min(possible, key=oddness)
    return time or "s", length or "m"
