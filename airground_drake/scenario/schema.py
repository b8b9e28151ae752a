"""The scenario file as dataclasses: every key with its unit (in the key's name), its allowed values and its meaning.

pydantic fills them (`load.py`). They are mutable, so that scenarios can be changed in Python; nothing changes them
after validation (`validate.py`). They have slots: Python refuses an attribute that is not a key. A file must have every
key without a default. Positions are in the world frame, z up, the ground at z = 0.
"""

# No `from __future__ import annotations` here: pydantic needs the types themselves, not their names.
import json
import math
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from typing import Annotated, Any, ClassVar

from pydantic import ConfigDict, Field

from airground_drake.base.files import sha256
from airground_drake.base.limits import MAX_CORNERS, MAX_RECTANGLES, MAX_STAGES, MAX_UGVS
from airground_drake.base.registry import (
    METHODS,
    MODEL_CLAIMS,
    POLICIES,
    ROUTES,
    RUN_CLAIMS,
    UAV_TASKS,
    UGV_CONTROLLERS,
)
from airground_drake.base.values import (
    Chance,
    Count,
    CountFromZero,
    Heading,
    Loss,
    Name,
    Noise,
    NotNegative,
    Positive,
    Real,
    Share,
    Words,
    YesNo,
)
from airground_drake.model.bodies.kinds import Kind
from airground_drake.scenario.kinds import (
    CLAIMS,
    AirPoint,
    AirPointOrNone,
    CellRectangle,
    Corner,
    CornersOrNone,
    GroundPoint,
    OneValue,
    Place,
    PlaceOrNone,
    Point,
    SizeOrNone,
    TwoCornersOrNone,
    expected_of,
    one_of,
    registered,
    settings_of,
)
from airground_drake.scenario.plants import Plants

Vector = list[float]

ARENA = "arena_"
"""Begins the names of the arena's walls: arena_south, arena_east, arena_north and arena_west."""
ENDLESS_M = 1e6
"""Height of the arena's walls, m."""
MAP = "map"
"""Name of the obstacle that the map is."""
SHAPES = ("polygon_m", "segment_m", "size_m")
"""Keys that give an obstacle a shape, turned by its heading; `shapes.py` makes convex parts of them."""
ABOUT = ("size_m",)
"""Those of them that are about its position, which they need."""

ERRORS: tuple[str, ...] = ("drawn", "adversarial", "away", "sideways")
TRIGGERS: tuple[str, ...] = ("automaton", "bare")
AT_END: tuple[str, ...] = ("stop", "reverse", "loop")
UNNAMED = "uav"
"""Name of a UAV that is given none."""
SET = "set"
"""Source of a value that an override changed."""
RULES: tuple[str, ...] = ("hysteresis", "first_stage")
LAWS: tuple[str, ...] = ("shared", "asynchronous")
OPTIONAL: dict[str, object] = {
    "channel": None, "sensing": None, "faults": None, "ugv_controller": None,
    "uav": None, "uavs": {}, "ugvs": [], "lost_at_s": 0.0, "uav_m": 0.0, "law": "shared",
}  # fmt: skip
"""Keys that may be left out, and their values then: a scenario is written and digested as if these did not exist."""
SETTABLE: tuple[str, ...] = ("channel", "decision", "gatekeeper", "intervention")
"""Sections in which a run may set its own values. All runs share bodies, distances and controllers: a report draws them
once, and proves safety once."""


@dataclass(slots=True)
class Preset:
    """Preset trajectory rho_rd of a UGV: a polyline travelled at constant speed from t = 0, then held."""

    waypoints_m: Annotated[list[GroundPoint], Field(min_length=2)]
    """Its corners, at least two; the last must be at the target if a run expects the UGV there."""
    speed_m_s: Positive = 1.0
    """Constant speed along it, at most the UGV's `max_speed_m_s`."""


@dataclass(slots=True)
class Ugv:
    """One UGV: a disc of radius `radius_m` on the ground."""

    start_m: GroundPoint
    """Start of its body (of a unicycle: of the axle); z = 0."""
    target_m: GroundPoint
    """Its target; z = 0. Preset and target are for the point that the law steers."""
    preset: Preset
    """The trajectory that it follows by itself."""
    max_speed_m_s: Positive = 6.0
    """Commands are shortened to this speed."""
    radius_m: NotNegative = 0.0
    """Radius of its body, added to the safe distances of its pairs; 0: a point."""
    plant: Plants = field(default_factory=list)
    """Its motion model; by default it follows commands exactly. The law keeps a larger distance for other plants: see
    `airground budget`. A list combines a delay with a lag after it."""


@dataclass(slots=True)
class Uav:
    """A UAV, a robot in space whose `task` is to fly over the centroid of its UGVs, eqs (9)-(10).

    Another task is named as `module:Class` or `file.py:Class`. `phantoms_m` are points on its map without a real
    obstacle. Its body is a ball of radius `radius_m`.
    """

    name: Name = UNNAMED
    """Its name in traces and reports; under `uavs`, its key."""
    start_m: AirPoint = field(kw_only=True)
    """Its start."""
    target_m: AirPointOrNone = field(default_factory=list)
    """Its target; default: above the centroid of its UGVs' targets, at `altitude_m`."""
    altitude_m: Positive = 2.0
    """Height above its UGVs; more than `air_ground_m` plus both radii."""
    task: Annotated[Words, registered(UAV_TASKS)] = "formation"
    """Its task, with lower priority than obstacle avoidance."""
    max_speed_m_s: Positive = 10.0
    """Commands are shortened to this speed."""
    phantoms_m: list[Point] = field(default_factory=list)
    """Points on its map without a real obstacle."""
    radius_m: NotNegative = 0.0
    """Radius of its body, added to the safe distances of its pairs; 0: a point."""
    plant: Plants = field(default_factory=list)
    """Its motion model; by default it follows commands exactly. The law keeps a larger distance for other plants: see
    `airground budget`. A list combines a delay with a lag after it."""
    ugvs: list[Name] = field(default_factory=list)
    """Its UGVs: it flies over their centroid, and intervenes on them only. Default: all that no other UAV lists."""
    lost_at_s: NotNegative = 0.0
    """From this time on it neither sends nor receives anything, and flies on. 0: never."""


@dataclass(slots=True)
class Moves:
    """The path of a moving obstacle: the origin of its frame moves straight between waypoints, without rotation.

    Each leg takes a whole number of control periods, so the speed is rounded down. Walls and robots do not stop it.
    """

    waypoints_m: Annotated[list[Place], Field(min_length=2, max_length=MAX_CORNERS)]
    """Corners of the path, [x, y] or [x, y, z], at least two."""
    speed_m_s: Positive
    """Speed along the path."""
    start_s: NotNegative = 0.0
    """Start of the motion; until then the obstacle stands at the first waypoint."""
    at_end: Annotated[Words, one_of(AT_END)] = "stop"
    """At the last waypoint it stops, reverses, or continues straight to the first one."""


@dataclass(slots=True)
class Obstacle:
    """An obstacle from which robots keep the safe distance of (7)-(8); by default a ball (a point without a radius).

    At most one of `polygon_m`, `segment_m` and `size_m` gives it another shape. Its coordinates are in the obstacle's
    frame, with origin `position_m`, rotated by `heading_rad`; by default that is the world frame.
    """

    position_m: PlaceOrNone = field(default_factory=list)
    """Centre of a ball or box, otherwise origin of its frame: [x, y] or [x, y, z]. Needed for a ball."""
    known_to_uav: YesNo = True
    """Whether it is on the UAV's map from the beginning."""
    radius_m: NotNegative = 0.0
    """Radius of a ball; for other shapes, the radius by which corners and edges are rounded outwards."""
    polygon_m: CornersOrNone = field(default_factory=list)
    """Corners [x, y] of a polygon, in order, at least three; edges must not cross."""
    segment_m: CornersOrNone = field(default_factory=list)
    """Corners [x, y] of a thin wall, at least two."""
    size_m: SizeOrNone = field(default_factory=list)
    """Length and width [x, y] of a box about `position_m`."""
    heading_rad: Heading = 0.0
    """Rotates a polygon, wall or box about `position_m`, counter-clockwise."""
    height_m: NotNegative = 0.0
    """It extends from the ground to this height; 0: flat, or a ball. UGVs treat walls as infinitely high."""
    distance_m: NotNegative = 0.0
    """Distance to keep from it, in place of `safe_distance.obstacle_m` or `moving_m`; 0: use these."""
    moves: Moves | None = None
    """Its motion, in place of `position_m`."""
    max_speed_m_s: NotNegative = 0.0
    """Largest speed that robots expect of it; 0: the speed of `moves`, if any."""
    known_motion: YesNo = False
    """Whether predictions use its path, or only its present velocity. Guaranteed distances do not depend on this."""
    appears_s: NotNegative = 0.0
    """It exists from this time on, rounded up to a control sample."""
    disappears_s: NotNegative = 0.0
    """It exists until this time, rounded up to a control sample; 0: always."""

    @property
    def expected_speed_m_s(self) -> float:
        """Largest speed that robots expect of it, m/s."""
        return self.max_speed_m_s or (self.moves.speed_m_s if self.moves else 0.0)


@dataclass(slots=True)
class MapCells:
    """The cells read from the files of a map, filled in when a scenario is loaded.

    So the scenario in a report needs no other file. A free cell that no robot can reach from its start counts as
    occupied.
    """

    file: Words
    """The map's `file`."""
    unknown: Words
    """The map's `unknown`."""
    sha256: dict[Words, Words]
    """SHA-256 of the YAML file and of its image, by name."""
    starts_m: list[Corner]
    """Starts of the robots."""
    cell_m: Positive
    """Side of a cell."""
    origin: Annotated[list[Real], Field(min_length=3, max_length=3)]
    """Outer corner of the first cell of the lowest row, x and y in m; heading of the rows in rad."""
    rows: CountFromZero
    """Number of rows."""
    columns: CountFromZero
    """Number of columns."""
    occupied: CountFromZero
    """Number of occupied cells."""
    unsure: CountFromZero
    """Number of unknown cells."""
    unreached: CountFromZero
    """Number of free cells that no robot can reach from these starts."""
    rectangles: Annotated[list[CellRectangle], Field(max_length=MAX_RECTANGLES)]
    """Rectangles that cover the occupied cells: first row, row after the last, first column, column after the last.
    They may overlap."""

    def __str__(self) -> str:
        cells = f"{self.columns} x {self.rows} cells of {self.cell_m:g} m"
        counts = f"{self.occupied} occupied, {self.unsure} unknown ({self.unknown}), {self.unreached} out of reach"
        return f"map {self.file}: {cells}, {counts}; {len(self.rectangles)} rectangles"


@dataclass(slots=True)
class Map:
    """A map in the files of ROS's map_server (YAML and image): its occupied cells are one obstacle."""

    file: Annotated[Words, Field(min_length=1)]
    """Path of the YAML file, from the folder of the scenario."""
    height_m: NotNegative = 0.0
    """Height of occupied cells; 0: the UAV flies over them. UGVs treat them as infinitely high."""
    distance_m: NotNegative = 0.0
    """Distance to keep from it, in place of `safe_distance.obstacle_m`; 0: use that."""
    known_to_uav: YesNo = True
    """Whether the UAV has the map from the beginning."""
    unknown: Annotated[Words, one_of(("occupied", "free"))] = "occupied"
    """How unknown cells count: grey 205, transparent, or between the thresholds."""
    cells: MapCells | None = None
    """The cells read from the files; filled in."""


@dataclass(slots=True)
class MapObstacle(Obstacle):
    """The obstacle that a map is; its parts are those of `cells`."""

    cells: MapCells = field(kw_only=True)
    """The map's cells."""


@dataclass(slots=True)
class SafeDistance:
    """Safe distances d of (7)-(8), for each kind of pair, and the distance that counts as a collision.

    They are distances between surfaces: the centres of a pair keep d + (radius + radius), and collide at
    `collision_m` + (radius + radius). All other distances, also `control.sensing_range_m`, are between centres.
    """

    obstacle_m: Positive = 2.0
    """Between a robot and an obstacle."""
    moving_m: NotNegative = 0.0
    """Between a robot and a moving obstacle; 0: `obstacle_m`."""
    ugv_m: Positive = 2.0
    """Between two UGVs."""
    air_ground_m: Positive = 1.0
    """Between a UAV and a UGV."""
    uav_m: NotNegative = 0.0
    """Between two UAVs; needed if there are several."""
    collision_m: Positive = 0.05
    """A smaller distance is a collision; must be less than the other distances."""


@dataclass(slots=True)
class Control:
    """NSBC controllers of all robots: sampled with zero-order hold."""

    period_s: Positive = 0.025
    """Control period h of all robots."""
    avoidance_gain_1_s: NotNegative = 3.0
    """Gain A of obstacle avoidance; like all gains, at most 1/`period_s`."""
    motion_gain_1_s: NotNegative = 2.0
    """Gain of tracking the preset trajectory, (6)."""
    formation_gain_1_s: NotNegative = 5.0
    """Gain of the UAV's task, (10)."""
    intervention_gain_1_s: NotNegative = 1.5
    """Gain of tracking an intervention, (14)."""
    sensing_range_m: Positive = 4.0
    """Sensing range; at least safe distance, both radii and the distance that closes in a period, for every pair."""
    law: Annotated[Words, one_of(LAWS)] = "shared"
    """How two UGVs keep apart. 'shared': each takes half of an inequality, with positions of this sample.
    'asynchronous', with `channel.ugvs`: with positions of any age. A UGV avoids all points that the other can reach
    before it decides again. This needs more room: closer than the safe distance plus V (age + period) they may only
    separate."""


@dataclass(slots=True)
class Sensing:
    """Measured positions: each robot publishes one with a bounded error, and all robots and gatekeepers act on it.

    The law keeps a larger distance to allow for the errors (`airground budget`), and robots stand still if measured
    inequalities contradict one another. 'drawn' errors change smoothly. The other errors are at the bound: the nearest
    body appears farther away ('away') or in another direction ('sideways'); 'adversarial' chooses one of them at random
    every half second. Positions of obstacles are exact; beside an obstacle that may move, a robot only moves in
    directions that cannot bring it nearer whatever the error, or stands still.
    """

    position_error_m: NotNegative = 0.0
    """Largest error of a robot's published position."""
    errors: Annotated[Words, one_of(ERRORS)] = "drawn"
    """The kind of errors."""
    correlation_s: Positive = 1.0
    """Time between independent drawn errors, which are interpolated linearly."""
    shared: bool = True
    """Whether all robots act on the published positions. If not, each robot measures all other robots, so that two of
    them see different directions: this costs more distance, and more the faster they are. Gatekeepers still act on
    published positions."""
    uav_error_m: NotNegative = 0.0
    """Largest (drawn) error of the positions with which the UAV plans. Guaranteed distances do not depend on it."""
    seed: CountFromZero = 0
    """Seed of the errors."""


@dataclass(slots=True)
class Faults:
    """Faults that exceed the declared bounds. The report says for each run which hypothesis failed first.

    For a robot that does not follow its commands, use a plant of your own that exceeds its `drift_m_s`.
    """

    position_error_m: NotNegative = 0.0
    """Excess of position errors over `sensing.position_error_m`."""
    late: Chance = 0.0
    """Share of control samples at which announced positions arrive one period later than `channel.ugvs` allows."""


@dataclass(slots=True)
class OwnController:
    """The user's own controller of all UGVs, a Drake System with the same outputs as the package's.

    Distances and steps are judged as usual; claims about the package's law and its predictions are not run.
    """

    kind: Annotated[Words, registered(UGV_CONTROLLERS)]
    """Its class: `module:Class` or `file.py:Class`."""
    parameters: dict[Name, Real] = field(default_factory=dict)
    """Numbers for its class, by name."""


@dataclass(slots=True)
class Threshold:
    """Decision threshold zeta. The rule 'fixed' uses zeta_m; 'bayes' minimises the Bayes risk (16)-(18).

    'printed' uses the root of (19) as printed in the paper, for comparison: it does not minimise the risk.
    """

    rule: Annotated[Words, one_of(("fixed",), "model.trigger.bayes:COMPUTED")] = "fixed"
    """Where the threshold comes from."""
    zeta_m: Positive = 3.0
    """The threshold under the rule 'fixed'."""
    c1_1_s: Positive = 0.5
    """Cost of a second until the decision, in the Bayes risk (16)."""
    c2: Positive = 1.0
    """Cost of an error, in the Bayes risk (16)."""
    drift_m_s: Positive = 6.05
    """Drift in the Bayes risk."""
    noise_m_sqrt_s: Positive = 10.0
    """Noise in the Bayes risk."""


@dataclass(slots=True)
class Decision:
    """Drift-diffusion (15) and trigger: 'automaton' (hysteresis, minimum inter-event time) or the paper's 'bare'."""

    threshold: Threshold = field(default_factory=Threshold)
    """The decision threshold zeta."""
    trigger: Annotated[Words, one_of(TRIGGERS)] = "automaton"
    """With hysteresis and a minimum inter-event time, or without both, as in the paper."""
    release_m: Positive = 1.5
    """Release level: an intervention ends when the decision variable falls to it; below the threshold."""
    min_inter_event_s: NotNegative = 0.5
    """Minimum time between two triggers of a UGV."""
    noise_m_sqrt_s: Noise = 0.0
    """Noise of the decision variable in the simulation."""
    leak_1_s: NotNegative = 0.0
    """Rate at which accumulated noise decays; 0: never."""
    noise_period_s: Positive = 0.025
    """Sampling period of the noise."""

    def levels(self, zeta_m: float) -> tuple[float, float, float]:
        """Threshold and release level, m, and dwell, s; the bare trigger has no release level and no dwell."""
        return (zeta_m, zeta_m, 0.0) if self.trigger == "bare" else (zeta_m, self.release_m, self.min_inter_event_s)


@dataclass(slots=True)
class Policy:
    """One entry of the UAV's behaviour database: a policy and its parameters."""

    name: Annotated[Words, registered(POLICIES)]
    """Name of the policy."""
    parameters: dict[Name, Real] = field(default_factory=dict)
    """Its parameters, numbers by name."""


@dataclass(slots=True)
class Intervention:
    """The UAV's policies, its planning period, and its rest after a refusal.

    `ranking` is 'listed' (in the order of the list) or 'predicted' (best predicted outcome on the UAV's map first). A
    policy that takes longer than `budget_s` proposes nothing. A policy with a fixed number of iterations, such as
    `coordinate`, has no time limit; a third-party one has at least a minute.
    """

    period_s: Positive = 0.05
    """Planning period of the UAV; a multiple of the control period."""
    retry_s: NotNegative = 1.0
    """Time until the UAV asks again after a refusal; doubled each time that no policy has a proposal."""
    ranking: Annotated[Words, one_of((), "uav.database:RANKINGS")] = "predicted"
    """Order in which policies are asked."""
    budget_s: Positive = 2.0
    """Wall-clock limit of a policy for one proposal."""
    policies: list[Policy] = field(default_factory=list)
    """The behaviour database, in order."""


@dataclass(slots=True)
class Gatekeeper:
    """The accept/refuse decision, eqs (21)-(29).

    Under method (c), by our rule `hysteresis`, an answer is reversed only if the plan is cheaper by the relative
    `switching_margin`, and not before `min_dwell_s` have passed. The paper's rule, `first_stage`, executes the first
    stage of each rounded plan, whatever the earlier answers were. With the route `nonlinear` it follows (27)-(29)
    literally, with two choices that the paper leaves open: the search starts at the cheaper constant plan, and the
    velocities of (23) are those along the constant plans. A decision may take `budget_iterations` iterations of a
    relaxation's solver and 2,000 iterations of the searches of `mixed_integer`. The budget 'counted' has no other
    limit, so a run is the same on every machine, if these iterations take less than 1 s (usually a tenth of that). The
    budget 'wall_clock', for real time, also limits a decision to the share `budget_share` of the sampling period.
    `terminal_weight_s` is the weight w of a terminal cost w a ||rho_rd - rho_N||^2 in addition to (25), which the paper
    does not have.

    Method (d) compares outcomes instead, up to `settling_s` past the end of motion and preset trajectory. An accepted
    proposal is executed for `longest_s` at most. After `tries` accepted proposals a UGV accepts no more until it has
    followed its own task for `rest_s`.
    """

    route: Annotated[Words, registered(ROUTES)] = "mixed_integer"
    """Solver route of (26) under method (c)."""
    period_s: Positive = 0.05
    """Decision period; a multiple of the control period."""
    horizon_s: Positive = 3.0
    """Horizon of (26), and time for which other robots are predicted to keep their velocities."""
    stages: Annotated[Count, Field(le=MAX_STAGES)] = 60
    """Stages of (26): horizon_s / stages is a multiple of the control period."""
    blocks: CountFromZero = 0
    """Number of accept variables of (26), each for a block of stages (route mixed_integer); 0: one per stage."""
    solver: Annotated[Words, one_of(("daqp", "gurobi", "mosek"))] = "daqp"
    """Solver of the route mixed_integer; gurobi and mosek need a Drake with these solvers, and a licence."""
    error_weight_1_m2_s: Positive = 1.0
    """a of (25): weight of the distance to the preset trajectory."""
    slack_weight_1_m2_s: NotNegative = 1000.0
    """Weight of the slack of the soft constraints in (25)."""
    terminal_weight_s: NotNegative = 0.0
    """Weight w of a terminal cost, which the paper does not have."""
    rule: Annotated[Words, one_of(RULES)] = "hysteresis"
    """How a plan determines the answer under method (c): with margin and dwell, or by its first stage alone."""
    switching_margin: NotNegative = 0.05
    """Relative amount by which a plan must be cheaper to reverse a decision of method (c)."""
    min_dwell_s: NotNegative = 0.2
    """Minimum time between two different answers of method (c)."""
    budget: Annotated[Words, one_of(("counted", "wall_clock"))] = "counted"
    """Limits of a decision's effort: iteration counts only, or also wall-clock time."""
    budget_iterations: Count = 100
    """Largest number of iterations of the solver of a relaxation."""
    budget_share: Share = 0.5
    """Share of the sampling period that a decision may take under 'wall_clock'; at most 1."""
    longest_s: Positive = 30.0
    """Longest time for which an accepted proposal is executed."""
    settling_s: Positive = 10.0
    """Outcomes are compared up to this time after the end of motion and preset trajectory."""
    tries: Count = 5
    """Number of acceptances before a rest."""
    rest_s: Positive = 5.0
    """Length of that rest, during which the UGV follows its own task."""


@dataclass(slots=True)
class WayBack:
    """The link from UGVs to the UAV: only the values that differ from those of `channel`."""

    delay_s: NotNegative | None = None
    """Delay of every message."""
    jitter_s: NotNegative | None = None
    """Largest additional delay of a message, uniformly distributed."""
    loss: Loss | None = None
    """Share of messages that are lost."""
    burst_s: NotNegative | None = None
    """Mean duration of an outage, 0.001 s at least; 0: messages are lost independently."""
    duplicate: Chance | None = None
    """Share of messages that arrive twice."""
    reorder: YesNo | None = None
    """Whether a message may overtake another one."""


@dataclass(slots=True)
class UgvLinks:
    """Delay and loss of positions sent between UGVs; without it UGVs always know each other's positions.

    At a control sample a UGV publishes its position at the next sample, so a delay of up to one control period costs
    nothing. If it misses the message of another UGV, it stands still for that period, unless the other one is certainly
    far: the distance from its last known position, minus the distance that it may have driven since, exceeds the law's
    distance. Starts are known. Predictions of gatekeepers assume that all messages arrive.

    With `control.law: asynchronous` a UGV publishes its current position, and others act on the last received position,
    however old it is. Predictions of gatekeepers use true positions, with the age given by the delay.
    """

    delay_s: NotNegative = 0.0
    """Delay of a position; at most the control period, except with `control.law: asynchronous`."""
    loss: Loss = 0.0
    """Share of positions that are lost, for each receiver."""


@dataclass(slots=True)
class Channel:
    """Delay and loss of messages between UAVs and UGVs; without it messages arrive at once, and none is lost.

    Delay and loss of a message depend on `seed`, its link, its number and how often it was sent before; with `burst_s`
    also on the time. A sender without an answer repeats its message after the delays of both links, the larger jitter
    and 0.15 s (or one period each of gatekeeper, control and planner, if that is longer). All robots know the positions
    of the others; with `ugvs` UGVs know those of other UGVs only from messages.
    """

    delay_s: NotNegative = 0.0
    """Delay of every message."""
    jitter_s: NotNegative = 0.0
    """Largest additional delay of a message, uniformly distributed."""
    loss: Loss = 0.0
    """Share of messages that are lost."""
    burst_s: NotNegative = 0.0
    """Mean duration of an outage, 0.001 s at least; 0: messages are lost independently."""
    duplicate: Chance = 0.0
    """Share of messages that arrive twice."""
    reorder: YesNo = True
    """Whether a message may overtake another one."""
    seed: CountFromZero = 1
    """Seed of losses, duplicates and delays."""
    up: WayBack | None = None
    """The link from UGVs to the UAV; by default the same as the link to the UGVs."""
    ugvs: UgvLinks | None = None
    """Positions sent between UGVs; the same in all runs."""


@dataclass(slots=True)
class Run:
    """One simulation: a method (see `airground list methods`) and its expected results.

    `stalls_m` gives UGVs that must stall at a point short of their target, to within `stall_tolerance_m`. `expected`
    maps claim identifiers to expected verdicts; a claim that is not named must hold. Use `nothing` for a claim about
    which the method promises nothing. `exercised` means "holds, and the run tested it". `interventions: 2` in
    `expected` requires that UGVs begin to execute at least two proposals, `messages: 5` that at least five proposals
    and answers are delivered. `set: {decision.threshold.zeta_m: 2.0}` sets a value for this run, as `--set` does for
    all runs. Claims about the model that use a changed constant are also judged for this run; `expected` may name them.
    """

    method: Annotated[Words, one_of(METHODS)]
    """How UAV and UGVs are coupled."""
    composition: Annotated[Words, one_of((), "model.law.avoidance:COMPOSITIONS")] = "augmented"
    """Composition of avoidance with lower tasks: 'augmented', or an interpretation of recursion (5)."""
    set: Annotated[dict[Words, OneValue], settings_of(SETTABLE)] = field(default_factory=dict)
    """Other values in this run, by dotted key of `channel`, `decision`, `gatekeeper` or `intervention`."""
    stalls_m: dict[Name, GroundPoint] = field(default_factory=dict)
    """Points at which UGVs must end short of their target, by UGV."""
    expected: Annotated[dict[Words, Any], expected_of(RUN_CLAIMS)] = field(default_factory=dict)
    """Expected verdicts of claims about this run, by claim; other claims must hold. Also the least numbers of
    interventions and messages."""


@dataclass(slots=True)
class Reproduction:
    """One row of the reproduction table: a measure of a run against the paper's value.

    `calibrated`: a value that the paper leaves open was chosen to obtain this one. `by_construction`: the scenario
    itself sets the value, so nothing is reproduced. `ambiguous` states another interpretation of the paper; the row
    then counts as neither reproduced nor not reproduced.
    """

    id: Words
    """Identifier of the row."""
    quantity: Words
    """The compared quantity, in words."""
    measure: Words
    """The measure of our value, see `report/reproduction.py`."""
    run: Words
    """The run that is measured."""
    robot: Words
    """The robot that is measured."""
    paper: Annotated[list[Real], Field(min_length=1)]
    """The paper's value, one number for each component."""
    unit: Words = ""
    """Its unit."""
    tolerance: NotNegative = 0.0
    """Largest allowed difference from the paper's value."""
    calibrated: YesNo = False
    """Whether a value that the paper leaves open was chosen to obtain this one."""
    why: Words = ""
    """Explanation of the row."""
    ambiguous: Words = ""
    """Another interpretation of the paper, in words."""
    by_construction: YesNo = False
    """Whether the scenario itself sets the value."""


@dataclass(slots=True)
class Choice:
    """Origin of a value that is not from the paper.

    `source` is 'calibrated' if it was chosen so that a result matches the paper's, else 'ours'. An override of the
    value (`--set`) makes it 'set', and replaces the reason.
    """

    key: Words
    """Dotted key of the value."""
    source: Annotated[Words, one_of(("calibrated", "ours", SET))]
    """Its origin."""
    paper: Words = ""
    """The paper's value or statement."""
    reason: Words = field(kw_only=True)
    """The reason for the value."""


def _written(items: list[tuple[str, Any]]) -> dict[str, Any]:
    """A mapping of a file, without optional keys that are left out."""
    return {key: value for key, value in items if not (key in OPTIONAL and (value is None or value == OPTIONAL[key]))}


@dataclass(slots=True)
class Scenario:
    """A scenario file. The order of `ugvs` and `obstacles` is the order of all arrays.

    `expected` maps identifiers of claims about the model (proofs and experiments, the same for all runs) to the
    expected verdict; other claims must be proved, or supported if they are statistical. `claims` adds the user's own
    claims: `module:Class` or `file.py:Class` by identifier.
    """

    __pydantic_config__: ClassVar = ConfigDict(extra="forbid", revalidate_instances="always")

    name: Name
    """Its name: a-z, A-Z, 0-9 and _."""
    title: Words = ""
    """One line."""
    description: Words = ""
    """The purpose of the scenario."""
    seed: CountFromZero = 0
    """Seed of the decision noise."""
    duration_s: Positive = 30.0
    """Simulated time of each run, at least one control period."""
    arrival_tolerance_m: Positive = 0.1
    """A robot within this distance of its target has arrived."""
    stall_tolerance_m: Positive = 0.1
    """A UGV must end within this distance of its point in `stalls_m`."""
    ugvs: Annotated[dict[Name, Ugv], Field(min_length=1, max_length=MAX_UGVS)] = field(kw_only=True)
    """The UGVs, 1 to 100, by name, in the order of all arrays."""
    uav: Uav | None = field(default=None, kw_only=True)
    """The UAV; for several UAVs use `uavs` instead."""
    uavs: dict[Name, Uav] = field(default_factory=dict, kw_only=True)
    """Several UAVs by name, in place of `uav` and with its keys; each UGV is assigned to one of them."""
    obstacles: dict[Name, Obstacle] = field(default_factory=dict)
    """The obstacles, by name."""
    arena_m: TwoCornersOrNone = field(default_factory=list)
    """Opposite corners [x, y] of a rectangle that encloses all robots, with infinitely high walls."""
    map: Map | None = None
    """A map of ROS."""
    safe_distance: SafeDistance = field(default_factory=SafeDistance)
    """Distances to keep."""
    control: Control = field(default_factory=Control)
    """The controllers."""
    ugv_controller: OwnController | None = None
    """A controller of your own, in place of the package's."""
    sensing: Sensing | None = None
    """Errors of measured positions."""
    faults: Faults | None = None
    """Faults that exceed the declared bounds."""
    decision: Decision = field(default_factory=Decision)
    """The event trigger."""
    intervention: Intervention = field(default_factory=Intervention)
    """The UAV's intervention behaviours."""
    gatekeeper: Gatekeeper = field(default_factory=Gatekeeper)
    """The UGVs' decisions about proposals."""
    channel: Channel | None = None
    """Delay and loss of messages; by default messages arrive at once."""
    runs: Annotated[dict[Name, Run], Field(min_length=1)] = field(kw_only=True)
    """The simulations, by name."""
    claims: Annotated[dict[Words, Words], CLAIMS] = field(default_factory=dict)
    """The user's own claims, by identifier."""
    expected: Annotated[dict[Words, Words], expected_of(MODEL_CLAIMS)] = field(default_factory=dict)
    """Expected verdicts of claims about the model, by claim."""
    reproduction: list[Reproduction] = field(default_factory=list)
    """The paper's numbers to compare with."""
    choices: list[Choice] = field(default_factory=list)
    """Origins of values that are not from the paper."""

    def data(self) -> dict[str, Any]:
        """The scenario as nested dicts and lists, with all defaults."""
        return asdict(self, dict_factory=_written)

    @property
    def digest(self) -> str:
        """SHA-256 of the scenario as nested dicts and lists in strict JSON, with all defaults and without spaces."""
        text = json.dumps(self.data(), separators=(",", ":"), allow_nan=False)
        return sha256(text.encode())

    @property
    def position_error_m(self) -> float:
        """Bound of the error of a robot's published position, m; 0 without errors."""
        return self.sensing.position_error_m if self.sensing else 0.0

    @property
    def ugv_links(self) -> UgvLinks | None:
        """What happens to positions on their way between UGVs; None: nothing."""
        return self.channel.ugvs if self.channel else None

    @property
    def publishes(self) -> bool:
        """Whether robots act on positions that are published, not on true ones."""
        return self.sensing is not None or self.announces

    @property
    def announces(self) -> bool:
        """Whether UGVs publish where they will be at the next control sample."""
        return self.ugv_links is not None and self.ugv_links.delay_s > 0.0 and not self.asynchronous

    @property
    def asynchronous(self) -> bool:
        """Whether UGVs act on old positions of each other."""
        return self.control.law == "asynchronous"

    @property
    def late_samples(self) -> int:
        """After how many control samples a position arrives at the UGVs that act on old ones."""
        late_s = self.ugv_links.delay_s if self.ugv_links and self.asynchronous else 0.0
        return math.ceil(late_s / self.control.period_s * (1.0 - 1e-9))

    @property
    def unsure_s(self) -> float:
        """How long UGVs reckon with any motion of others: the age of positions that all arrive, and a period; or 0."""
        return (self.late_samples + 1) * self.control.period_s if self.asynchronous else 0.0

    @property
    def stands(self) -> bool:
        """Whether robots stand where their inequalities contradict one another."""
        return self.position_error_m > 0.0 or self.asynchronous

    @property
    def own_views(self) -> bool:
        """Whether each robot acts on its own, inexact measurements of the other robots."""
        return self.position_error_m > 0.0 and self.sensing is not None and not self.sensing.shared

    def seen(self, robot: str) -> dict[str, Any]:
        """What the bounds of a robot's motion say about what is known: `error_m`, `may_stand` and `own_views`."""
        lossy = self.ugv_links is not None and self.ugv_links.loss > 0.0 and not self.asynchronous
        may_stand = lossy and robot in self.ugvs
        return {"error_m": self.position_error_m, "may_stand": may_stand, "own_views": self.own_views}

    @property
    def barriers(self) -> dict[str, Obstacle]:
        """The obstacles, the map and the walls of the arena, by name."""
        bodies = dict(self.obstacles)
        if (given := self.map) is not None and given.cells is not None and given.cells.rectangles:
            bodies[MAP] = MapObstacle(
                known_to_uav=given.known_to_uav, height_m=given.height_m, distance_m=given.distance_m, cells=given.cells
            )
        if self.arena_m:
            (ax, bx), (ay, by) = (sorted(axis) for axis in zip(*self.arena_m, strict=True))
            corners = [[ax, ay], [bx, ay], [bx, by], [ax, by], [ax, ay]]
            walls = zip(("south", "east", "north", "west"), pairwise(corners), strict=True)
            bodies |= {f"{ARENA}{side}": Obstacle(segment_m=list(wall), height_m=ENDLESS_M) for side, wall in walls}
        return bodies

    @property
    def aerial(self) -> dict[str, Uav]:
        """The UAVs, by name, whether they are in `uav` or in `uavs`."""
        return dict(self.uavs) or ({self.uav.name: self.uav} if self.uav else {})

    @property
    def robots(self) -> dict[str, Ugv | Uav]:
        """The UGVs and then the UAVs, by name."""
        return {**self.ugvs, **self.aerial}

    def in_charge(self, uav: str) -> tuple[str, ...]:
        """The UGVs that a UAV is in charge of, in their order."""
        listed = self.aerial[uav].ugvs
        return tuple(ugv for ugv in self.ugvs if ugv in listed or not listed)

    @property
    def lost_s(self) -> dict[str, float]:
        """When the UAV in charge of each UGV is lost, s, by UGV in their order; infinite: never."""
        lost = {ugv: robot.lost_at_s or math.inf for uav, robot in self.aerial.items() for ugv in self.in_charge(uav)}
        return {ugv: lost[ugv] for ugv in self.ugvs}

    def kind_of(self, name: str) -> Kind:
        """What the body of this name is.

        Raises:
            KeyError: if there is no such body.
        """
        if name in self.ugvs:
            return "ugv"
        if name in self.aerial:
            return "uav"
        if name in self.obstacles or name in self.barriers:
            return "obstacle"
        raise KeyError(name)

    def pair_of(self, first: str, second: str) -> str:
        """The kind of a pair of robots: `ugv`, `uav` or `air_ground`; with `_m` the key of its safe distance."""
        kinds = {self.kind_of(first), self.kind_of(second)}
        return "air_ground" if len(kinds) == 2 else kinds.pop()

    def key_of(self, name: str) -> str:
        """The key of a body in a scenario file; walls of the arena count as obstacles."""
        kind = self.kind_of(name)
        if name == MAP and kind == "obstacle" and name not in self.obstacles:
            return MAP
        return "uav" if kind == "uav" and not self.uavs else f"{kind}s.{name}"

    @property
    def bodies(self) -> dict[str, Ugv | Uav | Obstacle]:
        """The robots and then the obstacles, by name."""
        return {**self.robots, **self.barriers}

    def __repr__(self) -> str:
        """One line with the numbers of robots and obstacles, and the runs."""
        uavs = f"{len(self.uavs)} UAVs" if self.uavs else "the UAV"
        things = f"{len(self.ugvs)} UGVs, {uavs}, {len(self.obstacles)} obstacles"
        return f"<Scenario {self.name!r}: {things}, runs {', '.join(self.runs)}>"
