"""The scenario file as dataclasses: every key, its unit (in the key's name) and its meaning.

pydrake's YAML reader fills them (`load.py`), which is why they are mutable and use lists: after loading and
validation (`validate.py`) nothing changes them. Positions are in the world frame, z up, the ground at z = 0.
"""

# No `from __future__ import annotations` here: pydrake's reader needs the types themselves, not their names.
from dataclasses import dataclass, field

Vector = list[float]


REQUIRED = {"required": True}
"""Of a key that a scenario must have; what stands there before is what pydrake needs."""

FROM_ZERO = {"from_zero": True}
"""Of a number that may be 0; every other number of the schema must be positive."""


@dataclass
class Preset:
    """Preset trajectory rho_rd of a UGV: a polyline travelled at constant speed from t = 0, then held."""

    waypoints_m: list[Vector] = field(default_factory=list, metadata=REQUIRED)
    speed_m_s: float = 1.0


@dataclass
class Ugv:
    """One UGV: a planar first-order robot, a disc of radius `radius_m` on the ground."""

    start_m: Vector = field(default_factory=list, metadata=REQUIRED)
    target_m: Vector = field(default_factory=list, metadata=REQUIRED)
    preset: Preset = field(default_factory=Preset, metadata=REQUIRED)
    max_speed_m_s: float = 6.0
    radius_m: float = field(default=0.0, metadata=FROM_ZERO)


@dataclass
class Uav:
    """The UAV: a spatial first-order robot whose `task` is to fly over the centroid of the UGVs, eqs (9)-(10).

    Another task is named as `module:Class`. `phantoms_m` are obstacles on its map that are not there, points without a
    radius. Its own body is a ball of radius `radius_m`.
    """

    name: str = "uav"
    start_m: Vector = field(default_factory=list, metadata=REQUIRED)
    target_m: Vector = field(default_factory=list, metadata=REQUIRED)
    altitude_m: float = 2.0
    task: str = "formation"
    max_speed_m_s: float = 10.0
    phantoms_m: list[Vector] = field(default_factory=list)
    radius_m: float = field(default=0.0, metadata=FROM_ZERO)


@dataclass
class Obstacle:
    """A ball to keep away from by the safe distance of (7)-(8); a point with the default radius."""

    position_m: Vector = field(default_factory=list, metadata=REQUIRED)
    known_to_uav: bool = True
    radius_m: float = field(default=0.0, metadata=FROM_ZERO)


@dataclass
class SafeDistance:
    """Safe distances d of (7)-(8), for each kind of pair, and the distance that counts as a collision.

    They are kept between surfaces: the centres of a pair keep d + (radius + radius), and collide at `collision_m` +
    (radius + radius). All other distances, `control.sensing_range_m` among them, are of centres.
    """

    obstacle_m: float = 2.0
    ugv_m: float = 2.0
    air_ground_m: float = 1.0
    collision_m: float = 0.05


@dataclass
class Control:
    """NSBC controllers of all robots: sampled with zero-order hold."""

    period_s: float = 0.025
    avoidance_gain_1_s: float = field(default=3.0, metadata=FROM_ZERO)
    motion_gain_1_s: float = field(default=2.0, metadata=FROM_ZERO)
    formation_gain_1_s: float = field(default=5.0, metadata=FROM_ZERO)
    intervention_gain_1_s: float = field(default=1.5, metadata=FROM_ZERO)
    sensing_range_m: float = 4.0


@dataclass
class Threshold:
    """Decision threshold zeta: rule 'fixed' takes zeta_m; 'bayes' minimises the Bayes risk (16)-(19)."""

    rule: str = "fixed"
    zeta_m: float = 3.0
    c1_1_s: float = 0.5
    c2: float = 1.0
    drift_m_s: float = 6.05
    noise_m_sqrt_s: float = 10.0


@dataclass
class Decision:
    """DDM (15) and event trigger: 'automaton' (hysteresis, minimum inter-event time) or 'bare' (the paper's)."""

    threshold: Threshold = field(default_factory=Threshold)
    trigger: str = "automaton"
    release_m: float = 1.5
    min_inter_event_s: float = field(default=0.5, metadata=FROM_ZERO)
    noise_m_sqrt_s: float = field(default=0.0, metadata=FROM_ZERO)
    leak_1_s: float = field(default=0.0, metadata=FROM_ZERO)
    noise_period_s: float = 0.025


@dataclass
class Policy:
    """One entry of the UAV's behaviour database: a policy's name and its numbers."""

    name: str = field(default_factory=str, metadata=REQUIRED)
    parameters: dict[str, float] = field(default_factory=dict)


@dataclass
class Intervention:
    """The UAV's intervention behaviours; how often it plans, and how long it rests after a refusal.

    `ranking` is 'listed' (in the order of the list) or 'predicted' (best predicted outcome on the UAV's map
    first). A policy that takes longer than `budget_s` for a proposal counts as proposing nothing; one that bounds its
    effort in counts, such as `coordinate`, is not timed (one of others is, after a minute).
    """

    period_s: float = 0.05
    retry_s: float = field(default=1.0, metadata=FROM_ZERO)
    ranking: str = "predicted"
    budget_s: float = 2.0
    policies: list[Policy] = field(default_factory=list)


@dataclass
class Gatekeeper:
    """The accept/refuse decision, eqs (21)-(29).

    Under method (c) a decision on a proposal is reversed only for a plan that is cheaper by the (relative) switching
    margin, and not before `min_dwell_s` have passed. A decision may take `budget_iterations` of a solver and
    `budget_nodes` of a search (budget 'counted': a run is the same on every machine), or besides the share
    `budget_share` of the sampling period by the clock (budget 'wall_clock': for real time). `terminal_weight_s` is the
    w of a terminal cost w a ||rho_rd - rho_N||^2 besides (25); the paper has none.

    Under method (d) outcomes are compared instead, `settling_s` past the end of motion and preset trajectory. An
    accepted proposal is executed for `longest_s` at most, and given back when the UGV has been farther behind it than
    predicted, by more than `lag_m`, for `behind_s`. A UGV accepts `tries` proposals, and then none until it has been
    on its own for `rest_s`.
    """

    route: str = "relaxed"
    period_s: float = 0.05
    horizon_s: float = 3.0
    stages: int = 60
    error_weight_1_m2_s: float = 1.0
    slack_weight_1_m2_s: float = field(default=1000.0, metadata=FROM_ZERO)
    terminal_weight_s: float = field(default=0.0, metadata=FROM_ZERO)
    switching_margin: float = field(default=0.05, metadata=FROM_ZERO)
    min_dwell_s: float = field(default=0.2, metadata=FROM_ZERO)
    budget: str = "counted"
    budget_iterations: int = 100
    budget_nodes: int = 15000
    budget_share: float = 0.5
    longest_s: float = 30.0
    settling_s: float = 10.0
    tries: int = 5
    rest_s: float = 5.0
    lag_m: float = 0.5
    behind_s: float = 2.0


@dataclass
class Run:
    """One simulation: a method (see `registry.METHODS`) and what is expected of it.

    `stalls_m` names the UGVs that must end (to within `stall_tolerance_m`) at that point short of their
    target. `expected` maps claim identifiers to the expected verdict; a claim not named must hold. Where
    there is no guarantee, "holds or refuted" admits either. `exercised` is "holds, and something put it to the test".
    """

    method: str = field(default_factory=str, metadata=REQUIRED)
    composition: str = "augmented"
    stalls_m: dict[str, Vector] = field(default_factory=dict)
    expected: dict[str, str] = field(default_factory=dict)


@dataclass
class Reproduction:
    """One row of the reproduction table: a measure of a run against the paper's value.

    `calibrated`: something that the paper leaves open was chosen so that the value comes out. `ambiguous` is another
    way to read the paper: the row is then neither reproduced nor not.
    """

    id: str = field(default_factory=str, metadata=REQUIRED)
    quantity: str = field(default_factory=str, metadata=REQUIRED)
    measure: str = field(default_factory=str, metadata=REQUIRED)
    run: str = field(default_factory=str, metadata=REQUIRED)
    robot: str = field(default_factory=str, metadata=REQUIRED)
    paper: list[float] = field(default_factory=list, metadata=REQUIRED)
    unit: str = ""
    tolerance: float = field(default=0.0, metadata=FROM_ZERO)
    calibrated: bool = False
    why: str = ""
    ambiguous: str = ""


@dataclass
class Choice:
    """Where a value that is not the paper's comes from: `source` is 'calibrated' or 'ours'."""

    key: str = field(default_factory=str, metadata=REQUIRED)
    source: str = field(default_factory=str, metadata=REQUIRED)
    paper: str = ""
    reason: str = field(default_factory=str, metadata=REQUIRED)


@dataclass
class Scenario:
    """A scenario file. The order of `ugvs` and `obstacles` is the order of all arrays.

    `expected` maps identifiers of claims about the model (proofs and experiments, whatever the run) to the
    expected verdict; one that is not named must be proved, or supported if it is statistical. `claims` adds claims
    to those of the package: `module:Class` by identifier.
    """

    name: str = field(default_factory=str, metadata=REQUIRED)
    title: str = ""
    description: str = ""
    seed: int = 0
    duration_s: float = 30.0
    arrival_tolerance_m: float = 0.1
    stall_tolerance_m: float = 0.1
    ugvs: dict[str, Ugv] = field(default_factory=dict, metadata=REQUIRED)
    uav: Uav = field(default_factory=Uav, metadata=REQUIRED)
    obstacles: dict[str, Obstacle] = field(default_factory=dict)
    safe_distance: SafeDistance = field(default_factory=SafeDistance)
    control: Control = field(default_factory=Control)
    decision: Decision = field(default_factory=Decision)
    intervention: Intervention = field(default_factory=Intervention)
    gatekeeper: Gatekeeper = field(default_factory=Gatekeeper)
    runs: dict[str, Run] = field(default_factory=dict, metadata=REQUIRED)
    claims: dict[str, str] = field(default_factory=dict)
    expected: dict[str, str] = field(default_factory=dict)
    reproduction: list[Reproduction] = field(default_factory=list)
    choices: list[Choice] = field(default_factory=list)
