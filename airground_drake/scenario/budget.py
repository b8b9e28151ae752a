"""The distance budget of a scenario: for each pair the distance promised, that in the law, and what each term costs."""

from collections.abc import Iterable, Iterator
from itertools import combinations
from typing import NamedTuple

from airground_drake.model.plants.budget import AT_REST, Bounds, costs, law_distance, least_gain
from airground_drake.scenario.outlines import gap_m
from airground_drake.scenario.plants import bounds_of, plant_of
from airground_drake.scenario.schema import Scenario

# By term of a budget, the key that it comes from; a dip follows from several.
KEYS = {
    "dip": "dip", "drift": "drift_m_s", "lag": "time_constant_s", "delay": "delay_s", "error": "position_error_m",
    "views": "shared",
}  # fmt: skip


class Term(NamedTuple):
    """A term of a budget: the key of the plant that it comes from, whose plant ('': of both), and its metres."""

    key: str
    of: str
    metres: float


class PairBudget(NamedTuple):
    """The budget of a pair of bodies."""

    first: str  # a robot
    second: str  # a robot, an obstacle, the map or a wall of the arena
    kind: str  # `ugv`, `uav`, `air_ground`, `obstacle`, or `moving` for an obstacle that may move
    promised_m: float  # gap to be kept between the surfaces, m
    radii_m: float  # sum of both radii, m
    law_m: float  # distance that the law keeps between steered points, or a steered point and a core, m
    terms: tuple[Term, ...]  # what it takes beyond the promise and the radii, in the order of their addition
    start: str = ""  # conditions of the promise if the obstacle appears after the start; '' if none
    least_gain: float = 0.0  # least A h with which errors of measured positions cost no more than that
    # Least uncertainty of the other position for two UGVs that act on old positions, m.
    unsure_m: float = 0.0

    @property
    def gap_m(self) -> float:
        """The distance in the law less the radii, to compare with the promise, m."""
        return self.law_m - self.radii_m

    @property
    def largest(self) -> str:
        """Key of the term that takes most; '' without terms."""
        sums = dict[str, float]()
        for term in self.terms:
            sums[term.key] = sums.get(term.key, 0.0) + term.metres
        return max(sums, key=lambda key: sums[key]) if sums else ""

    def in_words(self) -> str:
        """What the terms take: `hand_point_m 0.078 m each, dip 0.001 m`."""
        words = []
        for key in dict.fromkeys(term.key for term in self.terms):
            parts = [term.metres for term in self.terms if term.key == key]
            taken = f"{parts[0]:.3f} m each" if len(parts) == 2 and parts[0] == parts[1] else f"{sum(parts):.3f} m"
            words.append(f"{key} {taken}")
        return ", ".join(words)


def takes_room(scenario: Scenario) -> bool:
    """Whether any robot is not where the law steers or sees it, so that the law keeps more than is promised."""
    robots, period_s = scenario.robots.values(), scenario.control.period_s
    return scenario.position_error_m > 0.0 or any(plant_of(robot, period_s).signals for robot in robots)


def budget(scenario: Scenario) -> Iterator[PairBudget]:
    """The budgets of all pairs that must keep apart, robot by robot."""
    safe, gain = scenario.safe_distance, scenario.control.avoidance_gain_1_s
    bounds, cover = dict[str, Bounds](), dict[str, str]()
    for name, robot in scenario.robots.items():
        bounds[name] = bounds_of(robot, scenario.control.period_s, scenario.seen(name))
        cover[name] = plant_of(robot, scenario.control.period_s).cover_key

    def of_pair(first: str, second: str, kind: str, promised: float, radii: float) -> PairBudget:
        both = bounds[first], bounds.get(second, AT_REST)
        names, passive = (first, second, ""), kind == "moving"
        terms = [
            Term(cover[names[term.of]] if term.term == "cover" else KEYS[term.term], names[term.of], term.metres)
            for term in costs(promised + radii, *both, gain=gain, passive=passive)
        ]
        law = float(law_distance(promised + radii, *both, gain=gain, passive=passive))
        start = _start(bounds[first], promised, law - radii) if kind == "obstacle" and appears.get(second) else ""
        least = 0.0 if passive else least_gain(promised + radii, *both)
        fastest = max(bounds[name].speed_m_s for name in (first, second)) if kind == "ugv" else 0.0
        unsure = scenario.unsure_s * fastest
        return PairBudget(first, second, kind, promised, radii, law, tuple(terms), start, least, unsure)

    appears = {name: obstacle.appears_s for name, obstacle in scenario.obstacles.items()}
    radius = {name: robot.radius_m for name, robot in scenario.robots.items()}
    for first in scenario.robots:
        for name, barrier in scenario.barriers.items():
            kind = "moving" if barrier.expected_speed_m_s else "obstacle"
            yield of_pair(first, name, kind, gap_m(scenario, barrier), radius[first] + barrier.radius_m)
    for first, second in combinations(scenario.robots, 2):
        kind = scenario.pair_of(first, second)
        yield of_pair(first, second, kind, getattr(safe, f"{kind}_m"), radius[first] + radius[second])


def _start(robot: Bounds, promised_m: float, gap_m: float) -> str:
    """What has to hold of a robot where an obstacle appears, so that its distance is promised from then on."""
    if robot.exact:
        return f"{gap_m:.3f} m when it appears"
    of_point = f"{gap_m:.3f} m of the steered point when it appears"
    if not (robot.late or robot.drawn):
        return of_point
    way_m = robot.delay_s * robot.speed_m_s
    way = f", also on its way of up to {way_m:.3f} m under commands already given" if way_m else ""
    return f"{of_point}, and {promised_m:.3f} m of the body{way}"


def alike(pairs: Iterable[PairBudget]) -> list[list[PairBudget]]:
    """The pairs with the same numbers together, in the order of the first of each."""
    groups = dict[object, list[PairBudget]]()
    for pair in pairs:
        terms = tuple(sorted((term.key, term.metres) for term in pair.terms))
        same = pair.kind, pair.promised_m, round(pair.gap_m, 12), terms, pair.start, pair.unsure_m
        groups.setdefault(same, []).append(pair)
    return [*groups.values()]
