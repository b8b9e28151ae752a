"""Reads an exported Coq file back and compares it with the run.

Coq cannot see whether the numbers in the file are the recorded ones. This module takes the file apart by its own
patterns. From the exporter it uses only the required distances, `demands`, and how far bodies may be off the straight
lines, `off_m`. Corners are compared with the shapes of the scenario.
"""

import re
from collections.abc import Sequence
from fractions import Fraction
from itertools import chain
from typing import NamedTuple

from airground_drake.base.errors import AirgroundError
from airground_drake.scenario.shapes import convex_parts
from airground_drake.sim.trace import Trace
from airground_drake.verify.proofs.export import PARTS, demands, demands_of, off_m

_NUMBER = r"(\d+|\(\d+ / \d+\))"
_SAFE = r"(?P<safe>\d+|\(\d+ / \d+\))"
_FIRST, _SECOND, _SETS = r"(?P<first>\w+)", r"(?P<second>\w+)", r"(?P<sets>\w+)"

Claim = tuple[str, str, str, Fraction]  # two bodies, the sets that are the second one or '', and their distance


class ReadbackError(AirgroundError):
    """An exported file does not say what the trace says."""


class RereadError(NamedTuple):
    """The number of coordinates that differ from the recorded ones, and the largest difference, m."""

    coordinates: int
    most_m: float


def compare(text: str, trace: Trace) -> RereadError:
    """Compare the file about distances with the run that it should be about."""
    spelled, error = compare_positions(text, trace)
    named = [pair._replace(first=spelled[pair.first], second=spelled[pair.second]) for pair in demands_of(trace)]
    run = f"run_{trace.run}"
    balls = rf"{_SAFE} <= norm \(sub \(position {run} {_FIRST} t\) \(position {run} {_SECOND} t\)\)"
    wanted = [(pair.first, pair.second, pair.sets if pair.core else "", pair.safe_m) for pair in named]
    clear = rf"clear {run} {_FIRST} {_SECOND} {_SETS} {_SAFE} t"
    _compare_theorem(f"{run}_keeps_its_distances", text, trace, (balls, clear), wanted)
    if any(trace.is_apart(name) for name in trace.robots):
        balls = rf"{_SAFE} <= norm \(sub \(x {_FIRST} t\) \(x {_SECOND} t\)\)"
        sets = rf"forall corners c, In corners {_SETS} -> hull \(map \(place_in {run}\) corners\) c -> "
        sets += rf"{_SAFE} <= norm \(sub \(x {_FIRST} t\) \(add \(x {_SECOND} t\) c\)\)"
        wanted = [(*pair[:3], demand.body_m) for pair, demand in zip(wanted, named, strict=True)]
        _compare_theorem(f"{run}_bodies_keep_their_distances", text, trace, (balls, sets), wanted)
        near = f"Hypothesis near_lines : forall i t, norm (sub (x i t) (position {run} i t)) <= {run}_off i."
        if near not in text:
            raise ReadbackError(f"{run}: the theorem about bodies is not about all that are near their lines")
    return error


def compare_positions(text: str, trace: Trace, *, steered: bool = False) -> tuple[dict[str, str], RereadError]:
    """The names of bodies in the file, by their names in the trace, and the differences of coordinates."""
    run = f"run_{trace.run}{'_steered' if steered else ''}"
    unit, times, listed = _parts(rf"^Definition {run} := Run (\w+) \[\n(.*?)\] \[\n(.*?)\]\.$", text)
    if [Fraction(int(t, 0), int(unit, 0)) for t in times.split(";\n")] != [Fraction(t) for t in trace.t.tolist()]:
        raise ReadbackError(f"{run}: the times are not those of the trace")
    shapes = {name: convex_parts(obstacle) for name, obstacle in trace.scenario.barriers.items()}
    recorded = {
        name: [obstacle.position_m if shapes[name] is None else [0.0] * 3]
        for name, obstacle in trace.scenario.barriers.items()
    }
    moving = [name for name, obstacle in trace.scenario.barriers.items() if obstacle.moves]
    place = trace.position if steered else trace.body
    recorded |= {name: place(name).tolist() for name in (*moving, *trace.robots)}
    bodies = [name.removesuffix("_places") for name in listed.split("; ")]
    numbers = re.findall(r"^Definition (\w+) := (\d+)%nat\.$", text, re.MULTILINE)
    if numbers != [(name, str(k)) for k, name in enumerate(bodies)] or len(bodies) != len(recorded):
        raise ReadbackError(f"{run}: the bodies are not numbered in their order")
    off = list[Fraction]()
    for body, places in zip(bodies, recorded.values(), strict=True):
        values = _coordinates(body, text, len(trace.t), int(unit, 0), len(places))
        off += [abs(number - Fraction(axis)) for number, axis in zip(values, chain(*places), strict=True)]
    spelled = dict(zip(recorded, bodies, strict=True))
    asked = demands(trace.scenario)
    for name, core in dict.fromkeys((demand.second, demand.core) for demand in asked if demand.core):
        top = trace.scenario.barriers[name].height_m if core == "solid" else 0.0
        parts = [[(*corner, z) for z in dict.fromkeys((0.0, top)) for corner in part] for part in shapes[name] or []]
        off += _off_corners(f"{spelled[name]}_{core}", text, int(unit, 0), parts)
    if max(off) > Fraction(1, 2 * PARTS):
        raise ReadbackError(f"{run}: a position differs from the trace by {float(max(off)):.3g} m")
    room = off_m(trace, steered=steered)
    if room and f"Definition {run}_off (i : nat) : R := nth i" in text:
        [listed_m] = _parts(rf"^Definition {run}_off \(i : nat\) : R := nth i \[(.*?)\] 0\.$", text)
        if [_value(value) for value in listed_m.split("; ")] != [room.get(name, Fraction(0)) for name in recorded]:
            raise ReadbackError(f"{run}: bodies may be off the straight lines by other lengths than their plants say")
    elif room:
        raise ReadbackError(f"{run}: how far bodies may be off the straight lines is missing")
    return spelled, RereadError(sum(distance > 0 for distance in off), float(max(off)))


def _coordinates(body: str, text: str, rows: int, unit: int, places: int) -> list[Fraction]:
    """All coordinates of a body in the file, m."""
    [what] = _parts(rf"^Definition {body}_places := (.*?)\.$", text)
    points = _points(what, unit)
    if len(points) != places or not what.startswith("Track " if places > 1 else f"at_rest {rows} "):
        raise ReadbackError(f"{body}: {len(points)} places in the file, {places} in the trace")
    return [*chain(*points)]


def _off_corners(sets: str, text: str, unit: int, parts: Sequence[Sequence[Sequence[float]]]) -> list[Fraction]:
    """Differences of the corners of convex sets between the file and the scenario, m."""
    [what] = _parts(rf"^Definition {sets} := \[\n(.*?)\]\.$", text)
    read = [_points(part, unit) for part in what.split(";\n")]
    if [len(part) for part in read] != [len(part) for part in parts]:
        raise ReadbackError(f"{sets}: the sets in the file have other corners than the shape in the scenario")
    pairs = zip(chain(*chain(*read)), chain(*chain(*parts)), strict=True)
    return [abs(number - Fraction(axis)) for number, axis in pairs]


def _points(text: str, unit: int) -> list[list[Fraction]]:
    """All points in a part of the file, m."""
    points = re.findall(r"\bP (\(?-?\w+\)?) (\(?-?\w+\)?) (\(?-?\w+\)?)", text)
    return [[Fraction(int(axis.strip("()"), 0), unit) for axis in point] for point in points]


def _compare_theorem(theorem: str, text: str, trace: Trace, kinds: Sequence[str], wanted: Sequence[Claim]) -> None:
    """Check that the theorem is about the whole run and every pair, with its full distance."""
    # kinds: patterns of claims, each with the groups `first`, `second` and `safe`, and `sets` where there are any.
    start, end, body = _parts(rf"^Theorem {theorem} : forall t, {_NUMBER} <= t <= {_NUMBER} ->\n(.*?)\.\nProof\.", text)
    if [_value(start), _value(end)] != [Fraction(trace.t[0]), Fraction(trace.t[-1])]:
        raise ReadbackError(f"{theorem} is not about all of the run's time")
    matches = sorted((match for kind in kinds for match in re.finditer(kind, body)), key=re.Match.start)
    claims = [(m["first"], m["second"], m.groupdict().get("sets", ""), _value(m["safe"])) for m in matches]
    for kind in kinds:  # the rest must be conjunctions and their parentheses alone
        body = re.sub(kind, "", body)
    if claims != wanted or re.sub(r"[\s()]", "", body) != "/\\" * (len(claims) - 1):
        raise ReadbackError(f"{theorem} does not claim the scenario's distance of every pair")


def _value(text: str) -> Fraction:
    return Fraction(text.strip("()").replace(" ", ""))


def _parts(pattern: str, text: str) -> tuple[str, ...]:
    matches = list(re.finditer(pattern, text, re.MULTILINE | re.DOTALL))
    if len(matches) != 1:
        raise ReadbackError(f"{pattern.split(' :')[0].lstrip('^')} is in the file {len(matches)} times; wanted: once")
    return matches[0].groups()
