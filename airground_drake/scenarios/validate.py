"""What a well-formed scenario must satisfy to make sense: one small function per rule, all in `CHECKS`.

A check yields its problems as (key, value, allowed); `check` raises the first. What may be named is looked up in
`registry`; nothing that a scenario names is imported here.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import fields, is_dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from fractions import Fraction
from itertools import pairwise, starmap
from typing import NamedTuple

import numpy as np
from scipy.spatial.distance import cdist

from airground_drake.arrays import LARGEST
from airground_drake.decision.bayes import COMPUTED
from airground_drake.errors import Fault, ScenarioError
from airground_drake.intervention.database import RANKINGS
from airground_drake.nsbc.avoidance import COMPOSITIONS
from airground_drake.registry import (
    METHODS,
    MODEL_CLAIMS,
    PLUGIN,
    POLICIES,
    RETIRED_CLAIMS,
    RETIRED_ROUTES,
    ROUTES,
    RUN_CLAIMS,
    UAV_TASKS,
    Registry,
    is_plugin,
)
from airground_drake.scenarios.rounding import TOLERANCE_M, Rounding
from airground_drake.scenarios.schema import MAX_NAME, MAX_SEED, MAX_UGVS, Scenario, Vector
from airground_drake.statuses import EXPECTATIONS, alternatives

TRIGGERS: tuple[str, ...] = ("automaton", "bare")
THRESHOLD_RULES: tuple[str, ...] = ("fixed", *COMPUTED)
SOURCES: tuple[str, ...] = ("calibrated", "ours")
BUDGETS: tuple[str, ...] = ("counted", "wall_clock")
RULES: tuple[str, ...] = ("hysteresis", "first_stage")
SOLVERS: tuple[str, ...] = ("daqp", "gurobi", "mosek")
SETTABLE: tuple[str, ...] = ("decision", "gatekeeper", "intervention")
"""Sections that a run may change for itself. Bodies, distances and controllers are those of all runs: a report draws
them once, and proves safety once."""

MAX_STAGES = 1000
MAX_TEXT = 10_000  # characters
NAME_PATTERN = "^[A-Za-z_][A-Za-z0-9_]*$"  # of a UGV, an obstacle, a run, a parameter
CLAIM_PATTERN = f"^[A-Z][A-Z0-9-]{{0,{MAX_NAME - 1}}}$"
GAINS = ("avoidance_gain_1_s", "motion_gain_1_s", "formation_gain_1_s", "intervention_gain_1_s")
SMALLEST = 1e-9  # of a positive number
ARRIVES = "LIVE-GOAL"  # the claim that every UGV ends where it is to end
TOLERANCE = 1e-9  # m between points; relative between periods
_SHORT = 1.0 - 1e-5  # of a limit that is printed with six digits, so that what a message allows is allowed

# Unit by the suffix of a key, the longest suffix first.
_UNITS = {"m_sqrt_s": "m/sqrt(s)", "1_m2_s": "1/(m^2 s)", "m_s": "m/s", "1_s": "1/s", "m": "m", "s": "s"}

Problems = Iterator[tuple[str, object, str]]


def check(scenario: Scenario, source: str) -> None:
    """Check a scenario whose values have the types of the schema.

    Args:
        scenario: the scenario.
        source: where it comes from, for the message.

    Raises:
        ScenarioError: for the first problem; names the key, its value and what is allowed.
    """
    for rule in CHECKS:
        for key, value, allowed in rule(scenario):
            raise ScenarioError(source, key, value, allowed)


def unit_of(name: str, before: str = "") -> str:
    """Unit that the suffix of a key says, with words before it; '' if it says none."""
    return next((before + unit for suffix, unit in _UNITS.items() if name.endswith(f"_{suffix}")), "")


def dotted(key: str, part: str) -> str:
    """Key of a part of what has this key ('' for the scenario itself)."""
    return f"{key}.{part}" if key else part


def _one_of(key: str, value: str, allowed: Iterable[str], what: str = "one of") -> Problems:
    options = tuple(allowed)
    if value not in options:
        yield key, value, f"{what} {', '.join(options) or '(none)'}"


def _expectation(key: str, expected: str) -> Problems:
    for status in alternatives(expected):
        if status not in EXPECTATIONS:
            allowed = f"one of {', '.join(EXPECTATIONS)}, or several of them, such as: exercised or refuted"
            yield key, expected, allowed


def _registered(key: str, name: str, registry: Registry) -> Problems:
    if not registry.accepts(name):
        yield key, name, f"one of {', '.join(registry.allowed)}"


def _nodes(value: object, key: str = "", name: str = "") -> Iterator[tuple[str, str, object]]:
    """(dotted key, name of the field or parameter, value) of a value and of everything in it."""
    yield key, name, value
    if is_dataclass(value):
        children = [(field.name, field.name, getattr(value, field.name)) for field in fields(value)]
    elif isinstance(value, dict):
        children = [(entry, name if unit_of(name) else entry, child) for entry, child in value.items()]
    else:
        children = [(str(index), name, child) for index, child in enumerate(value if isinstance(value, list) else ())]
    for part, child_name, child in children:
        yield from _nodes(child, dotted(key, part), child_name)


def _finite(scenario: Scenario) -> Problems:
    for key, name, value in _nodes(scenario):
        if isinstance(value, float) and not abs(value) <= LARGEST:
            yield key, value, f"a finite number{unit_of(name, ' in ')}, at most {LARGEST:g} in size"


def _bounds(scenario: Scenario) -> Problems:
    for key, _, value in _nodes(scenario):
        for field in fields(value) if is_dataclass(value) else ():
            least = 0.0 if "from_zero" in field.metadata else SMALLEST
            if isinstance(field.default, float) and getattr(value, field.name) < least:
                allowed = f"a number{unit_of(field.name, ' in ')}, not below {least:g}"
                yield dotted(key, field.name), getattr(value, field.name), allowed


def _texts(scenario: Scenario) -> Problems:
    """No text may take anything else's place where it is shown: no control characters, nothing that turns writing."""
    for key, _, value in _nodes(scenario):
        if isinstance(value, str):
            if hidden := next(filter(_is_hidden, value), None):
                allowed = "text without control characters and without marks that turn the direction of writing"
                yield key, hidden, allowed
            if len(value) > MAX_TEXT:
                yield key, value, f"at most {MAX_TEXT} characters are allowed"


def _is_hidden(character: str) -> bool:
    """Whether a character shows only by what it does to others; line breaks, tabs and joiners are not meant."""
    return character not in "\n\t\u200c\u200d" and unicodedata.category(character) in ("Cc", "Cf", "Cs", "Zl", "Zp")


def _names(scenario: Scenario) -> Problems:
    bodies = [(f"ugvs.{name}", name) for name in scenario.ugvs]
    bodies += [("uav.name", scenario.uav.name), *((f"obstacles.{name}", name) for name in scenario.obstacles)]
    others = [("name", scenario.name), *((f"runs.{name}", name) for name in scenario.runs)]
    for index, policy in enumerate(scenario.intervention.policies):
        others += [(f"intervention.policies.{index}.parameters.{name}", name) for name in policy.parameters]
    count = Counter(name for _, name in bodies)
    for key, name in (*bodies, *others):
        if not re.fullmatch(NAME_PATTERN, name):
            yield key, name, "a name of letters, digits and underscores that does not begin with a digit"
        if len(name) > MAX_NAME:
            yield key, name, f"a name of at most {MAX_NAME} characters"
        if count[name] > 1:
            yield key, name, "a name that no other UGV, obstacle or UAV has"


RETIRED_KEYS = {"gatekeeper.budget_nodes": "remove it: the search of the route mixed_integer is limited in time only"}
"""Keys of earlier versions, and what to do about them."""


def _counts(scenario: Scenario) -> Problems:
    if not 0 <= scenario.seed <= MAX_SEED:
        yield "seed", scenario.seed, f"a whole number from 0 to {MAX_SEED}"
    if not 1 <= scenario.gatekeeper.stages <= MAX_STAGES:
        yield "gatekeeper.stages", scenario.gatekeeper.stages, f"a whole number from 1 to {MAX_STAGES}"
    if not 0 <= scenario.gatekeeper.blocks <= scenario.gatekeeper.stages:
        allowed = "a whole number from 1 to gatekeeper.stages, or 0: one accept variable per stage"
        yield "gatekeeper.blocks", scenario.gatekeeper.blocks, allowed
    if scenario.gatekeeper.blocks and scenario.gatekeeper.route in (set(ROUTES.own) - {"mixed_integer"}):
        yield "gatekeeper.blocks", scenario.gatekeeper.blocks, "0: only the route mixed_integer has blocks"
    if scenario.gatekeeper.solver != "daqp" and scenario.gatekeeper.route in (set(ROUTES.own) - {"mixed_integer"}):
        yield "gatekeeper.solver", scenario.gatekeeper.solver, "daqp: only the route mixed_integer has other solvers"
    for name in ("budget_iterations", "tries"):
        if not 1 <= getattr(scenario.gatekeeper, name) <= MAX_SEED:
            yield f"gatekeeper.{name}", getattr(scenario.gatekeeper, name), f"a whole number from 1 to {MAX_SEED}"
    if scenario.gatekeeper.budget_share > 1.0:
        yield "gatekeeper.budget_share", scenario.gatekeeper.budget_share, "at most 1, the whole sampling period"
    if not 1 <= len(scenario.ugvs) <= MAX_UGVS:
        yield "ugvs", Fault(f"{len(scenario.ugvs)} UGVs"), f"1 to {MAX_UGVS} are allowed"
    if not scenario.runs:
        yield "runs", Fault("no run"), "at least one is needed, such as d: {method: d}"


def _options(scenario: Scenario) -> Problems:
    yield from _one_of("intervention.ranking", scenario.intervention.ranking, RANKINGS)
    if scenario.gatekeeper.route in RETIRED_ROUTES:
        what = f"no longer a route: use {RETIRED_ROUTES[scenario.gatekeeper.route]}"
        yield "gatekeeper.route", scenario.gatekeeper.route, what
    else:
        yield from _registered("gatekeeper.route", scenario.gatekeeper.route, ROUTES)
    yield from _registered("uav.task", scenario.uav.task, UAV_TASKS)
    for index, policy in enumerate(scenario.intervention.policies):
        yield from _registered(f"intervention.policies.{index}.name", policy.name, POLICIES)
    yield from _one_of("gatekeeper.rule", scenario.gatekeeper.rule, RULES)
    yield from _one_of("gatekeeper.solver", scenario.gatekeeper.solver, SOLVERS)
    yield from _one_of("gatekeeper.budget", scenario.gatekeeper.budget, BUDGETS)
    yield from _one_of("decision.trigger", scenario.decision.trigger, TRIGGERS)
    yield from _one_of("decision.threshold.rule", scenario.decision.threshold.rule, THRESHOLD_RULES)


def _runs(scenario: Scenario) -> Problems:
    for name, run in scenario.runs.items():
        yield from _one_of(f"runs.{name}.method", run.method, METHODS)
        yield from _one_of(f"runs.{name}.composition", run.composition, COMPOSITIONS)
        for key, value in run.set.items():
            if key.partition(".")[0] not in SETTABLE or "." not in key:
                yield (
                    f"runs.{name}.set.{key}",
                    value,
                    f"a run may set keys of {', '.join(SETTABLE)}, such as gatekeeper.rule",
                )
        for robot in run.stalls_m:
            yield from _one_of(f"runs.{name}.stalls_m.{robot}", robot, scenario.ugvs, "one of the UGVs")
        for claim, status in run.expected.items():
            known = (*RUN_CLAIMS, *scenario.claims, *(MODEL_CLAIMS if run.set else ()))
            if claim in RETIRED_CLAIMS:
                yield f"runs.{name}.expected.{claim}", claim, f"no longer a claim, {RETIRED_CLAIMS[claim]}: remove it"
                continue
            yield from _one_of(f"runs.{name}.expected.{claim}", claim, known, "one of the claims")
            yield from _expectation(f"runs.{name}.expected.{claim}", status)
    for claim, status in scenario.expected.items():
        known = (*MODEL_CLAIMS, *scenario.claims)
        yield from _one_of(f"expected.{claim}", claim, known, "one of the claims about the model")
        yield from _expectation(f"expected.{claim}", status)
    for claim, place in scenario.claims.items():
        if claim in (*RUN_CLAIMS, *MODEL_CLAIMS) or not re.fullmatch(CLAIM_PATTERN, claim):
            what = f"a new identifier of at most {MAX_NAME} capitals, digits and hyphens, such as MY-CLAIM"
            yield f"claims.{claim}", claim, what
        if not is_plugin(place):
            yield f"claims.{claim}", place, PLUGIN


def _ugv_points(scenario: Scenario) -> Iterator[tuple[str, Vector]]:
    for name, ugv in scenario.ugvs.items():
        yield f"ugvs.{name}.start_m", ugv.start_m
        yield f"ugvs.{name}.target_m", ugv.target_m
        for index, point in enumerate(ugv.preset.waypoints_m):
            yield f"ugvs.{name}.preset.waypoints_m.{index}", point
    for run_name, run in scenario.runs.items():
        for name, point in run.stalls_m.items():
            yield f"runs.{run_name}.stalls_m.{name}", point


def _points(scenario: Scenario) -> Problems:
    others = [("uav.start_m", scenario.uav.start_m), ("uav.target_m", scenario.uav.target_m)]
    others += [(f"obstacles.{name}.position_m", each.position_m) for name, each in scenario.obstacles.items()]
    others += [(f"uav.phantoms_m.{index}", point) for index, point in enumerate(scenario.uav.phantoms_m)]
    for key, point in (*_ugv_points(scenario), *others):
        if len(point) != 3:
            yield key, point, "3 numbers in m: [x, y, z]"
    for key, point in _ugv_points(scenario):
        if point[2] != 0.0:
            yield key, point, "z must be 0 m: a UGV moves on the ground"


def _presets(scenario: Scenario) -> Problems:
    for name, ugv in scenario.ugvs.items():
        key = f"ugvs.{name}.preset.waypoints_m"
        if len(ugv.preset.waypoints_m) < 2:
            yield key, ugv.preset.waypoints_m, "at least 2 waypoints"
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
    """A preset leads to its target, to within the tolerance, where a run expects the UGV there.

    Runs that are shorter than a preset are cut short on purpose: their robots are not to arrive.
    """
    presets = [ugv.preset for ugv in scenario.ugvs.values()]
    if max(preset_s(each.waypoints_m, each.speed_m_s) for each in presets) > scenario.duration_s:
        return
    for name, ugv in scenario.ugvs.items():
        away, end = math.dist(ugv.preset.waypoints_m[-1], ugv.target_m), len(ugv.preset.waypoints_m) - 1
        for run, spec in scenario.runs.items():
            arrives = name not in spec.stalls_m and "refuted" not in alternatives(spec.expected.get(ARRIVES, "holds"))
            if arrives and away > scenario.arrival_tolerance_m + TOLERANCE:
                allowed = (
                    f"at most arrival_tolerance_m = {scenario.arrival_tolerance_m:.9g} m from {name}'s target_m, where "
                    f"run {run} expects it, not {away:.9g} m (or runs.{run}.expected.{ARRIVES}: refuted)"
                )
                yield f"ugvs.{name}.preset.waypoints_m.{end}", ugv.preset.waypoints_m[end], allowed


def _gains(scenario: Scenario) -> Problems:
    period = scenario.control.period_s
    for name in GAINS:
        gain = getattr(scenario.control, name)
        if exactly(gain) * exactly(period) > 1:  # as the proofs take them
            most = _shown(1 / exactly(period), ROUND_FLOOR)
            yield f"control.{name}", gain, f"at most {most} 1/s: gain * control.period_s must not exceed 1"


def _periods(scenario: Scenario) -> Problems:
    control, gatekeeper, noise = scenario.control.period_s, scenario.gatekeeper, scenario.decision.noise_period_s
    rule = f"must be a whole multiple of control.period_s = {control:.9g} s"
    if scenario.duration_s < control:
        yield "duration_s", scenario.duration_s, f"at least one control period, control.period_s = {control} s"
    for key, period in (("gatekeeper", gatekeeper.period_s), ("intervention", scenario.intervention.period_s)):
        if not _multiple(period, control):
            yield f"{key}.period_s", period, rule
    stage = gatekeeper.horizon_s / gatekeeper.stages
    if not _multiple(stage, control):
        fits = f" (gatekeeper.stages: {round(gatekeeper.horizon_s / control)} would do)"
        problem = f"a stage, horizon_s / stages = {stage:.9g} s, {rule}"
        yield "gatekeeper.horizon_s", gatekeeper.horizon_s, problem + fits * _multiple(gatekeeper.horizon_s, control)
    if not (_multiple(noise, control) or _multiple(control, noise)):
        yield "decision.noise_period_s", noise, f"{rule}, or go into it a whole number of times"
    step, leak = min(control, noise), scenario.decision.leak_1_s
    if leak * step > 1.0:
        most = _shown(1 / exactly(step), ROUND_FLOOR)
        allowed = f"at most {most} 1/s: leak * {step:.9g} s, a step of the noise, must not exceed 1"
        yield "decision.leak_1_s", leak, allowed


def _multiple(of: float, unit: float) -> bool:
    ratio = of / unit
    return round(ratio) >= 1 and abs(ratio - round(ratio)) <= TOLERANCE * ratio


def _release(scenario: Scenario) -> Problems:
    decision, rule = scenario.decision, scenario.decision.threshold
    zeta = rule.zeta_m
    if rule.rule in COMPUTED:
        try:
            zeta = COMPUTED[rule.rule](rule.drift_m_s, rule.noise_m_sqrt_s, rule.c1_1_s, rule.c2)
        except ValueError:
            none = Fault(f"no {rule.rule} threshold found")
            yield "decision.threshold", none, "numbers of comparable size are allowed"
    if decision.trigger == "automaton" and not decision.release_m < zeta:
        yield "decision.release_m", decision.release_m, f"less than the {rule.rule} threshold, {zeta:.9g} m"


def _distances(scenario: Scenario) -> Problems:
    safe, altitude = scenario.safe_distance, scenario.uav.altitude_m
    for name in ("obstacle_m", "ugv_m", "air_ground_m"):
        if not safe.collision_m < getattr(safe, name):
            allowed = f"less than safe_distance.{name} = {getattr(safe, name):.9g} m"
            yield "safe_distance.collision_m", safe.collision_m, allowed
    radii = scenario.uav.radius_m + max(ugv.radius_m for ugv in scenario.ugvs.values())
    if not altitude > safe.air_ground_m + radii:
        least = f"safe_distance.air_ground_m = {safe.air_ground_m:.9g} m{_and(radii)}"
        yield "uav.altitude_m", altitude, f"more than {least}, for the UAV to fly over a UGV"


def _and(radii: float) -> str:
    """What two radii add to a distance, m, as a message has it."""
    return f" + radii {radii:.9g} m" if radii else ""


class _Body(NamedTuple):
    """What keeps apart from others: how far it reaches in a control period m, its speed m/s, radius m and name."""

    reach: float
    speed: float
    radius: float
    name: str

    @classmethod
    def of(cls, name: str, radius: float, speed: float, period: float) -> _Body:
        return cls(radius + speed * period, speed, radius, name)


def _nearest_pairs(scenario: Scenario) -> list[tuple[str, _Body, _Body]]:
    """Of each kind of pairs, named by the key of its safe distance, the one that needs the most room in a period."""
    h, uav = scenario.control.period_s, scenario.uav
    ugvs = [_Body.of(name, ugv.radius_m, ugv.max_speed_m_s, h) for name, ugv in scenario.ugvs.items()]
    ugvs.sort(reverse=True)
    flier = _Body.of(uav.name, uav.radius_m, uav.max_speed_m_s, h)
    fixed = [_Body.of(name, obstacle.radius_m, 0.0, h) for name, obstacle in scenario.obstacles.items()]
    pairs = [("air_ground_m", flier, ugvs[0]), *(("ugv_m", one, other) for one, other in pairwise(ugvs[:2]))]
    return [*pairs, *(("obstacle_m", max(flier, ugvs[0]), each) for each in fixed)]


def exactly(number: float) -> Fraction:
    """The decimal that a number prints as, which is what proofs take it for."""
    return Fraction(repr(float(number)))


def _shown(number: Fraction, rounding: str) -> str:
    """A number of nine digits, rounded so that it is itself allowed."""
    digits = Context(prec=9, rounding=rounding).divide(Decimal(number.numerator), Decimal(number.denominator))
    return f"{digits:.9g}"


def _closing(one: _Body, other: _Body, period: float) -> Fraction:
    """How much nearer two can come in a control period, m."""
    return (exactly(one.speed) + exactly(other.speed)) * exactly(period)


def _sensing(scenario: Scenario) -> Problems:
    """What is farther than the sensing range must not come within the safe distance in one control period."""
    period = scenario.control.period_s
    needed, kind, one, other = max(
        (exactly(getattr(scenario.safe_distance, kind) + (a.radius + b.radius)) + _closing(a, b, period), kind, a, b)
        for kind, a, b in _nearest_pairs(scenario)
    )
    if exactly(scenario.control.sensing_range_m) < needed:
        apart = f"safe_distance.{kind} {getattr(scenario.safe_distance, kind):.9g} m{_and(one.radius + other.radius)}"
        total = f"{apart} + closing {one.speed + other.speed:.9g} m/s * control.period_s {period:.9g} s"
        allowed = f"at least {_shown(needed, ROUND_CEILING)} m for {one.name} and {other.name}: {total}"
        yield "control.sensing_range_m", scenario.control.sensing_range_m, allowed


def _extent(scenario: Scenario) -> Problems:
    """Rounding must not take more from a safe distance than SAFE-TRACE tolerates; without a gain nothing is restored.

    Then (A = 0) there is nothing that an extent could be accepted by; SAFE-HYP says what a run lost.
    """
    control, duration = scenario.control, scenario.duration_s
    if control.avoidance_gain_1_s == 0.0:
        return
    speeds = sorted([scenario.uav.max_speed_m_s, *(ugv.max_speed_m_s for ugv in scenario.ugvs.values())])
    speed, closing = speeds[-1], speeds[-2] + speeds[-1]
    loss = Rounding(control.sensing_range_m, closing, control.period_s, control.avoidance_gain_1_s)
    points = [each for each in _ugv_points(scenario) if each[0].startswith("ugvs.")]
    points.append(("uav.start_m", scenario.uav.start_m))
    points += [(f"obstacles.{name}.position_m", each.position_m) for name, each in scenario.obstacles.items()]
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
            f"coordinates of at most {allowed * _SHORT:.6g} m in size, {why} within duration_s = {duration:.9g} s",
        )
    elif longest > 0.0:
        yield "duration_s", duration, f"at most {longest * _SHORT:.6g} s at {speed:.9g} m/s, {why}"
    else:
        gain = loss.least_gain(farthest + speed * duration, duration)
        yield "control.avoidance_gain_1_s", control.avoidance_gain_1_s, f"0, or at least {gain / _SHORT:.6g} 1/s, {why}"


class _Round(NamedTuple):
    """A robot or obstacle: its key in the scenario, its name, where it is, m, and its radius, m."""

    key: str
    name: str
    point: Vector
    radius: float


def _clearances(scenario: Scenario) -> Problems:
    """Robots that start, or are to end, within the safe distance of an obstacle or of each other."""
    fixed = [_Round("", name, each.position_m, each.radius_m) for name, each in scenario.obstacles.items()]
    for attribute, verb in (("start_m", "starts"), ("target_m", "would end")):
        ugvs = [
            _Round(f"ugvs.{name}", name, getattr(ugv, attribute), ugv.radius_m) for name, ugv in scenario.ugvs.items()
        ]
        uav = _Round("uav", scenario.uav.name, getattr(scenario.uav, attribute), scenario.uav.radius_m)
        for robots, others, kind in (
            ([*ugvs, uav], fixed, "obstacle_m"), (ugvs, ugvs, "ugv_m"), ([uav], ugvs, "air_ground_m"),
        ):  # fmt: skip
            least = getattr(scenario.safe_distance, kind)
            for robot, other in _within(robots, others, least - TOLERANCE):
                radii = robot.radius + other.radius
                allowed = f"at least safe_distance.{kind} = {least:.9g} m{_and(radii)} is needed"
                distance = math.dist(robot.point, other.point)
                message = f"{robot.name} {verb} {distance:.9g} m from {other.name}, {allowed}"
                yield f"{robot.key}.{attribute}", robot.point, message


def _within(these: Sequence[_Round], those: Sequence[_Round], distance: float) -> Iterator[tuple[_Round, _Round]]:
    """Pairs whose surfaces are nearer than that, m; of one list with itself, each pair once."""
    (points, radii), (others, other_radii) = (
        (np.reshape([each.point for each in group], (-1, 3)), np.array([each.radius for each in group]))
        for group in (these, those)
    )
    for i, j in np.argwhere(cdist(points, others) < distance + np.add.outer(radii, other_radii)).tolist():
        if these is not those or j < i:
            yield these[i], those[j]


def _reproduction(scenario: Scenario) -> Problems:
    count = Counter(row.id for row in scenario.reproduction)
    for index, row in enumerate(scenario.reproduction):
        key = f"reproduction.{index}"
        if not row.id or count[row.id] > 1:
            yield f"{key}.id", row.id, "an identifier that no other row has"
        if not row.paper:
            yield f"{key}.paper", row.paper, "at least one number"
        yield from _one_of(f"{key}.run", row.run, scenario.runs, "one of the runs")
        yield from _one_of(f"{key}.robot", row.robot, (*scenario.ugvs, scenario.uav.name), "one of the robots")


def _choices(scenario: Scenario) -> Problems:
    keys = {key for key, _, _ in _nodes(scenario) if key}
    for index, choice in enumerate(scenario.choices):
        if choice.key not in keys:
            yield f"choices.{index}.key", choice.key, "a key of this scenario, such as control.period_s"
        yield from _one_of(f"choices.{index}.source", choice.source, SOURCES)


CHECKS: tuple[Callable[[Scenario], Problems], ...] = (
    _finite, _bounds, _counts, _texts, _names, _options, _runs, _points, _presets, _ends, _gains, _periods, _release,
    _distances, _sensing, _extent, _clearances, _reproduction, _choices,
)  # fmt: skip
"""Every rule; later ones rely on earlier ones (finite numbers, three coordinates)."""
