"""A recorded run: it belongs to the run of the scenario, is complete, and obeys its law of motion."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd

from .files import Json, canonical, parse_json, parse_table, read_bytes, sha256
from .nearness import least_apart_m
from .rules import SMALL, Array, Flags, NotEstablished, at_most, close, holds, same
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
"""What meta.json and the run's entry in report.json both say."""
INTERVENING = 1.0
"""The mode in which the UAV intervenes."""


@dataclass(frozen=True, eq=False)
class Run:
    """One run; T rows. Every robot moves straight from row to row.

    Attributes:
        name: of the run in its scenario.
        scenario: as resolved.
        events: by time.
        decision_times_s: CPU time of each decision.
        wall_s: wall-clock time of the simulation.
        signals: see airground_drake/run/trace.py for the columns.
        decisions: a row per decision of the gatekeeper.
        problems: the problem (26) of each decision.
        proposals: a row per proposal of the UAV.
    """

    name: str
    scenario: Json
    events: list[Json]
    decision_times_s: list[float]
    wall_s: float
    signals: pd.DataFrame
    decisions: pd.DataFrame
    problems: pd.DataFrame
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
        """Pairs of bodies and the distances that they must keep."""
        return pairs_of(self.scenario)

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

    @cached_property
    def command_m_s(self) -> dict[str, Array]:
        """Velocity of each robot since the row before, (T, 3); 0 in the first row."""
        return {robot: self.vector(robot, "v", "m_s") for robot in self.robots}

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
            NotEstablished: if it is not there.
            Disagreement: if a number is not finite.
        """
        if name not in self._columns:
            if name not in self.signals:
                raise NotEstablished("the signals have the column", "it is missing", name)
            values = self.signals[name].to_numpy(dtype=np.float64)
            holds("numbers are finite", np.isfinite(values), values, "a finite number", about=name)
            self._columns[name] = values
        return self._columns[name]

    @cached_property
    def _columns(self) -> dict[str, Array]:
        """Columns that were read before."""
        return {}

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

    def executed(self, ugv: str) -> Flags:
        """Rows up to which an intervention was executed, (T,)."""
        return self.column(f"{ugv}.accepted") != 0.0


def read_run(folder: Path, name: str, report: Json) -> Run:
    """Read a trace and apply the rules that all claims about it rest on; equal files give the same Run.

    Args:
        folder: of the trace.
        name: of the run.
        report: report.json.

    Raises:
        Disagreement: if a rule is broken.
        NotEstablished: if a file cannot be read.
    """
    contents = tuple(read_bytes(folder / file) for file in ("meta.json", "timings.json", *TABLES))
    entry = {key: report["runs"][name][key] for key in SHARED}
    return _run(name, canonical(report["scenario"]["resolved"]), canonical(entry), contents)


@lru_cache(maxsize=8)
def _run(name: str, scenario_text: str, entry_text: str, contents: tuple[bytes, ...]) -> Run:
    scenario, entry = json.loads(scenario_text), json.loads(entry_text)
    meta, timings = parse_json(contents[0], "meta.json"), parse_json(contents[1], "timings.json")
    same("files of the trace", sorted(meta["files"]), sorted(TABLES))
    same("what meta.json says", sorted(meta), sorted(META))
    same("what timings.json says", sorted(timings), ["decision_times_s", "wall_s"])
    tables = []
    for file, content in zip(TABLES, contents[2:], strict=True):
        same("SHA-256 of a table", meta["files"][file], sha256(content), about=file)
        tables.append(parse_table(content, file))
        columns = COLUMNS.get(file) or _signals_of(scenario)
        strange = sorted({*tables[-1].columns} - {*columns})
        same("no column but those of a trace", strange, [], about=file)
    _is_of_the_run(meta, entry, scenario, name)
    run = Run(name, as_run(scenario, name), meta["events"], timings["decision_times_s"], timings["wall_s"], *tables)
    same("a time for each decision", len(run.decision_times_s), len(run.decisions))
    at_most("times of decisions are not negative", -np.array([*run.decision_times_s, run.wall_s]), 0.0)
    _rows_cover_the_run(run)
    _decisions_come_by_time(run)
    _a_row_at_every_control_sample(run)
    _robots_start_where_declared(run)
    _robots_are_where_their_commands_lead(run)
    _presets_are_those_of_the_scenario(run)
    _nothing_is_commanded_before_the_start(run)
    _flags_are_0_or_1(run)
    return run


def _signals_of(scenario: Json) -> list[str]:
    """Columns of the signals."""
    of_robots = [f"{robot}.{name}" for robot in robots_of(scenario) for name in OF_ROBOT]
    return ["t_s", *of_robots, *(f"{ugv}.{name}" for ugv in scenario["ugvs"] for name in OF_UGV)]


def _is_of_the_run(meta: Json, entry: Json, scenario: Json, name: str) -> None:
    """meta.json, the run's entry in report.json and the scenario say the same."""
    same("schema of the trace", meta["schema"], SCHEMA)
    same("name of the run", meta["run"], name)
    same("scenario of the trace", meta["scenario"], scenario)
    same("method of the run", meta["method"], scenario["runs"][name]["method"])
    same("composition of the run", meta["composition"], scenario["runs"][name]["composition"])
    same("seed of the run", meta["seed"], scenario["seed"])
    same("UGVs of the run", meta["ugvs"], list(scenario["ugvs"]))
    same("robots of the run", meta["robots"], list(robots_of(scenario)))
    close("threshold in force", meta["zeta_m"], levels_of(as_run(scenario, name)).zeta_m, within=SMALL)
    for key in SHARED:
        same(f"{key} in report.json", entry[key], meta[key])


def _decisions_come_by_time(run: Run) -> None:
    """The decisions of a UGV are in the order of time."""
    for ugv in run.ugvs:
        times = run.decisions.loc[run.decisions["robot"] == ugv, "t_s"].to_numpy(dtype=np.float64)
        later = times[1:]
        holds("decisions are in order", later >= times[:-1], later, "not before the one above", about=ugv, t_s=later)


def _rows_cover_the_run(run: Run) -> None:
    """Time increases from row to row, from 0 to the duration."""
    t = run.t_s
    if len(t) < 2:
        raise NotEstablished("the rows cover the run", f"there are {len(t)} rows")
    holds("time increases from row to row", np.diff(t) > 0.0, t[1:], "later than the row before", t_s=t[1:])
    close("the rows cover the run", t[[0, -1]], [0.0, run.scenario["duration_s"]], within=SMALL, t_s=t[[0, -1]])


def _a_row_at_every_control_sample(run: Run) -> None:
    close("a row at every control sample", run.t_s[run.sample_row], run.sample_s, within=SMALL, t_s=run.sample_s)


def _robots_start_where_declared(run: Run) -> None:
    for robot, spec in run.robots.items():
        close("start of a robot", run.position_m[robot][0], spec["start_m"], within=SMALL, about=robot)


def _robots_are_where_their_commands_lead(run: Run) -> None:
    """position[k] = position[k-1] + (t[k] - t[k-1]) * command[k]."""
    dt = np.diff(run.t_s)[:, None]
    for robot in run.robots:
        led = run.position_m[robot][:-1] + dt * run.command_m_s[robot][1:]
        close("law of motion", run.position_m[robot][1:], led, within=SMALL, about=robot, t_s=run.t_s[1:])


def _nothing_is_commanded_before_the_start(run: Run) -> None:
    """The first row is the start, so its command is 0."""
    for robot in run.robots:
        first = run.command_m_s[robot][0]
        close("command before the start", first, np.zeros(3), within=0.0, about=robot, t_s=float(run.t_s[0]))


def _flags_are_0_or_1(run: Run) -> None:
    for ugv in run.ugvs:
        flags = run.column(f"{ugv}.accepted")
        holds("flag whether an intervention is executed", (flags == 0.0) | (flags == 1.0), flags, "0 or 1",
              about=ugv, t_s=run.t_s)  # fmt: skip


def _presets_are_those_of_the_scenario(run: Run) -> None:
    for ugv, preset in run.presets.items():
        recorded = run.vector(ugv, "ref_", "m")
        close("preset trajectory", recorded, preset.position_m(run.t_s), within=SMALL, about=ugv, t_s=run.t_s)
