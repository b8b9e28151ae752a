"""Attack the gatekeeper: hostile proposals at decision level, and whole runs with a hostile UAV.

    python benchmarks/hostile.py --proposals 10000 --runs 300 --lies 300

Decision level: UGVs at random safe places among points, walls, boxes and triangles, many exactly at the safe distance,
get proposals of random position, speed, direction and course; a third of them lead to the nearest obstacle. A person
walks straight at the UGV all the time. Under method (d) each proposal is executed, accepted or not; under (c) only if
its gatekeeper accepts.

Whole runs: case A with walls and boxes in the place of some obstacles, and two persons who walk at random; the policies
`hostile`, `towards` and `noisy` of random parameters, obstacles that the UAV does not know, and a gatekeeper that
accepts nearly everything (under method (d) one that finds every prediction useful, as a lying map could make it).
Distances are exact in continuous time. Beside persons the margin is that of SAFE-OWN: how near a robot brought itself.
The time that a UAV steals is measured, too: the longest time for which a UGV executed interventions between two rests,
against the bound of LIVE-WAIT.

Lies: runs of case A under (d) with a UAV that lies in every part of its messages (`hostile_uav`), half of them with
gatekeepers that believe every prediction, and with random patience. A small evolutionary search looks for the tactics
that steal the largest share of the bound.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Self
from unittest import mock

import numpy as np
from hostile_uav import CHOICES, LyingPlanner, Tactic, drawn, mutated, shape_at

from airground_drake.base.arrays import Array
from airground_drake.base.registry import Method
from airground_drake.model.bodies.motion import PeriodMotion
from airground_drake.model.bodies.world import Body
from airground_drake.model.geometry import convex, outline
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.model.plants.scripted import Scripted
from airground_drake.report.audit.companions import Believing
from airground_drake.scenario.load import load, validated
from airground_drake.scenario.schema import Moves, Obstacle, Policy, Run, Scenario
from airground_drake.scenario.world import make_world
from airground_drake.sim import components
from airground_drake.sim.blocks.controllers import UgvController
from airground_drake.sim.components import make_planner, make_presets
from airground_drake.sim.simulation import Recorder
from airground_drake.sim.trace import Trace
from airground_drake.uav.planner import Planner
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.outcome_gatekeeper import OutcomeGatekeepers
from airground_drake.ugv.problem import Horizon, predicted_problem
from airground_drake.ugv.rollout import View
from airground_drake.ugv.routes.relaxed import RelaxedRoute
from airground_drake.verify.claims.safe_own import SafeOwn
from airground_drake.verify.claims.safe_trace import SafeTrace
from airground_drake.verify.engines.outlines import Cores, closest

STEPS = 30
"""Control periods for which a proposal is executed at decision level."""
FAR_AWAY = ([-90.0, 0.0, 0.0], [-90.0, 0.0, 2.0])
"""Where the other robots are at decision level, m."""
GENERATION, BEST = 20, 5
"""Lies of a generation, and the best lies so far, whose tactics are mutated for the next one."""


def attack(random: np.random.Generator, start: Array, middles: Array, t: float) -> Motion:
    """A hostile motion: some corners, held or jumping, a third of them at the nearest obstacle."""
    count = int(random.integers(1, 6))
    corners = start + random.normal(scale=random.choice([0.5, 3.0, 30.0]), size=(count, 3)) * [1, 1, 0]
    if random.random() < 1 / 3:
        nearest = middles[np.linalg.norm(middles - start, axis=1).argmin()]
        corners[-1] = start + (nearest - start) * random.choice([0.5, 1.0, 1.5]) * [1, 1, 0]
    times = t + np.cumsum(random.choice([1e-3, 0.05, 0.5]) * random.uniform(0.1, 1.0, count + 1))
    return Motion(times, np.vstack([start, corners]))


def at_decision_level(seed: int, proposals: int) -> tuple[float, float, int, int]:
    """The worst margins under (d), m, to obstacles at rest, and by own doing to the person.

    Also the number of proposals that (c) accepted, and of these with a distance below d from an obstacle at rest.
    """
    random = np.random.default_rng(seed)
    scenario = load("case_a")
    base, presets = make_world(scenario), make_presets(scenario)
    gate = scenario.gatekeeper
    horizon = Horizon(gate.stages, 1, gate.error_weight_1_m2_s, gate.slack_weight_1_m2_s)
    avoidance = Avoidance(scenario.control.avoidance_gain_1_s, scenario.control.period_s, 4.0)
    route, d = RelaxedRoute(), scenario.safe_distance.obstacle_m
    worst, own, accepted, below = np.inf, np.inf, 0, 0
    for _ in range(proposals):
        still = outline.stacked(shape_at(place, d, random) for place in random.uniform(-4.0, 4.0, (4, 2)))
        start = safe_start(random, still, d)
        person = Person.drawn(random)
        bodies = (Body(f"o{k}", "obstacle", np.zeros(3), row[None]) for k, row in enumerate(still))
        world = replace(base, bodies=(*base.moving, person.body, *bodies))
        t = float(random.uniform(0.0, 20.0))
        middles = np.column_stack([still[:, outline.MIDDLE : outline.EXTENT], np.zeros(len(still))])
        proposal = Proposal("hostile", t, attack(random, start, middles, t))
        for on_top in (False, True):
            law = UgvLaw(avoidance, 2.0, 1.5, intervention_on_top=on_top)
            if on_top:
                place, rows = person.start[None], person.body.shape
                keep = np.append(outline.keep(still, 0.0), outline.keep(rows, 0.0))
                scene = View(t, start, presets[0], still, rows, place, 0.0 * place, keep, np.ones(len(keep)), 3.0)
                if not route.solve(predicted_problem(scene, law, proposal, horizon)).accept_first:
                    continue
                accepted += 1
            way, walked = executed(UgvController(world, law), presets[0], proposal, start, t, person)
            margin = closest(Cores.of(still), way, planar=True)[0] - d
            if on_top:
                below += margin < -1e-9
            else:
                worst, own = min(worst, margin), min(own, own_margin(way, walked, person, avoidance.period))
    return worst, own, accepted, below


@dataclass(frozen=True)
class Person:
    """A person who walks straight at a UGV.

    Attributes:
        start: place at the beginning, (3,), m.
        keeps_m: distance that the UGV has to keep from the middle of the person, m.
        speed_m_s: of the person, as declared.
    """

    start: Array
    keeps_m: float
    speed_m_s: float

    @classmethod
    def drawn(cls, random: np.random.Generator) -> Self:
        """Anywhere, also on the UGV."""
        start = np.append(random.uniform(-5.0, 5.0, 2), 0.0)
        return cls(start, float(random.choice([0.3, 1.0])), float(random.choice([0.3, 1.2, 4.0])))

    @property
    def body(self) -> Body:
        """The person as an obstacle that moves."""
        shape = outline.balls(np.zeros(3), gap=self.keeps_m)
        shape[:, outline.SPEED] = self.speed_m_s
        script = Motion(np.zeros(1), self.start[None])
        return Body("person", "obstacle", self.start, shape, Scripted(script), self.speed_m_s)


def safe_start(random: np.random.Generator, still: Array, d: float) -> Array:
    """A place at least d from all outlines; half of the time exactly d from one."""
    while True:
        start = np.append(random.uniform(-5.0, 5.0, 2), 0.0)
        if random.random() < 0.5:
            away, k = np.empty(3), int(random.integers(len(still)))
            apart = convex.nearest(still[k], *start, True, away, np.inf)
            start = start + (d - apart) * away
        if (convex.distances(still, start, True) >= d).all():
            return start


def executed(
    controller: UgvController, preset: Motion, proposal: Proposal, start: Array, t: float, person: Person
) -> tuple[Array, Array]:
    """Where the UGV and the person are at the samples while the UGV executes the proposal, (STEPS + 1, 3), m."""
    h, positions = controller.law.avoidance.period, np.array([start, *FAR_AWAY, person.start])
    ways = [positions.copy()]
    for k in range(STEPS):
        now = t + k * h
        reference, rate = (np.array([value, np.zeros(3)]) for value in preset.at(now))
        velocity = controller.velocity(now, positions, reference, rate, [proposal, None])
        towards = positions[0] - positions[3]
        positions[3] += h * person.speed_m_s * towards / max(float(np.linalg.norm(towards)), 1e-9)
        positions[:2] += h * velocity
        ways.append(positions.copy())
    return np.array(ways)[:, 0], np.array(ways)[:, 3]


def own_margin(way: Array, walked: Array, person: Person, period: float) -> float:
    """How near the UGV came to where the person was at each sample, less min(D, d + V h), m."""
    start = (way - walked)[:-1]
    least = PeriodMotion(start, start + np.diff(way, axis=0)).least_distance()[0]
    keeps = person.keeps_m + person.speed_m_s * period
    return float((least - np.minimum(np.linalg.norm(start, axis=1), keeps)).min())


def with_walls_and_persons(scenario: Scenario, random: np.random.Generator) -> None:
    """Turn some obstacles of case A into walls and boxes, and let two persons walk among the robots."""
    for obstacle in scenario.obstacles.values():
        kind = int(random.integers(3))
        if kind:
            obstacle.heading_rad = float(random.uniform(-3.0, 3.0))
            obstacle.distance_m, obstacle.radius_m = 1.4, 0.1
            setattr(obstacle, *[("segment_m", [[-0.5, 0.0], [0.5, 0.0]]), ("size_m", [0.8, 0.6])][kind - 1])
    for k in range(2):
        ways = random.uniform([-4.0, 0.0], [8.0, 14.0], (3, 2)).round(3).tolist()
        moves = Moves([[*corner, 0.0] for corner in ways], float(random.uniform(0.3, 1.5)), at_end="reverse")
        scenario.obstacles[f"person{k}"] = Obstacle(
            radius_m=0.25, moves=moves, max_speed_m_s=1.2, distance_m=0.3, known_to_uav=bool(random.integers(2))
        )
    validated(scenario)


def margin_of(trace: Trace) -> float:
    """How much nearer than it may a robot brought itself to anything, m; above 0 it did not."""
    claim = SafeOwn() if SafeOwn().applies(trace) else SafeTrace()
    margin = claim.check(trace).margin
    return np.nan if margin is None else float(margin)


def whole_run(seed: int) -> tuple[float, int, float, float, float]:
    """Margin under (d), m, proposals that it executed, margin under (c), m, time stolen and the bound of it, s."""
    random = np.random.default_rng(seed)
    scenario = load("case_a", ["duration_s=20", f"seed={seed}"])
    x, y = random.uniform([-1.0, 3.0], [6.0, 10.0])
    scenario.intervention.policies = [
        [
            Policy("hostile", {"speed_m_s": float(random.uniform(0.5, 30.0))}),
            Policy("towards", {"x_m": x, "y_m": y, "speed_m_s": float(random.uniform(0.5, 10.0))}),
            Policy("noisy", {"speed_m_s": 2.8, "noise_m": float(random.uniform(0.2, 3.0))}),
        ][seed % 3]
    ]
    scenario.intervention.ranking, scenario.intervention.retry_s = "listed", 0.05
    scenario.gatekeeper.error_weight_1_m2_s = float(random.choice([1.0, 30.0, 1000.0]))
    scenario.obstacles["obstacle_2"].known_to_uav = bool(random.integers(2))
    scenario.choices = []  # some are about runs that are not made here
    with_walls_and_persons(scenario, random)
    margins, executed, stolen = {}, 0, 0.0
    for method in ("d", "c"):
        scenario.runs, scenario.reproduction = {method: Run(method=method)}, []
        with mock.patch.object(OutcomeGatekeepers, "foresee", Believing.foresee):
            trace = Recorder(scenario, method).simulate()
        margins[method] = margin_of(trace)
        if method == "d":
            executed = sum(event["kind"] == "accept" for event in trace.events)
            stolen = max(stolen_s(trace, ugv) for ugv in trace.ugvs)
    gate = scenario.gatekeeper
    return margins["d"], executed, margins["c"], stolen, gate.tries * (gate.longest_s + gate.period_s)


@dataclass(frozen=True)
class Lie:
    """A run with a lying UAV: its tactic, the seed of everything else, whether gatekeepers believe it."""

    tactic: Tactic
    seed: int
    believed: bool


@dataclass(frozen=True)
class Told:
    """The result of a lie: margin to d, m; time stolen and its bound, s; longest decision, s."""

    lie: Lie
    margin_m: float
    stolen_s: float
    bound_s: float
    decision_s: float

    @property
    def share(self) -> float:
        """Share of the bound that was stolen."""
        return self.stolen_s / self.bound_s


def told(lie: Lie) -> Told:
    """Make the run."""
    random = np.random.default_rng(lie.seed)
    scenario = load("case_a", [f"seed={lie.seed}"])
    gate = scenario.gatekeeper
    gate.tries, gate.longest_s = int(random.integers(1, 5)), float(random.uniform(0.5, 4.0))
    gate.rest_s, gate.period_s = float(random.uniform(0.3, 3.0)), float(random.choice([0.05, 0.1, 0.15]))
    scenario.intervention.period_s = float(random.choice([0.05, 0.1]))
    scenario.duration_s = max(20.0, 2.5 * (gate.tries * gate.longest_s + gate.rest_s))
    scenario.obstacles["obstacle_2"].known_to_uav = bool(random.integers(2))
    scenario.choices, scenario.reproduction = [], []
    body = float(random.choice([0.0, 1.0]))  # radius of an obstacle, a part of the 2 m to its centre
    scenario.safe_distance.obstacle_m -= body
    for obstacle in scenario.obstacles.values():
        obstacle.radius_m = body
    if random.random() < 0.5:
        with_walls_and_persons(scenario, random)
    scenario.choices, scenario.runs, scenario.reproduction = [], {"d": Run(method="d")}, []

    def lying(given: Scenario, method: Method, uav: str) -> Planner:
        honest = make_planner(given, method, uav)
        parts = {f.name: getattr(honest, f.name) for f in fields(Planner)}
        return LyingPlanner(**parts, tactic=lie.tactic, random=random)

    foresee = Believing.foresee if lie.believed else OutcomeGatekeepers.foresee
    with (
        mock.patch.object(components, "make_planner", lying),
        mock.patch.object(OutcomeGatekeepers, "foresee", foresee),
    ):
        trace = Recorder(scenario, "d").simulate()
    return Told(
        lie,
        margin_of(trace),
        max(stolen_s(trace, ugv) for ugv in trace.ugvs),
        gate.tries * (gate.longest_s + gate.period_s),
        max(trace.timings["decision_times_s"], default=0.0),
    )


def search(pool: ProcessPoolExecutor, runs: int) -> list[Told]:
    """Lies in generations: the first at random, then mutants of the tactics that stole the most."""
    random = np.random.default_rng(0)
    found: list[Told] = []
    while len(found) < runs:
        best = sorted(found, key=lambda one: -one.share)[:BEST]
        count = min(GENERATION, runs - len(found))
        seeds = range(len(found), len(found) + count)
        tactics = [
            mutated(best[k % len(best)].lie.tactic, random) if best and k % 4 else drawn(random) for k in range(count)
        ]
        lies = [Lie(tactic, seed, bool(seed % 2)) for tactic, seed in zip(tactics, seeds, strict=True)]
        found += pool.map(told, lies)
    return found


def print_lies(found: list[Told]) -> None:
    """Print the worst lies: of all, for each part of a tactic, and those that stole the most."""
    print(f"{len(found)} runs with a lying UAV:")
    print(f"  (d) worst margin to d: {min(one.margin_m for one in found):.3g} m")
    above = sum(one.stolen_s > one.bound_s + 1e-9 for one in found)
    print(f"  runs in which more was stolen than the bound: {above}")
    for believed in (False, True):
        those = [one for one in found if one.lie.believed == believed]
        most = max(those, key=lambda one: one.share)
        judging = "believe every prediction" if believed else "judge by outcomes"
        print(f"  gatekeepers that {judging}: {len(those)} runs, most stolen {most.stolen_s:.3f} s of a bound of "
              f"{most.bound_s:.3f} s ({100.0 * most.share:.2f} %)")  # fmt: skip
    print(f"  longest decision: {1e3 * max(one.decision_s for one in found):.0f} ms CPU")
    print("\n| part | is | runs | stole anything | most stolen, % of the bound | worst margin to d, m |")
    print("| --- | --- | --- | --- | --- | --- |")
    for part in ("mapped", "radii", "motion", "cause", "forge"):
        for value in CHOICES[part]:
            those = [one for one in found if getattr(one.lie.tactic, part) == value and not one.lie.believed]
            if those:
                most, least = max(one.share for one in those), min(one.margin_m for one in those)
                stole = sum(one.stolen_s > 0.0 for one in those)
                print(f"| {part} | {value} | {len(those)} | {stole} | {100.0 * most:.1f} | {least:.3g} |")
    for one in sorted(found, key=lambda one: -one.share)[:BEST]:
        print(f"  {100.0 * one.share:.2f} %: {one.lie}")


def stolen_s(trace: Trace, ugv: str) -> float:
    """The longest that a UGV executed interventions between two rests, s."""
    t, busy = trace.t, trace.executing(ugv) >= 0
    rest_s = trace.scenario.gatekeeper.rest_s - 1e-9
    worst, sum_s, alone_s = 0.0, 0.0, 0.0
    for k in range(1, len(t)):
        step = float(t[k] - t[k - 1])
        alone_s = 0.0 if busy[k] else alone_s + step
        if alone_s >= rest_s:
            sum_s = 0.0
        sum_s += step if busy[k] else 0.0
        worst = max(worst, sum_s)
    return worst


def main() -> None:
    """Run the attacks and print their results."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--proposals", type=int, default=10_000)
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--lies", type=int, default=300)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    with ProcessPoolExecutor(options.jobs) as pool:
        if options.proposals:
            share = options.proposals // 20
            parts = list(pool.map(partial(at_decision_level, proposals=share), range(20)))
            (worst, own), (accepted, below) = np.min(parts, axis=0)[:2], np.sum(parts, axis=0)[2:].astype(int)
            print(f"{20 * share} hostile proposals, each executed for {STEPS} control periods:")
            print(f"  (d) worst margin to d: {worst:.3g} m; own doing beside the person: {own:.3g} m")
            print(f"  (c) accepted {accepted}, and {below} of these then came below d")
        if options.runs:
            runs = np.array(list(pool.map(whole_run, range(options.runs), chunksize=5)))
            print(f"{options.runs} whole runs with a hostile UAV:")
            print(f"  (d) accepted {int(runs[:, 1].sum())} proposals; worst margin to d: {runs[:, 0].min():.3g} m")
            print(f"  (d) longest kept from its own task between two rests: {runs[:, 3].max():.1f} s, "
                  f"bound {runs[:, 4].max():.1f} s")  # fmt: skip
            print(f"  (c) runs below d: {int((runs[:, 2] < -1e-9).sum())}; worst margin: {runs[:, 2].min():.3g} m")
        if options.lies:
            print_lies(search(pool, options.lies))


if __name__ == "__main__":
    main()
