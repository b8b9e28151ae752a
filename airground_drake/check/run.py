"""A recorded run: it belongs to the run of the scenario, is complete, and obeys its law of motion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd

from .files import Json, parse_table, read_bytes, read_json, sha256
from .rules import SMALL, Array, NotEstablished, close, holds, same
from .scenario import Levels, Pair, Preset, as_run, levels_of, pairs_of, preset_of, robots_of

Rows = npt.NDArray[np.intp]
SCHEMA = "airground_drake.trace/8"
TABLES = ("states.parquet", "samples.parquet")
"""The tables that are read: positions, noise and triggers; commands and references at the control samples."""
SHARED = ("method", "composition", "seed", "zeta_m", "events", "faults")
"""Keys that meta.json and the run's entry in report.json share."""
ROWS = 50
"""Rows of a slice of a run."""
ROUNDING_M = 1e-6
"""Bounds are lowered by this, because of rounding."""


@dataclass(frozen=True, eq=False)
class Run:
    """One run; T rows. Every robot moves straight from row to row.

    Attributes:
        name: of the run in its scenario.
        scenario: as resolved, with the values that the run sets.
        events: by time.
        states: see airground_drake/run/trace.py for the columns.
        samples: likewise.
    """

    name: str
    scenario: Json
    events: list[Json]
    states: pd.DataFrame
    samples: pd.DataFrame

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
        places = {robot: np.stack([self.column(f"{robot}.{a}_m") for a in "xyz"], axis=1) for robot in self.robots}
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
        """A column of the states, (T,); raises as `column_of`."""
        return column_of(self.states, name)

    def sampled(self, robot: str, stem: str, unit: str) -> Array:
        """Three columns of the samples, (S, 3), such as `ugv1.vx_m_s`: stem `v`, unit `m_s`; raises as `column_of`."""
        return np.stack([column_of(self.samples, f"{robot}.{stem}{axis}_{unit}") for axis in "xyz"], axis=1)

    def times_s(self, robot: str, kind: str) -> Array:
        """Times of the recorded events of a kind, increasing."""
        found = [float(event["t_s"]) for event in self.events if (event["robot"], event["kind"]) == (robot, kind)]
        return np.array(sorted(found))


def column_of(table: pd.DataFrame, name: str) -> Array:
    """A column of a table.

    Raises:
        NotEstablished: if it is missing.
        Disagreement: if a number is not finite.
    """
    if name not in table:
        raise NotEstablished("columns of a table", f"there is no {name}", " or ".join(TABLES))
    values = table[name].to_numpy(dtype=np.float64)
    holds("numbers are finite", np.isfinite(values), values, "a finite number", about=name)
    return values


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
    content = {table: read_bytes(folder / table) for table in TABLES}
    for table in TABLES:
        same("SHA-256 of a table", meta["files"][table], sha256(content[table]), about=table)
    _is_of_the_run(meta, report["runs"][name], scenario, name)
    tables = (parse_table(content[table], table) for table in TABLES)
    run = Run(name, as_run(scenario, name), meta["events"], *tables)
    close("threshold in force", meta["zeta_m"], run.levels.zeta_m, within=SMALL)
    _rows_cover_the_run(run)
    for robot in run.robots:
        _moves_as_commanded(run, robot)
    for ugv, preset in run.presets.items():
        recorded = run.sampled(ugv, "ref_", "m")
        close("preset trajectory", recorded, preset.position_m(run.sample_s), within=SMALL, about=ugv, t_s=run.sample_s)
    return run


def _is_of_the_run(meta: Json, entry: Json, scenario: Json, name: str) -> None:
    """meta.json, the run's entry in report.json and the scenario say the same."""
    of_scenario = {key: scenario["runs"][name][key] for key in ("method", "composition")} | {
        "schema": SCHEMA, "run": name, "scenario": scenario, "seed": scenario["seed"],
        "ugvs": list(scenario["ugvs"]), "robots": list(robots_of(scenario)),
    }  # fmt: skip
    same("meta.json is of the run", {key: meta[key] for key in of_scenario}, of_scenario)
    same("report.json is of the run", {key: entry[key] for key in SHARED}, {key: meta[key] for key in SHARED})


def _rows_cover_the_run(run: Run) -> None:
    """Time increases from 0 to the duration, with a row at every control sample in both tables."""
    t, sampled = run.t_s, column_of(run.samples, "t_s")
    if len(t) < 2:
        raise NotEstablished("the rows cover the run", f"there are {len(t)} rows")
    holds("time increases from row to row", np.diff(t) > 0.0, t[1:], "later than the row before", t_s=t[1:])
    close("the rows cover the run", t[[0, -1]], [0.0, run.scenario["duration_s"]], within=SMALL, t_s=t[[0, -1]])
    close("a row at every control sample", t[run.sample_row], run.sample_s, within=SMALL, t_s=run.sample_s)
    if len(sampled) != len(run.sample_s):
        raise NotEstablished("a row at every control sample", f"there are {len(sampled)}, not {len(run.sample_s)}")
    close("a row at every control sample", sampled, run.sample_s, within=SMALL, t_s=run.sample_s)


def _moves_as_commanded(run: Run, robot: str) -> None:
    """position[k] = position[k-1] + (t[k] - t[k-1]) * command, from the declared start; samples hold their command."""
    place, chosen = run.position_m[robot], run.sampled(robot, "v", "m_s")
    command = chosen[np.searchsorted(run.sample_row, np.arange(len(place) - 1), side="right") - 1]
    close("start of a robot", place[0], run.robots[robot]["start_m"], within=SMALL, about=robot)
    led = place[:-1] + np.diff(run.t_s)[:, None] * command
    close("law of motion", place[1:], led, within=SMALL, about=robot, t_s=run.t_s[1:])


def least_apart_m(position_m: dict[str, Array], pairs: list[Pair]) -> Array:
    """Lower bounds of the distances of pairs over a whole run, (P,), so that only near pairs are looked at closely.

    On a slice of the run each body stays in a ball around its positions. Two bodies are at least as far apart as their
    balls.
    """
    number = {name: k for k, name in enumerate(position_m)}
    one = np.array([number[pair.robot] for pair in pairs], dtype=np.intp)
    other = np.array([number[pair.other] for pair in pairs], dtype=np.intp)
    found, places = np.full(len(pairs), np.inf), list(position_m.values())
    for begin in range(0, max(len(places[0]) - 1, 1), ROWS):
        parts = [place[begin : begin + ROWS + 1] for place in places]
        middle = np.array([0.5 * (part.min(axis=0) + part.max(axis=0)) for part in parts])
        reach = np.array([np.linalg.norm(part - at, axis=1).max() for part, at in zip(parts, middle, strict=True)])
        apart = np.linalg.norm(middle[one] - middle[other], axis=1) - reach[one] - reach[other]
        found = np.minimum(found, apart)
    return found - ROUNDING_M
