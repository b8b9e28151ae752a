"""A recorded run: it belongs to the run of the scenario, is complete, and obeys its law of motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd

from .files import Json, parse_table, read_bytes, read_json, sha256
from .nearness import least_apart_m
from .rules import SMALL, Array, NotEstablished, close, holds, same
from .scenario import Levels, Pair, Preset, as_run, levels_of, pairs_of, preset_of, robots_of

Rows = npt.NDArray[np.intp]
SCHEMA = "airground_drake.trace/7"
TABLES = ("signals.parquet", "decisions.parquet", "problems.parquet", "proposals.parquet")
OF_ROBOT = ("x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s")
OF_UGV = (
    "ref_x_m", "ref_y_m", "ref_z_m", "noise_m", "decision_variable_m", "mode", "triggers", "triggered_at_s",
    "released_at_s", "accepted",
)  # fmt: skip
"""Signals of each robot, and of each UGV besides."""
OF_SOLUTIONS = ("status", "route", "first_stage")
"""Columns of decisions that only method (c) fills, in words."""
OF_MPC = (
    "relaxed_first_stage", "objective", "route_bound", "gap", "objective_accept", "objective_refuse",
    "accept_throughout", "refuse_throughout", "rounding_deviation_s", "predicted_clearance_m",
)  # fmt: skip
"""Columns of decisions that method (c) fills: it solves problem (26)."""
OF_OUTCOMES = (
    "refuse_outcome_m2_s", "accept_outcome_m2_s", "refuse_stalls", "accept_stalls", "refuse_left_m", "accept_left_m",
    "tries",
)  # fmt: skip
"""Columns of decisions that method (d) fills: it compares outcomes."""
COLUMNS = {
    "decisions.parquet": (
        "t_s", "robot", "policy", "number", "issued_s", "decision", "reason",
        *OF_SOLUTIONS, *OF_MPC, *OF_OUTCOMES,
    ),
    "problems.parquet": (
        "dt_s", "error_weight_1_m2_s", "slack_weight_1_m2_s", "terminal_weight_s", "initial_m", "accept_m_s",
        "refuse_m_s", "reference_m", "centres_m", "distances_m", "plan", "positions_m", "relaxed", "rounded", "normals",
    ),
    "proposals.parquet": (
        "number", "robot", "policy", "issued_s", "times_s", "positions_m", "selection", "mapped_m", "mapped_radius_m",
        "cause", "party",
    ),
}  # fmt: skip
"""Columns of the tables other than the signals."""
META = (
    "schema", "run", "method", "composition", "seed", "robots", "ugvs", "scenario", "events", "zeta_m", "controllers",
    "decision_block", "faults", "files",
)  # fmt: skip
SHARED = ("method", "composition", "seed", "zeta_m", "events", "faults")
"""Keys that meta.json and the run's entry in report.json share."""


@dataclass(frozen=True, eq=False)
class Run:
    """One run; T rows. Every robot moves straight from row to row.

    Attributes:
        name: of the run in its scenario.
        scenario: as resolved, with the values that the run sets.
        events: by time.
        signals: see airground_drake/run/trace.py for the columns.
        decisions: a row per decision of the gatekeeper.
        proposals: a row per proposal of the UAV.
    """

    name: str
    scenario: Json
    events: list[Json]
    signals: pd.DataFrame
    decisions: pd.DataFrame
    proposals: pd.DataFrame

    @cached_property
    def method(self) -> str:
        """a: no intervention, b: no gatekeeper, c: the paper's, d: by outcomes, avoidance on top."""
        return str(self.scenario["runs"][self.name]["method"])

    @cached_property
    def ugvs(self) -> list[str]:
        """Names of the UGVs."""
        return list(self.scenario["ugvs"])

    @cached_property
    def uav(self) -> str:
        """Name of the UAV."""
        return str(self.scenario["uav"]["name"])

    @cached_property
    def robots(self) -> dict[str, Json]:
        """What the scenario says of each robot."""
        return robots_of(self.scenario)

    @cached_property
    def pairs(self) -> list[Pair]:
        """Pairs of bodies that are there before the end, and the distances that they must keep."""
        return [pair for pair in pairs_of(self.scenario) if self.there_from(pair.other) < len(self.t_s)]

    @cached_property
    def apart_m(self) -> dict[tuple[str, str], float]:
        """Lower bound of the distance of each pair, by both names in either order, m."""
        least = least_apart_m(self.position_m, self.pairs).tolist()
        found = {(pair.robot, pair.other): apart for pair, apart in zip(self.pairs, least, strict=True)}
        return found | {(other, robot): apart for (robot, other), apart in found.items()}

    @cached_property
    def presets(self) -> dict[str, Preset]:
        """Preset trajectory of each UGV."""
        return {ugv: preset_of(self.scenario, ugv) for ugv in self.ugvs}

    @cached_property
    def levels(self) -> Levels:
        """The trigger."""
        return levels_of(self.scenario)

    @cached_property
    def t_s(self) -> Array:
        """Times of the rows, (T,)."""
        return self.column("t_s")

    @cached_property
    def position_m(self) -> dict[str, Array]:
        """Places of robots and obstacles, (T, 3) each."""
        places = {robot: self.vector(robot, "", "m") for robot in self.robots}
        for name, obstacle in self.scenario["obstacles"].items():
            places[name] = np.tile(np.array(obstacle["position_m"], dtype=np.float64), (len(self.t_s), 1))
        return places

    def there_from(self, name: str) -> int:
        """Row from which on a body is there, the number of rows if not before the end.

        An obstacle with `appears_s` is there from the first control sample at or after that time on.
        """
        appears = float(self.scenario["obstacles"].get(name, {}).get("appears_s", 0.0))
        if appears == 0.0:
            return 0
        later = self.sample_row[self.sample_s >= appears - SMALL]
        return int(later[0]) if len(later) else len(self.t_s)

    @cached_property
    def sample_s(self) -> Array:
        """Times of the control samples, (S,): multiples of the control period before the end."""
        period = self.scenario["control"]["period_s"]
        return period * np.arange(math.ceil((self.t_s[-1] - SMALL) / period))

    @cached_property
    def sample_row(self) -> Rows:
        """Row of each control sample, (S,); rows closer than 1e-9 s are one instant."""
        return np.searchsorted(self.t_s, self.sample_s - SMALL)

    def column(self, name: str) -> Array:
        """A column of the signals, (T,).

        Raises:
            Disagreement: if a number is not finite.
        """
        values = self.signals[name].to_numpy(dtype=np.float64)
        holds("numbers are finite", np.isfinite(values), values, "a finite number", about=name)
        return values

    def vector(self, robot: str, stem: str, unit: str) -> Array:
        """Three columns of the signals, (T, 3), such as `ugv1.vx_m_s`: stem `v`, unit `m_s`."""
        return np.stack([self.column(f"{robot}.{stem}{axis}_{unit}") for axis in "xyz"], axis=1)

    def place_m(self, name: str, t_s: float) -> Array:
        """Place of a robot or an obstacle at any time, (3,)."""
        return np.array([np.interp(t_s, self.t_s, axis) for axis in self.position_m[name].T])

    def times_s(self, robot: str, kind: str) -> Array:
        """Times of the recorded events of a kind, increasing."""
        found = [float(event["t_s"]) for event in self.events if (event["robot"], event["kind"]) == (robot, kind)]
        return np.array(sorted(found))


def read_run(folder: Path, name: str, report: Json) -> Run:
    """Read a trace, and check the rules that all claims about it rest on.

    Args:
        folder: of the trace.
        name: of the run.
        report: report.json.

    Raises:
        Disagreement: if a rule is broken.
        NotEstablished: if a file cannot be read.
    """
    scenario, meta = report["scenario"]["resolved"], read_json(folder / "meta.json")
    same("keys of meta.json", sorted(meta), sorted(META))
    same("keys of timings.json", sorted(read_json(folder / "timings.json")), ["decision_times_s", "wall_s"])
    same("files of the trace", sorted(meta["files"]), sorted(TABLES))
    tables = {file: _table(folder / file, meta["files"][file], _columns(file, scenario)) for file in TABLES}
    _is_of_the_run(meta, report["runs"][name], scenario, name)
    signals, decisions, _, proposals = tables.values()
    run = Run(name, as_run(scenario, name), meta["events"], signals, decisions, proposals)
    close("threshold in force", meta["zeta_m"], run.levels.zeta_m, within=SMALL)
    _rows_cover_the_run(run)
    for robot in run.robots:
        _moves_as_commanded(run, robot)
    for ugv, preset in run.presets.items():
        recorded, flags = run.vector(ugv, "ref_", "m"), run.column(f"{ugv}.accepted")
        close("preset trajectory", recorded, preset.position_m(run.t_s), within=SMALL, about=ugv, t_s=run.t_s)
        holds("flag of an intervention", np.isin(flags, (0.0, 1.0)), flags, "0 or 1", about=ugv, t_s=run.t_s)
    return run


def _table(path: Path, digest: str, columns: Sequence[str]) -> pd.DataFrame:
    """The table in a file that has the digest and the columns."""
    content = read_bytes(path)
    same("SHA-256 of a table", digest, sha256(content), about=path.name)
    table = parse_table(content, path.name)
    same("columns of a table", sorted(table.columns), sorted(columns), about=path.name)
    return table


def _columns(file: str, scenario: Json) -> Sequence[str]:
    """Columns of a table; those of the signals follow from the robots."""
    of_robots = [f"{robot}.{name}" for robot in robots_of(scenario) for name in OF_ROBOT]
    of_ugvs = [f"{ugv}.{name}" for ugv in scenario["ugvs"] for name in OF_UGV]
    return COLUMNS.get(file) or ["t_s", *of_robots, *of_ugvs]


def _is_of_the_run(meta: Json, entry: Json, scenario: Json, name: str) -> None:
    """meta.json, the run's entry in report.json and the scenario say the same."""
    of_scenario = {key: scenario["runs"][name][key] for key in ("method", "composition")} | {
        "schema": SCHEMA, "run": name, "scenario": scenario, "seed": scenario["seed"],
        "ugvs": list(scenario["ugvs"]), "robots": list(robots_of(scenario)),
    }  # fmt: skip
    same("meta.json is of the run", {key: meta[key] for key in of_scenario}, of_scenario)
    same("report.json is of the run", {key: entry[key] for key in SHARED}, {key: meta[key] for key in SHARED})


def _rows_cover_the_run(run: Run) -> None:
    """Time increases from 0 to the duration, with a row at every control sample."""
    t = run.t_s
    if len(t) < 2:
        raise NotEstablished("the rows cover the run", f"there are {len(t)} rows")
    holds("time increases from row to row", np.diff(t) > 0.0, t[1:], "later than the row before", t_s=t[1:])
    close("the rows cover the run", t[[0, -1]], [0.0, run.scenario["duration_s"]], within=SMALL, t_s=t[[0, -1]])
    close("a row at every control sample", t[run.sample_row], run.sample_s, within=SMALL, t_s=run.sample_s)


def _moves_as_commanded(run: Run, robot: str) -> None:
    """position[k] = position[k-1] + (t[k] - t[k-1]) * command[k], from the declared start and a command of 0."""
    place, command = run.position_m[robot], run.vector(robot, "v", "m_s")
    close("start of a robot", place[0], run.robots[robot]["start_m"], within=SMALL, about=robot)
    close("command before the start", command[0], np.zeros(3), within=0.0, about=robot, t_s=float(run.t_s[0]))
    led = place[:-1] + np.diff(run.t_s)[:, None] * command[1:]
    close("law of motion", place[1:], led, within=SMALL, about=robot, t_s=run.t_s[1:])
