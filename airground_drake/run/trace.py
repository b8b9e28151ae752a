"""The record of a run: signals, events, gatekeeper decisions; saved and loaded.

Rows of `signals` are the ends of the simulator's steps: all control periods, and the isolated event times in
between. A row's command is the velocity that was applied between the previous row and this one, so that
position[k] = position[k-1] + (t[k] - t[k-1]) * command[k]: between rows every robot moves on a straight line.
The other held signals (mode, accepted, ...) are likewise those in force just before the row's time, so an event
at the last row's time may be missing. Noise is linear between rows. Row 0's command means nothing.

Columns (units in the names; one set per robot or UGV):
    t_s
    <robot>.x_m .y_m .z_m                     position, world frame
    <robot>.vx_m_s .vy_m_s .vz_m_s            command in force up to this row
    <ugv>.ref_x_m .ref_y_m .ref_z_m           preset trajectory rho_rd(t)
    <ugv>.noise_m                             integrated noise of (15)
    <ugv>.decision_variable_m                 x, input of the trigger: ||rho_rd - rho|| + noise, unless another
                                              block computes it
    <ugv>.mode                                0 supervising, 1 intervening, 2 refractory
    <ugv>.triggers                            number of triggers so far
    <ugv>.triggered_at_s .released_at_s       time of the last trigger and release, -1 before the first
    <ugv>.accepted                            1 while an intervention is accepted

Rows closer than 1e-9 s are merged.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from math import ceil
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pandas as pd

from airground_drake.base import files
from airground_drake.base.arrays import Array, read_only
from airground_drake.base.errors import TraceError, one_line
from airground_drake.run.collisions import first_collisions
from airground_drake.scenarios.recorded import of_run
from airground_drake.scenarios.schema import Scenario
from airground_drake.world.motion import SAME_S

T = TypeVar("T")

SCHEMA = "airground_drake.trace/7"

DECISION_COLUMNS = {
    "t_s": "float64",
    "robot": "str",
    "policy": "str",
    "number": "int64",
    "issued_s": "float64",
    "decision": "str",
    "reason": "str",
    "status": "str",
    "route": "str",
    "first_stage": "str",
    "relaxed_first_stage": "float64",
    "objective": "float64",
    "route_bound": "float64",
    "gap": "float64",
    "objective_accept": "float64",
    "objective_refuse": "float64",
    "accept_throughout": "float64",
    "refuse_throughout": "float64",
    "rounding_deviation_s": "float64",
    "predicted_clearance_m": "float64",
    "refuse_outcome_m2_s": "float64",
    "accept_outcome_m2_s": "float64",
    "refuse_stalls": "float64",
    "accept_stalls": "float64",
    "refuse_left_m": "float64",
    "accept_left_m": "float64",
    "tries": "float64",
}
"""Columns of `Trace.decisions`, one row per robot and gatekeeper call; -1 where a number does not apply. `number` is
that of the proposal in `Trace.proposals`. Columns up to `predicted_clearance_m` belong to decisions by problem (26),
the others to decisions by outcomes: the outcome of either choice by `gatekeeper.outcome` (cost, 1 if the UGV comes to
rest short of its goal, way left), and the number of tries since the UGV last rested."""

PROBLEM_SCALARS = ("dt_s", "error_weight_1_m2_s", "slack_weight_1_m2_s", "terminal_weight_s")
PROBLEM_ARRAYS = (
    "initial_m", "accept_m_s", "refuse_m_s", "reference_m", "centres_m", "distances_m",
    "plan", "positions_m", "relaxed", "rounded", "normals",
)  # fmt: skip
"""Columns of `Trace.problems` (empty under method (d)): the data of (26) for each row of `decisions`, and the result of
the route. Arrays are flattened in C order: initial (3), accept, refuse and reference (N x 3), centres and normals
(N x m x 3), distances (m), plan, relaxed and rounded omega (N), positions of the plan (N x 3). An array that the route
does not give is empty. The normals are those of the half-planes of `route_bound`."""

PROPOSAL_COLUMNS = (
    "number", "robot", "policy", "issued_s", "times_s", "positions_m", "selection", "mapped_m", "mapped_radius_m",
    "cause", "party",
)  # fmt: skip
"""Columns of `Trace.proposals`, one row per proposal sent; arrays are flattened in C order:
- number: identifies the proposal; counts from 0 in the order of sending.
- robot, policy, issued_s: its UGV, its policy, the time of sending.
- times_s (M), positions_m (M x 3): vertices of the requested motion.
- selection (m x 3): J_int of (12)-(14), the directions that the motion concerns.
- mapped_m (k x 3), mapped_radius_m (k): centres and radii of the obstacles on the UAV's map.
- cause: the UGV whose trigger led to it: this UGV, or another UGV for which it makes way.
- party: indices in `ugvs` of all UGVs in the same joint plan; empty if the proposal stands alone."""


TABLES = ("signals", "decisions", "problems", "proposals")
"""Attributes of `Trace` that are tables, each saved as a Parquet file of its name."""


@dataclass(frozen=True, repr=False)
class Trace:
    """One run.

    Values read from its tables are cached. To change a table, make another run with `dataclasses.replace`;
    `verify` and `verify_all` read them anew.

    Attributes:
        meta: strict JSON: `schema`, `run` (identifier), `method`, `composition`, `seed`, `robots`, `ugvs`
            (names, array order; the UAV is the last robot), `zeta_m` (threshold in force), `scenario` (the
            resolved scenario as nested dicts), `events` (list, by time), `controllers` (what the controllers were
            built with, read back from the diagram: see `systems.controllers.read_back`), `decision_block` (name of
            the class that computes the decision variables, read back from the diagram; empty for that of (15)),
            `faults` (list of errors in policies: `t_s`, `robot`, `policy`, `what`; the first of a policy may have a
            `traceback`).
        signals: see the module's docstring.
        decisions: see DECISION_COLUMNS.
        problems: see PROBLEM_ARRAYS.
        proposals: see PROPOSAL_COLUMNS.
        timings: what may differ between identical runs: `wall_s`, duration of the run by the clock, and
            `decision_times_s`, CPU time of each row of `decisions`, in order.
    """

    meta: dict[str, Any]
    signals: pd.DataFrame
    decisions: pd.DataFrame
    timings: dict[str, Any] = field(default_factory=dict, compare=False)
    problems: pd.DataFrame = field(default_factory=lambda: pd.DataFrame(columns=[*PROBLEM_SCALARS, *PROBLEM_ARRAYS]))
    proposals: pd.DataFrame = field(default_factory=lambda: pd.DataFrame(columns=list(PROPOSAL_COLUMNS)))
    _read: dict[str, Array] = field(default_factory=dict, init=False, repr=False, compare=False)
    _derived: dict[Any, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def run(self) -> str:
        """Identifier of the run in its scenario."""
        return str(self.meta["run"])

    @property
    def robots(self) -> list[str]:
        """Names of all robots: the UGVs, then the UAV."""
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
        """One column as float64, (T,), read-only and cached.

        Raises:
            TraceError: if it is missing or not finite.
        """
        if name in self._read:
            return self._read[name]
        if name not in self.signals:
            raise TraceError(f"run {self.meta.get('run')}: the trace has no column {name!r}")
        values = self.signals[name].to_numpy(dtype=np.float64, copy=True)
        if not np.isfinite(values).all():
            raise TraceError(f"run {self.meta.get('run')}: column {name!r} has values that are not finite")
        values.setflags(write=False)
        self._read[name] = values
        return values

    def derived(self, key: Any, work_out: Callable[[], T]) -> T:
        """The value of `work_out`, computed once per key: several claims need the same."""
        if key not in self._derived:
            self._derived[key] = work_out()
        found: T = self._derived[key]
        return found

    def vector(self, robot: str, stem: str = "", unit: str = "m") -> Array:
        """Three columns as (T, 3), read-only: positions by default; stem 'v' and unit 'm_s' for commands, 'ref_'."""
        columns = (f"{robot}.{stem}{axis}_{unit}" for axis in "xyz")
        return self.derived(
            ("vector", robot, stem, unit), lambda: read_only(np.column_stack([self.column(name) for name in columns]))
        )

    def position(self, robot: str) -> Array:
        """Positions, (T, 3), m, world frame."""
        return self.vector(robot)

    def there_from(self, name: str) -> int:
        """Row from which on a body is there: the first control sample at or after an obstacle's `appears_s`, or row 0.

        The number of rows if there is no such sample before the end: then nothing of the run is about the body.
        """
        obstacle = self.scenario.obstacles.get(name)
        if obstacle is None or obstacle.appears_s == 0.0:
            return 0
        period = self.scenario.control.period_s
        row = int(np.searchsorted(self.t, period * ceil((obstacle.appears_s - SAME_S) / period) - SAME_S))
        return row if row < len(self.t) - 1 else len(self.t)

    def command(self, robot: str) -> Array:
        """Commands in force up to each row, (T, 3), m/s."""
        return self.vector(robot, "v", "m_s")

    def reference(self, ugv: str) -> Array:
        """Preset trajectory, (T, 3), m."""
        return self.vector(ugv, "ref_")

    def rows_before(self, t_s: float) -> int:
        """Number of rows before a time, s; at least one."""
        return max(1, int(np.searchsorted(self.t, t_s)))

    def counting_rows(self, robot: str) -> int:
        """Number of rows that count for a robot: those before its first collision. The model lets it drive on."""
        return self.rows_before(first_collisions(self.events).get(robot, {"t_s": np.inf})["t_s"])

    def to_pandas(self) -> pd.DataFrame:
        """The signals as a new table: a row per time, the index `t_s`; columns by robot, then by signal."""
        table = self.signals.set_index("t_s")
        parts = [tuple(str(name).split(".", 1)) for name in table]
        table.columns = pd.MultiIndex.from_tuples(parts, names=["robot", "signal"])
        return table

    def __repr__(self) -> str:
        """Run, scenario, numbers of rows and events in one line."""
        scenario, events = self.meta.get("scenario", {}).get("name"), self.meta.get("events", [])
        return f"<Trace: run {self.meta.get('run')!r} of {scenario!r}, {len(self.signals)} rows, {len(events)} events>"


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


def load(folder: Path) -> Trace:
    """Load a saved trace.

    Raises:
        TraceError: if it has another schema, or a file is missing, unreadable, or differs from its digest in
            `meta.json`.
    """
    try:
        meta = json.loads(files.read_text(folder / "meta.json"))
        if meta.get("schema") != SCHEMA:
            raise TraceError(f"{folder}: schema {meta.get('schema')!r}, this version reads {SCHEMA!r}: simulate again")
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
        raise TraceError(one_line(f"{error.filename}: {error.strerror}; wanted: a file of a saved run")) from error
    except (LookupError, TypeError, ValueError, AttributeError, RecursionError) as error:
        raise TraceError(one_line(f"{folder}: not a readable trace: {error}")) from error
