"""The scenario file as dataclasses: every key, its unit (in the key's name), what may stand there, and its meaning.

`load.py` has pydantic fill them. They are mutable, for scenarios changed in Python; after validation (`validate.py`)
nothing changes them. They have slots, so that Python refuses an attribute that is no key. A key without a default is
needed in a file. Positions are in the world frame, z up, the ground at z = 0.
"""

# No `from __future__ import annotations` here: pydantic needs the types themselves, not their names.
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Annotated, ClassVar

from pydantic import ConfigDict, Field

from airground_drake.registry import METHODS, MODEL_CLAIMS, POLICIES, RETIRED_ROUTES, ROUTES, RUN_CLAIMS, UAV_TASKS
from airground_drake.scenarios.kinds import (
    CLAIMS,
    Count,
    CountFromZero,
    GroundPoint,
    Name,
    NotNegative,
    OneValue,
    Point,
    PointOrNone,
    Positive,
    Real,
    Share,
    Words,
    YesNo,
    expected_of,
    one_of,
    registered,
    settings_of,
)
from airground_drake.scenarios.limits import MAX_STAGES, MAX_UGVS
from airground_drake.scenarios.picture import picture

Vector = list[float]

TRIGGERS: tuple[str, ...] = ("automaton", "bare")
SOURCES: tuple[str, ...] = ("calibrated", "ours")
BUDGETS: tuple[str, ...] = ("counted", "wall_clock")
RULES: tuple[str, ...] = ("hysteresis", "first_stage")
SOLVERS: tuple[str, ...] = ("daqp", "gurobi", "mosek")
SETTABLE: tuple[str, ...] = ("decision", "gatekeeper", "intervention")
"""Sections that a run may change for itself. Bodies, distances and controllers are those of all runs: a report draws
them once, and proves safety once."""

_NO_LAG = "remove it: longest_s, tries and rest_s bound how long a UGV goes along"
RETIRED_KEYS = {
    "gatekeeper.budget_nodes": "remove it: the search of the route mixed_integer is limited in iterations",
    "gatekeeper.lag_m": _NO_LAG,
    "gatekeeper.behind_s": _NO_LAG,
    "runs.NAME.rule": "write it as `set: {gatekeeper.rule: ...}` of the run",
}
"""Keys of earlier versions, and what to do about them; NAME is any run."""


@dataclass(slots=True)
class Preset:
    """Preset trajectory rho_rd of a UGV: a polyline travelled at constant speed from t = 0, then held."""

    waypoints_m: Annotated[list[GroundPoint], Field(min_length=2)]
    """Its corners, at least two: the first at t = 0, the last at the target wherever a run expects the UGV there."""
    speed_m_s: Positive = 1.0
    """Constant speed along it; not above the UGV's `max_speed_m_s`."""


@dataclass(slots=True)
class Ugv:
    """One UGV: a planar first-order robot, a disc of radius `radius_m` on the ground."""

    start_m: GroundPoint
    """Where it starts; z = 0."""
    target_m: GroundPoint
    """Where it is to end; z = 0."""
    preset: Preset
    """The trajectory that it follows."""
    max_speed_m_s: Positive = 6.0
    """Commands are shortened to this speed."""
    radius_m: NotNegative = 0.0
    """Of its body, added to the safe distances of its pairs; 0: a point."""


@dataclass(slots=True)
class Uav:
    """The UAV: a spatial first-order robot whose `task` is to fly over the centroid of the UGVs, eqs (9)-(10).

    Another task is named as `module:Class` or `file.py:Class`. `phantoms_m` are obstacles on its map that are
    not there, points without a radius. Its own body is a ball of radius `radius_m`.
    """

    name: Name = "uav"
    """What it is called in traces and reports."""
    start_m: Point = field(kw_only=True)
    """Where it starts."""
    target_m: PointOrNone = field(default_factory=list)
    """Where it is to end; left out or empty: over the centroid of the UGVs' targets, at `altitude_m`."""
    altitude_m: Positive = 2.0
    """Height over the centroid of the UGVs; more than `air_ground_m` and both radii."""
    task: Annotated[Words, registered(UAV_TASKS)] = "formation"
    """What it does below obstacle avoidance."""
    max_speed_m_s: Positive = 10.0
    """Commands are shortened to this speed."""
    phantoms_m: list[Point] = field(default_factory=list)
    """Obstacles on its map that are not there."""
    radius_m: NotNegative = 0.0
    """Of its body, added to the safe distances of its pairs; 0: a point."""


@dataclass(slots=True)
class Obstacle:
    """A ball to keep away from by the safe distance of (7)-(8); a point with the default radius."""

    position_m: Point
    """Where it is."""
    known_to_uav: YesNo = True
    """Whether it is on the UAV's map from the beginning."""
    radius_m: NotNegative = 0.0
    """Of its body, added to the safe distances of its pairs; 0: a point."""


@dataclass(slots=True)
class SafeDistance:
    """Safe distances d of (7)-(8), for each kind of pair, and the distance that counts as a collision.

    They are kept between surfaces: the centres of a pair keep d + (radius + radius), and collide at `collision_m` +
    (radius + radius). All other distances, `control.sensing_range_m` among them, are of centres.
    """

    obstacle_m: Positive = 2.0
    """Of a robot to an obstacle."""
    ugv_m: Positive = 2.0
    """Of two UGVs."""
    air_ground_m: Positive = 1.0
    """Of the UAV to a UGV."""
    collision_m: Positive = 0.05
    """What is closer than this counts as a collision; less than the others."""


@dataclass(slots=True)
class Control:
    """NSBC controllers of all robots: sampled with zero-order hold."""

    period_s: Positive = 0.025
    """Control period h of all robots."""
    avoidance_gain_1_s: NotNegative = 3.0
    """Of obstacle avoidance; gain times period at most 1, as for all gains (1/period is rounded down to that)."""
    motion_gain_1_s: NotNegative = 2.0
    """Of tracking the preset trajectory, (6)."""
    formation_gain_1_s: NotNegative = 5.0
    """Of the UAV's task, (10)."""
    intervention_gain_1_s: NotNegative = 1.5
    """Of tracking an intervention, (14)."""
    sensing_range_m: Positive = 4.0
    """What is farther away is not seen; it must cover every safe distance with both radii and a period's closing."""


@dataclass(slots=True)
class Threshold:
    """Decision threshold zeta: rule 'fixed' takes zeta_m; 'bayes' minimises the Bayes risk (16)-(18).

    'printed' takes the root of (19) as the paper prints it, for comparison: it does not minimise the risk.
    """

    rule: Annotated[Words, one_of(("fixed",), "decision.bayes:COMPUTED")] = "fixed"
    """Where the threshold comes from."""
    zeta_m: Positive = 3.0
    """The threshold under the rule 'fixed'."""
    c1_1_s: Positive = 0.5
    """Cost of a second until the decision, in the Bayes risk (16)."""
    c2: Positive = 1.0
    """Cost of an error, in the Bayes risk (16)."""
    drift_m_s: Positive = 6.05
    """Drift that the Bayes risk takes."""
    noise_m_sqrt_s: Positive = 10.0
    """Noise that the Bayes risk takes."""


@dataclass(slots=True)
class Decision:
    """DDM (15) and event trigger: 'automaton' (hysteresis, minimum inter-event time) or 'bare' (the paper's)."""

    threshold: Threshold = field(default_factory=Threshold)
    """The decision threshold zeta."""
    trigger: Annotated[Words, one_of(TRIGGERS)] = "automaton"
    """With hysteresis and a minimum inter-event time, or without both as in the paper."""
    release_m: Positive = 1.5
    """An intervention ends when the decision variable falls to it; below the threshold."""
    min_inter_event_s: NotNegative = 0.5
    """Minimum inter-event time: no trigger follows another sooner."""
    noise_m_sqrt_s: NotNegative = 0.0
    """Noise of the decision variable in the simulation."""
    leak_1_s: NotNegative = 0.0
    """Rate at which accumulated noise decays; 0: never."""
    noise_period_s: Positive = 0.025
    """How often noise is drawn."""


@dataclass(slots=True)
class Policy:
    """One entry of the UAV's behaviour database: a policy's name and its numbers."""

    name: Annotated[Words, registered(POLICIES)]
    """Which policy."""
    parameters: dict[Name, Real] = field(default_factory=dict)
    """Its numbers, by name."""


@dataclass(slots=True)
class Intervention:
    """The UAV's intervention behaviours; how often it plans, and how long it rests after a refusal.

    `ranking` is 'listed' (in the order of the list) or 'predicted' (best predicted outcome on the UAV's map
    first). A policy that takes longer than `budget_s` for a proposal counts as proposing nothing; one that bounds its
    effort in counts, such as `coordinate`, is not timed (one of others is, after a minute).
    """

    period_s: Positive = 0.05
    """How often the UAV plans; a multiple of the control period."""
    retry_s: NotNegative = 1.0
    """How long it rests after a refusal; when no policy has a proposal, twice as long each time in a row."""
    ranking: Annotated[Words, one_of((), "intervention.database:RANKINGS")] = "predicted"
    """Which policy is asked first."""
    budget_s: Positive = 2.0
    """Time that a policy may take for a proposal, by the clock."""
    policies: list[Policy] = field(default_factory=list)
    """The behaviour database, in order."""


@dataclass(slots=True)
class Gatekeeper:
    """The accept/refuse decision, eqs (21)-(29).

    Under method (c) a decision on a proposal is reversed only for a plan that is cheaper by the (relative) switching
    margin, and not before `min_dwell_s` have passed. That is ours: by the paper's own rule, `first_stage`, the first
    stage of each plan is executed, without regard to earlier answers. A decision may take `budget_iterations`
    iterations of the solver of a relaxation and 20,000 iterations of the search of `mixed_integer`. With budget
    'counted' that is all: a run is the same on every machine where a decision takes less than 10 s, ten times the
    usual. Budget 'wall_clock', for real time, adds the share `budget_share` of the sampling period by the clock.
    `terminal_weight_s` is the w of a terminal cost w a ||rho_rd - rho_N||^2 besides (25); the paper has no such cost.

    Under method (d) outcomes are compared instead, `settling_s` past the end of motion and preset trajectory. An
    accepted proposal is executed for `longest_s` at most. A UGV accepts `tries` proposals, and then none until it has
    been on its own for `rest_s`.
    """

    route: Annotated[Words, registered(ROUTES, RETIRED_ROUTES)] = "mixed_integer"
    """How (26) is solved under method (c)."""
    period_s: Positive = 0.05
    """How often it decides; a multiple of the control period."""
    horizon_s: Positive = 3.0
    """How far (26) looks ahead, and how long other robots are predicted to go on."""
    stages: Annotated[Count, Field(le=MAX_STAGES)] = 60
    """Stages of (26): horizon_s / stages is a multiple of the control period."""
    blocks: CountFromZero = 0
    """Accept variables of (26), each for a block of stages, for route mixed_integer; 0: one per stage."""
    solver: Annotated[Words, one_of(SOLVERS)] = "daqp"
    """What searches for the optimum of route mixed_integer; the others need a Drake that has them, and a licence."""
    error_weight_1_m2_s: Positive = 1.0
    """a of (25): weight of the distance to the preset trajectory."""
    slack_weight_1_m2_s: NotNegative = 1000.0
    """Weight of the slack of the soft constraints in (25)."""
    terminal_weight_s: NotNegative = 0.0
    """w of a terminal cost that the paper does not have."""
    rule: Annotated[Words, one_of(RULES)] = "hysteresis"
    """How a plan becomes the answer under method (c): with margin and dwell, or by its first stage alone."""
    switching_margin: NotNegative = 0.05
    """How much cheaper, relatively, a plan must be to reverse a decision of method (c)."""
    min_dwell_s: NotNegative = 0.2
    """How long a decision of method (c) stands at least."""
    budget: Annotated[Words, one_of(BUDGETS)] = "counted"
    """What bounds a decision's effort: counts only, or also the clock."""
    budget_iterations: Count = 100
    """Iterations of the solver of a relaxation."""
    budget_share: Share = 0.5
    """Share of the sampling period, by the clock; at most 1."""
    longest_s: Positive = 30.0
    """How long an accepted proposal is executed at most."""
    settling_s: Positive = 10.0
    """How far outcomes are compared past the end of motion and preset trajectory."""
    tries: Count = 5
    """Acceptances until a rest."""
    rest_s: Positive = 5.0
    """How long a UGV is then on its own."""


@dataclass(slots=True)
class Run:
    """One simulation: a method (see `airground list methods`) and what is expected of it.

    `stalls_m` names the UGVs that must end (to within `stall_tolerance_m`) at that point short of their
    target. `expected` maps claim identifiers to the expected verdict; a claim not named must hold. Where
    there is no guarantee, "holds or refuted" admits either. `exercised` is "holds, and something put it to the test".
    `set: {decision.threshold.zeta_m: 2.0}` gives this run a value of its own, as `--set` gives one to all runs. Claims
    about the model whose constants it changes are judged for this run, too; `expected` may name them.
    """

    method: Annotated[Words, one_of(METHODS)]
    """How UAV and UGVs are coupled."""
    composition: Annotated[Words, one_of((), "nsbc.avoidance:COMPOSITIONS")] = "augmented"
    """How avoidance is composed with the tasks below: 'augmented' or a reading of recursion (5)."""
    set: Annotated[dict[Words, OneValue], settings_of(SETTABLE)] = field(default_factory=dict)
    """Other values in this run, by dotted key of `decision`, `gatekeeper` or `intervention`."""
    stalls_m: dict[Name, GroundPoint] = field(default_factory=dict)
    """Where UGVs must end short of their target, by UGV."""
    expected: Annotated[dict[Words, Words], expected_of(RUN_CLAIMS)] = field(default_factory=dict)
    """Expected verdicts of claims about this run, by claim; unnamed ones must hold."""


@dataclass(slots=True)
class Reproduction:
    """One row of the reproduction table: a measure of a run against the paper's value.

    `calibrated`: something that the paper leaves open was chosen so that the value comes out. `by_construction`: the
    scenario itself says the value, so that nothing is reproduced. `ambiguous` is another way to read the paper: the row
    is then neither reproduced nor not.
    """

    id: Words
    """Identifier of the row."""
    quantity: Words
    """What is compared, in words."""
    measure: Words
    """How our value is measured: see `report/reproduction.py`."""
    run: Words
    """On which run."""
    robot: Words
    """Of which robot."""
    paper: Annotated[list[Real], Field(min_length=1)]
    """The paper's value, one number for each component."""
    unit: Words = ""
    """Its unit."""
    tolerance: NotNegative = 0.0
    """How far ours may be off."""
    calibrated: YesNo = False
    """Whether something was chosen so that the value comes out."""
    why: Words = ""
    """Why the row is as it is."""
    ambiguous: Words = ""
    """Another way to read the paper, in words."""
    by_construction: YesNo = False
    """Whether the scenario itself says the value."""


@dataclass(slots=True)
class Choice:
    """Where a value that is not the paper's comes from: `source` is 'calibrated' or 'ours'."""

    key: Words
    """Dotted key of the value."""
    source: Annotated[Words, one_of(SOURCES)]
    """Where it comes from."""
    paper: Words = ""
    """What the paper has instead."""
    reason: Words = field(kw_only=True)
    """Why it is as it is."""


@dataclass(slots=True)
class Scenario:
    """A scenario file. The order of `ugvs` and `obstacles` is the order of all arrays.

    `expected` maps identifiers of claims about the model (proofs and experiments, the same for all runs) to the
    expected verdict; one that is not named must be proved, or supported if it is statistical. `claims` adds claims
    to those of the package: `module:Class` or `file.py:Class` by identifier.
    """

    __pydantic_config__: ClassVar = ConfigDict(
        extra="forbid", revalidate_instances="always", use_attribute_docstrings=True
    )

    name: Name
    """What it is called: letters, digits and underscores."""
    title: Words = ""
    """One line."""
    description: Words = ""
    """What it shows."""
    seed: CountFromZero = 0
    """Of the decision noise."""
    duration_s: Positive = 30.0
    """How long each run is simulated, at least one control period."""
    arrival_tolerance_m: Positive = 0.1
    """How close to its target a robot has arrived."""
    stall_tolerance_m: Positive = 0.1
    """How close to its point in `stalls_m` a UGV must end."""
    ugvs: Annotated[dict[Name, Ugv], Field(min_length=1, max_length=MAX_UGVS)] = field(kw_only=True)
    """The UGVs, 1 to 100, by name, in the order of all arrays."""
    uav: Uav = field(kw_only=True)
    """The UAV."""
    obstacles: dict[Name, Obstacle] = field(default_factory=dict)
    """The obstacles, by name."""
    safe_distance: SafeDistance = field(default_factory=SafeDistance)
    """Distances to keep."""
    control: Control = field(default_factory=Control)
    """The controllers."""
    decision: Decision = field(default_factory=Decision)
    """The event trigger."""
    intervention: Intervention = field(default_factory=Intervention)
    """What the UAV proposes, and when."""
    gatekeeper: Gatekeeper = field(default_factory=Gatekeeper)
    """What a UGV makes of proposals."""
    runs: Annotated[dict[Name, Run], Field(min_length=1)] = field(kw_only=True)
    """The simulations, by name."""
    claims: Annotated[dict[Words, Words], CLAIMS] = field(default_factory=dict)
    """Claims of one's own, by identifier."""
    expected: Annotated[dict[Words, Words], expected_of(MODEL_CLAIMS)] = field(default_factory=dict)
    """Expected verdicts of claims about the model, by claim."""
    reproduction: list[Reproduction] = field(default_factory=list)
    """The paper's numbers to compare with."""
    choices: list[Choice] = field(default_factory=list)
    """Where values come from that are not the paper's."""

    @property
    def robots(self) -> dict[str, Ugv | Uav]:
        """The UGVs and then the UAV, by name."""
        return {**self.ugvs, self.uav.name: self.uav}

    @property
    def bodies(self) -> dict[str, Ugv | Uav | Obstacle]:
        """The robots and then the obstacles, by name."""
        return {**self.robots, **self.obstacles}

    def __repr__(self) -> str:
        """In one line: how many robots and obstacles there are, and the runs."""
        things = f"{len(self.ugvs)} UGVs, the UAV, {len(self.obstacles)} obstacles"
        return f"<Scenario {self.name!r}: {things}, runs {', '.join(self.runs)}>"

    def _repr_html_(self) -> str:
        """What a notebook shows: title, map with the preset trajectories, robots and runs."""
        ugvs = [
            f"{name} from {_place(ugv.start_m)} to {_place(ugv.target_m)}, at most {ugv.max_speed_m_s:g} m/s"
            for name, ugv in self.ugvs.items()
        ]
        told = [f"run {name}: ({run.method}) {METHODS[run.method].says}" for name, run in self.runs.items()]
        listed = "".join(f"<li>{escape(line)}</li>" for line in (*ugvs, f"{self.uav.name}, the UAV", *told))
        return f"<p><b>{escape(self.title or self.name)}</b> {escape(repr(self))}</p>{picture(self)}<ul>{listed}</ul>"


def _place(at: Sequence[float]) -> str:
    return f"({at[0]:g}, {at[1]:g}) m"
