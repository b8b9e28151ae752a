"""The table of a run: the pairs and periods in which the hypotheses of its theorem hold, decided in whole numbers.

An entry says of a pair from which row on, and for how many periods, it obeyed the avoidance law (`obeys_law` in
LawChecker.v). A period in which it does not ends the entry. The next one starts at a later row at which the pair has
its distance again. Coq decides every entry once more, and proves that it keeps its promise (`entry_keeps` in Mixed.v).

Coq stops at the first pair that comes too near; `too_near` finds all of them.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from math import sqrt
from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.verify.proofs.export import Demand, Recorded, all_of, data, offs, ratio, real, stride
from airground_drake.verify.proofs.separating import Prism, Vector, apart, dot

SCREEN_M = 1e-6  # largest error of floating-point distances, m; steps that come near by less are computed exactly


class Entry(NamedTuple):
    """A pair, and the periods in which it obeyed the law."""

    demand: Demand  # the pair, and the distance that it is to keep
    first: int  # row at which they begin
    many: int  # their number


class Missed(NamedTuple):
    """A pair with periods without an entry."""

    demand: Demand  # the pair
    begin_s: float  # when the first of these periods begins, s
    end_s: float  # when the last one ends, s


def lawful(demands: Iterable[Demand]) -> list[Demand]:
    """The pairs with entries: of two robots or a robot and a static ball, without a lag or delay."""
    return [demand for demand in demands if not (demand.core or demand.passive or demand.late)]


def entries(run: Recorded) -> list[Entry]:
    """The table of a run, in the order of its demands."""
    return [Entry(demand, *window) for demand in lawful(run.demands) for window in _windows(run, demand)]


def missed(run: Recorded, table: Sequence[Entry]) -> list[Missed]:
    last = len(run.times) - 1
    pairs = []
    for demand in lawful(run.demands):
        ends = [end for entry in table if entry.demand == demand for end in (entry.first, entry.first + entry.many)]
        gaps = [(begin, end) for begin, end in zip([0, *ends[1::2]], [*ends[::2], last], strict=True) if begin < end]
        if gaps:
            pairs.append(Missed(demand, float(run.times[gaps[0][0]]), float(run.times[gaps[-1][1]])))
    return pairs


def _windows(run: Recorded, demand: Demand) -> Iterator[tuple[int, int]]:
    """The first row and the number of periods of each entry of a pair."""
    way, safe = run.way(demand), int(demand.safe_m * run.unit)
    reach = stride(run.rows[demand.first]) + stride(run.rows[demand.second])
    rows = np.array(way, dtype=np.float64)
    near = np.linalg.norm(rows, axis=1) < (safe + reach) * (1.0 + 1e-9)
    first: int | None = None
    for row, (place, after) in enumerate(pairwise(way)):
        obeys = not near[row] or _obeys(run, safe, reach, place, after)
        if first is None and obeys and (not near[row] or dot(place, place) >= safe * safe):
            first = row
        if first is not None and not obeys:
            if row > first:
                yield first, row - first
            first = None
    if first is not None:
        yield first, len(way) - 1 - first


def _obeys(run: Recorded, safe: int, reach: int, place: Vector, after: Vector) -> bool:
    """Whether a step meets the law; see `step_meets` in LawChecker.v."""
    squared = dot(place, place)
    if squared >= (safe + reach) ** 2:
        return True
    speed = run.gain.numerator if squared <= safe * safe else run.gain.denominator
    along = run.gain.denominator * (dot(place, after) - squared) + speed * squared
    return squared > 0 and along >= 0 and (speed * safe) ** 2 * squared <= along * along


_LAW = """\
(** Coq computes [obeys_law], and [obeys_exactly] turns the answer into an entry that was checked. *)
Ltac decide_entry i j num den x y :=
  intros b R; apply (obeys_exactly {run} {run}_off b i j num den x y);
  [exact is_well_formed | vm_cast_no_check (eq_refl true) | exact R | lra | lra | lra | lra |];
  unfold {run}_off, i, j; cbn [nth]; lra.

"""


def law_file(run: Recorded, table: Sequence[Entry], *, alone: bool = False) -> str:
    """The file with the theorem that the table's entries were checked and keep their promises."""
    # alone: whether the file has the positions itself, in place of those in the file about distances.
    robots = dict.fromkeys(entry.demand.first for entry in table)
    groups = [[entry for entry in table if entry.demand.first == robot] for robot in robots]
    names = [f"{run.name}_table_of_{group[0].demand.first}" for group in groups]
    claims = [f"(Forall (checked 1) ({name} b) /\\ Forall (promise 1) ({name} b))" for name in names]
    proofs = [f"(conj ({name}_checked b R) (run_all 1 Rlt_0_1 _ ({name}_checked b R)))" for name in names]
    theorem = f"{run.name}_obeys_the_law"
    return (
        f"(** When {run.name} obeys the avoidance law, and what follows. Written by `airground prove`, from the "
        "positions in trace/. *)\nRequire Import Reals Lra ZArith List.\n"
        f"Require Import Safety Convex Run Mixed LawChecker{'' if alone else ' ' + run.name}.\nImport ListNotations.\n"
        f"{'Local Open Scope Z_scope.' + chr(10) * 2 + data(run) if alone else ''}Local Open Scope R_scope.\n\n"
        f"{offs(run)}{_LAW.format(run=run.name)}"
        f"{''.join(_group(run, name, group) for name, group in zip(names, groups, strict=True))}"
        "(** Entries: first row, number of periods, bodies; A h, distance of the law in m, three errors; distance kept "
        "in m. Time is in periods. *)\n"
        f"Theorem {theorem} : forall b, recorded {run.name} {run.name}_off b ->\n  {_SO.join(claims)}.\n"
        f"Proof. intros b R; exact {all_of(proofs)}. Qed.\n\n"
        f"Print Assumptions {theorem}.\n"
    )


_SO = " /\\\n  "


def _group(run: Recorded, name: str, group: Sequence[Entry]) -> str:
    """The entries of one robot, and the lemmas that they were checked."""
    of, terms = group[0].demand.first, [_term(run, entry) for entry in group]
    lemmas = [
        f"Lemma entry_{k}_of_{of} : forall b, recorded {run.name} {run.name}_off b ->\n  checked 1 ({term}).\n"
        f"Proof. decide_entry {entry.demand.first} {entry.demand.second} {ratio(run.gain)} "
        f"{ratio(entry.demand.safe_m)}. Qed.\n\n"
        for k, (entry, term) in enumerate(zip(group, terms, strict=True))
    ]
    proofs = "".join(f"(Forall_cons _ (entry_{k}_of_{of} b R)\n  " for k in range(len(group)))
    listed = ";\n".join(terms)
    return (
        f"Definition {name} (b : nat -> body) : list entry := [\n{listed}].\n\n{''.join(lemmas)}"
        f"Lemma {name}_checked : forall b, recorded {run.name} {run.name}_off b -> Forall (checked 1) ({name} b).\n"
        f"Proof. intros b R; exact {proofs}(Forall_nil _){')' * len(group)}. Qed.\n\n"
    )


def _term(run: Recorded, entry: Entry) -> str:
    """An entry in Coq: without errors of position or velocity."""
    first, second = entry.demand.first, entry.demand.second
    off = run.off_m.get(first, Fraction(0)) + run.off_m.get(second, Fraction(0))
    law, kept = real(entry.demand.safe_m), real(min(entry.demand.body_m, entry.demand.safe_m - off))
    pair = f"(Together (b {first}) (b {second}) points (Numbers {real(run.gain)} {law} 0 0 0) {kept})"
    return f"Entry {entry.first} {entry.many} {pair}"


@dataclass(frozen=True)
class TooNear:
    """A pair that comes nearer than it may."""

    demand: Demand  # the pair, and the distance that it is to keep
    least_m: float  # least distance of its surfaces; below 0 they overlap
    short_m: float  # the deficit
    t_s: float  # when the pair is so near

    def __str__(self) -> str:
        pair = " and ".join(self.demand.called)
        wanted = f"{self.short_m:.3g} m less than {float(self.demand.required_m):g} m"
        return f"{pair} are {self.least_m:.6g} m apart at {self.t_s:.6g} s, {wanted}"


def too_near(run: Recorded) -> list[TooNear]:
    """All pairs that do not keep their distance at all times of the run, in the order of its demands."""
    return [worst for demand in run.demands if (worst := _worst(run, demand)) is not None]


def _worst(run: Recorded, demand: Demand) -> TooNear | None:
    """The least distance of a pair, if it is too small."""
    unit, way = run.unit, run.way(demand)
    rows = np.array(way, dtype=np.float64)
    near = (float(demand.safe_m) + SCREEN_M) * unit
    steps = [
        (apart(prism, way[row], way[row + 1])[0] / unit**2, row, prism)
        for prism in run.prisms(demand)
        for row in _near(prism, rows, near)
    ]
    squared, row, prism = min(steps, default=(demand.safe_m**2, 0, None), key=lambda step: step[0])
    if prism is None or squared >= demand.safe_m**2:
        return None
    apart_m = sqrt(squared)
    short_m = float(demand.safe_m**2 - squared) / (float(demand.safe_m) + apart_m)  # d - D, without cancellation
    t_s = run.times[row] + _when(prism, way[row], way[row + 1]) * (run.times[row + 1] - run.times[row])
    return TooNear(demand, apart_m - float(demand.radii_m), short_m, float(t_s))


def _near(prism: Prism, rows: Array, reach: float) -> list[int]:
    """The rows, (k, 3), from which the next step may come nearer to a set than `reach`; all in parts."""
    steps = np.linalg.norm(np.diff(rows, axis=0), axis=1)
    apart = np.linalg.norm(rows - prism.nearest(rows), axis=1)[:-1]
    rows_near: list[int] = np.flatnonzero(apart - steps < reach).tolist()
    return rows_near


def _when(prism: Prism, begin: Vector, end: Vector) -> Fraction:
    """The share of a straight motion, from 0 to 1, at which a set is nearest, to 0.01."""
    places = np.linspace(np.array(begin, dtype=np.float64), np.array(end, dtype=np.float64), 101)
    return Fraction(int(np.argmin(np.linalg.norm(places - prism.nearest(places), axis=1))), 100)
