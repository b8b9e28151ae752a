"""What a campaign draws: a scenario, distributions over its keys, a seed.

name: case_a_drawn
scenario: case_a              # shipped, or a path beside this file
runs: [d]                     # default: all runs of the scenario
seed: 1                       # of the draws
set: {duration_s: 30}         # the same in every draw
draw:                         # distributions by dotted key: see `distributions.KINDS`
  seed: {integer: [0, 1000000]}
  decision.noise_m_sqrt_s: {uniform: [0, 0.05]}
course: {ugvs: [1, 4]}        # random maps and teams: see `course.Course`
claims: [SAFE-TRACE]          # default: all claims about runs
"""

from __future__ import annotations

import dataclasses
import difflib
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from airground_drake.base.arrays import LARGEST
from airground_drake.base.errors import Fault, ScenarioError
from airground_drake.campaign.course import REPLACES, Course
from airground_drake.campaign.distributions import KINDS, RANDOM, Choice, Key, combinations, made, stream, values_of
from airground_drake.campaign.rows import TIMES
from airground_drake.registry import RUN_CLAIMS
from airground_drake.scenarios import plugins
from airground_drake.scenarios.document import read_data
from airground_drake.scenarios.limits import MAX_NAME, MAX_UGVS
from airground_drake.scenarios.load import from_data, load, shipped
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.finding import PLAIN_NAME

MOST_OBSTACLES = 10_000
"""That a course may draw."""
KEYS = ("name", "title", "scenario", "runs", "seed", "set", "draw", "course", "claims", "marks")
COURSE = "course"
"""Name of the random stream of maps and teams."""
NOT_JUDGED: dict[str, Any] = {"reproduction": [], "choices": []}
"""Keys that say what is in the paper, and nothing about a drawn scenario."""


@dataclass(frozen=True)
class Spec:
    """A campaign as its file has it.

    Attributes:
        name, title: for people.
        scenario: shipped name, or path.
        runs: of the scenario; empty: all.
        seed: of the draws.
        fixed: overrides that every draw has.
        drawn: distributions by dotted key.
        course: random maps and teams, if any.
        claims: identifiers of the claims to judge; empty: all about runs.
        marks: values to be found in distributions of times, by column.
        digest: SHA-256 of the file.
        source: its path.
        data: what the scenario's file held when the campaign was read, without what is not judged.
    """

    name: str
    title: str
    scenario: str
    runs: tuple[str, ...]
    seed: int
    fixed: Mapping[str, Any]
    drawn: Mapping[str, Key]
    course: Course | None
    claims: tuple[str, ...]
    marks: Mapping[str, float]
    digest: str
    source: str
    data: Any = field(repr=False)

    @property
    def combinations(self) -> int:
        """Draws after which all grids have been gone through once."""
        return combinations(self.drawn)

    @property
    def dependent(self) -> list[str]:
        """Keys whose values in one draw depend on those in others: `halton` and `grid`."""
        return [key for key, drawn in self.drawn.items() if drawn.how != RANDOM]

    def values(self, index: int) -> dict[str, Any]:
        """What is drawn, by dotted key; `course` and its keys not among it."""
        return values_of(self.drawn, self.seed, index)

    def draw(self, index: int) -> Scenario:
        """The scenario of one draw, validated; its name ends with the index.

        Raises:
            ScenarioError: if what is drawn makes no valid scenario.
        """
        return self.scenario_of(self.values(index), index)

    def base_digest(self) -> str:
        """SHA-256 of the scenario's file and of what is the same in every draw."""
        return load(self.scenario, NOT_JUDGED | dict(self.fixed))[1]

    def base(self) -> Scenario:
        """The scenario before anything is drawn.

        Raises:
            ScenarioError: if it cannot be loaded.
        """
        return load(self.scenario, NOT_JUDGED | dict(self.fixed))[0]

    def scenario_of(self, values: Mapping[str, Any], index: int) -> Scenario:
        """The scenario with these values by dotted key, on the course of a draw; raises as `draw`."""
        overrides = dict(self.fixed)
        if self.course is not None:
            base = self._with(overrides)
            distance, rng = base.safe_distance, stream(self.seed, COURSE, index)
            try:
                overrides |= self.course.values(rng, distance.obstacle_m, distance.ugv_m, base.uav.altitude_m)
            except ValueError as error:
                raise ScenarioError(self.source, COURSE, Fault(str(error)), "wanted: a larger field") from None
        scenario = self._with(overrides | dict(values))
        _known(self.runs, scenario.runs, self.source, "runs")
        runs = {run: scenario.runs[run] for run in self.runs} if self.runs else scenario.runs
        return replace(scenario, name=f"{_identifier(self.name)[: MAX_NAME - 1 - len(str(index))]}_{index}", runs=runs)

    def refuse_plugins(self) -> None:
        """Refuse code of others, in the scenario or in anything that may be drawn.

        Raises:
            ScenarioError: if any is named; says where, and how to allow it.
        """
        plugins.refuse(self.base(), self.scenario)
        first = self.values(0)
        for key, drawn in self.drawn.items():
            for value in drawn.distribution.values if isinstance(drawn.distribution, Choice) else ():
                try:
                    scenario = self.scenario_of(first | {key: value}, 0)
                except ScenarioError:
                    continue  # such a draw is invalid
                plugins.refuse(scenario, self.source)

    def _with(self, overrides: Mapping[str, Any]) -> Scenario:
        """The scenario with values by dotted key; raises as `draw`."""
        return from_data(self.data, self.scenario, overrides)


def load_spec(path: Path) -> Spec:
    """Read a campaign, and see that its first draw can be made.

    Raises:
        ScenarioError: if the file cannot be read, or something in it is not allowed.
    """
    if not path.exists():
        wanted = "wanted: the path of a campaign (YAML: a scenario, and distributions over its keys)"
        raise ScenarioError(str(path), "", Fault("no such file"), wanted)
    data, digest = read_data(path)
    source = str(path)
    given = _mapping(data, source, "", KEYS)
    name = given.get("name", path.stem)
    if not isinstance(name, str) or not PLAIN_NAME.fullmatch(name):
        raise ScenarioError(source, "name", name, f"wanted: {PLAIN_NAME.pattern}")
    scenario = _scenario(given.get("scenario"), path)
    spec = Spec(
        name,
        _text(given.get("title", ""), source, "title"),
        scenario,
        _names(given.get("runs", []), source, "runs"),
        _seed(given.get("seed", 0), source),
        _keys(given.get("set", {}), source, "set"),
        _drawn(given.get("draw", {}), source),
        _course(given.get("course"), source) if "course" in given else None,
        _names(given.get("claims", []), source, "claims"),
        _marks(given.get("marks", {}), source),
        digest,
        source,
        _judged_part(scenario),
    )  # fmt: skip
    for key in spec.fixed if spec.course is not None else ():
        if f"{key}.".startswith(tuple(f"{each}." for each in REPLACES)):
            wanted = "wanted: a key that the course does not draw; one under draw comes after the course"
            raise ScenarioError(source, f"set.{key}", Fault("the course would replace it"), wanted)
    _known(spec.runs, spec.base().runs, source, "runs")
    _known(spec.claims, tuple(RUN_CLAIMS), source, "claims")
    return spec


def _identifier(name: str) -> str:
    """A campaign's name as the beginning of a scenario's."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return f"_{plain}" if plain[0].isdigit() else plain


def _judged_part(scenario: str) -> dict[str, Any]:
    data = read_data(Path(scenario))[0]
    return data | NOT_JUDGED if isinstance(data, dict) else {}  # `Spec.base` says what is wrong, and in which line


def _mapping(given: Any, source: str, key: str, allowed: Collection[str]) -> dict[str, Any]:
    if not isinstance(given, dict):
        raise ScenarioError(source, key, given, f"wanted: a mapping with the keys {', '.join(allowed)}")
    _known(given, allowed, source, key)
    return given


def _known(names: Collection[str], allowed: Collection[str], source: str, key: str) -> None:
    for name in names:
        if name not in allowed:
            close = difflib.get_close_matches(str(name), list(allowed), n=1)
            meant = f"did you mean {close[0]}? " if close else ""
            raise ScenarioError(source, key or str(name), name, f"{meant}allowed: {', '.join(allowed)}")


def _text(given: Any, source: str, key: str) -> str:
    if not isinstance(given, str):
        raise ScenarioError(source, key, given, "wanted: text")
    return given


def _scenario(given: Any, path: Path) -> str:
    """Shipped, or beside the file."""
    if not isinstance(given, str) or not given:
        raise ScenarioError(str(path), "scenario", given, "wanted: a shipped scenario, or the path of a YAML file")
    return given if given in shipped() else str(path.parent / given)


def _seed(given: Any, source: str) -> int:
    if type(given) is not int or given < 0:
        raise ScenarioError(source, "seed", given, "wanted: a whole number from 0 on")
    return given


def _marks(given: Any, source: str) -> dict[str, float]:
    for name, value in _mapping(given, source, "marks", TIMES).items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ScenarioError(source, f"marks.{name}", value, "wanted: a number in s")
    return dict(given)


def _names(given: Any, source: str, key: str) -> tuple[str, ...]:
    if not isinstance(given, list) or not all(isinstance(each, str) for each in given):
        raise ScenarioError(source, key, given, "wanted: a list of names")
    return tuple(given)


def _keys(given: Any, source: str, key: str) -> dict[str, Any]:
    if not isinstance(given, dict):
        raise ScenarioError(source, key, given, "wanted: a mapping with dotted keys of the scenario")
    return given


def _drawn(given: Any, source: str) -> dict[str, Key]:
    return {key: _distribution(each, source, f"draw.{key}") for key, each in _keys(given, source, "draw").items()}


def _distribution(given: Any, source: str, key: str) -> Key:
    kinds = ", ".join(KINDS)
    if not isinstance(given, dict) or len(given) != 1:
        raise ScenarioError(source, key, given, f"wanted: one of {kinds} and its parameters")
    ((kind, parameters),) = given.items()
    _known([kind], KINDS, source, key)
    try:
        return made(kind, parameters)
    except ValueError as error:
        raise ScenarioError(source, f"{key}.{kind}", parameters, str(error)) from None


def _course(given: Any, source: str) -> Course:
    fields = {field.name: field.default for field in dataclasses.fields(Course)}
    values = _mapping({} if given is None else given, source, "course", tuple(fields))
    return Course(
        **{name: _course_value(value, fields[name], source, f"course.{name}") for name, value in values.items()}
    )


def _course_value(value: Any, default: Any, source: str, key: str) -> Any:
    """A count or a range of counts where the default is a range; else a number."""
    if isinstance(default, tuple):
        low, high = value if isinstance(value, list) and len(value) == 2 else (value, value)
        least = 1 if key.endswith("ugvs") else 0
        most = MAX_UGVS if key.endswith("ugvs") else MOST_OBSTACLES
        if type(low) is not int or type(high) is not int or not least <= low <= high <= most:
            raise ScenarioError(source, key, value, f"wanted: a whole number from {least} to {most}, or [least, most]")
        return low, high
    share = key.endswith("hidden")
    wrong = isinstance(value, bool) or not isinstance(value, int | float)
    if wrong or not (0 <= value <= 1 if share else 0 < value <= LARGEST):
        wanted = "a share, 0 to 1" if share else f"a positive number up to {LARGEST:g}"
        raise ScenarioError(source, key, value, f"wanted: {wanted}")
    return float(value)
