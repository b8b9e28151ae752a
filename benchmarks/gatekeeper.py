"""Time and cost of the solution routes of (26) on the same problems, side by side.

    python benchmarks/gatekeeper.py [--quick] [--routes mixed_integer,relaxed] [-o table.csv]

The problems are those of the gatekeeper in runs of cases A and B, and random ones: one to eight UGVs among discs, with
a detour or a straight line proposed. A sample has one problem for each UGV. Times are CPU times of a sample.

The best plan known of a problem is the best plan of all routes. `excess` is the cost (25) above it, in per cent of it,
or of a hundredth of the cheaper constant plan's cost if that is more. `other_choice` counts the problems where the
first stage differs from that of the best plan, and accepting and refusing first differ by more than 0.1 %. `proved`
counts solutions with a gap of 0. Every problem where the default route misses the best plan by more than 0.1 % is
listed at the end. The last column is the ratio of median times to the default route.
"""

import argparse
import csv
import logging
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from airground_drake.base.registry import ROUTES
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.geometry.outline import balls
from airground_drake.model.geometry.paths import NoPath, shortest_path
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.scenario.load import load
from airground_drake.sim.simulation import Recorder
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.budget import Budget
from airground_drake.ugv.problem import Horizon, Problem, predicted_problem
from airground_drake.ugv.rollout import View
from airground_drake.ugv.routes.relaxed import RelaxedRoute
from airground_drake.ugv.routes.route import Route
from airground_drake.ugv.solution import ConstantPlans, Solution

LAW = UgvLaw(Avoidance(3.0, 0.05, 4.0), 2.0, 1.5, intervention_on_top=False)

Sample = list[Problem]
"""The problems of one solution, one per UGV."""

COLUMNS = ("problems", "ugvs", "points", "stages", "route", "decisions", "p50_ms", "p99_ms", "max_ms", "mean_excess_%",
           "max_excess_%", "over_0.1_%", "accepted", "other_choice", "no_plan", "proved", "p50_ratio")  # fmt: skip
DEFAULT = "mixed_integer"
RULE = 1e-3
"""Largest excess of the default route, relative."""


def recorded(case: str, run: str, most: int) -> list[Sample]:
    """Problems that the gatekeeper solved in a run, evenly spaced; by mode velocities, without the loop.

    Raises:
        ValueError: if it solved no problem, as under method (d).
    """
    seen: list[Sample] = []

    class Listening(RelaxedRoute):
        def solve(self, problem: Problem, budget: Budget = Budget()) -> Solution:  # noqa: B008 (immutable)
            seen.append([problem])
            return super().solve(problem, budget)

    scenario = load(case)
    scenario.gatekeeper.route = "listening"
    with ROUTES.adding("listening", Listening):
        Recorder(scenario, run).simulate()
    if not seen:
        raise ValueError(f"{case}, run {run}: no problem (26) was solved")
    return seen[:: -(-len(seen) // most)]


def rolled_out(rng: np.random.Generator, ugvs: int, discs: int, stages: int, safe: float) -> Sample:
    """Problems (26) of UGVs among discs; the same situations as `among`, by mode velocities."""
    horizon, sample = Horizon(stages, 1, 1.0, 1000.0), []
    for scene, proposal in among(rng, ugvs, discs, safe):
        sample.append(predicted_problem(scene, LAW, proposal, horizon))
    return sample


def among(rng: np.random.Generator, ugvs: int, discs: int, safe: float) -> list[tuple[View, Proposal]]:
    """UGVs among the same discs, all within sensing range of the first; each senses the others, which move."""
    angle, radius = rng.uniform(-np.pi, np.pi, discs), rng.uniform(safe + 0.1, 3.8, discs)
    centres = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(discs)])
    starts, speeds = np.zeros((ugvs, 3)), rng.uniform(-0.5, 0.5, (ugvs, 3)) * [1, 1, 0]
    for i in range(1, ugvs):
        while min(np.linalg.norm(centres - starts[i], axis=1).min(), np.linalg.norm(starts[i])) < safe:
            starts[i] = rng.uniform(-3.5, 3.5, 3) * [1, 1, 0]
    sample = []
    for i in range(ugvs):
        others = [j for j in range(ugvs) if j != i]
        goal = starts[i] + rng.uniform(-6.0, 6.0, 3) * [1, 1, 0]
        preset = Motion.at_speed(np.array([starts[i], goal]), 0.56, start=-rng.uniform(0.0, 4.0))
        aim = goal if rng.random() < 0.7 else starts[i] + rng.uniform(-6.0, 6.0, 3) * [1, 1, 0]
        scene = View(
            t=0.0,
            position=starts[i],
            preset=preset,
            still=balls(centres),
            parts=balls(np.zeros((len(others), 3))),
            places=starts[others],
            velocities=speeds[others],
            distances=np.full(discs + ugvs - 1, safe),
            shares=np.concatenate([np.ones(discs), np.full(ugvs - 1, 0.5)]),
            max_speed=3.0,
        )
        motion = Motion.at_speed(way(starts[i], aim, centres, safe + 0.05), 2.85, start=0.0)
        sample.append((scene, Proposal("proposed", 0.0, motion)))
    return sample


def way(start: np.ndarray, goal: np.ndarray, centres: np.ndarray, radius: float) -> np.ndarray:
    """Shortest way round the discs as points (k, 3), m; a straight line if no way exists."""
    try:
        path = shortest_path(start[:2], goal[:2], balls(centres), np.full(len(centres), radius))
    except NoPath:
        return np.array([start, goal])
    count = max(2, int(path.length_m / 0.1))
    return np.array([[*path.at(path.length_m * k / count)[0], start[2]] for k in range(count + 1)])


def groups(quick: bool) -> Iterator[tuple[str, int, int, int, list[Sample]]]:
    """Name, UGVs, points, stages and samples of every group."""
    many, few = (20, 5) if quick else (200, 30)
    for case in ("case_a", "case_b"):
        samples = recorded(case, "c", many)
        yield f"{case}, run c", 1, max(len(s[0].distances) for s in samples), samples[0][0].stages, samples

    def random(ugvs: int, discs: int, stages: int, safe: float, count: int) -> tuple[int, int, int, list[Sample]]:
        rng = np.random.default_rng([ugvs, discs, stages])
        samples = [rolled_out(rng, ugvs, discs, stages, safe) for _ in range(count)]
        return ugvs, discs + ugvs - 1, stages, samples

    for ugvs in (1, 2):
        for discs in (1, 2, 3, 4):
            yield "random", *random(ugvs, discs, 60, 2.0, many)
    for stages in (30, 120) if quick else (30, 60, 120, 240):
        yield "growth with N", *random(1, 2, stages, 2.0, few)
    for discs in (1, 16) if quick else (1, 2, 4, 8, 16):
        yield "growth with points", *random(1, discs, 60, 1.0, few)
    for ugvs in (1, 8) if quick else (1, 2, 4, 8):
        yield "growth with UGVs", *random(ugvs, 2, 60, 1.0, few)


def measure(route: Any, samples: list[Sample]) -> tuple[np.ndarray, list[Solution]]:
    """CPU time of each sample, ms, and the solutions of all problems; the first sample is solved once before."""
    for problem in samples[0]:
        route.solve(problem)
    times, solutions = [], []
    for sample in samples:
        started = time.process_time()
        solutions += [route.solve(problem) for problem in sample]
        times.append(1e3 * (time.process_time() - started))
    return np.array(times), solutions


@dataclass(frozen=True)
class Known:
    """Lowest costs known of plans that refuse and that accept first, and the cost that an excess is relative to."""

    refuse: float
    accept: float
    scale: float

    @classmethod
    def of(cls, problem: Problem, solutions: list[Solution]) -> Self:
        """By the constant plans and every plan of `solutions`."""
        constants = ConstantPlans.of(problem)
        planned = [d for d in solutions if d.has_plan]
        refuse = min([constants.refuse.objective, *(d.objective_refuse for d in planned)])
        accept = min([constants.accept.objective, *(d.objective_accept for d in planned)])
        constant = constants.better.objective
        return cls(refuse, accept, max(refuse if refuse < accept else accept, 0.01 * constant, 1e-12))

    def excess(self, solution: Solution) -> float:
        """Cost above the best known, relative."""
        return (solution.objective - min(self.refuse, self.accept)) / self.scale

    def differs(self, solution: Solution) -> bool:
        """Whether the first stage is not the best, and the difference matters."""
        matters = abs(self.refuse - self.accept) > RULE * self.scale
        return matters and solution.accept_first != (self.accept < self.refuse)


def row(name: str, times: np.ndarray, pairs: list[tuple[Solution, Known]], default_ms: float) -> list[Any]:
    """The columns from `route` on."""
    decided = [(d, k) for d, k in pairs if d.status != "solver_failed"]
    excess = 100.0 * np.array([k.excess(d) for d, k in decided] or [np.nan])
    return [
        name, len(times), *(f"{t:.2f}" for t in (*np.percentile(times, [50, 99]), times.max())),
        f"{excess.mean():.3f}", f"{excess.max():.3f}", int((excess > 100.0 * RULE).sum()),
        sum(d.accept_first for d, _ in pairs), sum(k.differs(d) for d, k in decided), len(pairs) - len(decided),
        sum(d.status == "optimal" and 0.0 <= d.gap + 1e-9 <= 2e-9 for d, _ in pairs),
        f"{np.median(times) / default_ms:.1f}",
    ]  # fmt: skip


def exceptions(title: str, pairs: list[tuple[Solution, Known]]) -> list[str]:
    """Problems where a route misses the best plan known by more than the rule allows."""
    return [
        f"{title}, problem {i}: {d.status}, cost {d.objective:.6g} ({'accept' if d.accept_first else 'refuse'}), best "
        f"known accepting {k.accept:.6g}, refusing {k.refuse:.6g}, excess {100.0 * k.excess(d):.2f} %, gap in "
        f"half-planes {100.0 * d.gap:.2f} %{', other first stage' if k.differs(d) else ''}"
        for i, (d, k) in enumerate(pairs) if not d.has_plan or k.excess(d) > RULE or k.differs(d)
    ]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a tenth of the problems")
    parser.add_argument("-o", "--output", metavar="CSV", help="write the table there, too")
    parser.add_argument("--routes", default=",".join(ROUTES.own), metavar="NAMES", help="default: %(default)s")
    arguments = parser.parse_args()
    logging.getLogger("drake").setLevel(logging.ERROR)  # solvers that give up are counted below
    routes = {name: ROUTES.load(name, of=Route)() for name in arguments.routes.split(",")}
    layout = "{:<19}{:>5}{:>7}{:>7}  {:<17}{:>9}{:>9}{:>9}{:>9}{:>14}{:>13}{:>11}{:>9}{:>13}{:>8}{:>7}{:>10}"
    print(layout.format(*COLUMNS))
    table, missed, solved = [], [], 0
    for title, ugvs, points, stages, samples in groups(arguments.quick):
        measured = {name: measure(route, samples) for name, route in routes.items()}
        problems = [problem for sample in samples for problem in sample]
        known = [Known.of(p, [found[i] for _, found in measured.values()]) for i, p in enumerate(problems)]
        default_ms = float(np.median(measured[DEFAULT][0])) if DEFAULT in measured else np.nan
        for name, (times, found) in measured.items():
            table.append(
                [title, ugvs, points, stages, *row(name, times, [*zip(found, known, strict=True)], default_ms)]
            )
            print(layout.format(*table[-1]), flush=True)
        if DEFAULT in measured:
            found = measured[DEFAULT][1]
            label = f"{title}, {ugvs} UGVs, {points} points, {stages} stages"
            missed += exceptions(label, [*zip(found, known, strict=True)])
            solved += len(found)
    print(f"\n{DEFAULT}: {len(missed)} of {solved} problems miss the best plan known by more than {100.0 * RULE} %")
    print("\n".join(missed))
    if arguments.output:
        with open(arguments.output, "w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([COLUMNS, *table])


if __name__ == "__main__":
    main()
