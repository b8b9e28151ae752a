"""The types of report.json, for its writer (`document`) and all readers."""

# No `from __future__ import annotations` here: pydantic needs the types themselves, not their names.
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from airground_drake.base import files
from airground_drake.base.errors import ReportError, short
from airground_drake.base.statuses import NOT_EXERCISED, STATUSES, Status
from airground_drake.base.values import RECORDED
from airground_drake.report.folder import PAGES
from airground_drake.report.sentences import SLACK_M, distance, metres, named
from airground_drake.scenario.schema import Scenario

SCHEMA = "airground_drake.report/4"
LONGEST_INTEGER = 18  # maximum number of digits of an integer

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Whole = Annotated[int, Field(strict=True)]
Words = Annotated[str, BeforeValidator(str)]  # of third-party claims, whatever they are
YesNo = Annotated[bool, Field(strict=True)]
Json = dict[str, Any]


class Entry(BaseModel):
    """A mapping of report.json. Keys that only a page shows are not listed; they are kept."""

    model_config = ConfigDict(extra="allow", frozen=True)


class Claim(Entry):
    """A claim, its verdict on a run or about the model, and how to judge it again."""

    id: str
    run: str  # '' for a claim about the model
    status: Status
    expected: str | None = None
    as_expected: YesNo | None  # none if nothing is expected
    exercised: Whole | None  # how often it was tested; none if that is not counted
    exercised_by: Words = ""  # what is counted
    subject: Words = ""  # what it is about, in a few words
    statement: Words = ""
    assumptions: list[Words] = []
    margin: Number | None = None
    quantity: Words = ""  # that the margin is of
    unit: Words = ""
    where: Json = {}  # where the margin is
    counterexample: Json | None = None
    evidence: Json
    figure: Json | None = None  # its chart
    inputs: Json


class Distance(Entry):
    """The smallest distance of surfaces over continuous time, below 0 as an overlap, and what is required, m."""

    value: Number
    t_s: Number
    safe_distance_m: Number
    at_m: list[Number] | None = None  # the place of the map that was nearest, [x, y], if it is the map
    appeared: YesNo = False  # it was smallest at the instant at which the other one appeared
    moves: YesNo = False  # the other one may move, so that no theorem keeps its distance


class Approach(Distance):
    """The smallest distance of a pair."""

    first: str
    second: str

    @property
    def margin_m(self) -> float:
        return self.value - self.safe_distance_m

    @property
    def is_short(self) -> bool:
        return self.margin_m < -SLACK_M

    @property
    def whom(self) -> str:
        return named(self.second, self.at_m)

    def __str__(self) -> str:
        """The distance, without the pair."""
        return distance(self.value, self.safe_distance_m)

    @property
    def line(self) -> str:
        """The pair, its distance beside the required one, and when: a line of the first screen."""
        apart = metres(self.value, self.safe_distance_m).removesuffix(" m")
        sign = "<" if self.is_short else "≥"
        apart = f"overlap {apart[1:]} m" if apart.startswith("-") else f"{apart} {sign} {self.safe_distance_m:g} m"
        return f"{self.first}\N{EN DASH}{self.whom} {apart} at {f'{self.t_s:.2f} s' if self.t_s > 0.0 else 'the start'}"


class Seed(Approach):
    """The outcome of a run with a seed: the pair of least margin, whether distances were kept, and all arrived."""

    run: str
    seed: Whole
    kept: YesNo
    home: YesNo
    value: Number = Field(alias="min_distance_m")


class OnTheWay(Entry):
    """The progress of a UGV that had neither arrived nor collided at the end of the run."""

    stands: YesNo = False  # it did not move in the last second
    creeps: YesNo = False  # it hardly did
    left_m: Number = 0.0  # the way to its target along its preset
    left_s: Number | None = None  # if it comes nearer as fast as in the last second; none if it stands or creeps
    kept_away: Json | None = None  # the obstacle that moves and keeps it away from its target, if one does
    at_m: list[Number] | None = None  # the nearest place of the map, if it stands as near to it as it may


class Stall(Entry):
    robot: str
    from_s: Number
    until_s: Number  # at most the end of the run
    held_by: list[str]  # bodies that stop its wish to move, half way through the stall, or at the end of the run


class Ending(Entry):
    # If the UGV executed it: `over` (its motion was), `given up` (the UGV refused it after all), `replaced`,
    # `withdrawn`, `released` (no intervention any more) or `end of the run`; else `refused`, `lost` (never
    # delivered), `withdrawn first` or `end of the run`.
    how: str
    t_s: Number
    reason: str  # that of the UGV's gatekeeper if it refused, else ''


class Intervention(Entry):
    """A proposal and its outcome."""

    robot: str
    cause: str = ""  # the UGV whose trigger it was sent for
    accepted_s: Number | None  # none: it was never accepted
    begun_s: Number | None = None  # when the UGV began to execute it; none: never
    ended: Ending
    tries: Whole | None = None  # how many the UGV had used; none if it does not count them


class Messages(Entry):
    proposals: Whole = 0
    withdrawals: Whole = 0
    answers: Whole = 0  # each is a decision of the gatekeeper
    always_on: dict[str, Whole]  # number if every UGV got a proposal, and decided, in every period


class Gatekeeper(Entry):
    solver_failures: Whole = 0  # decisions that rest on the best plan known because the solver failed
    budget_spent: Whole = 0  # the same because the budget was spent
    refusals: dict[str, dict[str, Whole]] = {}  # by robot and reason: proposals refused at the first answer
    farthest_from_prediction: Json | None = None  # where a UGV was farthest from its prediction while an answer stood
    max_gap: Number | None = None  # largest optimality gap
    gaps: dict[str, Whole] = {}  # decisions with no gap, up to 1 %, and more
    time_s: dict[str, Number] | None = None  # CPU times: p50, p99, max, as order statistics; none if not recorded
    late: Whole | None = None  # decisions that took a period or longer; simulated time waits for them
    closest_call: Json | None = None  # decision at which the costs of accepting and refusing were closest, relatively


class Metrics(Entry):
    min_distance_m: dict[str, dict[str, Distance]]  # by robot and obstacle: at most 20, those of least margin
    min_robot_distance_m: dict[str, dict[str, Distance]]  # by robot: to the other robot of least margin
    came_near: list[Approach]  # at most two, see `metrics.came_near`
    final_position_m: dict[str, list[Number]]
    duration_s: Number
    wall_s: Number | None = None  # none if not measured
    gatekeeper: Gatekeeper | None = None  # none if it made no decision
    on_the_way: dict[str, OnTheWay]
    stalls: list[Stall]
    above_at_start: list[str]  # UGVs whose decision variable is at the threshold or above when the run begins
    interventions: list[Intervention]  # by time
    messages: Messages | None  # none without a UAV that intervenes
    without_proposals: list[str]  # UGVs that were intervened on for long enough and got no proposal
    lost_at_the_end: list[str]  # UGVs for which the UAV found no way when it last looked for one
    no_way_reasons: dict[str, str] = {}  # why, where the policy says so
    without_decisions: list[str] = []  # UGVs that got a proposal and did not decide


class Event(Entry):
    t_s: Number
    robot: str
    kind: str


class Run(Entry):
    zeta_m: Number  # the threshold
    events: list[Event]
    faults: list[Json]  # of policies and solvers
    metrics: Metrics

    def pairs(self) -> Iterator[Approach]:
        """The smallest distances of all pairs that are listed."""
        for nearest in (self.metrics.min_distance_m, self.metrics.min_robot_distance_m):
            for robot, others in nearest.items():
                yield from (Approach(first=robot, second=other, **dict(at)) for other, at in others.items())

    @property
    def no_way(self) -> list[str]:
        """UGVs for which the UAV found no path, ever or at the end, although no policy failed."""
        failed = {fault["robot"] for fault in self.faults}
        lost = dict.fromkeys([*self.metrics.without_proposals, *self.metrics.lost_at_the_end])
        return [ugv for ugv in lost if ugv not in failed]


class ScenarioPart(Entry):
    name: str
    title: str
    resolved: Scenario  # with all defaults


class Deviation(Entry):
    """A claim, or a finding that is not as expected, undecided or missing."""

    id: str
    run: str
    status: str = "not_run"  # or what was counted
    why: str = ""  # it is missing


class ExpectedNumber(Entry):
    """A number that a scenario expects of a run."""

    id: str
    run: str
    found: Whole
    least: Whole
    as_expected: YesNo


class Overall(Entry):
    status: Literal["as_expected", "not_as_expected", "inconclusive"]
    exit_code: Whole = 0
    why: str = ""
    checks: Whole  # claims about which something is expected, and numbers
    as_expected: Whole
    # Claims by outcome; untested claims are counted separately.
    counts: dict[Literal[(*STATUSES, NOT_EXERCISED)], Whole] = {}  # type: ignore[valid-type]
    differs: list[Deviation]  # also numbers that are too small
    undecided: list[Deviation]
    missing: list[Deviation]
    undemonstrated: list[Whole]  # findings about the paper
    unpromised: list[Json]  # claims about which nothing is expected
    numbers: list[ExpectedNumber] = []


class ReproductionRow(Entry):
    """A result of the paper, and ours."""

    id: str
    quantity: str = ""
    paper: Any = None
    ours: Any = None  # a number, or one per component; none without a value
    unit: str = ""
    status: Literal["reproduced", "calibrated", "by_construction", "ambiguous", "not_reproduced"]


class Finding(Entry):
    id: Whole
    paper: Any
    ours: Any
    demonstrated: YesNo


def _provenance(given: Json) -> Json:
    if not isinstance(given.get("third_party", {}), dict):
        raise ValueError("third_party is the SHA-256 of files by class")
    return given


class Report(Entry):
    form: Literal[SCHEMA] = Field(alias="schema")  # type: ignore[valid-type]
    scenario: ScenarioPart
    provenance: Annotated[Json, AfterValidator(_provenance)]
    overall: Overall
    runs: dict[str, Run]
    seeds: list[Seed]
    claims: list[Claim]
    reproduction: list[ReproductionRow]
    choices: list[Json]
    audit: list[Finding]

    def about(self, name: str) -> list[Claim]:
        return [claim for claim in self.claims if claim.id == name]


def of(document: Any, source: str = "report.json") -> Report:
    """A report from its JSON; ReportError names the first key that is not as it must be."""
    try:
        return Report.model_validate(document, context=RECORDED)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        fault = "missing" if first["type"] == "missing" else f"{short(repr(first['input']))} is not allowed"
        raise _unusable(source, f"{'.'.join(map(str, first['loc']))}: {fault}; {first['msg']}") from None


def read(folder: Path) -> Report:
    path = folder / PAGES["json"]
    try:
        document = json.loads(files.read_text(path), parse_constant=_finite, parse_float=_finite, parse_int=_short)
        json.dumps(document, ensure_ascii=False).encode()  # refuses half of a surrogate pair
    except (OSError, ValueError, RecursionError) as error:
        raise _unusable(path, getattr(error, "strerror", None) or f"{type(error).__name__}: {error}") from None
    return of(document, str(path))


def _unusable(source: object, why: str) -> ReportError:
    return ReportError(f"{source} is not a report that can be used: {why}")


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text} is not finite")
    return value


def _short(text: str) -> int:
    if len(text) > LONGEST_INTEGER:
        raise ValueError(f"an integer of {len(text)} digits")
    return int(text)
