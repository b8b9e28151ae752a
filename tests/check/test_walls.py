"""Runs among walls, polygons and boxes: the checker holds what was kept, and refuses forged walls and places."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from builders import logs
from check.forgeries import all_of, cells, everywhere, leap
from check.forging import Edit, mend, read_table, refusals, trace
from sharing import once

from airground_drake.check.report import DECIDED, SCHEMA, SHAPE
from airground_drake.check.run import SHARED, read_run
from airground_drake.scenario.load import from_data, resolved
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import save
from airground_drake.study.logs.judging import KEPT

U = [[0.0, 1.0], [2.0, 1.0], [2.0, -1.0], [0.0, -1.0], [0.0, -0.9], [1.8, -0.9], [1.8, 0.9], [0.0, 0.9]]
TRAP = [[-3, -3], [2, -3], [2, 3], [1.5, 3], [1.5, -2.5], [-1.2, -2.5], [-1.2, 3], [-3, 3]]
"""Round a place that ugv1 reaches in 1.5 s, and where it started."""
BARRIERS: dict[str, dict[str, Any]] = {
    "wall": {"segment_m": [[1.0, -2.0], [1.0, 0.5], [2.0, 2.0]], "radius_m": 0.05},
    "room": {"polygon_m": U, "position_m": [1.0, 0.0], "heading_rad": 0.2, "distance_m": 0.25},
    "block": {"size_m": [1.0, 3.0], "position_m": [2.0, 0.5], "heading_rad": -0.3},
    "tower": {"size_m": [0.6, 0.6], "position_m": [0.0, 0.0], "heading_rad": 0.5, "height_m": 1.3},
    "trap": {"polygon_m": TRAP, "appears_s": 1.5},
}
"""What ugv1 runs into; the UAV climbs over the tower, which the two UGVs pass on either side."""


def scene(name: str) -> dict[str, Any]:
    """A run in which the barrier of that name, or the arena, decides the least margin."""
    aside = 1.5 if name == "tower" else 0.1
    ways = {"ugv1": [[-2.0, aside, 0.0], [5.0, aside, 0.0]], "ugv2": [[-2.0, -1.5, 0.0], [5.0, -1.5, 0.0]]}
    ways = ways if name == "tower" else {"ugv1": ways["ugv1"]}
    if name == "arena":  # beyond it and back
        ways["ugv1"].append([1.0, aside, 0.0])
    return {
        "name": name, "duration_s": 5.0, "uav": {"start_m": [-2.0, 0.0, 1.4], "altitude_m": 1.4},
        "safe_distance": {"obstacle_m": 0.3, "ugv_m": 0.3, "air_ground_m": 0.5}, "runs": {"d": {"method": "a"}},
        "control": {"period_s": 0.05, "sensing_range_m": 3.0}, "decision": {"noise_period_s": 0.05},
        "ugvs": {
            ugv: {"start_m": way[0], "target_m": way[-1], "preset": {"waypoints_m": way}, "radius_m": 0.2}
            for ugv, way in ways.items()
        },
        "obstacles": {name: BARRIERS[name]} if name in BARRIERS else {},
        "arena_m": [[2.0, -2.0], [-3.0, 2.0]] if name == "arena" else [],
    }  # fmt: skip


def with_map(data: dict[str, Any]) -> dict[str, Any]:
    """With a map of two rectangles in the way, as a report records it; its files need not exist."""
    cells = {
        "file": "lab.yaml", "unknown": "occupied", "sha256": {}, "cell_m": 0.5, "origin": [1.0, -2.0, 0.1], "rows": 9,
        "columns": 9, "occupied": 6, "unsure": 0, "unreached": 0, "rectangles": [[0, 3, 0, 1], [3, 9, 1, 2]],
        "starts_m": [body["start_m"][:2] for body in (*data["ugvs"].values(), data["uav"])],
    }  # fmt: skip
    return data | {"map": {"file": "lab.yaml", "cells": cells}}


@pytest.fixture(scope="module", name="report_of")
def reports(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """A report of each scene with the checker's own verdicts; nobody writes into it."""
    above = tmp_path_factory.mktemp("walls")

    def make(name: str, folder: Path) -> None:
        data = scene(name)
        scenario = from_data(with_map(data) if name == "map" else data, name)
        save(simulate(scenario, "d"), trace(folder))
        about = json.loads((trace(folder) / "meta.json").read_bytes())
        document: dict[str, Any] = {key: kind() for key, kind in SHAPE.items()} | {"schema": SCHEMA}
        document |= {"scenario": {"resolved": resolved(scenario)}, "runs": {"d": {key: about[key] for key in SHARED}}}
        run = read_run(trace(folder), "d", json.loads(json.dumps(document)))
        for claim, decide in DECIDED.items():
            if (found := decide(run)) is None:
                continue
            count = found.exercised[0] if found.exercised else 0
            entry = {"id": claim, "run": "d", "status": found.status, "margin": found.margin, "exercised": count}
            document["claims"].append(entry | {"unit": ""})
        (folder / "report.json").write_text(json.dumps(document))
        everywhere("name", value=name)(folder)  # its digest
        mend(folder)

    return lambda name: once(above / name, lambda folder: make(name, folder))


@pytest.mark.parametrize("name", [*BARRIERS, "arena", "map"])
def test_honest_runs_stop_at_the_distance_and_keep_it(report_of: Callable[[str], Path], name: str) -> None:
    folder = report_of(name)
    claims = {claim["id"]: claim for claim in json.loads((folder / "report.json").read_bytes())["claims"]}
    assert refusals(folder, all_of()) == {}
    assert claims["SAFE-TRACE"]["status"] == claims["SAFE-HYP"]["status"] == "holds"
    assert 0.0 <= claims["SAFE-TRACE"]["margin"] < 1e-3
    assert claims["SAFE-TRACE"]["exercised"] >= 1


@pytest.mark.parametrize(("name", "by_m"), [("wall", 0.0), ("room", 0.0), ("block", 0.01), ("tower", 0.01)])
def test_positions_among_walls_are_judged(
    report_of: Callable[[str], Path], name: str, by_m: float, tmp_path: Path
) -> None:
    folder = report_of(name)
    frame, scenario = read_table(folder), json.loads((folder / "report.json").read_bytes())["scenario"]["resolved"]
    columns = ["x_m", "y_m", "z_m"]
    tables = [
        pd.DataFrame(frame[[f"{robot}.{column}" for column in columns]].to_numpy(), columns=columns)
        .assign(t_s=frame["t_s"], body=robot)
        for robot in (*scenario["ugvs"], "uav")
    ]  # fmt: skip
    scenario["obstacles"][name]["distance_m"] = (scenario["obstacles"][name]["distance_m"] or 0.3) + by_m
    pairs = logs.judged(pd.concat(tables, ignore_index=True), scenario, tmp_path).pairs
    assert [pair.second for pair in pairs if pair.status != KEPT] == ([name] if by_m else [])
    assert max(pair.missed_m for pair in pairs) == pytest.approx(by_m, abs=1e-9)


def moved(by_m: float) -> Callable[[Any], Any]:
    return lambda corners: [[x + by_m, y] for x, y in corners]


FORGERIES: dict[str, tuple[str, str, Edit]] = {
    "wall moved": ("wall", "SAFE-TRACE", everywhere("obstacles", "wall", "segment_m", value=moved(-1e-3))),
    "wall moved away": ("wall", "SAFE-TRACE", everywhere("obstacles", "wall", "segment_m", value=moved(1e-3))),
    "wall thinner": ("wall", "SAFE-TRACE", everywhere("obstacles", "wall", "radius_m", value=0.049)),
    "wall with a distance of its own": ("wall", "SAFE-TRACE", everywhere("obstacles", "wall", "distance_m", value=0.2)),
    "wall left out": ("wall", "SAFE-TRACE", everywhere("obstacles", value={})),
    "smaller distance": ("room", "SAFE-TRACE", everywhere("obstacles", "room", "distance_m", value=0.249)),
    "room turned": ("room", "SAFE-TRACE", everywhere("obstacles", "room", "heading_rad", value=0.201)),
    "room moved": ("room", "SAFE-TRACE", everywhere("obstacles", "room", "position_m", value=[1.001, 0.0, 0.0])),
    "room filled": ("room", "SAFE-TRACE", everywhere("obstacles", "room", "polygon_m", value=U[:4])),
    "block turned": ("block", "SAFE-TRACE", everywhere("obstacles", "block", "heading_rad", value=-0.301)),
    "block smaller": ("block", "SAFE-TRACE", everywhere("obstacles", "block", "size_m", value=[0.999, 3.0])),
    "tower lower": ("tower", "SAFE-TRACE", everywhere("obstacles", "tower", "height_m", value=1.299)),
    "trap appears later": ("trap", "SAFE-TRACE", everywhere("obstacles", "trap", "appears_s", value=6.0)),
    "arena larger": ("arena", "SAFE-TRACE", everywhere("arena_m", value=[[2.001, -2.0], [-3.0, 2.0]])),
    "arena left out": ("arena", "SAFE-TRACE", everywhere("arena_m", value=[])),
    "map of other cells": ("map", "SAFE-TRACE", everywhere("map", "cells", "rectangles", 1, 2, value=0)),
    "map moved": ("map", "SAFE-TRACE", everywhere("map", "cells", "origin", 0, value=1.001)),
    "map without cells": ("map", "SAFE-TRACE", everywhere("map", "cells", "rectangles", value=[])),
    "onto the wall": ("wall", "SAFE-TRACE", leap("ugv1", 0.6, -11)),
    "through the wall and back between rows that are clear of it": ("wall", "SAFE-TRACE", leap("ugv1", 1.3, -11)),
    "through the wall and back without a collision": ("wall", "events", leap("ugv1", 1.3, -11)),
    "onto the wall without a command": ("wall", "trace", cells("ugv1.x_m", lambda old: old + 0.6, 90)),
    "wall that might move": ("wall", "SAFE-OWN", everywhere("obstacles", "wall", "max_speed_m_s", value=1.0)),
    "edges that cross": (
        "room", "events", everywhere("obstacles", "room", "polygon_m", value=[[0, 0], [9, 9], [9, 0], [0, 9]]),
    ),
}  # fmt: skip
"""The scene, the check that refuses the forgery, and the forgery."""


@pytest.mark.parametrize("name", FORGERIES)
def test_forged_walls_and_places_are_refused(report_of: Callable[[str], Path], name: str) -> None:
    barrier, claim, edit = FORGERIES[name]
    assert claim in refusals(report_of(barrier), edit)


@pytest.mark.parametrize("name", ["room", "trap"])
def test_corners_may_be_listed_in_either_order(report_of: Callable[[str], Path], name: str) -> None:
    reversed_corners = everywhere("obstacles", name, "polygon_m", value=lambda corners: corners[::-1])
    assert refusals(report_of(name), reversed_corners) == {}
