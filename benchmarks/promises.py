"""Promises beside what appears, stops and turns back: `python benchmarks/promises.py -n 1000 [--only 17]`.

Draws one or two robots with every plant beside obstacles that appear, stop or reverse on their way, and compares each
promise of a report with distances that are computed here: bodies are moved anew from the recorded commands, obstacles
from their scripts, in steps of a 40th of a control period. Compared are

- the distance guaranteed for each pair (SAFE-HYP),
- "proved": where SAFE-HYP holds, every pair without a mover keeps its distance,
- the periods in which the distance from a mover is proved,
- whose doing it was that a distance was broken, and SAFE-OWN,
- the budget: steered points that keep the law's distance, and a clear start, keep the bodies apart.

Prints each scenario that breaks a promise by its number, which draws it again, and how often each promise was put to
the test. Exit code 1 if there is such a scenario.
"""

import argparse
import math
from collections import Counter
from collections.abc import Sequence
from typing import Any, NamedTuple

import maps
import numpy as np
import numpy.typing as npt

from airground_drake.base.errors import ScenarioError
from airground_drake.report.rules import OURS
from airground_drake.scenario.budget import budget
from airground_drake.scenario.load import from_data
from airground_drake.scenario.schema import Obstacle, Scenario
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge
from airground_drake.verify.runs.encounters import encounters
from airground_drake.verify.runs.passive import beside

Array = npt.NDArray[np.float64]
FINE = 40
"""Instants per control period at which distances are computed."""
SLACK_M = 1e-6
"""A promise may exceed a distance by this much, m: that is far below what any of these faults costs."""
PLANTS: tuple[Any, ...] = (
    {"kind": "first_order"},
    {"kind": "lag", "time_constant_s": 0.3},
    {"kind": "lag", "time_constant_s": 0.8},
    {"kind": "delay", "delay_s": 0.3},
    {"kind": "delay", "delay_s": 1.0},
    [{"kind": "delay", "delay_s": 0.5}, {"kind": "lag", "time_constant_s": 0.3}],
    {"kind": "unicycle", "hand_point_m": 0.1, "max_turn_rad_s": 4.0},
    {"kind": "unicycle", "hand_point_m": 0.15, "max_turn_rad_s": 4.0, "backwards": False},
)


def draw(number: int) -> dict[str, Any]:
    """Draw a scenario: robots along the x axis, obstacles about their ways."""
    rng = np.random.default_rng([20261128, number])
    period_s, speed = float(rng.choice([0.025, 0.05])), float(rng.choice([0.5, 1.0, 2.0]))
    ugvs = {}
    for k in range(int(rng.integers(1, 3))):
        start, target = (0.0, 6.0 * k), (8.0, 6.0 * k + float(rng.uniform(-1.0, 1.0)))
        of = {"radius_m": 0.1, "max_speed_m_s": 1.25 * speed, "plant": PLANTS[int(rng.integers(len(PLANTS)))]}
        ugvs[f"u{k}"] = maps.straight(start, target, speed, **of)
    obstacles = {f"o{k}": _obstacle(rng, speed, len(ugvs)) for k in range(int(rng.integers(1, 5)))}
    return {
        "name": f"promises_{number}", "duration_s": 6.0, "ugvs": ugvs, "obstacles": obstacles,
        "uav": {"start_m": [0.0, 20.0, 4.0], "target_m": [8.0, 20.0, 4.0], "altitude_m": 4.0},
        "safe_distance": {"obstacle_m": 0.3, "moving_m": 0.2, "ugv_m": 0.3, "air_ground_m": 0.5, "collision_m": 0.01},
        "control": {"period_s": period_s, "sensing_range_m": 8.0},
        "intervention": {"policies": [{"name": "coordinate"}]},
        "runs": {"d": {"method": str(rng.choice(["a", "d"]))}},
    }  # fmt: skip


def _obstacle(rng: np.random.Generator, speed: float, robots: int) -> dict[str, Any]:
    """A disc about the way of a robot: it appears ahead of or beside it, might move, or moves across."""
    when, radius = float(rng.uniform(0.5, 4.0)), float(rng.choice([0.05, 0.2]))
    x = speed * when + float(rng.uniform(-speed, 1.5))  # a late body is behind its steered point
    y = 6.0 * int(rng.integers(robots)) + float(rng.uniform(-0.6, 0.6))
    kind = rng.choice(["appears", "might move", "stops", "reverses", "stands"])
    if kind == "stands":
        return {"position_m": [x + 1.0, y], "radius_m": radius}
    if kind == "appears":
        return {"position_m": [x, y], "radius_m": radius, "appears_s": when}
    if kind == "might move":
        return {"position_m": [x, y], "radius_m": radius, "appears_s": when, "max_speed_m_s": 0.1}
    pace = float(rng.choice([0.5, 1.5]))
    far = y + float(rng.choice([-3.0, 3.0]))
    moves = {
        "waypoints_m": [[x, far], [x, y]], "speed_m_s": pace, "start_s": max(when - 3.0 / pace, 0.0),
        "at_end": "stop" if kind == "stops" else "reverse",
    }  # fmt: skip
    return {"radius_m": radius, "moves": moves, **({"appears_s": when} if rng.random() < 0.3 else {})}


class Way(NamedTuple):
    """Places of a body and of its steered point at all instants, (N, 3) each, m."""

    body: Array
    steered: Array


def way_of(trace: Trace, robot: str) -> Way:
    """Move a robot from its start by its recorded commands, period by period, in this module's own equations."""
    given, h = trace.scenario.robots[robot], trace.scenario.control.period_s
    commands = np.column_stack([trace.samples[f"{robot}.v{axis}_m_s"] for axis in "xyz"])
    start, plants = np.array(given.start_m, dtype=float), {plant.kind: plant for plant in given.plant}
    if "unicycle" in plants:
        return _unicycle(start, commands, h, plants["unicycle"])
    steps = np.arange(FINE) / FINE * h
    steered = np.concatenate([[start], start + np.cumsum(commands * h, axis=0)])
    points = (steered[:-1, None] + steps[:, None] * commands[:, None]).reshape(-1, 3)
    late = round(plants["delay"].delay_s / h) if "delay" in plants else 0
    carried = np.concatenate([np.zeros((late, 3)), commands])[: len(commands)]  # the commands that take effect
    if "lag" not in plants:
        at = np.concatenate([[start], start + np.cumsum(carried * h, axis=0)])[:-1]
        return Way((at[:, None] + steps[:, None] * carried[:, None]).reshape(-1, 3), points)
    tau, place, velocity, rows = plants["lag"].time_constant_s, start, np.zeros(3), []
    for command in carried:
        off = velocity - command  # p' = command + off exp(-s / tau)
        rows.append(place + steps[:, None] * command - tau * np.expm1(-steps / tau)[:, None] * off)
        place = place + h * command - tau * math.expm1(-h / tau) * off
        velocity = command + math.exp(-h / tau) * off
    return Way(np.concatenate(rows), points)


def _unicycle(axle: Array, commands: Array, h: float, plant: Any) -> Way:
    """An axle that runs through an arc in each period, so that the hand point ends where the command leads."""
    heading, hand, steps, rows, hands = plant.heading_rad, plant.hand_point_m, np.arange(FINE) / FINE * h, [], []
    for command in commands:
        a, b = (command[0] * math.cos(heading) + command[1] * math.sin(heading),
                command[1] * math.cos(heading) - command[0] * math.sin(heading))  # fmt: skip
        beta = math.atan2(b * h, 2.0 * hand + a * h) if b else 0.0
        turn, speed = 2.0 * beta / h, (a * math.cos(beta) + b * math.sin(beta)) * (beta / math.sin(beta) if beta else 1)
        for times, out in ((steps, rows), (np.array([h]), None)):
            now = heading + turn * times
            x = np.sin(now) - math.sin(heading), math.cos(heading) - np.cos(now)
            gone = (speed / turn * x[0], speed / turn * x[1]) if turn else (
                speed * times * math.cos(heading), speed * times * math.sin(heading))  # fmt: skip
            places = axle + np.column_stack([*gone, np.zeros(len(times))])
            if out is not None:
                out.append(places)
                hands.append(places + hand * np.column_stack([np.cos(now), np.sin(now), np.zeros(len(times))]))
        axle, heading = places[0], heading + turn * h
    return Way(np.concatenate(rows), np.concatenate(hands))


def origin_of(obstacle: Obstacle, times: Array, h: float) -> Array:
    """Where a disc is at some times, (N, 3), m: legs take whole control periods, and begin at one."""
    moves = obstacle.moves
    if moves is None:
        return np.broadcast_to([*obstacle.position_m[:2], 0.0], (len(times), 3))
    begin, end = (np.array([*point[:2], 0.0]) for point in moves.waypoints_m)
    leg = math.ceil(np.linalg.norm(end - begin) / moves.speed_m_s / h - 1e-9) * h
    gone = np.maximum(times - math.ceil(moves.start_s / h - 1e-9) * h, 0.0) / leg
    share = np.minimum(gone, 1.0) if moves.at_end == "stop" else 1.0 - np.abs(1.0 - gone % 2.0)
    return begin + share[:, None] * (end - begin)


class Course(NamedTuple):
    """The distances of a robot and an obstacle, or another robot, at N instants.

    Attributes:
        gap: between the surfaces, m; NaN where the obstacle is not there.
        steered: between steered points, or such a point and a centre, less the radii, m.
        held: as `gap`, with the other body where it was at the control sample.
        required: gap to keep, m.
        first: number of the first instant at which both are there.
        delay_s: the longer delay of their commands.
    """

    gap: Array
    steered: Array
    held: Array
    required: float
    first: int
    delay_s: float


def courses(trace: Trace, period_s: float) -> dict[tuple[str, str], Course]:
    """All pairs of UGVs and obstacles, and of UGVs."""
    given, ugvs = trace.scenario, list(trace.scenario.ugvs)
    ways = {name: way_of(trace, name) for name in ugvs}
    times = np.arange(len(next(iter(ways.values())).body)) * period_s / FINE
    sample = np.arange(len(times)) // FINE * FINE
    delay = {name: sum(getattr(plant, "delay_s", 0.0) for plant in given.ugvs[name].plant) for name in ugvs}
    found = {}
    for k, name in enumerate(ugvs):
        body, steered = ways[name]
        for other, obstacle in given.obstacles.items():
            place = origin_of(obstacle, times, period_s)
            radii = given.ugvs[name].radius_m + obstacle.radius_m
            first = math.ceil(obstacle.appears_s / period_s - 1e-6) * FINE
            there = np.arange(len(times)) >= first
            apart, point, held = (
                np.where(there, np.linalg.norm((one - two)[:, :2], axis=1) - radii, np.nan)
                for one, two in ((body, place), (steered, place), (body, place[sample]))
            )
            moves = obstacle.expected_speed_m_s > 0.0
            required = given.safe_distance.moving_m if moves else given.safe_distance.obstacle_m
            found[name, other] = Course(apart, point, held, required, first, delay[name])
        for other in ugvs[k + 1 :]:
            radii = given.ugvs[name].radius_m + given.ugvs[other].radius_m
            apart, point = (np.linalg.norm(ways[name][j] - ways[other][j], axis=1) - radii for j in (0, 1))
            both = max(delay[name], delay[other])
            found[name, other] = Course(apart, point, apart, given.safe_distance.ugv_m, 0, both)
    return found


class Judged(NamedTuple):
    """What broke a promise, in words, and how often each promise was tested."""

    broken: list[str]
    tested: Counter[str]


def judged(number: int) -> Judged | None:
    """Simulate a drawn scenario and compare its promises; None if the scenario is not valid."""
    try:
        scenario = from_data(draw(number), f"promises_{number}")
    except ScenarioError:
        return None
    trace = simulate(scenario, "d", engine="batch")
    (hypotheses,) = judge(trace, ["SAFE-HYP"])
    pairs = courses(trace, scenario.control.period_s)
    broken, tested = list[str](), Counter[str]()

    def compare(promise: str, about: object, promised: float, true: float) -> None:
        tested[promise] += 1
        if not true >= promised - SLACK_M:
            broken.append(f"{number}: {promise}, {about}: {promised:.6f} m promised, {true:.6f} m are true")

    for row in hypotheses.evidence["pairs"]:
        pair = row["first"], row["second"]
        if pair in pairs and row["guarantee_m"] is not None:
            compare("guarantee", pair, row["guarantee_m"], float(np.nanmin(pairs[pair].gap)))
    at_rest = {pair for pair in pairs if not (o := scenario.obstacles.get(pair[1])) or not o.expected_speed_m_s}
    if hypotheses.status == "holds":
        for pair in at_rest:
            compare("proved", pair, pairs[pair].required, float(np.nanmin(pairs[pair].gap)))
    for periods in beside(trace):
        pair = periods.pair.first, periods.pair.second
        if pair in pairs:
            gap, begins = pairs[pair].gap, np.round(trace.t[periods.row[periods.kept]] / scenario.control.period_s)
            for begin in begins.astype(int).tolist():
                compare("kept period", pair, pairs[pair].required, float(gap[begin * FINE : (begin + 1) * FINE].min()))
    _doings(trace, pairs, compare)
    _budgets(scenario, pairs, at_rest, compare)
    return Judged(broken, tested)


def _own_m(course: Course) -> float:
    """The most that the robot's own motion took of the distance required, m, since both were once apart."""
    periods = course.gap.reshape(-1, FINE), course.held.reshape(-1, FINE)
    apart = np.flatnonzero(course.gap >= course.required)
    if not len(apart):
        return 0.0
    since = -(-int(apart[0]) // FINE)
    due = np.minimum(periods[0][since:, 0], course.required)
    short = periods[0][since:].min(axis=1) < course.required - SLACK_M
    return float(np.where(short, due - periods[1][since:].min(axis=1), 0.0).max(initial=0.0))


def _doings(trace: Trace, pairs: dict[tuple[str, str], Course], compare: Any) -> None:
    """Whose doing: who is cleared took nothing, and what never moved took nothing."""
    for encounter in encounters(trace):
        pair = encounter.first, encounter.second
        if pair not in pairs or encounter.doing in OURS:
            continue
        obstacle = trace.scenario.obstacles.get(encounter.second)
        compare("cleared", pair, 0.0, -_own_m(pairs[pair]))
        if encounter.doing == "other":
            compare("the other moved", pair, 1.0, float(obstacle is not None and obstacle.moves is not None))
        else:
            start = pairs[pair].gap[pairs[pair].first]
            compare("began too near", pair, float(start), pairs[pair].required)
    for own in judge(trace, ["SAFE-OWN"]):
        if own.status == "holds":
            for pair, course in pairs.items():
                if (obstacle := trace.scenario.obstacles.get(pair[1])) and obstacle.expected_speed_m_s:
                    compare("SAFE-OWN", pair, 0.0, -_own_m(course))


def _budgets(scenario: Scenario, pairs: dict[tuple[str, str], Course], at_rest: set[Any], compare: Any) -> None:
    """Where steered points keep the law's distance and the bodies are clear at first, the bodies keep the promise."""
    for entry in budget(scenario):
        pair = entry.first, entry.second
        if pair not in at_rest:
            continue
        course = pairs[pair]
        begun = course.first + round(course.delay_s / scenario.control.period_s) * FINE + 1
        clear = float(np.min(course.gap[course.first : begun])) >= entry.promised_m
        if clear and np.nanmin(course.steered) >= entry.gap_m:
            compare("budget", pair, entry.promised_m, float(np.nanmin(course.gap)))


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw, simulate, compare, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-n", type=int, default=100, help="draws")
    parser.add_argument("--first", type=int, default=0, help="number of the first draw")
    parser.add_argument("--only", type=int, help="this draw only")
    options = parser.parse_args(arguments)
    numbers = [options.only] if options.only is not None else range(options.first, options.first + options.n)
    broken, tested, valid = 0, Counter[str](), 0
    for number in numbers:
        result = judged(number)
        if result is not None:
            valid, broken = valid + 1, broken + bool(result.broken)
            tested += result.tested
            for words in result.broken:
                print(words, flush=True)
    print(f"{valid} valid scenarios of {len(numbers)}, {broken} with a broken promise; tested: {dict(tested)}")
    return 1 if broken else 0


if __name__ == "__main__":
    raise SystemExit(main())
