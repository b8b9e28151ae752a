"""Units that a log does not state, inferred from Unix times and from motion that the scenario makes impossible."""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import LogError
from airground_drake.check.files import Json
from airground_drake.check.scenario import robots_of
from airground_drake.study.logs.stream import OF_MESSAGES, PER_M, PER_S, Stream, unit_since_1970

# Stamps that would make a log this many times longer than the scenario are not since 1970 but in a finer unit.
TOO_LONG = 100.0
# A log that begins this close to a body's start begins there; starts this far from (0, 0) tell units and axes apart, m.
NEAR_M, APART_M = 0.1, 0.5
# Times this far apart, in a log this many times longer than the scenario, are milliseconds if no robot is then too
# fast.
LONG, SELDOM_S = 2.0, 4.0
# Whole numbers may be frame numbers if, as times, they make robots slower or faster than these shares of their limits.
SLOW, FAST = 0.2, 2.0
# A multiple of the speed limits, the duration or the size of a scenario that indicates another unit.
IMPOSSIBLE = 20.0
NAMES = {
    "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds", "s": "seconds",
    "mm": "millimetres", "cm": "centimetres", "m": "metres",
}  # fmt: skip


class _Motion(NamedTuple):
    """A log in some units relative to the scenario's duration, speeds and distances, with the most extreme body."""

    lasting: float
    speed: float
    away: float
    lasts_s: float
    fastest: tuple[float, str] = (0.0, "")
    farthest: tuple[float, str] = (0.0, "")

    @property
    def is_possible(self) -> bool:
        """Whether duration, speeds and distances are plausible."""
        return max(self.lasting, self.speed) <= IMPOSSIBLE

    @property
    def oddness(self) -> float:
        speed = abs(math.log(self.speed)) if self.speed else 0.0
        return abs(math.log(max(self.lasting, 1e-12))) + speed + self.away


def settle(
    streams: Mapping[str, Stream], scenario: Json, time_unit: str, length_unit: str, rate_hz: float
) -> list[str]:
    """Set the units of every stream; returns remarks on other units than seconds and metres."""
    # time_unit, length_unit: of streams that do not say theirs; '' to find out.
    # rate_hz: frames per second of streams whose times are numbers of frames; 0 without such streams.
    remarks = dict[str, None]()
    if rate_hz:
        _of_frames(streams, rate_hz)
        remarks[f"times are numbers of frames, {rate_hz:g} per second: as chosen"] = None
    for stream in streams.values():
        stated = stream.time_unit, stream.length_unit
        for unit, stamps, what in ((stated[0], stream.clock, "times"), (stated[1], "", "lengths")):
            if unit not in ("", "s", "m") and not (unit == "ns" and stamps in OF_MESSAGES) and not rate_hz:
                remarks[f"{what} are in {NAMES[unit]}, as the file says"] = None
        if stream.counts_frames and not (stated[0] or time_unit):
            raise LogError(f"the times of {stream.label} are numbers of frames ({stream.clock}); {_WANTED}")
        stream.time_unit = stream.time_unit or time_unit or _since_1970(stream, float(scenario["duration_s"]))
        stream.length_unit = stream.length_unit or length_unit
        if stream.time_unit in ("ms", "us", "ns") and not stated[0]:
            why = "as chosen" if time_unit else "by their size, stamps since 1970"
            remarks[f"times are in {NAMES[stream.time_unit]}: {why}"] = None
    open_time = [stream for stream in streams.values() if not stream.time_unit]
    open_length = [stream for stream in streams.values() if not stream.length_unit]
    if open_time or open_length:
        judged = {
            name: stream for name, stream in streams.items() if name in robots_of(scenario) and len(stream.whole) > 1
        }
        time, length, whys = _likely(judged, scenario)
        remarks |= dict.fromkeys(whys)
        _alike({name: stream for name, stream in judged.items() if not stream.length_unit}, length, scenario)
        for undecided in open_time:
            undecided.time_unit = time
        for undecided in open_length:
            undecided.length_unit = length
    return list(remarks)


_WANTED = "wanted: --rate-hz with the frames per second, such as --rate-hz 25"


def _of_frames(streams: Mapping[str, Stream], rate_hz: float) -> None:
    counted = [stream for stream in streams.values() if not stream.time_unit and not stream.nano.any()]
    if not counted:
        raise LogError("--rate-hz is for logs whose times are numbers of frames; this log has other times")
    for numbered in counted:
        if float(np.abs(numbered.whole / rate_hz).max(initial=0.0)) > 9e9:
            raise LogError(f"{numbered.label} has numbers of frames beyond 9e9 s; wanted: another --rate-hz")
        numbered.whole, numbered.time_unit = np.round(numbered.whole * (1e9 / rate_hz)).astype(np.int64), "ns"


def _alike(streams: Mapping[str, Stream], length: str, scenario: Json) -> None:
    """Refuse a stream that matches its body's start in metres if the others are in another unit."""
    for name, stream in streams.items():
        start = np.array(robots_of(scenario)[name]["start_m"][:2])
        off = {unit: float(np.linalg.norm(stream.places[0, :2] / PER_M[unit] - start)) for unit in ("m", length)}
        if off["m"] <= NEAR_M and off[length] > 5.0 * NEAR_M:
            raise LogError(
                f"lengths of {stream.label} fit {name}'s start in metres, others only fit in {NAMES[length]}; "
                "wanted: one unit for all, or units in the names of columns (x_mm)"
            )


def _since_1970(stream: Stream, duration_s: float) -> str:
    if not len(stream.whole):
        return ""
    unit = unit_since_1970(float(stream.whole.min()), float(stream.whole.max()))
    return unit if unit and float(stream.elapsed_s(unit).max()) <= TOO_LONG * duration_s else ""


def _is_seldom(streams: Mapping[str, Stream], lasting: float) -> bool:
    """Whether a log in seconds would be much longer than the scenario, with samples seconds apart."""
    steps = [np.diff(stream.elapsed_s("s")) for stream in streams.values() if not stream.time_unit]
    return lasting > LONG and min(float(np.median(step)) for step in steps) >= SELDOM_S


def _likely(streams: Mapping[str, Stream], scenario: Json) -> tuple[str, str, list[str]]:
    """The unknown units of time and length, and the reasons for others than seconds and metres."""
    # Metres are rejected only if robots would be too fast in every unit of time, or far from the scenario, and if in
    # another unit they start as in the scenario, or move among its bodies.
    times = [""] if all(stream.time_unit for stream in streams.values()) else [*PER_S]
    lengths = [""] if all(stream.length_unit for stream in streams.values()) else [*PER_M]
    usual = times[0] or "s", lengths[0] or "m"
    if not streams:
        return *usual, []
    moving = {(time, length): _motion(streams, scenario, time, length) for time in times for length in lengths}
    time, length = _chosen(streams, scenario, moving, times, lengths)
    asked = moving[time, length]
    if times[0] and not any(stream.nano.any() for stream in streams.values() if not stream.time_unit):
        long, slow = moving["s", length].lasting > LONG, asked.speed < SLOW
        if not asked.is_possible or (time == "s" and long and slow) or (time != "s" and asked.speed > FAST):
            whole = next(stream for stream in streams.values() if not stream.time_unit)
            raise LogError(
                f"the times of {whole.label} ({whole.clock}) are whole numbers that fit no unit: as seconds, "
                f"the log would last {moving['s', length].lasts_s:.6g} s; {_WANTED}, if they are numbers of "
                "frames, or --time-unit"
            )
    whys = []
    if time not in ("", "s"):
        lasts = f"the log would last {moving['s', length].lasts_s:.6g} s, and the scenario {scenario['duration_s']:g} s"
        whys.append(f"times are taken as {NAMES[time]}: as seconds, {lasts}")
    if length not in ("", "m"):
        metres = moving[time, "m"]
        (speed, fast), (off, far) = metres.fastest, metres.farthest
        why = f"{far} would start {off:.3g} m from where the scenario has it"
        if metres.speed > IMPOSSIBLE:
            why = f"{fast} would move at {speed:.3g} m/s"
        whys.append(f"lengths are taken as {NAMES[length]}: as metres, {why}")
    return time or "s", length or "m", whys


def _chosen(
    streams: Mapping[str, Stream], scenario: Json, moving: Mapping[tuple[str, str], _Motion], times: list[str],
    lengths: list[str],
) -> tuple[str, str]:  # fmt: skip
    """The unit of time and that of length, chosen from the data; '' for one that is known."""
    usual = lengths[0]
    fitting = _fitting(streams, scenario, lengths) if usual else []
    if usual in fitting:
        lengths, fitting = [usual], []
    if fitting:
        possible = [time for time in times if moving[time, fitting[0]].is_possible]
        return _time(possible or times, fitting[0], streams, moving), fitting[0]
    possible = [time for time in times if moving[time, usual].is_possible]
    is_far = moving[times[0], usual].away > IMPOSSIBLE
    others = [
        (time, length) for (time, length), motion in moving.items()
        if length in lengths[1:] and motion.is_possible and motion.away <= IMPOSSIBLE
        and (time == times[0] or (is_far and moving[times[0], usual].lasting > IMPOSSIBLE))  # else one unit is enough
        and (motion.speed * IMPOSSIBLE >= 1.0 or not possible)  # else the robot drives slowly in another frame
    ]  # fmt: skip
    if others and (is_far or not possible):
        length = min(others, key=lambda both: moving[both].oddness)[1]
        return _time([time for time, unit in others if unit == length], length, streams, moving), length
    return _time(possible or times[:1], usual, streams, moving), usual


def _time(
    possible: list[str], length: str, streams: Mapping[str, Stream], moving: Mapping[tuple[str, str], _Motion]
) -> str:
    """The unit of time: seconds if they are possible, and the log is not one of milliseconds that fits better."""
    if possible[0] == "s":
        seldom = _is_seldom(streams, moving["s", length].lasting) and moving["ms", length].speed <= 1.0
        return "ms" if seldom else "s"
    return min(possible, key=lambda time: moving[time, length].oddness)


def _fitting(streams: Mapping[str, Stream], scenario: Json, lengths: list[str]) -> list[str]:
    """The units in which all robots begin at the scenario's starts; none if these are all near (0, 0)."""
    fitting = []
    for unit in lengths:
        first_m = {name: stream.places[0, :2] / PER_M[stream.length_unit or unit] for name, stream in streams.items()}
        if begin_at_starts(first_m, scenario):
            fitting.append(unit)
    return fitting


def begin_at_starts(first_m: Mapping[str, Array], scenario: Json) -> bool:
    """Whether first places, (2,) each, m, are the robots' starts, some of them `APART_M` or more from (0, 0)."""
    starts = {name: np.array(robots_of(scenario)[name]["start_m"][:2], dtype=np.float64) for name in first_m}
    if max((float(np.linalg.norm(start)) for start in starts.values()), default=0.0) < APART_M:
        return False
    return all(float(np.linalg.norm(place - starts[name])) <= NEAR_M for name, place in first_m.items())


def _motion(streams: Mapping[str, Stream], scenario: Json, time: str, length: str) -> _Motion:
    """The robots' motion, with unknown units set to these."""
    robots = robots_of(scenario)
    starts = {name: np.array(robots[name]["start_m"][:2], dtype=np.float64) for name in streams}
    goals = [np.array(ugv["target_m"][:2], dtype=np.float64) for ugv in scenario["ugvs"].values()]
    size_m = max(1.0, float(np.ptp([*goals, *starts.values()], axis=0).max()))
    lasts = speed = 0.0
    fastest, farthest = (0.0, ""), (0.0, "")
    for name, stream in streams.items():
        t = stream.elapsed_s(stream.time_unit or time)
        places = stream.places[:, :2] / PER_M[stream.length_unit or length]
        step_s, moved = np.diff(t), np.hypot(*np.diff(places, axis=0).T)
        moves = (step_s > 0.0) & (moved > 0.0)  # in a long log most robots stand most of the time
        lasts = max(lasts, float(np.ptp(t)))
        if moves.any():
            usual = float(np.percentile(moved[moves] / step_s[moves], 90.0))
            fastest, speed = max(fastest, (usual, name)), max(speed, usual / float(robots[name]["max_speed_m_s"]))
        farthest = max(farthest, (float(np.linalg.norm(places[0] - starts[name])), name))
    return _Motion(lasts / float(scenario["duration_s"]), speed, farthest[0] / size_m, lasts, fastest, farthest)
