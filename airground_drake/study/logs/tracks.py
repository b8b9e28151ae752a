"""Streams joined to one track per body: in one frame, in the order of time, split where a body was not recorded."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.errors import LogError
from airground_drake.check.files import Json
from airground_drake.check.limits import LARGEST
from airground_drake.check.scenario import expected_m_s, robots_of, uavs_of
from airground_drake.report.sentences import counted
from airground_drake.study.logs import axes, units
from airground_drake.study.logs.stream import (
    HEADERS,
    OF_BODY,
    OF_MESSAGES,
    PER_M,
    RECEIPT,
    Log,
    Stream,
    Whole,
    body_of,
    is_elsewhere,
    renamed,
    segments,
)

# A body was not recorded where two of its samples are farther apart than this multiple of the usual time between.
GAP = 2.5
SINCE_1970_NS = 10**17  # from here on, stamps are since 1970; times are then from the first sample
SAME_M = 1e-9  # positions of one body at one time that differ by less are one
# Share of a body's rows that may contradict others: with more, stamps are too coarse, or recordings are mixed.
CONTRADICTORY = 0.1
# A body leaps if it moves farther than this from one row to the next, and this many times faster than its limit. Leaps
# come from tracking systems that lose a body: they write (0, 0), another number, or the last place again.
LOST_M, LOST = 0.05, 5.0
MOST_LEAPS = 0.5  # share of a body's steps that may be leaps
ORIGIN_M = 1e-3  # robots that start so close to (0, 0) start there
CLOCKS_S = 0.5  # header stamps that differ by more than messages may take indicate different clocks
MOST_PASSES = 100  # of a search for rows that are lost
# Stretches in the order of time that are compared with each other, and rows of one at least.
MOST_RECORDINGS, FEW = 20, 5


class Span(NamedTuple):
    """A stretch of time, s."""

    begin: float
    end: float


def joint(spans: Sequence[Span]) -> list[Span]:
    """Stretches in the order of time; those that touch are one."""
    begins = [span.begin for k, span in enumerate(spans) if not k or span.begin > spans[k - 1].end]
    ends = [span.end for k, span in enumerate(spans) if k + 1 == len(spans) or spans[k + 1].begin > span.end]
    return [Span(*both) for both in zip(begins, ends, strict=True)]


@dataclass(eq=False)
class Track:
    """Where one body was; n samples, strictly increasing in time."""

    t_s: Array  # times, (n,)
    places_m: Array  # (n, 3); z is nan if the log lacks it
    gap_s: float  # motion between two samples that are farther apart is unknown
    origin: dict[str, str] = field(default_factory=dict)  # stream, frame and clock
    # Times of samples that the body cannot have reached from the previous one, or that repeat a place before that.
    leaps_s: tuple[float, ...] = ()
    usual_s: float = 0.0  # usual time between two samples

    @property
    def is_known(self) -> Flags:
        """In which intervals between two samples the motion is known, (n - 1,)."""
        return (np.diff(self.t_s) <= self.gap_s * (1.0 + 1e-9)) & ~np.isin(self.t_s[1:], self.leaps_s)

    @property
    def spans(self) -> list[Span]:
        """Stretches without a gap; one sample alone is a stretch of length 0."""
        cut = np.flatnonzero(~self.is_known)
        begins, ends = self.t_s[np.append(0, cut + 1)], self.t_s[np.append(cut, len(self.t_s) - 1)]
        return [Span(*both) for both in zip(begins.tolist(), ends.tolist(), strict=True)]

    @property
    def gaps(self) -> list[Span]:
        """Stretches of unknown motion between samples."""
        return joint([Span(a.end, b.begin) for a, b in pairwise(self.spans)])

    def at(self, t_s: Array) -> Array:
        """Places at times (m,), with straight motion between samples: (m, 3), m."""
        return np.column_stack([np.interp(t_s, self.t_s, axis) for axis in self.places_m.T])


@dataclass(eq=False)
class Tracks:
    """The bodies of a log."""

    bodies: dict[str, Track]  # tracks by name
    remarks: list[str]  # remarks on the import for the reader
    ignored: list[str]  # what was not used
    origin: str = ""  # meaning of time 0; '' for the log's own clock


class Choice(NamedTuple):
    """Choices of the command line."""

    rename: Mapping[str, str] = {}  # bodies by names in the log
    # Frames to use, taken as one; positions in others are not used. Empty: all frames of the log.
    frames: Sequence[str] = ()
    without: Collection[str] = ()  # bodies of the scenario that are not judged
    uavs: Sequence[str] = ()  # further UAVs
    gap_s: float = 0.0  # see `Track`; 0 for `GAP` times the usual time between two samples
    time_unit: str = ""  # of stamps without one; '' to find out
    length_unit: str = ""  # of positions without one; '' to find out
    rate_hz: float = 0.0  # frames per second of stamps that are numbers of frames; 0 for other stamps
    # Of the log along x, y and z of the scenario, by body, '' for all others: "x,-z,y"; none to find out.
    axes: Mapping[str, str] = {}


def bodies_of(scenario: Json, uavs: Sequence[str] = ()) -> list[str]:
    """Names of possible bodies of a log: robots, further UAVs, and obstacles that may move."""
    movers = (name for name, obstacle in scenario["obstacles"].items() if expected_m_s(obstacle))
    return [*robots_of(scenario), *uavs, *movers]


def known(scenario: Json, choice: Choice, others: Sequence[str] = ()) -> None:
    """Refuse names that the scenario does not have, and further UAVs that it has; LogError names them."""
    there = bodies_of(scenario, choice.uavs)
    for name in (*choice.without, *others):
        if name not in there:
            raise LogError(f"the scenario has no {name}; it has {', '.join(there)}")
    if taken := [name for name in choice.uavs if name in bodies_of(scenario) or name in scenario["obstacles"]]:
        raise LogError(f"--uav {taken[0]}: the scenario has it already")


def joined(log: Log, scenario: Json, choice: Choice) -> Tracks:
    bodies = [name for name in bodies_of(scenario, choice.uavs) if name not in choice.without]
    streams, ignored = _assigned(log, bodies, choice)
    _in_one_frame({name: stream.frame for name, stream in streams.items()}, choice.frames)
    for name, stream in streams.items():
        if not (np.abs(np.nan_to_num(stream.places)) <= LARGEST * max(PER_M.values())).all():
            raise LogError(f"{name} has a value beyond {LARGEST:g}; wanted: seconds and metres")
    axes.chosen(streams, choice.axes)
    remarks = units.settle(streams, scenario, choice.time_unit, choice.length_unit, choice.rate_hz)
    for name, letters in choice.axes.items():
        whose = f"axes of {name}" if name else "axes"
        remarks.append(f"{whose}: {letters} are x, y, z, as chosen")
    remarks += axes.recognised(streams, scenario, streams if "" in choice.axes else choice.axes)
    movers = [name for name, obstacle in scenario["obstacles"].items() if obstacle["moves"]]
    for name in (*scenario["ugvs"], *choice.uavs, *movers):
        if name not in streams and name not in choice.without:
            for stream in log.streams:
                if stream.skipped and not len(stream.whole) and _body_of(stream, bodies, choice.rename)[0] == name:
                    unusable = ", ".join(f"{n} with {why}{_where(stream, why)}" for why, n in stream.skipped.items())
                    raise LogError(f"{name} has no usable rows: {unusable}; wanted: {_USABLE}")
            raise LogError(_not_there(name, log, choice))
    if len(clocks := {stream.clock for stream in streams.values() if stream.clock in OF_MESSAGES}) > 1:
        late = ", ".join(name for name, stream in streams.items() if stream.clock == RECEIPT)
        remarks.append(f"clocks differ: {late} by {RECEIPT}, others by {(clocks - {RECEIPT}).pop()}")
    late_s = {
        name: stream.late_s for name, stream in streams.items()
        if stream.clock == HEADERS and stream.whole.min() >= SINCE_1970_NS  # a simulator has one clock
    }  # fmt: skip
    if late_s and (apart_s := max(late_s.values()) - min(late_s.values())) > CLOCKS_S:
        slow, fast = max(late_s, key=late_s.__getitem__), min(late_s, key=late_s.__getitem__)
        remarks.append(
            f"clocks may differ: among messages received together, {HEADERS} of {fast} are {apart_s:.3g} s later than "
            f"those of {slow}"
        )
    stamps = {name: stream.ns(stream.time_unit) for name, stream in streams.items()}
    first = min(int(ns.min()) for ns in stamps.values())
    zero = first if first >= SINCE_1970_NS else 0
    tracks = {}
    for name, stream in ((body, streams[body]) for body in bodies if body in streams):
        ns, flat = stamps[name] - zero, np.isnan(stream.places[:, 2])
        if flat.any() and name not in scenario["ugvs"] and name not in scenario["obstacles"]:
            if flat.all():
                remarks.append(f"{name} has no height in the log: its distances are not judged")
                continue
            stream.skipped["no height"] += int(flat.sum())
            stream.places, ns = stream.places[~flat], ns[~flat]
        robot = robots_of(scenario).get(name)
        start = None if robot is None else np.array(robot["start_m"][:2], dtype=np.float64)
        tracks[name] = _track(name, stream, ns, choice.gap_s, _fastest(name, scenario), start, remarks)
    for uav in uavs_of(scenario):
        if uav not in streams and uav not in choice.without:
            remarks.append(f"{uav} is not in the log: its distances are not judged")
    if choice.uavs and not scenario["safe_distance"].get("uav_m"):
        remarks.append("distances between UAVs are not judged: the scenario promises none")
    for name in tracks:
        if plants := [plant["kind"] for plant in robots_of(scenario).get(name, {}).get("plant", ())]:
            is_other = f"{name} is no point that goes where it is told ({', '.join(plants)})"
            remarks.append(f"{is_other}: what its body lacks of the law need be no fault of its controller")
    if not tracks:
        raise LogError("no body is left to judge")
    _apart_at_the_start(tracks, scenario)
    _heights(tracks, scenario, remarks)
    return Tracks(tracks, remarks, [*log.ignored, *ignored], f"{first / 1e9:.6f} s since 1970" if zero else "")


def _not_there(name: str, log: Log, choice: Choice) -> str:
    frames = sorted({stream.frame for stream in log.streams if stream.frame})
    if choice.frames and frames and not {*frames} & {*choice.frames}:
        there = ", ".join(frames)[:300]
        return f"--frame {choice.frames[0]}: no position is in it, and transforms are not chained; frames: {there}"
    there = ", ".join(dict.fromkeys(stream.label for stream in log.streams))
    there = f"names there: {there[:300]}" if there else "no positions are there"
    of_it = [why for why in log.unusable if name in why]
    likely = of_it or log.unusable or (log.ignored if not log.streams else [])
    lacks = f"; not usable: {', '.join(likely[:3])[:300]}" if likely else ""
    return f"{name} is not in the log; {there}{lacks}; wanted: --rename NAME={name}, or --without {name}"


def _assigned(log: Log, bodies: Collection[str], choice: Choice) -> tuple[dict[str, Stream], list[str]]:
    _exist(choice.rename, log, bodies)
    candidates: dict[str, dict[int, list[Stream]]] = {}
    ignored = list[str]()
    for stream in log.streams:
        body, rank = _body_of(stream, bodies, choice.rename)
        if not len(stream.whole):
            ignored.append(f"{stream.label}: no usable rows")
        elif not body:
            ignored.append(f"{stream.label}: names no body of the scenario")
        elif choice.frames and stream.frame and stream.frame not in choice.frames:
            ignored.append(f"{stream.label}: in frame {stream.frame}")
        else:
            candidates.setdefault(body, {}).setdefault(rank, []).append(stream)
    assigned = {}
    for body, by_rank in candidates.items():
        best = _links(by_rank.pop(min(by_rank)))
        ignored += [f"{stream.label}: {body} has a nearer name" for others in by_rank.values() for stream in others]
        of_one = {(stream.name, stream.child, stream.frame): stream for stream in best}
        if len(of_one) > 1:
            frames = [f"{stream.label} in frame {stream.frame}" if stream.frame else stream.label for stream in best]
            name = best[0].name if len({stream.name for stream in best}) > 1 else best[0].child
            frame = "--frame FRAME" if len({stream.frame for stream in best}) > 1 else ""
            wanted = ", or ".join(filter(None, [f"--rename {name}={body}" if name else "", frame]))
            raise LogError(f"{body} is in the log more than once: {', '.join(frames)[:400]}; wanted: {wanted}")
        assigned[body] = _merged(best)
    return assigned, list(dict.fromkeys(ignored))


def _exist(rename: Mapping[str, str], log: Log, bodies: Collection[str]) -> None:
    known = {name.strip("/") for stream in log.streams for name in (stream.name, stream.child, stream.label) if name}
    for name, body in rename.items():
        if body not in bodies:
            raise LogError(f"--rename {name}={body}: the scenario has no {body}; it has {', '.join(bodies)}")
        if name.strip("/") not in known:
            there = ", ".join(sorted(known))[:300]
            raise LogError(f"--rename {name}={body}: the log has no {name}; it has {there}")


def _body_of(stream: Stream, bodies: Collection[str], rename: Mapping[str, str]) -> tuple[str, int]:
    """The body of a stream, or '', and how near its name is: 0 renamed, 1 `OF_BODY`, 2 equal, 3 part of it."""
    if body := renamed((stream.name, stream.child, stream.label), rename):
        return body, 0
    for name in filter(None, (stream.name, stream.child)):
        for rank, plain in ((1, name.removesuffix(OF_BODY)), (2, name.strip("/"))):
            if plain in bodies and (rank == 2 or plain != name):
                return plain, rank
        if is_elsewhere(name, bodies):
            break
        if body := body_of(name, bodies, is_file=stream.is_file):
            return body, 3
    return "", 3


def _links(streams: list[Stream]) -> list[Stream]:
    """Streams without those of a robot's own parts, whose frame is carried by the robot."""
    carried = {stream.child for stream in streams if stream.child}
    return [stream for stream in streams if stream.frame not in carried or stream.frame == stream.child] or streams


def _merged(streams: list[Stream]) -> Stream:
    first = streams[0]
    for other in streams[1:]:
        if (other.time_unit, other.length_unit, other.clock) != (first.time_unit, first.length_unit, first.clock):
            raise LogError(f"{first.label} has other units or clocks in {first.source} than in {other.source}")
        first.whole, first.nano = np.append(first.whole, other.whole), np.append(first.nano, other.nano)
        first.places = np.concatenate([first.places, other.places])
        first.skipped += other.skipped
        first.first_skipped = {**other.first_skipped, **first.first_skipped}
    return first


def _in_one_frame(frames: Mapping[str, str], allowed: Collection[str]) -> None:
    """Refuse positions in different frames, and odometry frames, which start at each robot's own pose."""
    stated = {name: frame for name, frame in frames.items() if frame}
    several = ", ".join(f"{name} in {frame or 'no named frame'}" for name, frame in frames.items())
    if allowed:
        return
    if len({*stated.values()}) > 1:
        wanted = "wanted: positions in one frame, such as map or world; or --frame for each name of that one frame"
        raise LogError(f"positions are in different frames: {several}; {wanted}")
    if len(frames) > 1 and stated and segments(next(iter(stated.values())))[-1] == "odom":
        wanted = "wanted: positions in one frame, such as map or world; or --frame odom if this is one for all"
        raise LogError(
            f"odometry is in a frame of each robot's own, though both may be called odom: {several}; {wanted}"
        )


def _where(stream: Stream, reason: str) -> str:
    first = stream.first_skipped.get(reason)
    return f", first in {first}" if first else ""


_USABLE = "seconds, or dates such as 2026-05-04T10:00:00.050Z, and numbers for x and y"


def _fastest(name: str, scenario: Json) -> float:
    """The plausible speed of a body, m/s: its limit, or for an obstacle the fastest body's."""
    limits = {ugv: float(robot["max_speed_m_s"]) for ugv, robot in robots_of(scenario).items()}
    expected = expected_m_s(scenario["obstacles"][name]) if name in scenario["obstacles"] else 0.0
    return limits.get(name, max(expected, *limits.values()))


def _track(
    name: str, stream: Stream, ns: Whole, gap_s: float, fastest_m_s: float, start: Array | None, remarks: list[str]
) -> Track:
    """The track of a stream, whose stamps are ns after time 0: sorted, each time once."""
    places = stream.places / PER_M[stream.length_unit]
    if not (np.abs(np.nan_to_num(places)) <= LARGEST).all():
        raise LogError(f"{name} has a value beyond {LARGEST:g}; wanted: seconds and metres")
    for reason, count in stream.skipped.items():
        remarks.append(f"{name}: {counted(count, 'row')} skipped, {reason}{_where(stream, reason)}")
    _of_one_recording(name, ns, places, fastest_m_s)
    if disorder := int((np.diff(ns) < 0).sum()):
        remarks.append(f"{name}: rows are not in the order of time in {disorder} places; they were sorted")
    order = np.argsort(ns, kind="stable")
    ns, places = ns[order], places[order]
    new = np.append(True, np.diff(ns) > 0)
    first = np.flatnonzero(new)[np.cumsum(new) - 1]
    apart = np.linalg.norm(np.nan_to_num(places - places[first]), axis=1)
    same, other = (~new) & (apart <= SAME_M), (~new) & (apart > SAME_M)
    if same.any():
        remarks.append(f"{name}: {counted(int(same.sum()), 'row')} repeated; each counts once")
    if other.sum() > CONTRADICTORY * len(ns):
        raise LogError(
            f"{name}: {int(other.sum())} of {len(ns)} rows are elsewhere at the same time as another row; "
            "wanted: stamps as fine as the rows, of one recording"
        )
    if other.any():
        k = int(np.argmax(np.where(other, apart, -1.0)))
        remarks.append(
            f"{name}: {counted(int(other.sum()), 'row')} not where an earlier one of the same time is, at "
            f"{ns[k] / 1e9:.6g} s by {apart[k]:.3g} m; the earlier one counts"
        )
    t_s, places = ns[new] / 1e9, places[new]
    lost = _lost(t_s, places, fastest_m_s, start)
    if lost.any():
        remarks.append(
            f"{name}: {counted(int(lost.sum()), 'row')} skipped, where it cannot have been: taken as lost, first at "
            f"{t_s[lost][0]:.6g} s"
        )
    t_s, places = t_s[~lost], places[~lost]
    leaps = _leaps(t_s, places, fastest_m_s)
    count = int(leaps.sum())
    says = f"{LOST:g} times faster than {fastest_m_s:g} m/s"
    if count > MOST_LEAPS * len(t_s):
        raise LogError(
            f"{name}: {count} of {len(t_s) - 1} steps are more than {says}; wanted: --length-unit, --time-unit, or a "
            "log of this robot"
        )
    if count:
        remarks.append(
            f"{name}: {counted(count, 'step')} more than {says}, first to {t_s[1:][leaps][0]:.6g} s: nothing is "
            "claimed of them, and positions before or after may be wrong, as when odometry is reset"
        )
    # A recorder that loses a body may write its last place again; then the body leaps to where it is found.
    stays = (np.diff(places[:, :2], axis=0) == 0.0).all(axis=1)
    stay = np.cumsum(~stays)  # the number of each stay; a leap has the next number
    unknown = t_s[1:][leaps | (stays & np.isin(stay, stay[leaps] - 1))]
    usual = float(np.median(np.diff(t_s))) if len(t_s) > 1 else 0.0
    origin = {"stream": stream.label, "frame": stream.frame, "clock": stream.clock, "source": stream.source}
    return Track(t_s, places, gap_s or GAP * usual, origin, tuple(unknown.tolist()), usual)


def _of_one_recording(name: str, ns: Whole, places: Array, fastest_m_s: float) -> None:
    """Refuse rows of two recordings of the same time that contradict each other."""
    ends = [0, *(np.flatnonzero(np.diff(ns) < 0) + 1).tolist(), len(ns)]
    longest = sorted(pairwise(ends), key=lambda ends_of: ends_of[0] - ends_of[1])[:MOST_RECORDINGS]
    for first, other in combinations([slice(*ends_of) for ends_of in longest if ends_of[1] - ends_of[0] >= FEW], 2):
        t, t_other = ns[first], ns[other]
        there = (t_other >= t[0]) & (t_other <= t[-1])
        if there.sum() < FEW:
            continue
        between = [np.interp(t_other[there], t, axis) for axis in places[first, :2].T]
        apart = np.hypot(*(places[other, :2][there].T - between))
        step_s = float(np.median(np.diff(t))) / 1e9
        if np.median(apart) > LOST_M + step_s * fastest_m_s:
            raise LogError(
                f"{name}: rows of two recordings of the same time, {float(np.median(apart)):.3g} m apart; "
                "wanted: one recording"
            )


def _leaps(t_s: Array, places: Array, fastest_m_s: float) -> Flags:
    """In which intervals a body leaps, (n - 1,)."""
    steps = np.hypot(*np.diff(places[:, :2], axis=0).T)
    return np.asarray((steps > LOST_M) & (steps > LOST * fastest_m_s * np.diff(t_s)))


def _lost(t_s: Array, places: Array, fastest_m_s: float, start: Array | None) -> Flags:
    """Which rows have impossible positions, (n,)."""
    # They are between two leaps, fewer than the rows on either side or as few and at (0, 0), and the body can have gone
    # from one side to the other. At either end of the log they are at (0, 0), unless the body starts there.
    kept = np.arange(len(t_s))
    starts_there = start is not None and float(np.hypot(*start)) <= LOST_M
    for _ in range(MOST_PASSES):
        cuts = np.flatnonzero(_leaps(t_s[kept], places[kept], fastest_m_s)) + 1
        if not len(cuts):
            break
        begins, ends = np.append(0, cuts), np.append(cuts, len(kept))
        rows, at_origin = ends - begins, np.logical_and.reduceat((places[kept, :2] == 0.0).all(axis=1), begins)
        gone = at_origin & np.isin(np.arange(len(rows)), (0, len(rows) - 1))
        gone[0] &= not starts_there
        before, after = kept[ends[:-2] - 1], kept[begins[2:]]  # of all but the first and the last
        way = np.hypot(*(places[after, :2] - places[before, :2]).T)
        possible = (way <= LOST_M) | (way <= LOST * fastest_m_s * (t_s[after] - t_s[before]))
        gone[1:-1] = (rows[1:-1] < np.minimum(rows[:-2], rows[2:]) + at_origin[1:-1]) & possible
        gone[1:] &= ~gone[:-1]  # neighbours one after the other
        if not gone.any():
            break
        kept = kept[~np.repeat(gone, rows)]
    return ~np.isin(np.arange(len(t_s)), kept)


def _apart_at_the_start(tracks: Mapping[str, Track], scenario: Json) -> None:
    """Refuse robots that all start at (0, 0), if the scenario's starts differ."""
    ugvs = scenario["ugvs"]
    there = [name for name in ugvs if name in tracks and np.abs(tracks[name].places_m[0, :2]).max() <= ORIGIN_M]
    starts = {tuple(ugvs[name]["start_m"][:2]) for name in there}
    if len(there) > 1 and len(starts) > 1:
        raise LogError(
            f"{', '.join(there)} all start at (0, 0): each is in a frame of its own, as odometry is; "
            "wanted: positions in one frame, such as map or world"
        )


def _heights(tracks: Mapping[str, Track], scenario: Json, remarks: list[str]) -> None:
    flat = []
    for name, track in tracks.items():
        if np.isnan(track.places_m[:, 2]).any():
            track.places_m[:, 2] = height_m(scenario, name)
            flat.append(name)
    if flat:
        remarks.append(f"no height in the log: {', '.join(flat)}; taken from the scenario")


def height_m(scenario: Json, name: str) -> float:
    """Height of a UGV, or of the origin of an obstacle's frame, by the scenario, m."""
    if name in scenario["ugvs"]:
        return float(scenario["ugvs"][name]["start_m"][2])
    moves = scenario["obstacles"][name]["moves"]
    return float([*moves["waypoints_m"][0], 0.0, 0.0][2]) if moves else 0.0
