"""How the values of a scenario must go together: one small function per rule, all in `CHECKS`.

`schema.py` says which values a single key may have. A rule yields its problems as (key, value, allowed); `check` raises
the first. Plug-ins that a scenario names are not imported here.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from fractions import Fraction
from itertools import combinations, pairwise, starmap
from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import Fault, ScenarioError
from airground_drake.base.exact import decimal, is_multiple
from airground_drake.base.registry import ARRIVAL, METHODS, MODEL_CLAIMS, POLICIES, ROUTES, RUN_CLAIMS
from airground_drake.base.statuses import COUNTS, NOTHING, alternatives
from airground_drake.model.geometry import convex, outline
from airground_drake.model.plants.plant import Setting
from airground_drake.model.trigger.bayes import threshold
from airground_drake.scenario import hints
from airground_drake.scenario.budget import PairBudget, budget, takes_room
from airground_drake.scenario.outlines import outlines_of
from airground_drake.scenario.plants import plant_of, refusal
from airground_drake.scenario.rounding import TOLERANCE_M, Rounding
from airground_drake.scenario.schema import ABOUT, ARENA, MAP, SHAPES, Obstacle, Scenario, Vector
from airground_drake.scenario.shapes import crossing, near_edge

GAINS = ("avoidance_gain_1_s", "motion_gain_1_s", "formation_gain_1_s", "intervention_gain_1_s")
TOLERANCE = 1e-9  # m between points; relative between periods
SHORTEST_S = 1e-3  # shortest mean outage of a link: all outages of a run are drawn in advance
_SHORT = 1.0 - 1e-5  # factor of limits printed with six digits, so that the printed value is allowed

Problems = Iterator[tuple[str, object, str]]


def check(scenario: Scenario, source: str) -> None:
    """Check a scenario whose values have the types of the schema."""
    for rule in CHECKS:
        for key, value, allowed in rule(scenario):
            raise ScenarioError(source, key, value, allowed)


def _one_of(key: str, value: str, allowed: Iterable[str], what: str) -> Problems:
    options = tuple(allowed)
    if value not in options:
        yield key, value, f"{what} {', '.join(options) or '(none)'}"


def _uavs(scenario: Scenario) -> Problems:
    """There is a UAV; several UAVs have a distance to keep from each other."""
    if scenario.uav and scenario.uavs:
        yield "uavs", Fault("uav is given, too"), "one of both: uavs has all UAVs by name"
    if not scenario.aerial:
        yield "uav", Fault("missing"), "wanted: a mapping with start_m, or several by name in uavs"
    for name, uav in scenario.uavs.items():
        if uav.name != name:
            yield f"uavs.{name}.name", uav.name, f"{name}, its key, or no name"
    if len(scenario.aerial) > 1 and not scenario.safe_distance.uav_m:
        yield "safe_distance.uav_m", Fault("missing"), "wanted: the distance between two UAVs, a number above 0 in m"


def _policies(scenario: Scenario) -> Problems:
    """The package's policies get parameters that they know."""
    for k, policy in enumerate(scenario.intervention.policies):
        why, _, takes = POLICIES.misfit(policy.name, policy.parameters).partition("; ")
        if why:
            yield f"intervention.policies.{k}.parameters", Fault(why), takes


def _charges(scenario: Scenario) -> Problems:
    """Each UGV is assigned to one UAV."""
    charged = dict[str, str]()
    for name, uav in scenario.aerial.items():
        for k, ugv in enumerate(uav.ugvs):
            key = f"{scenario.key_of(name)}.ugvs.{k}"
            yield from _one_of(key, ugv, scenario.ugvs, "one of the UGVs")
            if ugv in charged:
                elsewhere = f"it is in {scenario.key_of(charged[ugv])}.ugvs: remove it from one list"
                yield key, ugv, f"a UGV of no other UAV; {elsewhere}"
            charged[ugv] = name
    without = [name for name, uav in scenario.uavs.items() if not uav.ugvs]
    if without:
        why = f"{without[1]} has no list, too" if len(without) > 1 else "the other UAVs' lists contain all UGVs"
        yield f"uavs.{without[0]}.ugvs", Fault("missing"), f"wanted: the list of its UGVs: {why}"
    for ugv in scenario.ugvs if charged else ():
        if ugv not in charged:
            lists = " or ".join(f"{scenario.key_of(name)}.ugvs" for name in scenario.aerial)
            allowed = f"wanted: in {lists}, or one UAV without a list, which gets the rest"
            yield f"ugvs.{ugv}", Fault("assigned to no UAV"), allowed


def _bursts(scenario: Scenario) -> Problems:
    """Outages of a link are not too short to be drawn one by one."""
    for key, way in (("channel", scenario.channel), ("channel.up", scenario.channel and scenario.channel.up)):
        if way is not None and 0.0 < (way.burst_s or 0.0) < SHORTEST_S:
            yield f"{key}.burst_s", way.burst_s, f"0: independent losses; or at least {SHORTEST_S:g} s"


def _ugv_links(scenario: Scenario) -> Problems:
    """Positions arrive within a control period, unless the law is asynchronous; the package's law uses them."""
    if (link := scenario.ugv_links) is None:
        return
    if scenario.ugv_controller is not None:
        yield "channel.ugvs", Fault("with ugv_controller"), "left out: a controller of your own knows all positions"
    for run, spec in scenario.runs.items():
        for key, value in spec.set.items():
            if key.startswith("channel.ugvs"):
                yield f"runs.{run}.set.{key}", value, "the same in all runs: guaranteed distances depend on it"
    period_s = scenario.control.period_s
    if decimal(link.delay_s) > decimal(period_s) and not scenario.asynchronous:
        limit = f"at most control.period_s = {period_s:.9g} s: a robot publishes its position one period ahead"
        remedy = f"use control.period_s = {link.delay_s:.9g} or control.law = asynchronous"
        yield "channel.ugvs.delay_s", link.delay_s, f"{limit}; {remedy}"


def _asynchronous(scenario: Scenario) -> Problems:
    """The asynchronous law needs discs with exact motion, exact positions, and methods with avoidance on top."""
    if not scenario.asynchronous:
        return
    law = "with control.law: asynchronous"
    if scenario.ugv_links is None:
        allowed = "shared, or with a channel.ugvs, such as {}: without it UGVs know all positions at once"
        yield "control.law", "asynchronous", allowed
    if scenario.sensing is not None:
        yield "sensing", Fault(law), "left out: no theorem is about old positions with errors"
    for run, spec in scenario.runs.items():
        if METHODS[spec.method].intervention_on_top and METHODS[spec.method].intervenes:
            yield f"runs.{run}.method", spec.method, f"a or d {law}: {spec.method} puts interventions above avoidance"
        if spec.composition != "augmented":
            yield f"runs.{run}.composition", spec.composition, f"augmented {law}: UGVs may have to stand still"
    for name, ugv in scenario.ugvs.items():
        plant = plant_of(ugv, scenario.control.period_s)
        if plant.signals or plant.measured:
            why = f"first_order {law}: no theorem is about old positions of other plants"
            yield f"ugvs.{name}.plant", Fault(ugv.plant[0].kind), why
    for (one, first), (other, second) in combinations(scenario.ugvs.items(), 2):
        keeps = scenario.unsure_s * max(first.max_speed_m_s, second.max_speed_m_s) + scenario.safe_distance.ugv_m
        gap = math.dist(first.target_m, second.target_m) - first.radius_m - second.radius_m
        if gap < keeps - TOLERANCE:
            why = f"at least {keeps:.9g} m from that of {one}, not {gap:.9g} m"
            yield f"ugvs.{other}.target_m", second.target_m, f"{why}: UGVs with such old positions come no closer"


def _names(scenario: Scenario) -> Problems:
    keys = [(f"ugvs.{name}", name) for name in scenario.ugvs]
    keys += [(f"uavs.{name}" if scenario.uavs else "uav.name", name) for name in scenario.aerial]
    keys += [(f"obstacles.{name}", name) for name in scenario.obstacles]
    count = Counter(name for _, name in keys)
    yield from ((key, name, "a name that no other UGV, obstacle or UAV has") for key, name in keys if count[name] > 1)


def _reserved(scenario: Scenario) -> Problems:
    for name in (*scenario.robots, *scenario.obstacles):
        key = scenario.key_of(name)
        if name.startswith(ARENA):
            yield key, name, f"a name that does not begin with {ARENA}: these are the walls of arena_m"
        if name == MAP or name.startswith(f"{MAP}_"):
            yield key, name, f"a name other than {MAP}, and one that does not begin with {MAP}_: these are of the map"


def _map(scenario: Scenario) -> Problems:
    if scenario.map is None or scenario.map.cells is None:
        return
    cells = scenario.map.cells
    for index, (bottom, top, left, right) in enumerate(cells.rectangles):
        if not (bottom < top <= cells.rows and left < right <= cells.columns):
            allowed = f"a rectangle of the {cells.rows} rows and {cells.columns} columns"
            yield f"map.cells.rectangles.{index}", [bottom, top, left, right], allowed


def _shapes(scenario: Scenario) -> Problems:
    """Each obstacle has one shape, without crossing edges."""
    for name, obstacle in scenario.obstacles.items():
        key = f"obstacles.{name}"
        given = [shape for shape in SHAPES if getattr(obstacle, shape)]
        if len(given) > 1:
            yield f"{key}.{given[1]}", getattr(obstacle, given[1]), f"one shape: {given[0]} is given, too"
        if not (obstacle.position_m or obstacle.moves) and {*given} <= {*ABOUT}:
            yield f"{key}.position_m", Fault("missing"), "wanted: [x, y] or [x, y, z] in m, or polygon_m or segment_m"
        if obstacle.heading_rad and not given:
            yield f"{key}.heading_rad", obstacle.heading_rad, f"0: only {', '.join(SHAPES)} have a heading"
        if (given or obstacle.height_m) and obstacle.position_m and obstacle.position_m[2]:
            yield f"{key}.position_m", obstacle.position_m, "z = 0: it stands on the ground"
        if obstacle.disappears_s and obstacle.disappears_s <= obstacle.appears_s:
            yield (
                f"{key}.disappears_s",
                obstacle.disappears_s,
                f"later than appears_s = {obstacle.appears_s:.9g} s, or 0",
            )
        yield from _way(key, obstacle, flat=bool(given or obstacle.height_m))
        yield from _corners(f"{key}.segment_m", obstacle.segment_m, 2, closed=False)
        yield from _corners(f"{key}.polygon_m", obstacle.polygon_m, 3, closed=True)
    if scenario.arena_m and any(low == high for low, high in zip(*scenario.arena_m, strict=True)):
        yield "arena_m", scenario.arena_m, "two opposite corners of a rectangle"
    elif scenario.arena_m:
        low, high = np.min(scenario.arena_m, axis=0), np.max(scenario.arena_m, axis=0)
        for name, robot in scenario.robots.items():
            for key in ("start_m", "target_m"):
                place = np.array(getattr(robot, key)[:2])
                if not ((low < place) & (place < high)).all():
                    allowed = f"a place within arena_m = {scenario.arena_m}"
                    yield f"{scenario.key_of(name)}.{key}", getattr(robot, key), allowed


def _way(key: str, obstacle: Obstacle, *, flat: bool) -> Problems:
    moves = obstacle.moves
    if moves is None:
        if obstacle.known_motion:
            yield f"{key}.known_motion", True, "false: it has no moves"
        return
    if obstacle.position_m:
        yield f"{key}.position_m", obstacle.position_m, "no position_m: it moves along moves.waypoints_m"
    yield from _corners(f"{key}.moves.waypoints_m", moves.waypoints_m, 2, closed=False)
    if moves.at_end == "loop" and math.dist(moves.waypoints_m[0], moves.waypoints_m[-1]) <= TOLERANCE:
        yield (
            f"{key}.moves.waypoints_m",
            moves.waypoints_m,
            "without the first waypoint at the end: a loop leads back there",
        )
    if flat and any(point[2] for point in moves.waypoints_m):
        yield f"{key}.moves.waypoints_m", moves.waypoints_m, "z = 0: it stands on the ground"


def _corners(key: str, corners: Sequence[Vector], least: int, *, closed: bool) -> Problems:
    """The corners of a wall, or of a polygon whose edges must not touch each other."""
    if 0 < len(corners) < least:
        yield key, corners, f"at least {least} corners [x, y] in m"
        return
    edges = [(k - 1, k) for k in range(0 if closed else 1, len(corners))]
    for i, j in edges:
        if math.dist(corners[i], corners[j]) <= TOLERANCE:
            last, other = (j, "the one before it") if j else (len(corners) - 1, "the first: the outline ends there")
            yield f"{key}.{last}", corners[last], f"a corner other than {other}"
    if closed and corners and (met := crossing([(x, y) for x, y in corners])):
        first, second = (list(corners[k]) for k in met)
        yield key, corners, f"edges that do not meet: those that end at {first} and at {second} do"
    elif closed and corners and (thin := near_edge([(x, y) for x, y in corners], TOLERANCE)) is not None:
        allowed = f"a corner more than {TOLERANCE:g} m from the edges that do not end there (segment_m: a thin wall)"
        yield f"{key}.{thin}", corners[thin], allowed


def _blocks(scenario: Scenario) -> Problems:
    gatekeeper = scenario.gatekeeper
    if gatekeeper.blocks > gatekeeper.stages:
        allowed = "a whole number from 1 to gatekeeper.stages, or 0: one accept variable per stage"
        yield "gatekeeper.blocks", gatekeeper.blocks, allowed
    if gatekeeper.route in ROUTES.own and gatekeeper.route != "mixed_integer":
        if gatekeeper.blocks:
            yield "gatekeeper.blocks", gatekeeper.blocks, "0: only the route mixed_integer has blocks"
        if gatekeeper.solver != "daqp":
            yield "gatekeeper.solver", gatekeeper.solver, "daqp: only the route mixed_integer has other solvers"


def _runs(scenario: Scenario) -> Problems:
    for name, run in scenario.runs.items():
        for robot in run.stalls_m:
            yield from _one_of(f"runs.{name}.stalls_m.{robot}", robot, scenario.ugvs, "one of the UGVs")
        for claim in run.expected:
            key = f"runs.{name}.expected.{claim}"
            known = (*RUN_CLAIMS, *COUNTS, *scenario.claims, *(MODEL_CLAIMS if run.set else ()))
            yield from _one_of(key, claim, known, "one of the claims and numbers")
    for claim in scenario.expected:
        known = (*MODEL_CLAIMS, *scenario.claims)
        yield from _one_of(f"expected.{claim}", claim, known, "one of the claims about the model")


def _route(scenario: Scenario) -> Problems:
    """A third-party route that no run uses is a mistake: only method (c) solves problem (26)."""
    key, allowed = "gatekeeper.route", ", ".join(ROUTES.own)
    runs = ", ".join(f"{name} ({run.method})" for name, run in scenario.runs.items())
    if ROUTES.is_foreign(scenario.gatekeeper.route) and all(run.method != "c" for run in scenario.runs.values()):
        yield key, scenario.gatekeeper.route, f"no run would use it, of {runs}: add one of method c, or use {allowed}"
    for name, run in scenario.runs.items():
        route = str(run.set.get(key, ""))
        if route and ROUTES.is_foreign(route) and run.method != "c":
            yield f"runs.{name}.set.{key}", route, f"this run is of method {run.method}: only method c uses a route"


def _plants(scenario: Scenario) -> Problems:
    """Combinations of plants have a theorem, and their keys are consistent."""
    control = scenario.control
    for name, robot in scenario.robots.items():
        flies, place = scenario.kind_of(name) == "uav", f"{scenario.key_of(name)}.plant"
        if allowed := refusal(robot.plant):
            yield place, f"[{', '.join(keys.kind for keys in robot.plant)}]", allowed
        setting = Setting(control.period_s, control.avoidance_gain_1_s, robot.max_speed_m_s, flies)
        for k, keys in enumerate(robot.plant):
            at = f"{place}.{k}" if len(robot.plant) > 1 else place
            yield from ((f"{at}.{key}", value, allowed) for key, value, allowed in keys.problems(setting))


def _presets(scenario: Scenario) -> Problems:
    for name, ugv in scenario.ugvs.items():
        key = f"ugvs.{name}.preset.waypoints_m"
        for index, (before, after) in enumerate(pairwise(ugv.preset.waypoints_m), start=1):
            if math.dist(before, after) <= TOLERANCE:
                yield f"{key}.{index}", after, "a waypoint other than the one before it"
        if ugv.preset.speed_m_s > ugv.max_speed_m_s:
            allowed = f"at most the UGV's max_speed_m_s = {ugv.max_speed_m_s:.9g} m/s"
            yield f"ugvs.{name}.preset.speed_m_s", ugv.preset.speed_m_s, allowed


def preset_s(waypoints_m: Sequence[Vector], speed_m_s: float) -> float:
    """How long a preset trajectory takes, s."""
    return sum(starmap(math.dist, pairwise(waypoints_m))) / speed_m_s


def _ends(scenario: Scenario) -> Problems:
    """If a run expects a UGV at its target, the preset must end there to within the tolerance."""
    # A scenario that ends before a preset does is cut short on purpose: no arrival is expected.
    presets = [ugv.preset for ugv in scenario.ugvs.values()]
    if max(preset_s(preset.waypoints_m, preset.speed_m_s) for preset in presets) > scenario.duration_s:
        return
    for name, ugv in scenario.ugvs.items():
        away = math.dist(ugv.preset.waypoints_m[-1], ugv.target_m)
        end = len(ugv.preset.waypoints_m) - 1
        for run, spec in scenario.runs.items():
            admitted = alternatives(spec.expected.get(ARRIVAL, "holds"))
            arrives = name not in spec.stalls_m and {"refuted", NOTHING}.isdisjoint(admitted)
            if arrives and away > scenario.arrival_tolerance_m + TOLERANCE:
                allowed = (
                    f"at most arrival_tolerance_m = {scenario.arrival_tolerance_m:.9g} m from {name}'s target_m, where "
                    f"run {run} expects it, not {away:.9g} m (or runs.{run}.expected.{ARRIVAL}: refuted)"
                )
                yield f"ugvs.{name}.preset.waypoints_m.{end}", ugv.preset.waypoints_m[end], allowed


def _gains(scenario: Scenario) -> Problems:
    period = scenario.control.period_s
    for name in GAINS:
        gain = getattr(scenario.control, name)
        if decimal(gain) * decimal(period) > 1:  # as the proofs take them
            most = _shown(1 / decimal(period), ROUND_FLOOR)
            yield f"control.{name}", gain, f"at most {most} 1/s: gain * control.period_s must not exceed 1"


def _periods(scenario: Scenario) -> Problems:
    control = scenario.control.period_s
    gatekeeper = scenario.gatekeeper
    noise = scenario.decision.noise_period_s
    rule = f"must be a whole multiple of control.period_s = {control:.9g} s"
    if scenario.duration_s < control:
        yield "duration_s", scenario.duration_s, f"at least one control period, control.period_s = {control} s"
    for key, period in (("gatekeeper", gatekeeper.period_s), ("intervention", scenario.intervention.period_s)):
        if not is_multiple(period, control):
            yield f"{key}.period_s", period, rule
    stage = gatekeeper.horizon_s / gatekeeper.stages
    if not is_multiple(stage, control):
        fits = f" (gatekeeper.stages: {round(gatekeeper.horizon_s / control)} would do)"
        problem = f"a stage, horizon_s / stages = {stage:.9g} s, {rule}"
        yield "gatekeeper.horizon_s", gatekeeper.horizon_s, problem + fits * is_multiple(gatekeeper.horizon_s, control)
    if not (is_multiple(noise, control) or is_multiple(control, noise)):
        yield "decision.noise_period_s", noise, f"{rule}, or go into it a whole number of times"
    step, leak = min(control, noise), scenario.decision.leak_1_s
    if leak * step > 1.0:
        most = _shown(1 / decimal(step), ROUND_FLOOR)
        allowed = f"at most {most} 1/s: leak * {step:.9g} s, a step of the noise, must not exceed 1"
        yield "decision.leak_1_s", leak, allowed


def _release(scenario: Scenario) -> Problems:
    decision, rule = scenario.decision, scenario.decision.threshold
    zeta = threshold(**asdict(rule))
    if decision.trigger == "automaton" and not decision.release_m < zeta:
        yield "decision.release_m", decision.release_m, f"less than the {rule.rule} threshold, {zeta:.9g} m"


def _distances(scenario: Scenario) -> Problems:
    safe = scenario.safe_distance
    for name in ("obstacle_m", "ugv_m", "air_ground_m", *(key for key in ("moving_m", "uav_m") if getattr(safe, key))):
        if not safe.collision_m < getattr(safe, name):
            allowed = f"less than safe_distance.{name} = {getattr(safe, name):.9g} m"
            yield "safe_distance.collision_m", safe.collision_m, allowed
    for name, body in scenario.barriers.items():
        if body.distance_m and not safe.collision_m < body.distance_m:
            allowed = f"more than safe_distance.collision_m = {safe.collision_m:.9g} m, or 0"
            yield f"{scenario.key_of(name)}.distance_m", body.distance_m, allowed
    for name, uav in scenario.aerial.items():
        radii = uav.radius_m + max(ugv.radius_m for ugv in scenario.ugvs.values())
        if not uav.altitude_m > safe.air_ground_m + radii:
            least = f"safe_distance.air_ground_m = {safe.air_ground_m:.9g} m{_and(radii)}"
            key = f"{scenario.key_of(name)}.altitude_m"
            yield key, uav.altitude_m, f"more than {least}, for the UAV to fly over a UGV"


def _and(radii: float) -> str:
    """The radii of a distance, m, as a part of a message."""
    return f" + radii {radii:.9g} m" if radii else ""


class _Body(NamedTuple):
    """A robot or obstacle: radius plus travel in a control period, m; speed, m/s; radius, m; name."""

    reach: float
    speed: float
    radius: float
    name: str


Apart = tuple[str, float]  # a safe distance: its key, and its value, m


def apart_of(scenario: Scenario, name: str) -> Apart:
    obstacle = scenario.barriers[name]
    if obstacle.distance_m:
        return f"{scenario.key_of(name)}.distance_m", obstacle.distance_m
    moving = obstacle.expected_speed_m_s and scenario.safe_distance.moving_m
    return _apart(scenario, "moving_m" if moving else "obstacle_m")


def _apart(scenario: Scenario, kind: str) -> Apart:
    return f"safe_distance.{kind}", getattr(scenario.safe_distance, kind)


def _nearest_pairs(scenario: Scenario) -> list[tuple[Apart, _Body, _Body]]:
    """For each kind of pair, the pair that needs the largest sensing range, with its safe distance."""
    h = scenario.control.period_s
    ugvs, uavs = (
        sorted(
            (
                _Body(robot.radius_m + robot.max_speed_m_s * h, robot.max_speed_m_s, robot.radius_m, name)
                for name, robot in robots.items()
            ),
            reverse=True,
        )
        for robots in (scenario.ugvs, scenario.aerial)
    )
    fixed = [
        _Body(body.radius_m, body.expected_speed_m_s, body.radius_m, name) for name, body in scenario.barriers.items()
    ]
    pairs = [(_apart(scenario, "air_ground_m"), uavs[0], ugvs[0])]
    for kind, robots in (("ugv_m", ugvs), ("uav_m", uavs)):
        pairs += [(_apart(scenario, kind), first, second) for first, second in pairwise(robots[:2])]
    return [*pairs, *((apart_of(scenario, body.name), max(uavs[0], ugvs[0]), body) for body in fixed)]


def _shown(number: Fraction, rounding: str) -> str:
    """A number with nine digits, rounded so that it is allowed."""
    digits = Context(prec=9, rounding=rounding).divide(Decimal(number.numerator), Decimal(number.denominator))
    return f"{digits:.9g}"


def _sensing(scenario: Scenario) -> Problems:
    """A body beyond the sensing range must not come within the safe distance in one control period."""
    period = scenario.control.period_s

    def room(apart: Apart, first: _Body, second: _Body) -> Fraction:
        closing = (decimal(first.speed) + decimal(second.speed)) * decimal(period)
        return decimal(apart[1] + (first.radius + second.radius)) + closing

    needed, (kind, least), first, second = max((room(*pair), *pair) for pair in _nearest_pairs(scenario))
    if decimal(scenario.control.sensing_range_m) < needed:
        apart = f"{kind} {least:.9g} m{_and(first.radius + second.radius)}"
        total = f"{apart} + closing {first.speed + second.speed:.9g} m/s * control.period_s {period:.9g} s"
        allowed = f"at least {_shown(needed, ROUND_CEILING)} m for {first.name} and {second.name}: {total}"
        allowed += hints.fast(max(first.speed, second.speed))
        yield "control.sensing_range_m", scenario.control.sensing_range_m, allowed


def _extent(scenario: Scenario) -> Problems:
    """Rounding errors of distances must stay within the tolerance of reports."""
    # With the gain A = 0 the law restores no lost distance, and no bound applies; reports say what a run lost.
    control, duration = scenario.control, scenario.duration_s
    if control.avoidance_gain_1_s == 0.0:
        return
    speeds = sorted(robot.max_speed_m_s for robot in scenario.robots.values())
    speed, closing = speeds[-1], speeds[-2] + speeds[-1]
    loss = Rounding(control.sensing_range_m, closing, control.period_s, control.avoidance_gain_1_s)
    points: list[tuple[str, Vector]] = []
    for name, ugv in scenario.ugvs.items():
        points += [(f"ugvs.{name}.start_m", ugv.start_m), (f"ugvs.{name}.target_m", ugv.target_m)]
        points += [(f"ugvs.{name}.preset.waypoints_m.{i}", place) for i, place in enumerate(ugv.preset.waypoints_m)]
    points += [(f"{scenario.key_of(name)}.start_m", uav.start_m) for name, uav in scenario.aerial.items()]
    for name, body in scenario.barriers.items():
        shape = next((key for key in SHAPES if getattr(body, key)), "position_m")
        corners = outlines_of(scenario, body)[:, outline.CORNERS :].reshape(-1, 2)  # and zeros
        places = [corners[np.abs(corners).max(axis=1).argmax()].tolist()]
        if body.position_m:
            places.append(body.position_m)
        if body.moves:
            shape, places = "moves.waypoints_m", [*places, *body.moves.waypoints_m]
        key = f"{scenario.key_of(name)}.{'file' if name == MAP else shape}"
        points += [("arena_m" if name.startswith(ARENA) else key, place) for place in places]
    key, point = max(points, key=lambda entry: max(map(abs, entry[1])))
    farthest = max(map(abs, point))
    allowed = loss.largest_extent(duration) - speed * duration
    if farthest <= allowed:
        return
    why = f"for rounding to take less than {TOLERANCE_M:g} m from a safe distance"
    longest = loss.longest(farthest, speed)
    if allowed > 0.0 and farthest > speed * duration:
        yield (
            key,
            point,
            f"coordinates of at most {allowed * _SHORT:.6g} m in size, {why} within duration_s = {duration:.9g} s"
            f"{hints.far(farthest)}",
        )
    elif longest > 0.0:
        allowed_s = f"at most {longest * _SHORT:.6g} s at {speed:.9g} m/s, {why}"
        yield "duration_s", duration, f"{allowed_s}{hints.fast(speed) or hints.far(farthest)}"
    else:
        gain = loss.least_gain(farthest + speed * duration, duration)
        yield "control.avoidance_gain_1_s", control.avoidance_gain_1_s, f"0, or at least {gain / _SHORT:.6g} 1/s, {why}"


def _filled(scenario: Scenario) -> str:
    """Which free or unknown cells of the map count as occupied."""
    cells = scenario.map.cells if scenario.map else None
    if cells is None:
        return ""
    counted = [f"{cells.unsure} unknown ones"] if cells.unsure and cells.unknown == "occupied" else []
    if cells.unreached:
        counted.append(f"{cells.unreached} free ones that cannot be reached from any start")
    return f" (of whose cells {' and '.join(counted)} count as occupied)" if counted else ""


def _clearances(scenario: Scenario) -> Problems:
    """No robot may start or end within the safe distance of an obstacle or of another robot."""
    robots, outlines = scenario.robots, {name: outlines_of(scenario, body) for name, body in scenario.barriers.items()}
    for attribute, verb in (("start_m", "starts"), ("target_m", "would end")):
        points = {name: getattr(robot, attribute) for name, robot in robots.items()}
        near = list[tuple[str, str, float, Apart]]()  # a robot, what it is too near to, the gap, m, and what is needed
        for name, rows in outlines.items():
            if scenario.barriers[name].moves or (scenario.barriers[name].appears_s and attribute == "start_m"):
                continue  # judged in each run, when it moves or appears
            needed = apart_of(scenario, name)
            for robot, point in points.items():
                apart = convex.distances(rows, np.array(point), robot in scenario.ugvs) - rows[:, outline.RADIUS]
                near.append((robot, name, float(apart.min()) - robots[robot].radius_m, needed))
        for other, robot in combinations(robots, 2):
            gap = math.dist(points[robot], points[other]) - (robots[robot].radius_m + robots[other].radius_m)
            near.append((robot, other, gap, _apart(scenario, f"{scenario.pair_of(other, robot)}_m")))
        for robot, other, gap, (kind, least) in near:
            if gap < least - TOLERANCE:
                what = f"{verb} {gap:.9g} m from {other}{_filled(scenario) if other == MAP else ''}"
                allowed = f"{robot} {what}, at least {kind} = {least:.9g} m is needed"
                yield f"{scenario.key_of(robot)}.{attribute}", points[robot], allowed


def _standing(scenario: Scenario) -> Problems:
    """Robots without drift only, if they may have to stand still or announce positions."""
    links = ["sensing.position_error_m"] if scenario.position_error_m else []
    links += [f"channel.ugvs.{key}" for key in ("delay_s", "loss") if getattr(scenario.ugv_links, key, 0.0)]
    for name, robot in scenario.robots.items() if links else ():
        if drift := plant_of(robot, scenario.control.period_s).bounds(robot.max_speed_m_s).drift_m_s:
            allowed = f"0 with {links[0]}: {name} must stand still when commanded to, and reach its announced positions"
            yield f"{scenario.key_of(name)}.plant.drift_m_s", drift, allowed


def _faults(scenario: Scenario) -> Problems:
    """Each fault exceeds a bound that the scenario declares."""
    if (faults := scenario.faults) and faults.position_error_m and not scenario.position_error_m:
        why = "0 without sensing.position_error_m: exact positions are published"
        yield "faults.position_error_m", faults.position_error_m, why
    if faults and faults.late and not scenario.announces:
        yield "faults.late", faults.late, "0 without channel.ugvs.delay_s: no position is announced"


def _measured(scenario: Scenario) -> Problems:
    """The gain is large enough for the errors of measured positions."""
    if not (error_m := scenario.position_error_m):
        return
    key, control = "sensing.position_error_m", scenario.control
    if scenario.own_views and scenario.ugv_links is not None:
        yield "sensing.shared", False, "true with channel.ugvs, which carries the positions that UGVs publish"
    for run, spec in scenario.runs.items():
        if spec.composition != "augmented":
            yield f"runs.{run}.composition", spec.composition, f"augmented: with {key} robots may have to stand still"
    for pair in budget(scenario):
        share = decimal(control.avoidance_gain_1_s) * decimal(control.period_s)
        if share < pair.least_gain:
            both = " (each may have to stand still)" if pair.second in scenario.robots else ""
            why = f"{pair.promised_m:.9g} m between {pair.first} and {pair.second} with errors of {error_m:.9g} m{both}"
            needed = _shown(Fraction(pair.least_gain) / decimal(control.period_s), ROUND_CEILING)
            yield "control.avoidance_gain_1_s", control.avoidance_gain_1_s, f"at least {needed} 1/s for {why}"


def _budget(scenario: Scenario) -> Problems:
    """The larger distances of the law, for bodies off their steered points, can be kept."""
    # Starts and targets are that far apart, the sensing range covers it, and the UAV flies above it.
    period, robots = scenario.control.period_s, scenario.robots
    if not takes_room(scenario):
        return
    start = {
        name: plant_of(robot, period).steered(np.array(robot.start_m, dtype=np.float64))
        for name, robot in robots.items()
    }
    target = {name: np.array(robot.target_m, dtype=np.float64) for name, robot in robots.items()}
    outlines = {name: outlines_of(scenario, body) for name, body in scenario.barriers.items()}
    for pair in budget(scenario):
        if not pair.terms:
            continue
        key = scenario.key_of(pair.first)
        needs = (
            f"{pair.promised_m:.9g} m between {pair.first} and {pair.second} needs {pair.gap_m:.9g} m in the law "
            f"({pair.in_words()})"
        )
        other = scenario.barriers.get(pair.second)
        for places, verb in ((start, "start"), (target, "would end")):
            if other and (other.moves or (other.appears_s and verb == "start")):
                continue
            apart = _apart_m(scenario, places, pair, outlines) - pair.radii_m
            if apart < pair.gap_m - TOLERANCE:
                yield key, Fault(needs), f"they {verb} {apart:.9g} m apart. Largest term: {pair.largest}"
        speed = other.expected_speed_m_s if other else robots[pair.second].max_speed_m_s
        unsure_m = scenario.position_error_m * (2.0 if pair.second in robots else 1.0)
        reach = pair.law_m + unsure_m + (robots[pair.first].max_speed_m_s + speed) * period
        if scenario.control.sensing_range_m < reach:
            allowed = (
                f"control.sensing_range_m must be at least {reach + TOLERANCE:.9g} m. Largest term: {pair.largest}"
            )
            yield key, Fault(needs), allowed
        uav = scenario.aerial.get(pair.second)
        if uav and pair.kind == "air_ground" and not uav.altitude_m > pair.law_m:
            above = f"{scenario.key_of(pair.second)}.altitude_m must be more than {pair.law_m:.9g} m"
            yield key, Fault(needs), f"{above}. Largest term: {pair.largest}"


def _apart_m(scenario: Scenario, places: dict[str, Array], pair: PairBudget, outlines: dict[str, Array]) -> float:
    """Distance of a pair at some positions, m, comparable with `PairBudget.law_m`."""
    place = places[pair.first]
    if pair.second in places:
        return float(np.linalg.norm(place - places[pair.second]))
    return float(convex.distances(outlines[pair.second], place, pair.first in scenario.ugvs).min())


def _reproduction(scenario: Scenario) -> Problems:
    count = Counter(row.id for row in scenario.reproduction)
    for index, row in enumerate(scenario.reproduction):
        key = f"reproduction.{index}"
        if not row.id or count[row.id] > 1:
            yield f"{key}.id", row.id, "an identifier that no other row has"
        yield from _one_of(f"{key}.run", row.run, scenario.runs, "one of the runs")
        yield from _one_of(f"{key}.robot", row.robot, scenario.robots, "one of the robots")


def _choices(scenario: Scenario) -> Problems:
    keys = set(_keys(scenario.data())) if scenario.choices else set()
    for index, choice in enumerate(scenario.choices):
        if choice.key not in keys:
            yield f"choices.{index}.key", choice.key, "a key of this scenario, such as control.period_s"


def _keys(value: object, above: str = "") -> Iterator[str]:
    """Dotted keys of all entries of nested dicts and lists."""
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for name, inner in entries:
        yield f"{above}{name}"
        yield from _keys(inner, f"{above}{name}.")


# Every rule; later ones rely on earlier ones.
CHECKS: tuple[Callable[[Scenario], Problems], ...] = (
    _uavs, _names, _reserved, _policies, _charges, _bursts, _ugv_links, _shapes, _map, _blocks, _route, _runs, _plants,
    _presets, _ends, _gains, _periods, _release, _distances, _sensing, _extent, _clearances, _standing, _faults,
    _measured, _budget, _asynchronous, _reproduction, _choices,
)  # fmt: skip
