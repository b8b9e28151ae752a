"""A recorded run as Coq files: its positions as integers, and theorems about them that Coq decides by computing.

A first-order robot moves on the straight lines between its recorded places. For other plants, theorems of Plants.v
bound the deviation from these lines:

- the axle of a unicycle runs on arcs, off their chords by |omega| |v| h^2 / 8 at most;
- a body with lag tau accelerates by 2 V / tau at most, and is off by V h^2 / (4 tau);
- a body with a delay alone moves on straight lines.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields
from fractions import Fraction
from functools import cache, cached_property
from itertools import chain, groupby, pairwise
from math import lcm
from typing import NamedTuple

import numpy as np

from airground_drake.base.errors import TraceError
from airground_drake.base.exact import decimal
from airground_drake.model.plants.budget import Bounds, law_distance
from airground_drake.scenario.plants import bounds_of
from airground_drake.scenario.schema import SHAPES, Obstacle, Scenario
from airground_drake.scenario.shapes import convex_parts
from airground_drake.sim.trace import Trace
from airground_drake.verify.pair_kinds import MOVING, apart
from airground_drake.verify.proofs.coq import without_comments
from airground_drake.verify.proofs.separating import Prism, Vector, root_up, separating
from airground_drake.verify.proofs.theorems import FOLDER

# A dip is rounded down by this, m, so that the sum of a budget is not above its floating-point value. The arc stays far
# below its dip.
ROUNDED_M = Fraction(1, 2**45)
# Positions are rounded to 1/PARTS m: some coordinates are as small as 1e-100 m. At a metre binary64 is coarser.
PARTS = 2**60

Place = tuple[Fraction, Fraction, Fraction]


class ConvexSet(NamedTuple):
    """A prism over a convex outline between two heights, m, relative to its body's position."""

    outline: tuple[tuple[Fraction, Fraction], ...]  # corners, counter-clockwise; two of a wall, one of a post
    base: Fraction = Fraction(0)  # lowest z
    top: Fraction = Fraction(0)  # highest z; the base if the set is flat

    def in_parts(self, unit: int) -> Prism:
        """This set in whole numbers of metres / unit."""
        outline = tuple((int(x * unit), int(y * unit)) for x, y in self.outline)
        return Prism(outline, int(self.base * unit), int(self.top * unit))


class Demand(NamedTuple):
    """Two bodies, by name, and the distance that they must keep."""

    first: str  # a robot
    second: str  # the other body
    required_m: Fraction  # distance of their surfaces, m
    radii_m: Fraction  # sum of their radii, m
    # Core of the second body: "" for a point, "ground" for flat convex sets, "solid" for prisms.
    core: str = ""
    # Whether the second body is an obstacle that may move, beside which robots follow the passive law.
    passive: bool = False
    # Sum of both bodies' largest distances from the recorded straight lines, m; or, where the law's points are
    # recorded, the law's addition to the distance.
    room_m: Fraction = Fraction(0)
    late: bool = False  # whether one of the two has a lag or a delay, or they act on old positions of each other
    called: tuple[str, str] = ("", "")  # names of the two in the scenario; `first` and `second` are names for Coq

    @property
    def body_m(self) -> Fraction:
        """Distance of the centres of the bodies, or of a centre from convex sets, m."""
        return self.required_m + self.radii_m

    @property
    def safe_m(self) -> Fraction:
        """Required distance of the recorded straight lines, m, including the deviation of bodies."""
        return self.body_m + self.room_m

    @property
    def lemma(self) -> str:
        return f"{self.first}_and_{self.second}"

    @property
    def sets(self) -> str:
        """Name of the convex sets that are the second body."""
        return f"{self.second}_{self.core}"


@dataclass(frozen=True)
class Recorded:
    """A run in exact numbers."""

    name: str  # of the run in Coq
    times: tuple[Fraction, ...]  # of the rows, s
    # Of each body, m: one per row, or a single one of a body at rest. In the order of their numbers.
    places: Mapping[str, tuple[Place, ...]]
    demands: tuple[Demand, ...]  # pairs and distances
    gain: Fraction  # a h, the product of gain and control period, at most 1 (see `capped` in Safety.v)
    # Largest distance of bodies from the straight lines between these places, m; 0 if not named.
    off_m: Mapping[str, Fraction]
    # The convex sets of demands, by name, from where their body is.
    sets: Mapping[str, tuple[ConvexSet, ...]] = field(default_factory=dict)

    @cached_property
    def unit(self) -> int:
        """Common denominator of all numbers, in parts of a metre and of a second."""
        numbers: Iterable[Fraction] = (
            *self.times,
            *(demand.safe_m for demand in self.demands),
            *(axis for places in self.places.values() for place in places for axis in place),
            *(axis for prism in chain(*self.sets.values()) for axis in (prism.base, prism.top, *chain(*prism.outline))),
        )
        return lcm(*(number.denominator for number in numbers))

    @cached_property
    def rows(self) -> Mapping[str, Sequence[Vector]]:
        """Positions of each body at each row, in integer units."""
        unit, count = self.unit, len(self.times)
        whole = {
            name: [(int(x * unit), int(y * unit), int(z * unit)) for x, y, z in places]
            for name, places in self.places.items()
        }
        return {name: rows * count if len(rows) == 1 else rows for name, rows in whole.items()}

    def way(self, demand: Demand) -> list[Vector]:
        """Positions of the first body of a pair relative to the second, in units."""
        both = zip(self.rows[demand.first], self.rows[demand.second], strict=True)
        return [(p[0] - q[0], p[1] - q[1], p[2] - q[2]) for p, q in both]

    def prisms(self, demand: Demand) -> list[Prism]:
        """The sets that are the second body of a pair, in metres / unit; for a ball its centre."""
        return [part.in_parts(self.unit) for part in self.sets[demand.sets]] if demand.core else [Prism(((0, 0),))]


def recorded(trace: Trace, *, steered: bool = False) -> Recorded:
    """A run with positions rounded to 1/PARTS m, and all else exact."""
    # steered: whether it is the record of the points that the law steers, in place of the bodies.
    refuse_unknown(trace)
    scenario, control = trace.scenario, trace.scenario.control
    barriers = scenario.barriers
    places: dict[str, tuple[Place, ...]] = {}
    for name, obstacle in barriers.items():  # corners are in the world frame, or in the frame of the moving body
        is_ball = convex_parts(obstacle) is None
        places[name] = (_rounded((is_ball and obstacle.position_m) or (0.0, 0.0, 0.0)),)
    moving = [name for name, obstacle in barriers.items() if obstacle.moves]
    of = trace.position if steered else trace.body
    places |= {name: tuple(map(_rounded, of(name).tolist())) for name in (*moving, *trace.robots)}
    spelled = _spelled(list(places))
    asked = demands_of(trace, steered=steered)
    wanted = [
        pair._replace(first=spelled[pair.first], second=spelled[pair.second], called=(pair.first, pair.second))
        for pair in asked
    ]
    return Recorded(
        name=f"run_{trace.run}{'_steered' if steered else ''}",
        times=tuple(map(Fraction, trace.t.tolist())),
        places={spelled[name]: place for name, place in places.items()},
        demands=tuple(wanted),
        gain=min(decimal(control.avoidance_gain_1_s) * decimal(control.period_s), Fraction(1)),
        off_m={spelled[name]: off for name, off in off_m(trace, steered=steered).items()},
        sets={demand.sets: _sets(barriers[demand.called[1]], demand.core) for demand in wanted if demand.core},
    )


# Keys of bodies that theorems account for, or need not.
COVERED = frozenset(
    {"start_m", "target_m", "preset", "max_speed_m_s", "radius_m", "name", "altitude_m", "task", "phantoms_m"}
    | {"ugvs", "lost_at_s"}
    | {"position_m", "known_to_uav", *SHAPES, "heading_rad", "height_m", "distance_m"}
    | {"moves", "known_motion", "cells", "plant"}
)


def refuse_unknown(trace: Trace) -> None:
    """Refuse a run with a body that no theorem covers."""
    for name, body in trace.scenario.bodies.items():
        for key in fields(body):
            given, default = getattr(body, key.name), key.default
            default = default if key.default_factory is MISSING else key.default_factory()
            if key.name not in COVERED and given != default:
                raise TraceError(f"run {trace.run}: {name} has {key.name}; no theorem is about such a body")
        if name in trace.robots and (why := trace.plant(name).unproved):
            kinds = " and ".join(keys.kind for keys in trace.scenario.robots[name].plant)
            raise TraceError(f"run {trace.run}: {name} has the plant {kinds}; {why}")


def _sets(obstacle: Obstacle, core: str) -> tuple[ConvexSet, ...]:
    """The convex parts of an obstacle: for UGVs all walls are endless, so their outlines on the ground are enough."""
    top = _round(obstacle.height_m if core == "solid" else 0.0)
    parts = convex_parts(obstacle) or []
    return tuple(ConvexSet(tuple((_round(x), _round(y)) for x, y in part), top=top) for part in parts)


def off_m(trace: Trace, *, steered: bool = False) -> dict[str, Fraction]:
    """Largest deviations of robots' bodies from the straight lines between recorded positions, m, if not 0."""
    of = off_steered_m if steered else off_lines_m
    return {name: of(trace, name) for name in trace.robots if trace.is_apart(name)}


def demands_of(trace: Trace, *, steered: bool = False) -> list[Demand]:
    """The demands on a run, including deviations of bodies, or the law's additional distance."""
    lines = off_m(trace)
    demanded = []
    for demand in demands(trace.scenario):
        names = [name for name in (demand.first, demand.second) if name in lines]
        if steered:
            room = law_m(trace, demand.body_m, demand.first, demand.second) - demand.body_m
        else:
            room = sum((lines[name] for name in names), Fraction(0))
        old = trace.scenario.asynchronous and {demand.first, demand.second} <= set(trace.ugvs)
        demanded.append(demand._replace(room_m=room, late=old or any(_bounds(trace, name).late for name in names)))
    return demanded


def demands(scenario: Scenario) -> list[Demand]:
    """The required distances: each robot from each obstacle, and each two robots."""
    balls = {name for name, obstacle in scenario.barriers.items() if convex_parts(obstacle) is None}
    demanded = []
    for pair in apart(scenario):
        is_point = pair.second in balls or pair.second in scenario.robots
        core = "" if is_point else "solid" if scenario.kind_of(pair.first) == "uav" else "ground"
        radii = sum(map(decimal, pair.radii_m), Fraction(0))
        demanded.append(Demand(pair.first, pair.second, decimal(pair.required_m), radii, core, pair.kind == MOVING))
    return demanded


def _rounded(place: Sequence[float]) -> Place:
    x, y, z = map(_round, place)
    return x, y, z


def _round(axis: float) -> Fraction:
    return Fraction(round(Fraction(axis) * PARTS), PARTS)


def _spelled(names: list[str]) -> dict[str, str]:
    """Names for Coq: unchanged if that is an unused identifier, otherwise numbered."""
    plain = re.compile(r"(?!run_|body_number_|entry_)(?!\w*(_and_|_(places|ground|solid)\b))[A-Za-z]\w*", re.ASCII)
    return {
        name: name if plain.fullmatch(name) and name not in _taken() else f"body_number_{k}"
        for k, name in enumerate(names)
    }


@cache
def _taken() -> frozenset[str]:
    """Identifiers used in the theories or in an exported file."""
    theories = "".join(file.read_text(encoding="utf-8") for file in sorted(FOLDER.glob("*.v")))
    words = re.findall(r"\w+", without_comments(theories))
    own = {*re.findall(r"\w+", _DISTANCES), "is_well_formed", "decide_entry"}
    return frozenset({*words, *own, "exists", "fun", "let", "Set", "Prop", "Type"})


_DISTANCES = """\
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


def distances_file(run: Recorded, *, vectors: bool = True) -> str:
    """The file with the run and the theorem that all pairs keep their distances; Coq needs the `vectors`."""
    interval = f"{real(run.times[0])} <= t <= {real(run.times[-1])}"
    claims = [_claim(run, demand) for demand in run.demands]
    lemmas = ""
    for demand, claim in zip(run.demands, claims, strict=True):
        decided = f"decide_clear {ratio(demand.safe_m)} {demand.lemma}_vectors"
        if not demand.core:
            decided = f"decide_distance {ratio(demand.safe_m)}"
        elif vectors:
            lemmas += _vectors(run, demand)
        lemmas += f"Lemma {demand.lemma} : forall t, {interval} ->\n  {claim}.\nProof. {decided}. Qed.\n\n"
    checks = _DISTANCES.format(
        run=run.name, interval=interval, start=ratio(run.times[0]), end=ratio(run.times[-1])
    )  # fmt: skip
    bodies, theorem = "", f"{run.name}_keeps_its_distances"
    together = _together(run.demands, theorem, interval, claims, "")
    if run.off_m:
        bodies, theorem = _bodies(run, interval), f"{run.name}_bodies_keep_their_distances"
    return (
        f"(** That {run.name} keeps its distances. Written by `airground prove`, from the positions in trace/. *)\n"
        "Require Import Reals Lra ZArith List.\nRequire Import Safety Convex Run DistanceChecker.\n"
        f"Import ListNotations.\nLocal Open Scope Z_scope.\n\n{data(run)}{checks}{lemmas}"
        "(** All pairs: distances of centres, which are the safe distance and both radii, in m; times in s. *)\n"
        f"{together}{bodies}"
        f"Print Assumptions {theorem}.\n"
    )


def offs(run: Recorded) -> str:
    """Definition of the bodies' deviations from the straight lines, by their numbers."""
    listed = "; ".join(real(run.off_m.get(name, Fraction(0))) for name in run.places)
    value = f"nth i [{listed}] 0" if run.off_m else "0"
    return (
        "(** By how much bodies may be off the straight lines between the rows, m. *)\n"
        f"Definition {run.name}_off (i : nat) : R := {value}.\n\n"
    )


_BODIES = """\
(** The bodies themselves. *)
Section Bodies.

Variable x : nat -> R -> vec.
Hypothesis near_lines : forall i t, norm (sub (x i t) (position {run} i t)) <= {run}_off i.

Ltac decide_bodies i j keeps :=
  intros t T; pose proof (keeps t T) as K; pose proof (near_lines i t) as I; pose proof (near_lines j t) as J;
  unfold {run}_off, i, j in I, J; cbn [nth] in I, J;
  match type of K with
  | _ <= norm (sub ?u ?v) => pose proof (nearby u v (x i t) (x j t) _ _ _ I J K); lra
  | clear _ _ _ _ ?d t => intros corners c Hin Hc; specialize (K corners c Hin Hc);
      pose proof (nearby _ _ (x i t) (add (x j t) c) _ _ _ I
        ltac:(replace (sub (add (x j t) c) (add (position {run} j t) c)) with (sub (x j t) (position {run} j t))
          by (apply vec_eq; vectors; ring); exact J) K); lra
  end.

"""


def _bodies(run: Recorded, interval: str) -> str:
    """The theorem that bodies within their deviation of the straight lines keep their distances."""
    claims = [_body_claim(run, demand) for demand in run.demands]
    lemmas = "".join(
        f"Lemma bodies_{demand.lemma} : forall t, {interval} ->\n  {claim}.\n"
        f"Proof. decide_bodies {demand.first} {demand.second} {demand.lemma}. Qed.\n\n"
        for demand, claim in zip(run.demands, claims, strict=True)
    )
    together = _together(run.demands, f"{run.name}_bodies_keep_their_distances", interval, claims, "bodies_")
    return f"{offs(run)}{_BODIES.format(run=run.name)}{lemmas}{together}End Bodies.\n\n"


def _body_claim(run: Recorded, demand: Demand) -> str:
    first, second, safe = f"(x {demand.first} t)", f"(x {demand.second} t)", real(demand.body_m)
    if not demand.core:
        return f"{safe} <= norm (sub {first} {second})"
    sets = f"forall corners c, In corners {demand.sets} -> hull (map (place_in {run.name}) corners) c ->"
    return f"({sets} {safe} <= norm (sub {first} (add {second} c)))"


def _claim(run: Recorded, demand: Demand) -> str:
    if demand.core:
        return f"clear {run.name} {demand.first} {demand.second} {demand.sets} {real(demand.safe_m)} t"
    positions = (f"(position {run.name} {name} t)" for name in (demand.first, demand.second))
    return f"{real(demand.safe_m)} <= norm (sub {' '.join(positions)})"


def _vectors(run: Recorded, demand: Demand) -> str:
    """For each convex set of the second body, vectors that separate the first one from it, with their periods."""
    way, safe = run.way(demand), int(demand.safe_m * run.unit)
    listed = ";\n".join(
        f"[{'; '.join(f'({periods}, {_point(vector)})' for periods, vector in stretches)}]"
        for stretches in separating(run.prisms(demand), way, safe)
    )
    return f"Definition {demand.lemma}_vectors := ([\n{listed}])%Z.\n"


def without_vectors(text: str) -> str:
    """An exported file without its separating vectors, which may differ between machines."""
    return re.sub(r"^Definition \w+_vectors := \(\[[][\s();,P\da-fx-]*\]\)%Z\.\n", "", text, flags=re.MULTILINE)


def _grouped(demands: Sequence[Demand], texts: Sequence[str]) -> list[list[str]]:
    """One text per pair, by the first body: Coq takes a time quadratic in the length of each conjunction."""
    pairs = groupby(zip(demands, texts, strict=True), key=lambda both: both[0].first)
    return [[text for _, text in group] for _, group in pairs]


def _together(demands: Sequence[Demand], name: str, interval: str, claims: Sequence[str], prefix: str) -> str:
    groups = " /\\\n  ".join("(" + " /\\\n   ".join(group) + ")" for group in _grouped(demands, claims))
    lemmas = _grouped(demands, [f"({prefix}{demand.lemma} t T)" for demand in demands])
    proof = all_of([all_of(group) for group in lemmas])
    return f"Theorem {name} : forall t, {interval} ->\n  {groups}.\nProof. intros t T; exact {proof}. Qed.\n\n"


def all_of(proofs: Sequence[str]) -> str:
    return "".join(f"(conj {proof}\n  " for proof in proofs[:-1]) + proofs[-1] + ")" * (len(proofs) - 1)


def data(run: Recorded) -> str:
    """The definitions: bodies, their numbers, convex sets, times; and the lemma that they make a run."""
    unit = run.unit
    out = [f"(** Positions at the rows, in parts: {unit} parts are 1 m. *)\n"]
    for name, rows in run.rows.items():
        if len(run.places[name]) == 1:
            out.append(f"Definition {name}_places := at_rest {len(rows)} ({_point(rows[0])}).\n")
        else:
            listed = ";\n".join(map(_point, rows))
            out.append(f"Definition {name}_places := Track {stride(rows):#x} [\n{listed}].\n")
    out += [f"Definition {name} := {k}%nat.\n" for k, name in enumerate(run.places)]
    for name, sets in run.sets.items():
        corners = ("; ".join(map(_point, prism.in_parts(unit).corners)) for prism in sets)
        listed = ";\n".join(f"[{outline}]" for outline in corners)
        out.append(f"(** Corners of convex sets, from where their body is. *)\nDefinition {name} := [\n{listed}].\n")
    times = ";\n".join(_whole(int(time * unit)) for time in run.times)
    bodies = "; ".join(f"{name}_places" for name in run.places)
    out.append(f"Definition {run.name} := Run {unit:#x} [\n{times}] [\n{bodies}].\n\n")
    checked = "Proof. vm_cast_no_check (eq_refl true). Qed."
    out.append(f"Lemma is_well_formed : well_formed {run.name} = true.\n{checked}\n\n")
    return "".join(out)


def _whole(number: int) -> str:
    return f"-{-number:#x}" if number < 0 else f"{number:#x}"


def _point(place: Vector) -> str:
    return "P " + " ".join(f"({text})" if text.startswith("-") else text for text in map(_whole, place))


def stride(rows: Sequence[Vector]) -> int:
    """The longest step, parts, rounded up."""
    return root_up(max(sum((b - a) ** 2 for a, b in zip(p, q, strict=True)) for p, q in pairwise(rows)))


def real(number: Fraction) -> str:
    return str(number.numerator) if number.denominator == 1 else f"({number.numerator} / {number.denominator})"


def ratio(number: Fraction) -> str:
    """Two arguments, numerator and denominator."""
    return f"{number.numerator}%Z {number.denominator}%Z"


def _bounds(trace: Trace, robot: str) -> Bounds:
    """Bounds of a robot's body, at its speed limit or at its fastest command if that is faster."""
    fastest = float(np.linalg.norm(trace.chosen(robot), axis=1).max())
    return trace.plant(robot).bounds(max(trace.scenario.robots[robot].max_speed_m_s, fastest))


def off_lines_m(trace: Trace, robot: str) -> Fraction:
    """Largest deviation of a robot's body from the straight lines between its recorded positions, m."""
    limits = _bounds(trace, robot)
    lagging = limits.speed_m_s * trace.scenario.control.period_s**2 / (4.0 * limits.lag_s) if limits.lag_s else 0.0
    return Fraction(limits.dip_m) + Fraction(lagging)


def off_steered_m(trace: Trace, robot: str) -> Fraction:
    """Largest deviation of a robot's body from the straight lines of its steered point, m."""
    limits = _bounds(trace, robot)
    room = Fraction(limits.cover_m) + Fraction(limits.dip_m)
    return max(room - ROUNDED_M, Fraction(0))


def law_m(trace: Trace, distance_m: Fraction, first: str, second: str) -> Fraction:
    """The law's distance between two steered points, or between one and a static set, m."""
    robots, control = trace.scenario.robots, trace.scenario.control
    both = [
        bounds_of(robots[name], control.period_s, trace.scenario.seen(name))
        for name in (first, second)
        if name in robots
    ]
    if all(plant.exact for plant in both):
        return distance_m
    return Fraction(float(law_distance(float(distance_m), *both, gain=control.avoidance_gain_1_s)))
