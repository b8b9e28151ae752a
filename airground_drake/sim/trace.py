"""The record of a run: what happened and what each component acted on; saved and loaded.

`states` has a row at the end of each of the simulator's steps: all control periods, and the isolated event times in
between. Its values are true values just before the row's time, so an event at the last row's time may be missing. Rows
closer than 1e-9 s are merged. Between two rows robots move on straight lines, and noise is linear. A user's plant
need not: its rows are those of an integrator with error control.

    t_s
    <body>.x_m .y_m .z_m                      position of a robot, or of an obstacle that moves, world frame
    <robot>.<signal>                          of a robot that is not where the law steers it: what its plant records.
                                              x_m, y_m and z_m are then those of the steered point (of a unicycle, the
                                              chord of its hand point's way), body_x_m, body_y_m and body_z_m those of
                                              the body; of a unicycle also heading_rad (it does not jump), of a lag
                                              body_vx_m_s, body_vy_m_s and body_vz_m_s. Of a user's plant x_m, y_m
                                              and z_m are the steered point itself, and there is a heading_rad if it
                                              has one
    <ugv>.noise_m                             integrated noise of (15)
    <ugv>.decision_variable_m                 x, input of the trigger: ||rho_rd - rho|| + noise, unless another
                                              block computes it
    <ugv>.mode                                0 supervising, 1 intervening, 2 refractory
    <ugv>.triggers                            number of triggers so far
    <ugv>.triggered_at_s .released_at_s       time of the last trigger and release, -1 before the first

`samples` has a row per control sample, at the time of a row of `states`: what each controller acted on, and what it
chose, which is held until the next sample.

    t_s
    <robot>.vx_m_s .vy_m_s .vz_m_s            command chosen at this sample; of a unicycle, as it was shortened
    <ugv>.ref_x_m .ref_y_m .ref_z_m           preset trajectory rho_rd(t)
    <ugv>.ref_vx_m_s .ref_vy_m_s .ref_vz_m_s  its velocity
    <ugv>.executing                           number of the proposal executed from this sample on, -1 without one
    <robot>.seen_x_m .seen_y_m .seen_z_m      only with `sensing` or `channel.ugvs.delay_s`: its published position,
                                              which robots act on
    <robot>.saw_<other>_x_m ... _z_m          only with `sensing.shared: false`: where it measured another robot
    <ugv>.heard_<other>_s                     only with `channel.ugvs.loss` or `control.law: asynchronous`: the sample
                                              at which another UGV published the last position that this one has of it
    <ugv>.uav_saw_x_m .uav_saw_y_m .uav_saw_z_m  only with `sensing`: where the UAV saw it, to plan with
    <ugv>.command_share                       only with unicycles: the share that was left of the law's command
    <robot>.drift_m_s .cover_m                only of users' plants, in the period that begins here: by how much
                                              the steered point missed its command, per time; and how far the body was
                                              from the straight line of that point at most, at the rows
"""

import io
import json
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import wraps
from math import ceil
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np
import pandas as pd

from airground_drake.base import files
from airground_drake.base.arrays import Array, Indices, read_only
from airground_drake.base.errors import TraceError
from airground_drake.base.values import NAME_PATTERN
from airground_drake.model.bodies.motion import SAME_S
from airground_drake.model.plants.plant import Plant
from airground_drake.scenario.plants import plant_of
from airground_drake.scenario.recorded import of_run
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.collisions import first_collisions
from airground_drake.sim.tables import (
    MESSAGE_COLUMNS,
    PLAN_COLUMNS,
    PROBLEM_ARRAYS,
    PROBLEM_SCALARS,
    PROPOSAL_COLUMNS,
    SCHEMA,
    SEEN_COLUMNS,
    TABLES,
    listed,
    typed,
)

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True, repr=False)
class Trace:
    """One run.

    Values read from its tables are cached. To change a table, make another run with `dataclasses.replace`;
    `judge` and `judge_all` read them anew.

    Attributes:
        meta: strict JSON: `schema`, `run` (identifier), `method`, `composition`, `seed`, `robots`, `ugvs`
            (names, array order; UAVs are the last robots), `zeta_m` (threshold in force), `scenario` (the
            resolved scenario as nested dicts), `events` (list, by time), `controllers` (what the controllers were
            built with, read back from the diagram: see `sim.blocks.controllers.read_back`), `decision_block` (name of
            the class that computes the decision variables, read back from the diagram; empty for that of (15)),
            `faults` (list of errors in policies: `t_s`, `robot`, `policy`, `what`; the first of a policy may have a
            `traceback`).
        states, samples: see the module's docstring.
        decisions: see DECISION_COLUMNS.
        problems: see PROBLEM_ARRAYS.
        proposals: see PROPOSAL_COLUMNS.
        messages: see MESSAGE_COLUMNS.
        plans: see PLAN_COLUMNS.
        seen: see SEEN_COLUMNS.
        timings: what may differ between identical runs: `wall_s`, duration of the run by the clock, and
            `decision_times_s`, CPU time of each row of `decisions`, in order.
    """

    meta: dict[str, Any]
    states: pd.DataFrame
    samples: pd.DataFrame
    decisions: pd.DataFrame
    timings: dict[str, Any] = field(default_factory=dict, compare=False)
    problems: pd.DataFrame = field(default_factory=lambda: listed([], (*PROBLEM_SCALARS, *PROBLEM_ARRAYS)))
    proposals: pd.DataFrame = field(default_factory=lambda: listed([], PROPOSAL_COLUMNS))
    messages: pd.DataFrame = field(default_factory=lambda: typed([], MESSAGE_COLUMNS))
    plans: pd.DataFrame = field(default_factory=lambda: typed([], PLAN_COLUMNS, "sent"))
    seen: pd.DataFrame = field(default_factory=lambda: typed([], SEEN_COLUMNS))
    _read: dict[tuple[str, str], Array] = field(default_factory=dict, init=False, repr=False, compare=False)
    _derived: dict[Any, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def run(self) -> str:
        """Identifier of the run in its scenario."""
        return str(self.meta["run"])

    @property
    def robots(self) -> list[str]:
        """Names of all robots: the UGVs, then the UAVs."""
        return list(self.meta["robots"])

    @property
    def ugvs(self) -> list[str]:
        """Names of the UGVs."""
        return list(self.meta["ugvs"])

    @property
    def uavs(self) -> list[str]:
        """Names of the UAVs: the robots that are not UGVs."""
        return [name for name in self.robots if name not in self.ugvs]

    @property
    def scenario(self) -> Scenario:
        """The resolved scenario as this run had it, made from the metadata once.

        Raises:
            TraceError: if the metadata hold no scenario.
        """
        return self.derived("scenario", lambda: of_run(self.meta["scenario"], self.run))

    @property
    def events(self) -> list[dict[str, Any]]:
        """Events by time: `t_s`, `robot`, `kind`, `position_m`, and further entries of the kind."""
        return list(self.meta["events"])

    @property
    def t(self) -> Array:
        """Times of the rows, (T,), s."""
        return self.column("t_s")

    def column(self, name: str) -> Array:
        """One column of `states` as float64, (T,), read-only and cached.

        Raises:
            TraceError: if it is missing or not finite.
        """
        return self._column("states", name)

    def sampled(self, name: str) -> Array:
        """One column of `samples` as float64, (S,), read-only and cached; raises as `column`."""
        return self._column("samples", name)

    def _column(self, of: str, name: str) -> Array:
        if (of, name) in self._read:
            return self._read[of, name]
        table: pd.DataFrame = getattr(self, of)
        if name not in table:
            raise TraceError(f"run {self.meta.get('run')}: the trace has no column {name!r} in its {of}")
        values = table[name].to_numpy(dtype=np.float64, copy=True)
        if not np.isfinite(values).all():
            raise TraceError(f"run {self.meta.get('run')}: column {name!r} has values that are not finite")
        values.setflags(write=False)
        self._read[of, name] = values
        return values

    def derived(self, key: Any, work_out: Callable[[], T]) -> T:
        """The value of `work_out`, computed once per key: several claims need the same."""
        if key not in self._derived:
            self._derived[key] = work_out()
        value: T = self._derived[key]
        return value

    def _vectors(self, column: Callable[[str], Array], robot: str, stem: str, unit: str) -> Array:
        """Three columns side by side, (., 3), read-only."""
        names = [f"{robot}.{stem}{axis}_{unit}" for axis in "xyz"]
        return self.derived(("vectors", *names), lambda: read_only(np.column_stack([column(name) for name in names])))

    def position(self, body: str) -> Array:
        """Positions of an obstacle that moves, or of the point of a robot that the law steers, (T, 3), m, world frame.

        That point is the robot's body unless its plant records another place: see `body`.
        """
        return self._vectors(self.column, body, "", "m")

    def body(self, robot: str) -> Array:
        """Positions of the body of a robot, or of an obstacle that moves, (T, 3), m, world frame."""
        return self._vectors(self.column, robot, "body_", "m") if self.is_apart(robot) else self.position(robot)

    def heading(self, robot: str) -> Array | None:
        """Headings of a robot whose plant records them, (T,), rad, counter-clockwise from x; else None."""
        name = f"{robot}.heading_rad"
        return self.column(name) if name in self.states else None

    def plant(self, robot: str) -> Plant:
        """How a robot moves, by its scenario."""
        of = self.scenario.robots[robot], self.scenario.control.period_s
        return self.derived(("plant", robot), lambda: plant_of(*of))

    def signals(self, robot: str) -> Array:
        """What the plant of a robot records, its place first, (T, k)."""
        names = [f"{robot}.{name}" for name in self.plant(robot).signals]
        if not names:
            return self.position(robot)
        return self.derived(("signals", robot), lambda: read_only(np.column_stack([self.column(n) for n in names])))

    def is_apart(self, robot: str) -> bool:
        """Whether the body of a robot is recorded apart from the point that the law steers."""
        return f"{robot}.body_x_m" in self.states

    def there_from(self, name: str) -> int:
        """Row from which on a body is there: the first control sample at or after an obstacle's `appears_s`, or row 0.

        The number of rows if there is no such sample before it disappears or before the end: then nothing of the run is
        about the body.
        """
        obstacle = self.scenario.obstacles.get(name)
        row = self._row_of(obstacle.appears_s) if obstacle else 0
        return row if row < self.there_until(name) else len(self.t)

    def there_until(self, name: str) -> int:
        """Row up to which a body is there: that of the first sample at or after its `disappears_s`, or the last row."""
        obstacle = self.scenario.obstacles.get(name)
        return min(self._row_of(obstacle.disappears_s or np.inf), len(self.t) - 1) if obstacle else len(self.t) - 1

    def _row_of(self, t_s: float) -> int:
        """Row of the first control sample at or after a time, s; after the last sample, the number of rows."""
        period = self.scenario.control.period_s
        if not np.isfinite(t_s):
            return len(self.t)
        return int(np.searchsorted(self.t, period * ceil((t_s - SAME_S) / period) - SAME_S)) if t_s else 0

    @property
    def sample_rows(self) -> Indices:
        """Rows of `states` at the control samples, (S,).

        Raises:
            TraceError: if a sample is not at the time of a row.
        """
        return self.derived("sample rows", self._sample_rows)

    def _sample_rows(self) -> Indices:
        samples = self.sampled("t_s")
        rows = np.searchsorted(self.t, samples)
        if (rows >= len(self.t)).any() or (self.t[rows] != samples).any():
            raise TraceError(f"run {self.meta.get('run')}: a control sample is at the time of no row of the states")
        return rows

    def _held(self, values: Array, before: float) -> Array:
        """Values chosen at the samples, (S, ...), as in force up to each row, (T, ...); `before` the first sample."""
        last = np.cumsum(np.bincount(self.sample_rows + 1, minlength=len(self.t) + 1))[: len(self.t)]
        return np.concatenate([np.full((1, *values.shape[1:]), before), values])[last]

    def chosen(self, robot: str) -> Array:
        """Commands chosen at the control samples, (S, 3), m/s."""
        return self._vectors(self.sampled, robot, "v", "m_s")

    def command(self, robot: str) -> Array:
        """Commands in force up to each row, (T, 3), m/s; 0 at the first."""
        return self.derived(("command", robot), lambda: read_only(self._held(self.chosen(robot), 0.0)))

    def executing(self, ugv: str) -> Array:
        """Number of the proposal that a UGV executes up to each row, (T,), -1 without one."""
        return self.derived(("executing", ugv), lambda: read_only(self._held(self.sampled(f"{ugv}.executing"), -1.0)))

    def reference(self, ugv: str) -> Array:
        """Preset trajectory at the control samples, (S, 3), m."""
        return self._vectors(self.sampled, ugv, "ref_", "m")

    def reference_rate(self, ugv: str) -> Array:
        """Velocity of the preset trajectory at the control samples, (S, 3), m/s."""
        return self._vectors(self.sampled, ugv, "ref_v", "m_s")

    def as_seen(self, by: str, of: str) -> Array:
        """Where a robot saw a body at the control samples, (S, 3), m.

        That is the body's true place, unless `seen` says otherwise or robots act on measured positions.

        Raises:
            TraceError: if a row of `seen` is not at the time of a control sample.
        """
        if self.scenario.publishes and of in self.robots:
            if by != of and by in self.robots and self.scenario.own_views:
                return self._vectors(self.sampled, by, f"saw_{of}_", "m")
            return self._vectors(self.sampled, of, "seen_", "m")
        places = self.position(of)[self.sample_rows]
        mine = self.seen[(self.seen["by"] == by) & (self.seen["of"] == of)]
        if len(mine):
            places = places.copy()
            samples, times = self.sampled("t_s"), mine["t_s"].to_numpy(dtype=np.float64)
            if not np.isin(times, samples).all():
                raise TraceError(f"run {self.meta.get('run')}: {by} saw {of} at a time that is no control sample")
            at = np.searchsorted(samples, times)
            places[at] = mine[["x_m", "y_m", "z_m"]].to_numpy(dtype=np.float64)
        return places

    def rows_before(self, t_s: float) -> int:
        """Number of rows before a time, s; at least one."""
        return max(1, int(np.searchsorted(self.t, t_s)))

    def counting_rows(self, robot: str) -> int:
        """Number of rows that count for a robot: those before its first collision. The model lets it drive on."""
        return self.rows_before(first_collisions(self.events).get(robot, {"t_s": np.inf})["t_s"])

    def to_pandas(self) -> pd.DataFrame:
        """The states as a new table: a row per time, the index `t_s`; columns by robot, then by signal."""
        table = self.states.set_index("t_s")
        parts = [tuple(str(name).split(".", 1)) for name in table]
        table.columns = pd.MultiIndex.from_tuples(parts, names=["robot", "signal"])
        return table

    def __repr__(self) -> str:
        scenario, events = self.meta.get("scenario", {}).get("name"), self.meta.get("events", [])
        return f"<Trace: run {self.meta.get('run')!r} of {scenario!r}, {len(self.states)} rows, {len(events)} events>"


def per_trace(work_out: Callable[Concatenate[Trace, P], T]) -> Callable[Concatenate[Trace, P], T]:
    """A function that works something out once per trace and arguments; these are hashable."""

    @wraps(work_out)
    def known(trace: Trace, /, *about: P.args, **named: P.kwargs) -> T:
        key = work_out.__module__, work_out.__qualname__, *about, *named.items()
        return trace.derived(key, lambda: work_out(trace, *about, **named))

    return known


def save(trace: Trace, folder: Path) -> list[str]:
    """Write a Parquet file per table, `timings.json`, then `meta.json` with digests.

    Each file is written atomically and `meta.json` last, so that `load` recognises an interrupted save.

    Returns:
        The names of the files.

    Raises:
        OSError: if the folder cannot be written.
        ValueError: if `meta` holds a number that is not finite.
    """
    tables = {f"{name}.parquet": getattr(trace, name) for name in TABLES}
    digests = {}
    for name, table in tables.items():
        buffer = io.BytesIO()
        table.to_parquet(buffer, index=False)
        digests[name] = files.sha256(buffer.getvalue())
        files.write_bytes(folder / name, buffer.getvalue())
    files.write_json(folder / "timings.json", trace.timings)
    files.write_json(folder / "meta.json", {**trace.meta, "files": digests})
    return [*tables, "timings.json", "meta.json"]


def load(folder: Path, run: str = "") -> Trace:
    """Load a saved trace.

    Args:
        folder: of the trace.
        run: that it must be of; default: any.

    Raises:
        TraceError: if it has another schema, is of another run or its run has no plain name, or a file is missing,
            unreadable, or differs from its digest in `meta.json`.
    """
    try:
        meta = json.loads(files.read_text(folder / "meta.json"))
        if meta.get("schema") != SCHEMA:
            raise TraceError(f"{folder}: schema {meta.get('schema')!r}, this version reads {SCHEMA!r}: simulate again")
        if not re.fullmatch(NAME_PATTERN, meta["run"]):  # files are named after it
            raise TraceError(f"{folder}: its run is {meta['run']!r}; allowed: a name of letters, digits and _")
        if run not in ("", meta["run"]):
            raise TraceError(f"{folder}: its run is {meta['run']!r}; wanted: {run!r}")
        timings = json.loads(files.read_text(folder / "timings.json"))
        digests, tables = meta.pop("files"), {}
        for name in TABLES:
            path = folder / f"{name}.parquet"
            data = files.read_bytes(path)
            if files.sha256(data) != digests[path.name]:
                raise TraceError(f"{path}: its SHA-256 is not the one recorded in meta.json")
            tables[name] = files.read_table(data)
        return Trace(meta, timings=timings, **tables)
    except OSError as error:
        raise TraceError(f"{error.filename}: {error.strerror}; wanted: a file of a saved run") from error
    except (LookupError, TypeError, ValueError, AttributeError, RecursionError) as error:
        raise TraceError(f"{folder}: not a readable trace: {error}") from error
