"""The file of a campaign: a scenario, distributions over its keys, a seed.

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

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator, ConfigDict, PlainValidator, WithJsonSchema

from airground_drake.base import files
from airground_drake.base.errors import Fault, ScenarioError
from airground_drake.base.limits import MAX_NAME
from airground_drake.base.registry import RUN_CLAIMS
from airground_drake.base.values import Real, Words, refused, wanted
from airground_drake.scenario import plugins
from airground_drake.scenario.document import UNKNOWN_KEY, Document, read, suggestion
from airground_drake.scenario.filled import filled
from airground_drake.scenario.load import from_data, load
from airground_drake.scenario.schema import Scenario
from airground_drake.scenario.shipped import shipped
from airground_drake.study.campaign.course import REPLACES, Course
from airground_drake.study.campaign.distributions import GRID, HALTON, KINDS, Key, combinations, made, stream, values_of
from airground_drake.study.campaign.rows import TIMES

PLAIN_NAME = "^[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}$"  # a file name that stays in its folder, on any system
COURSE = "course"  # name of the random numbers that maps and teams are drawn from
# Keys about the paper's numbers, which say nothing about a drawn scenario.
NOT_JUDGED: dict[str, Any] = {"reproduction": [], "choices": []}


def _key(given: object) -> Key:
    if not isinstance(given, dict) or len(given) != 1:
        raise refused(given, f"wanted: one of {', '.join(KINDS)} and its parameters")
    ((kind, parameters),) = given.items()
    if kind not in KINDS:
        raise refused(kind, f"{suggestion(kind, KINDS)}allowed: {', '.join(KINDS)}")
    try:
        return made(kind, parameters)
    except ValueError as error:
        raise refused(parameters, str(error), kind) from None


_DOTTED = "a mapping with dotted keys of the scenario"
_Key = Annotated[Key, PlainValidator(_key), WithJsonSchema({})]
_Names = Annotated[tuple[Words, ...], wanted("a list of names")]


@dataclass(frozen=True, kw_only=True)
class File:
    """The keys of a campaign's file.

    Attributes:
        name, title: for people.
        scenario: shipped name, or path.
        runs: of the scenario; empty: all.
        seed: of the draws.
        fixed: overrides of every draw.
        drawn: distributions by dotted key.
        course: random maps and teams, if any.
        claims: identifiers of the claims to judge; empty: all about runs.
        marks: values that are marked in the distributions of times, by column.
    """

    __pydantic_config__: ClassVar = ConfigDict(extra="forbid")

    name: Annotated[str, wanted("a name of at most 100 letters, digits, _, . and -", pattern=PLAIN_NAME, strict=True)]
    title: Words = ""
    scenario: Annotated[Words, wanted("a shipped scenario, or the path of a YAML file", min_length=1)]
    runs: _Names = ()
    seed: Annotated[int, wanted("a whole number from 0 on", strict=True, ge=0)] = 0
    fixed: Annotated[dict[str, Any], wanted(_DOTTED, alias="set")] = field(default_factory=dict)
    drawn: Annotated[dict[str, _Key], wanted(_DOTTED, alias="draw")] = field(default_factory=dict)
    course: Annotated[Course | None, BeforeValidator(lambda given: {} if given is None else given)] = None
    claims: _Names = ()
    marks: dict[str, Real] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Spec(File):
    """A campaign.

    Attributes:
        digest: SHA-256 of its file.
        source: path of the file.
        data: content of the scenario's file when the campaign was read, without NOT_JUDGED.
    """

    digest: str
    source: str
    data: Any = field(repr=False)

    @property
    def combinations(self) -> int:
        """Number of combinations of all grids."""
        return combinations(self.drawn)

    @property
    def dependent(self) -> list[str]:
        """Keys with values that are not independent from draw to draw: `halton` and `grid`."""
        return [key for key, drawn in self.drawn.items() if drawn.kind in (HALTON, GRID)]

    @property
    def swept(self) -> list[str]:
        """Keys with a `grid`."""
        return [key for key, drawn in self.drawn.items() if drawn.kind == GRID]

    def values(self, index: int) -> dict[str, Any]:
        """The drawn values by dotted key, without the course."""
        return values_of(self.drawn, self.seed, index)

    def draw(self, index: int) -> Scenario:
        """The scenario of one draw, validated; its name ends with the index.

        Raises:
            ScenarioError: if what is drawn makes no valid scenario.
        """
        return self.scenario_of(self.values(index), index)

    def base(self) -> Scenario:
        """The scenario before anything is drawn, with the values of `fixed`.

        Raises:
            ScenarioError: if it cannot be loaded.
        """
        return load(self.scenario, NOT_JUDGED | dict(self.fixed))

    def scenario_of(self, values: Mapping[str, Any], index: int) -> Scenario:
        """The scenario with these values by dotted key, on the course of a draw; raises as `draw`."""
        overrides = dict(self.fixed)
        if self.course is not None:
            base = self._fixed_part
            if base.uav is None:
                raise ScenarioError(self.source, COURSE, Fault("the scenario has uavs"), "wanted: one UAV, in uav")
            distance = base.safe_distance
            rng = stream(self.seed, COURSE, index)
            try:
                overrides |= self.course.values(rng, distance.obstacle_m, distance.ugv_m, base.uav.altitude_m)
            except ValueError as error:
                raise ScenarioError(self.source, COURSE, Fault(str(error)), "wanted: a larger field") from None
        scenario = self._with(overrides | dict(values))
        for run in self.runs:
            if run not in scenario.runs:
                raise _unknown(self.source, "runs", run, scenario.runs)
        return replace(scenario, name=f"{_identifier(self.name)[: MAX_NAME - 1 - len(str(index))]}_{index}")

    def check_keys(self) -> None:
        """Refuse keys that the scenario does not have, and a key that would replace one given before it.

        Raises:
            ScenarioError: with the source `--set KEY`.
        """
        given: dict[str, str] = {}
        for key in (*self.fixed, *self.drawn):
            if key in given:
                fault = Fault(f"it would replace {given[key]}, which is given before")
                raise ScenarioError(f"--set {key}", key, fault, "wanted: one value for each key")
            names = key.split(".")
            given.update((".".join(names[:n]), key) for n in range(1, 1 + len(names)))
        try:
            self.draw(0)
        except ScenarioError as error:
            if error.value == UNKNOWN_KEY:  # no draw would be valid; other faults may concern this draw only
                raise

    def refuse_plugins(self) -> None:
        """Refuse third-party code in the scenario and in everything that may be drawn.

        Raises:
            ScenarioError: if any is named; says where, and how to allow it.
        """
        for scenario, source in self._alternatives():
            plugins.refuse(scenario, source)

    @property
    def third_party(self) -> dict[str, str]:
        """SHA-256 of the files of third-party code in the scenario and in everything that may be drawn, by class."""
        with plugins.beside(self.scenario, allow=True), plugins.beside(self.source, allow=True):
            digests = [plugins.digests(scenario) for scenario, _ in self._alternatives()]
        return {name: digest for of_scenario in digests for name, digest in of_scenario.items()}

    def _alternatives(self) -> Iterator[tuple[Scenario, str]]:
        """The scenario before anything is drawn, and with each value that may be chosen; each with its file."""
        yield self.base(), self.scenario
        first = self.values(0)
        for key, drawn in self.drawn.items():
            for value in drawn.choices:
                with suppress(ScenarioError):  # such a draw is invalid
                    yield self.scenario_of(first | {key: value}, 0), self.source

    @cached_property
    def _fixed_part(self) -> Scenario:
        """The scenario with the values of `fixed`; raises as `draw`."""
        return self._with(self.fixed)

    def _with(self, overrides: Mapping[str, Any]) -> Scenario:
        """The scenario with values by dotted key; raises as `draw`."""
        return from_data(self.data, self.scenario, overrides, self.runs)


def load_spec(path: Path) -> Spec:
    """Read a campaign, and check the names of keys, runs and claims in it.

    Raises:
        ScenarioError: if the file cannot be read, or something in it is not allowed.
    """
    if not path.exists():
        wanted = "wanted: the path of a campaign (YAML: a scenario, and distributions over its keys)"
        raise ScenarioError(str(path), "", Fault("no such file"), wanted)
    document, content = read(path)
    if isinstance(document.data, dict):
        document.data.setdefault("name", path.stem)
    file: File = filled(File, document)
    scenario = file.scenario if file.scenario in shipped() else str(path.parent / file.scenario)
    given = vars(file) | {"scenario": scenario}
    data = read(scenario)[0].data
    data = data | NOT_JUDGED if isinstance(data, dict) else {}  # `Spec.base` refuses it, with the line
    spec = Spec(**given, digest=files.sha256(content), source=str(path), data=data)
    _check_overrides(spec, document)
    _check_names(spec, document)
    return spec


def _check_overrides(spec: Spec, document: Document) -> None:
    """Refuse values under `set` that are not valid, values that are replaced, and unknown keys under `draw`."""
    for key in spec.fixed if spec.course is not None else ():
        if f"{key}.".startswith(tuple(f"{key_of}." for key_of in REPLACES)):
            wanted = "wanted: a key that the course does not draw; one under draw comes after the course"
            raise ScenarioError(document.where("set", key), f"set.{key}", Fault("the course would replace it"), wanted)
    try:
        spec.base()
    except ScenarioError as error:
        raise _placed(error, document, "set") from None
    try:
        spec.check_keys()
    except ScenarioError as error:
        raise _placed(error, document, "draw", "set") from None


def _check_names(spec: Spec, document: Document) -> None:
    """Refuse runs, claims and columns of times that do not exist."""
    for key, names, allowed in (("runs", spec.runs, spec.base().runs), ("claims", spec.claims, RUN_CLAIMS)):
        for index, name in enumerate(names):
            if name not in allowed:
                raise _unknown(document.where(key, str(index)), key, name, allowed)
    for name in spec.marks:
        if name not in TIMES:
            raise _unknown(document.where("marks", name, key=True), f"marks.{name}", name, TIMES)


def _placed(error: ScenarioError, document: Document, *parts: str) -> ScenarioError:
    """The error of an override, with its line in the first of these parts of the spec that has its key."""
    key = error.source.removeprefix("--set ").partition("=")[0]
    for part in parts:
        if (part, key) in document.places:
            return ScenarioError(document.where(part, key), f"{part}.{error.key}", error.value, error.allowed)
    return error


def _unknown(source: str, key: str, name: str, allowed: Iterable[str]) -> ScenarioError:
    return ScenarioError(source, key, name, f"{suggestion(name, allowed)}allowed: {', '.join(allowed)}")


def _identifier(name: str) -> str:
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return f"_{plain}" if plain[0].isdigit() else plain
