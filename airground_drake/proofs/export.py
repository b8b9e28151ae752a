"""A recorded run as Coq files: its positions as integers, and theorems about them that Coq decides by computing."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache, cached_property
from itertools import chain, combinations, groupby, pairwise
from math import isqrt, lcm
from typing import NamedTuple

from airground_drake.base.errors import TraceError
from airground_drake.base.exact import decimal
from airground_drake.proofs.record import FOLDER
from airground_drake.proofs.separating import Prism, Vector, separating
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Scenario

PARTS = 2**60
"""Positions are rounded to 1/PARTS m: some coordinates are as small as 1e-100 m. At a metre binary64 is coarser."""

Place = tuple[Fraction, Fraction, Fraction]


class ConvexSet(NamedTuple):
    """All that is over a convex outline, from the z of a body up to a height, m.

    Attributes:
        outline: corners from the body's position, counter-clockwise; two of a wall, one of a post.
        height: 0 if the set is flat.
    """

    outline: tuple[tuple[Fraction, Fraction], ...]
    height: Fraction = Fraction(0)

    def in_parts(self, unit: int) -> Prism:
        """The same in whole numbers of metres / unit."""
        return Prism(tuple((int(x * unit), int(y * unit)) for x, y in self.outline), int(self.height * unit))


class Demand(NamedTuple):
    """Two bodies, by name, and the distance that they are to keep.

    Attributes:
        first: a robot.
        second: the other body.
        required_m: distance of their surfaces, m.
        radii_m: sum of their radii, m.
        sets: name of the convex sets that are the second body without its radius; empty: it is a ball.
    """

    first: str
    second: str
    required_m: Fraction
    radii_m: Fraction
    sets: str = ""

    @property
    def safe_m(self) -> Fraction:
        """Distance of the centres, or of a centre from convex sets, m, which the theorems are about."""
        return self.required_m + self.radii_m

    @property
    def lemma(self) -> str:
        """Name of the lemma about it."""
        return f"{self.first}_and_{self.second}"


@dataclass(frozen=True)
class Recorded:
    """A run in exact numbers.

    Attributes:
        name: of the run in Coq.
        times: of the rows, s.
        places: of each body, m: one per row, or a single one of a body at rest. In the order of their numbers.
        demands: pairs and distances.
        gain: A h, the product of gain and control period, at most 1 (see `capped` in Safety.v).
        sets: convex sets that bodies are, by the name that demands give them.
    """

    name: str
    times: tuple[Fraction, ...]
    places: Mapping[str, tuple[Place, ...]]
    demands: tuple[Demand, ...]
    gain: Fraction
    sets: Mapping[str, tuple[ConvexSet, ...]] = field(default_factory=dict)

    @cached_property
    def unit(self) -> int:
        """Common denominator of all numbers, in parts of a metre and of a second."""
        numbers: Iterable[Fraction] = (
            *self.times,
            *(demand.safe_m for demand in self.demands),
            *(axis for places in self.places.values() for place in places for axis in place),
            *(axis for each in chain(*self.sets.values()) for axis in (each.height, *chain(*each.outline))),
        )
        return lcm(*(number.denominator for number in numbers))

    @cached_property
    def rows(self) -> Mapping[str, Sequence[Vector]]:
        """Where each body is at each row, in whole numbers of metres / unit."""
        unit, count = self.unit, len(self.times)
        found = {
            name: [(int(x * unit), int(y * unit), int(z * unit)) for x, y, z in places]
            for name, places in self.places.items()
        }
        return {name: rows * count if len(rows) == 1 else rows for name, rows in found.items()}

    def way(self, demand: Demand) -> list[Vector]:
        """Where the first body of a pair is at each row as seen from the second one, in metres / unit."""
        both = zip(self.rows[demand.first], self.rows[demand.second], strict=True)
        return [(p[0] - q[0], p[1] - q[1], p[2] - q[2]) for p, q in both]

    def prisms(self, demand: Demand) -> list[Prism]:
        """The sets that are the second body of a pair, in metres / unit."""
        return [each.in_parts(self.unit) for each in self.sets[demand.sets]]


def recorded(trace: Trace) -> Recorded:
    """A run with its positions rounded to 1/PARTS m; nothing else is rounded.

    Raises:
        TraceError: if a column is missing or not finite, or an obstacle appears under way.
    """
    control = trace.scenario.control
    if late := [name for name, obstacle in trace.scenario.obstacles.items() if obstacle.appears_s]:
        raise TraceError(
            f"run {trace.run}: {late[0]} appears under way; theorems are about bodies that are always there"
        )
    places: dict[str, tuple[Place, ...]] = {
        name: (_rounded(obstacle.position_m),) for name, obstacle in trace.scenario.obstacles.items()
    }
    places |= {robot: tuple(map(_rounded, trace.position(robot).tolist())) for robot in trace.robots}
    spelled = _spelled(list(places))
    return Recorded(
        name=f"run_{trace.run}",
        times=tuple(map(Fraction, trace.t.tolist())),
        places={spelled[name]: place for name, place in places.items()},
        demands=tuple(
            each._replace(first=spelled[each.first], second=spelled[each.second]) for each in demands(trace.scenario)
        ),
        gain=min(decimal(control.avoidance_gain_1_s) * decimal(control.period_s), Fraction(1)),
    )


def demands(scenario: Scenario) -> list[Demand]:
    """Who is to keep which distance from whom: each robot from each obstacle, and each two robots."""
    robots, safe, uav = scenario.robots, scenario.safe_distance, scenario.uav.name
    radius = {name: decimal(body.radius_m) for name, body in scenario.bodies.items()}
    found = [(robot, obstacle, safe.obstacle_m) for robot in robots for obstacle in scenario.obstacles]
    found += [(*two, safe.air_ground_m if uav in two else safe.ugv_m) for two in combinations(robots, 2)]
    return [Demand(one, other, decimal(apart), radius[one] + radius[other]) for one, other, apart in found]


def _rounded(place: Sequence[float]) -> Place:
    x, y, z = (Fraction(round(Fraction(axis) * PARTS), PARTS) for axis in place)
    return x, y, z


def _spelled(names: list[str]) -> dict[str, str]:
    """Names for Coq: as they are if that is a free identifier, else by number."""
    plain = re.compile(r"(?!run_|body_number_)(?!\w*(_and_|_places\b))[A-Za-z]\w*", re.ASCII)
    return {
        name: name if plain.fullmatch(name) and name not in _taken() else f"body_number_{k}"
        for k, name in enumerate(names)
    }


@cache
def _taken() -> frozenset[str]:
    """Words that mean something in the theories or in an exported file."""
    words = re.findall(r"\w+", "".join(file.read_text(encoding="utf-8") for file in FOLDER.glob("*.v")))
    return frozenset({*words, *re.findall(r"\w+", _DISTANCES + _LAW), "exists", "fun", "let", "Set", "Prop", "Type"})


_DISTANCES = """\
Lemma is_well_formed : well_formed {run} = true.
Proof. vm_cast_no_check (eq_refl true). Qed.

Local Open Scope R_scope.

Lemma during t : {interval} -> begins {run} <= t <= ends {run}.
Proof.
  intros H; apply (covers_sound {run} {start} {end}).
  - exact is_well_formed.
  - vm_cast_no_check (eq_refl true).
  - lra.
Qed.

(** Coq computes [keeps], and [sound] turns the answer into a statement about all times. *)
Ltac decide_distance a b :=
  intros t T; apply (Rle_trans _ (IZR a / IZR b)); [lra |];
  apply sound; [exact is_well_formed | vm_cast_no_check (eq_refl true) | exact (during t T)].

(** The same for convex sets, with vectors that separate: each with the number of periods for which it does. *)
Ltac decide_clear a b vectors :=
  intros t T; apply (clear_less _ _ _ _ (IZR a / IZR b)); [lra |];
  apply (sets_sound _ _ _ _ a b vectors); [exact is_well_formed | vm_cast_no_check (eq_refl true) | exact (during t T)].

"""
_LAW = """\
(** Coq computes [obeys_law], and [obeys_exactly] turns the answer into a statement about all rows. *)
Ltac decide_law num den a b :=
  apply (obeys_exactly _ _ _ num den a b); [exact is_well_formed | vm_cast_no_check (eq_refl true) | lra | lra].

"""


def distances_file(run: Recorded) -> str:
    """The run, and the theorem that every pair keeps its distance at all times."""
    interval = f"{real(run.times[0])} <= t <= {real(run.times[-1])}"
    claims = [_claim(run, demand) for demand in run.demands]
    lemmas = [
        f"Lemma {demand.lemma} : forall t, {interval} ->\n  {claim}.\nProof. {_tactic(run, demand)}. Qed.\n\n"
        for demand, claim in zip(run.demands, claims, strict=True)
    ]
    checks = _DISTANCES.format(
        run=run.name, interval=interval, start=ratio(run.times[0]), end=ratio(run.times[-1])
    )  # fmt: skip
    together = _theorem(f"{run.name}_keeps_its_distances", f"forall t, {interval} ->", _grouped(run.demands, claims))
    proofs = _grouped(run.demands, [f"({each.lemma} t T)" for each in run.demands])
    proof = _all_of([_all_of(group) for group in proofs])
    return (
        f"(** That {run.name} keeps its distances. Written by `airground prove`, from the positions in trace/. *)\n"
        "Require Import Reals Lra ZArith List.\nRequire Import Safety Run DistanceChecker.\nImport ListNotations.\n"
        f"Local Open Scope Z_scope.\n\n{_data(run)}{checks}{''.join(lemmas)}"
        "(** All pairs: distances of centres, which are the safe distance and both radii, in m; times in s. *)\n"
        f"{together}Proof. intros t T; exact {proof}. Qed.\n\n"
        f"Print Assumptions {run.name}_keeps_its_distances.\n"
    )


def _claim(run: Recorded, demand: Demand) -> str:
    if demand.sets:
        return f"clear {run.name} {demand.first} {demand.second} {demand.sets} {real(demand.safe_m)} t"
    positions = (f"(position {run.name} {name} t)" for name in (demand.first, demand.second))
    return f"{real(demand.safe_m)} <= norm (sub {' '.join(positions)})"


def _tactic(run: Recorded, demand: Demand) -> str:
    """Has Coq decide a claim."""
    if not demand.sets:
        return f"decide_distance {ratio(demand.safe_m)}"
    way, safe = run.way(demand), int(demand.safe_m * run.unit)
    proofs = (
        "; ".join(f"({periods}%nat, {_point(vector)})" for periods, vector in separating(prism, way, safe))
        for prism in run.prisms(demand)
    )
    listed = ";\n  ".join(f"[{vectors}]" for vectors in proofs)
    return f"decide_clear {ratio(demand.safe_m)} ([\n  {listed}])%Z"


def law_file(run: Recorded) -> str:
    """The theorem that every two balls of the run obey the avoidance law, without error."""
    g = real(run.gain)
    balls = [demand for demand in run.demands if not demand.sets]
    claims = [f"obeys {run.name} {g} {demand.first} {demand.second} {real(demand.safe_m)} 0" for demand in balls]
    lemmas = [
        f"Lemma {demand.lemma}_obey : {claim}.\nProof. decide_law {ratio(run.gain)} {ratio(demand.safe_m)}. Qed.\n\n"
        for demand, claim in zip(balls, claims, strict=True)
    ]
    proof = _all_of([_all_of(group) for group in _grouped(balls, [f"{each.lemma}_obey" for each in balls])])
    pairs = "All pairs" if len(balls) == len(run.demands) else "All pairs of balls, none with walls and polygons"
    return (
        f"(** That {run.name} obeys the avoidance law. Written by `airground prove`, from the positions in trace/. *)\n"
        f"Require Import Reals Lra ZArith.\nRequire Import Safety Run LawChecker {run.name}.\n"
        f"Local Open Scope R_scope.\n\n{_LAW}{''.join(lemmas)}"
        f"(** {pairs}: A h, bodies, distance of centres in m, error in m per step. *)\n"
        f"{_theorem(f'{run.name}_obeys_the_law', '', _grouped(balls, claims))}Proof. exact {proof}. Qed.\n\n"
        f"Print Assumptions {run.name}_obeys_the_law.\n"
    )


def _grouped(demands: Sequence[Demand], texts: Sequence[str]) -> list[list[str]]:
    """One text per pair, by the first body: Coq takes a time quadratic in the length of each conjunction."""
    pairs = groupby(zip(demands, texts, strict=True), key=lambda each: each[0].first)
    return [[text for _, text in group] for _, group in pairs]


def _theorem(name: str, quantifier: str, groups: Sequence[Sequence[str]]) -> str:
    together = " /\\\n  ".join("(" + " /\\\n   ".join(group) + ")" for group in groups)
    return f"Theorem {name} : {quantifier}\n  {together}.\n"


def _all_of(proofs: Sequence[str]) -> str:
    """A proof of a conjunction from proofs of its parts."""
    return "".join(f"(conj {proof}\n  " for proof in proofs[:-1]) + proofs[-1] + ")" * (len(proofs) - 1)


def _data(run: Recorded) -> str:
    """The integers: bodies, their numbers, convex sets, times."""
    unit = run.unit
    out = [f"(** Positions at the rows, in parts: {unit} parts are 1 m. *)\n"]
    for name, rows in run.rows.items():
        if len(run.places[name]) == 1:
            out.append(f"Definition {name}_places := at_rest {len(rows)} ({_point(rows[0])}).\n")
        else:
            listed = ";\n".join(map(_point, rows))
            out.append(f"Definition {name}_places := Body {_stride(rows):#x} [\n{listed}].\n")
    out += [f"Definition {name} := {k}%nat.\n" for k, name in enumerate(run.places)]
    for name, sets in run.sets.items():
        corners = ("; ".join(map(_point, each.in_parts(unit).corners)) for each in sets)
        listed = ";\n".join(f"[{each}]" for each in corners)
        out.append(f"(** Corners of convex sets, from where their body is. *)\nDefinition {name} := [\n{listed}].\n")
    times = ";\n".join(_whole(int(time * unit)) for time in run.times)
    bodies = "; ".join(f"{name}_places" for name in run.places)
    out.append(f"Definition {run.name} := Run {unit:#x} [\n{times}] [\n{bodies}].\n\n")
    return "".join(out)


def _whole(number: int) -> str:
    return f"-{-number:#x}" if number < 0 else f"{number:#x}"


def _point(place: Vector) -> str:
    return "P " + " ".join(f"({text})" if text.startswith("-") else text for text in map(_whole, place))


def _stride(rows: Sequence[Vector]) -> int:
    """The longest step, parts, rounded up."""
    square = max(sum((b - a) ** 2 for a, b in zip(p, q, strict=True)) for p, q in pairwise(rows))
    root = isqrt(square)
    return root + (root * root < square)


def real(number: Fraction) -> str:
    """A real number in Coq."""
    return str(number.numerator) if number.denominator == 1 else f"({number.numerator} / {number.denominator})"


def ratio(number: Fraction) -> str:
    """Two arguments, numerator and denominator."""
    return f"{number.numerator}%Z {number.denominator}%Z"
