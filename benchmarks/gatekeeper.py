"""Time and cost of every solution route of (26) on the same problems, side by side.

    python benchmarks/gatekeeper.py [--quick] [--routes mixed_integer,relaxed] [-o table.csv]

Problems are those that the gatekeeper of cases A and B was given in a run, and closed loops rolled out among random
discs (a detour or a straight line proposed), for one to eight UGVs. A solution is one sample: with two UGVs, both
problems. Times are CPU times of the process.

Plans are compared with the best known: the best of all rows of the same problem. `excess` is the cost (25) above it, in
per cent of it, or of a hundredth of the cheaper constant plan's cost if that is more (relative to a cost of almost 0 it
would mean nothing); `other_choice` counts the problems where the first stage is not that of the best plan known,
although accepting and refusing first differ by more than 0.1 %. Every problem where the default route misses either by
more than 0.1 % is listed at the end. CasADi with IPOPT and cvxpy with SCIP take part if they are installed; the last
columns are how often their median time goes into that of the default route. `mixed_10` is the default route with ten
blocks; `proved` counts solutions with a gap of 0. What one sample of method (d) costs, which solves no problem (26),
comes first: both outcomes, to their ends, for every UGV.
"""

from __future__ import annotations

import argparse
import csv
import logging
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Any

import cvxpy
import numpy as np

from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.outcome import Outlook, outcomes
from airground_drake.gatekeeper.problem import Horizon, Problem, predicted_problem
from airground_drake.gatekeeper.relaxation import normals_along, sum_up_rounding
from airground_drake.gatekeeper.rollout import View
from airground_drake.gatekeeper.routes.mixed_integer import MixedIntegerRoute
from airground_drake.gatekeeper.routes.relaxed import RelaxedRoute
from airground_drake.gatekeeper.routes.route import Route
from airground_drake.gatekeeper.solution import ConstantPlans, Solution, cheapest
from airground_drake.geometry.motion import Motion
from airground_drake.geometry.paths import NoPath, shortest_path
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.law import UgvLaw
from airground_drake.registry import ROUTES
from airground_drake.run.simulation import Recorder
from airground_drake.scenarios.load import load

LAW = UgvLaw(Avoidance(3.0, 0.05, 4.0), 2.0, 1.5, intervention_on_top=False)

Sample = list[Problem]
"""The problems of one solution, one per UGV."""

COLUMNS = ("problems", "ugvs", "points", "stages", "route", "decisions", "p50_ms", "p99_ms", "max_ms", "mean_excess_%",
           "max_excess_%", "over_0.1_%", "accepted", "other_choice", "no_plan", "proved", "p50_ratio")  # fmt: skip
DEFAULT = "mixed_integer"
RULE = 1e-3
"""What the default route may miss, relative."""
SLOW = {"cvxpy+scip": 60}
"""Most stages, and one in ten solutions, for what takes seconds."""
SCIP_LIMIT_S = 10.0


# --- problems ----------------------------------------------------------------------------------------------------


def recorded(case: str, run: str, most: int) -> list[Sample]:
    """Evenly spaced among the problems that the gatekeeper solved in a run; by mode velocities, without the loop.

    Raises:
        ValueError: if it solved none, as the gatekeeper of method (d) does.
    """
    seen: list[Sample] = []

    class Listening(RelaxedRoute):
        def solve(self, problem: Problem, budget: Budget = Budget()) -> Solution:  # noqa: B008 (immutable)
            seen.append([replace(problem, loop=None)])
            return super().solve(problem, budget)

    scenario = load(case)[0]
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
        sample.append(replace(predicted_problem(scene, LAW, proposal, horizon), loop=None))
    return sample


def outcomes_of(situations: list[tuple[View, Proposal]]) -> None:
    """What method (d) looks at, at one sample: both outcomes for every UGV."""
    motions = [proposal.motion for _, proposal in situations]
    for i, (seen, proposal) in enumerate(situations):
        asked = tuple((motion, False) for motion in motions[:i] + motions[i + 1 :])
        outcomes(replace(seen, asked=asked), LAW, proposal, Outlook(longest=30.0))


def cost_of_outcomes(count: int) -> None:
    """Print the CPU time of one sample of method (d) with new proposals for all UGVs."""
    for ugvs, discs in ((1, 4), (2, 4), (4, 4), (2, 16)):
        rng = np.random.default_rng([ugvs, discs])
        samples = [among(rng, ugvs, discs, 2.0 if discs < 16 else 1.0) for _ in range(count)]
        outcomes_of(samples[0])
        times = []
        for sample in samples:
            started = time.process_time()
            outcomes_of(sample)
            times.append(1e3 * (time.process_time() - started))
        p50, p99 = np.percentile(times, [50, 99])
        print(
            f"method (d), {ugvs} UGVs, {discs} obstacles: p50 {p50:.2f} ms, p99 {p99:.2f} ms, max {max(times):.2f} ms"
        )


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
            centres=np.concatenate([centres, starts[others]]),
            velocities=np.concatenate([np.zeros((discs, 3)), speeds[others]]),
            distances=np.full(discs + ugvs - 1, safe),
            shares=np.concatenate([np.ones(discs), np.full(ugvs - 1, 0.5)]),
            max_speed=3.0,
        )
        motion = Motion.at_speed(way(starts[i], aim, centres, safe + 0.05), 2.85, start=0.0)
        sample.append((scene, Proposal("proposed", 0.0, motion)))
    return sample


def way(start: np.ndarray, goal: np.ndarray, centres: np.ndarray, radius: float) -> np.ndarray:
    """Shortest way round the discs as points (k, 3), m; straight where there is none."""
    try:
        path = shortest_path(start[:2], goal[:2], centres[:, :2], np.full(len(centres), radius))
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


# --- references --------------------------------------------------------------------------------------------------


class CasadiRoute:
    """(27) with exact distances in CasADi, IPOPT with exact Hessians, sum-up rounding."""

    def solve(self, problem: Problem) -> Solution:
        """Build, solve, round."""
        import casadi

        stages, points = problem.centres.shape[:2]
        constants = ConstantPlans.of(problem)
        p, omega, u = casadi.SX.sym("p", 2, stages), casadi.SX.sym("w", stages), casadi.SX.sym("u", stages)
        velocity = problem.refuse[:, :2].T + casadi.repmat(omega.T, 2, 1) * (problem.accept - problem.refuse)[:, :2].T
        before = casadi.horzcat(problem.initial[:2], p[:, :-1])
        rows, low = [casadi.vec(p - before - problem.dt * velocity)], [np.zeros(2 * stages)]
        for m in range(points):
            offset = p - problem.centres[:, m, :2].T
            height = problem.initial[2] - problem.centres[:, m, 2]
            rows.append(casadi.sqrt(casadi.sum1(offset**2).T + height**2 + 1e-12) + u)
            low.append(np.full(stages, problem.distances[m]))
        weights = casadi.DM(problem.terms.error_weights)
        error = casadi.dot(weights, casadi.sum1((p - problem.reference[:, :2].T) ** 2).T)
        cost = problem.dt * (error + problem.slack_weight * casadi.sumsqr(u))
        nlp = {"x": casadi.vertcat(casadi.vec(p), omega, u), "f": cost, "g": casadi.vertcat(*rows)}
        silent = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"}
        solver = casadi.nlpsol("nlp", "ipopt", nlp, silent)
        lower = np.concatenate([np.full(2 * stages, -np.inf), np.zeros(2 * stages)])
        upper = np.concatenate([np.full(2 * stages, np.inf), np.ones(stages), np.full(stages, np.inf)])
        start = constants.better
        guess = np.concatenate([start.positions[:, :2].ravel(), start.omega, np.zeros(stages)])
        high = np.concatenate([np.zeros(2 * stages), np.full(stages * points, np.inf)])
        solution = solver(x0=guess, lbx=lower, ubx=upper, lbg=np.concatenate(low), ubg=high)
        if not solver.stats()["success"]:
            return cheapest(problem, constants.both, status="solver_failed")
        relaxed = np.clip(np.asarray(solution["x"]).ravel()[2 * stages : 3 * stages], 0.0, 1.0)
        return cheapest(problem, (problem.evaluate(sum_up_rounding(relaxed)), constants.accept, constants.refuse))


class ScipRoute:
    """The convexified problem with one binary per stage, SCIP through cvxpy."""

    def solve(self, problem: Problem) -> Solution:
        """Build and solve, up to the time limit."""
        constants = ConstantPlans.of(problem)
        normals = normals_along(problem, constants.better.positions)
        omega, u = cvxpy.Variable((problem.stages, 1), boolean=True), cvxpy.Variable(problem.stages, nonneg=True)
        velocity = problem.refuse + cvxpy.multiply(omega, problem.accept - problem.refuse)
        p = problem.initial[None] + problem.dt * cvxpy.cumsum(velocity, axis=0)
        rows: list[Any] = [
            cvxpy.sum(cvxpy.multiply(normals[:, m], p - problem.centres[:, m]), axis=1) >= d - u
            for m, d in enumerate(problem.distances)
        ]
        away = cvxpy.multiply(np.sqrt(problem.terms.error_weights)[:, None], problem.reference - p)
        error = cvxpy.sum_squares(away)
        cost = problem.dt * (error + problem.slack_weight * cvxpy.sum_squares(u))
        model = cvxpy.Problem(cvxpy.Minimize(cost), rows)
        try:
            model.solve(solver="SCIP", scip_params={"limits/time": SCIP_LIMIT_S})
        except cvxpy.SolverError:
            return cheapest(problem, constants.both, status="solver_failed")
        if model.status != "optimal" or omega.value is None:
            return cheapest(problem, constants.both, status="solver_failed")
        plan = problem.evaluate((omega.value[:, 0] > 0.5).astype(float))
        return cheapest(problem, (plan, constants.accept, constants.refuse))


def contestants() -> dict[str, Callable[[], Any]]:
    """Every route, and the references that are installed."""
    routes: dict[str, Callable[[], Any]] = {name: ROUTES.load(name, of=Route) for name in ROUTES.own}
    routes["mixed_10"] = lambda: MixedIntegerRoute(10)
    for name, module, make in (("casadi+ipopt", "casadi", CasadiRoute), ("cvxpy+scip", "pyscipopt", ScipRoute)):
        if find_spec(module) is None:
            print(f"{name}: {module} is not installed, left out")
        else:
            routes[name] = make
    return routes


# --- measurement -------------------------------------------------------------------------------------------------


def measure(route: Any, samples: list[Sample]) -> tuple[np.ndarray, list[list[Solution]]]:
    """CPU time of each solution, ms, and what was decided; the first sample is solved once before."""
    for problem in samples[0]:
        route.solve(problem)
    times, solutions = [], []
    for sample in samples:
        started = time.process_time()
        solutions.append([route.solve(problem) for problem in sample])
        times.append(1e3 * (time.process_time() - started))
    return np.array(times), solutions


@dataclass(frozen=True)
class Known:
    """Lowest costs known of plans that refuse and that accept first, and what an excess is relative to."""

    refuse: float
    accept: float
    scale: float

    @classmethod
    def of(cls, problem: Problem, solutions: list[Solution]) -> Known:
        """By the constant plans and every plan of `solutions`."""
        constants = ConstantPlans.of(problem)
        planned = [d for d in solutions if d.has_plan]
        refuse = min([constants.refuse.objective, *(d.objective_refuse for d in planned)])
        accept = min([constants.accept.objective, *(d.objective_accept for d in planned)])
        constant = constants.better.objective
        return cls(refuse, accept, max(refuse if refuse < accept else accept, 0.01 * constant, 1e-12))

    def excess(self, solution: Solution) -> float:
        """Relative."""
        return (solution.objective - min(self.refuse, self.accept)) / self.scale

    def differs(self, solution: Solution) -> bool:
        """Whether the first stage is another, where it matters."""
        matters = abs(self.refuse - self.accept) > RULE * self.scale
        return matters and solution.accept_first != (self.accept < self.refuse)


@dataclass(frozen=True)
class Result:
    """What a route did on every `step`-th sample."""

    step: int
    times: np.ndarray
    solutions: list[list[Solution]]


def row(name: str, result: Result, known: list[list[Known]], default: Result | None) -> list[Any]:
    """The columns from `route` on."""
    pairs = [(d, k) for i, ds in enumerate(result.solutions) for d, k in zip(ds, known[i * result.step], strict=True)]
    decided = [(d, k) for d, k in pairs if d.status != "solver_failed"]
    excess = 100.0 * np.array([k.excess(d) for d, k in decided] or [np.nan])
    return [
        name, len(result.times),
        *(f"{t:.2f}" for t in (*np.percentile(result.times, [50, 99]), result.times.max())),
        f"{excess.mean():.3f}", f"{excess.max():.3f}", int((excess > 100.0 * RULE).sum()),
        sum(d.accept_first for d, _ in pairs), sum(k.differs(d) for d, k in decided), len(pairs) - len(decided),
        sum(d.status == "optimal" and 0.0 <= d.gap + 1e-9 <= 2e-9 for d, _ in pairs),
        f"{np.median(result.times) / np.median(default.times):.1f}" if default else "",
    ]  # fmt: skip


def exceptions(title: str, result: Result, known: list[list[Known]]) -> list[str]:
    """Problems where the default route misses the best known by more than the rule allows."""
    lines = []
    for i, ds in enumerate(result.solutions):
        for j, (d, k) in enumerate(zip(ds, known[i * result.step], strict=True)):
            if not d.has_plan or k.excess(d) > RULE or k.differs(d):
                lines.append(
                    f"{title}, sample {i}, UGV {j + 1}: {d.status}, cost {d.objective:.6g} "
                    f"({'accept' if d.accept_first else 'refuse'}), best known accepting {k.accept:.6g}, refusing "
                    f"{k.refuse:.6g}, excess {100.0 * k.excess(d):.2f} %, gap in half-planes {100.0 * d.gap:.2f} %"
                    + (", other first stage" if k.differs(d) else "")
                )
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a tenth of the problems")
    parser.add_argument("-o", "--output", metavar="CSV", help="write the table there, too")
    parser.add_argument("--outcomes", action="store_true", help="only what a decision of method (d) costs")
    parser.add_argument("--routes", metavar="NAMES", help="only these, separated by commas (default: all)")
    arguments = parser.parse_args()
    logging.getLogger("drake").setLevel(logging.ERROR)  # solvers that give up are counted below
    makers = contestants()
    chosen = arguments.routes.split(",") if arguments.routes else list(makers)
    if unknown := set(chosen) - set(makers):
        parser.error(f"--routes: unknown {', '.join(sorted(unknown))}; allowed: {', '.join(makers)}")
    routes = {name: makers[name]() for name in chosen}
    cost_of_outcomes(20 if arguments.quick else 200)
    if arguments.outcomes:
        return
    layout = "{:<19}{:>5}{:>7}{:>7}  {:<17}{:>9}{:>9}{:>9}{:>9}{:>14}{:>13}{:>11}{:>9}{:>13}{:>8}{:>7}{:>10}"
    print(layout.format(*COLUMNS))
    table, missed, solved = [], [], 0
    for title, ugvs, points, stages, samples in groups(arguments.quick):
        results = {}
        for name, route in routes.items():
            if stages <= SLOW.get(name, stages):
                step = 10 if name in SLOW else 1
                results[name] = Result(step, *measure(route, samples[::step]))
        known = [
            [
                Known.of(p, [r.solutions[i // r.step][j] for r in results.values() if i % r.step == 0])
                for j, p in enumerate(sample)
            ]
            for i, sample in enumerate(samples)
        ]
        for name, result in results.items():
            table.append([title, ugvs, points, stages, *row(name, result, known, results.get(DEFAULT))])
            print(layout.format(*table[-1]), flush=True)
        if DEFAULT in results:
            label = f"{title}, {ugvs} UGVs, {points} points, {stages} stages"
            missed += exceptions(label, results[DEFAULT], known)
            solved += sum(len(ds) for ds in results[DEFAULT].solutions)
    print(f"\n{DEFAULT}: {len(missed)} of {solved} problems miss the best known by more than {100.0 * RULE} %")
    print("\n".join(missed))
    if arguments.output:
        with open(arguments.output, "w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([COLUMNS, *table])


if __name__ == "__main__":
    main()
