"""A recorded run: it belongs to the run of the scenario, is complete, and obeys its law of motion."""

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from .files import Json, parse_table, read_bytes, read_json, sha256
from .plants import Rows, Way, misses_as_recorded, moves_as_its_plant, own_of, plants_of, unicycle_of
from .rules import SMALL, Array, NotEstablished, close, holds, same
from .scenario import (
    Levels,
    Pair,
    Preset,
    as_run,
    has_own_views,
    levels_of,
    links_of,
    moving_of,
    pairs_of,
    places_of,
    preset_of,
    robots_of,
)
from .shapes import boxes_of

SCHEMA = "airground_drake.trace/10"
# The tables that are read: positions, noise and triggers; commands and references at the control samples.
TABLES = ("states.parquet", "samples.parquet")
# Keys that meta.json and the run's entry in report.json share.
SHARED = ("method", "composition", "seed", "zeta_m", "events", "faults")
# Keys of an obstacle that say while it is there, and what 0 means.
LIFETIME = (("appears_s", 0.0), ("disappears_s", math.inf))


@dataclass(frozen=True, eq=False)
class Run:
    """One run with T rows. Steered points move straight from row to row."""

    name: str  # of the run in its scenario
    scenario: Json  # as resolved, with the values that the run sets
    events: list[Json]  # by time
    states: pd.DataFrame  # columns as in airground_drake/sim/trace.py
    samples: pd.DataFrame  # columns as in airground_drake/sim/trace.py

    @cached_property
    def ugvs(self) -> list[str]:
        return list(self.scenario["ugvs"])

    @cached_property
    def robots(self) -> dict[str, Json]:
        return robots_of(self.scenario)

    @cached_property
    def pairs(self) -> list[Pair]:
        """Pairs of bodies that both exist for a control period, and the distances that they must keep."""
        return [pair for pair in pairs_of(self.scenario) if self.there(pair.other).start < len(self.t_s)]

    @cached_property
    def apart_m(self) -> dict[tuple[str, str], float]:
        """Lower bound of the distance of each pair, m, to skip distant pairs."""
        box = {name: boxes_of(place) for name, place in self.body_m.items()}
        bounds_m = {}
        for pair in self.pairs:
            (low, high), (other_low, other_high) = box[pair.robot], box[pair.other]
            bounds_m[pair.robot, pair.other] = float(pair.shape.bounds_m(low - other_high, high - other_low).min())
        return bounds_m

    @cached_property
    def presets(self) -> dict[str, Preset]:
        return {ugv: preset_of(self.scenario, ugv) for ugv in self.ugvs}

    @cached_property
    def levels(self) -> Levels:
        return levels_of(self.scenario)

    @cached_property
    def t_s(self) -> Array:
        """Times of the rows, (T,)."""
        return self.column("t_s")

    @cached_property
    def position_m(self) -> dict[str, Array]:
        """Places of steered points, and of the origins of obstacles' shapes, (T, 3) each; those at rest are at 0."""
        recorded = [*self.robots, *self.moving]
        places = {body: np.stack([self.column(f"{body}.{a}_m") for a in "xyz"], axis=1) for body in recorded}
        return places_of(self.scenario, self.t_s) | places

    @cached_property
    def ways(self) -> dict[str, Way]:
        """The motions of the robots' bodies."""
        return {name: self._way(name) for name in self.robots}

    def _way(self, robot: str) -> Way:
        plants = plants_of(self.robots[robot])
        if not plants:
            return Way(self.t_s, self.position_m[robot])
        place = np.stack([self.column(f"{robot}.body_{a}_m") for a in "xyz"], axis=1)
        if unicycle_of(self.robots[robot]):
            return Way(self.t_s, place, heading_rad=self.column(f"{robot}.heading_rad"))
        lag_s = sum(plant.get("time_constant_s", 0.0) for plant in plants)
        if not lag_s:
            return Way(self.t_s, place)
        velocity = np.stack([self.column(f"{robot}.body_v{a}_m_s") for a in "xyz"], axis=1)
        return Way(self.t_s, place, velocity_m_s=velocity, lag_s=lag_s)

    @cached_property
    def body_m(self) -> dict[str, Array]:
        """Places of the bodies of robots, and of the origins of obstacles' shapes, (T, 3) each."""
        return self.position_m | {name: way.place_m for name, way in self.ways.items()}

    def bent_m(self, pair: Pair) -> float:
        """How far both bodies of a pair may be from the straight lines between rows, together, m."""
        return sum(self._bent_m[name] for name in (pair.robot, pair.other) if name in self.ways)

    @cached_property
    def _bent_m(self) -> dict[str, float]:
        return {name: way.bent_m() for name, way in self.ways.items()}

    @cached_property
    def moving(self) -> list[str]:
        return moving_of(self.scenario)

    def apart(self, pair: Pair) -> Array:
        """Positions of a pair's robot body relative to the other's while both exist, (K, 3), m."""
        return (self.body_m[pair.robot] - self.body_m[pair.other])[self.there(pair.other)]

    def steered_apart(self, pair: Pair) -> Array:
        """Positions of a pair's steered point relative to the other's while both exist, (K, 3), m."""
        return (self.position_m[pair.robot] - self.position_m[pair.other])[self.there(pair.other)]

    def fine(self, name: str, row: int, parts: int) -> Array:
        """Positions of a body, or of the origin of an obstacle's shape, between two rows, (parts + 1, 3), m."""
        way = self.ways.get(name) or Way(self.t_s, self.position_m[name])
        return way.within(row, parts)

    def there(self, name: str) -> slice:
        """Rows in which a body exists; they start at the number of rows if it does not exist for a control period."""
        # It is there from the first control sample at or after its `appears_s` to that at or after its `disappears_s`.
        body = self.scenario["obstacles"].get(name, {})
        first, last = (self._row_at(float(body.get(key) or never)) for key, never in LIFETIME)
        return slice(first if first < last else len(self.t_s), last + 1)

    def period_rows(self, name: str) -> Rows:
        """Ends of the control periods in which a body exists: rows of control samples, and the last row."""
        rows = np.append(self.sample_row, len(self.t_s) - 1)
        there = self.there(name)
        return rows[(rows >= there.start) & (rows < there.stop)]

    def _row_at(self, time_s: float) -> int:
        """Row of the first control sample at or after a time, s; after the last sample, the number of rows."""
        later = self.sample_row[self.sample_s >= time_s - SMALL]
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

    @cached_property
    def error_m(self) -> float:
        """Error bound of measured positions, m."""
        return float((self.scenario.get("sensing") or {}).get("position_error_m", 0.0))

    @cached_property
    def links(self) -> dict[str, float]:
        """Delay, s, and loss of positions between UGVs."""
        return links_of(self.scenario)

    def seen_m(self, robot: str, by: str = "") -> Array:
        """Positions of a robot that robots act on at the control samples, (S, 3), m; as another one measured them."""
        if by not in ("", robot) and has_own_views(self.scenario):
            return self.sampled(by, f"saw_{robot}_", "m")
        if self.scenario.get("sensing") or self.links["delay_s"]:
            return self.sampled(robot, "seen_", "m")
        return self.position_m[robot][self.sample_row]

    def times_s(self, robot: str, kind: str) -> Array:
        """Times of the recorded events of a kind, increasing."""
        times_s = [float(event["t_s"]) for event in self.events if (event["robot"], event["kind"]) == (robot, kind)]
        return np.array(sorted(times_s))


def column_of(table: pd.DataFrame, name: str) -> Array:
    if name not in table:
        raise NotEstablished("columns of a table", f"there is no {name}", " or ".join(TABLES))
    values = table[name].to_numpy(dtype=np.float64)
    holds("numbers are finite", np.isfinite(values), values, "a finite number", about=name)
    return values


def read_run(folder: Path, name: str, report: Json) -> Run:
    """Read a trace, and check the rules on which all claims about it depend."""
    scenario = report["scenario"]["resolved"]
    meta = read_json(folder / "meta.json")
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
    declared = places_of(run.scenario, run.t_s)
    for name in run.moving:
        place = run.position_m[name]
        close("way of an obstacle", place, declared[name], within=SMALL, about=name, t_s=run.t_s)
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
    # A user's plant begins there, too, and misses its commands by as much as is recorded.
    place, chosen = run.position_m[robot], run.sampled(robot, "v", "m_s")
    command = chosen[np.searchsorted(run.sample_row, np.arange(len(place) - 1), side="right") - 1]
    close("start of a robot", run.body_m[robot][0], run.robots[robot]["start_m"], within=SMALL, about=robot)
    if own_of(run.robots[robot]):
        rows = np.append(run.sample_row, len(place) - 1)
        recorded = column_of(run.samples, f"{robot}.drift_m_s"), column_of(run.samples, f"{robot}.cover_m")
        misses_as_recorded(robot, run.ways[robot], place, chosen, rows, recorded)
        return
    led = place[:-1] + np.diff(run.t_s)[:, None] * command
    close("law of motion", place[1:], led, within=SMALL, about=robot, t_s=run.t_s[1:])
    if plants_of(run.robots[robot]):
        held = np.concatenate([np.zeros((1, 3)), command])
        period_s = float(run.scenario["control"]["period_s"])
        moves_as_its_plant(robot, run.robots[robot], run.ways[robot], place, held, period_s)
