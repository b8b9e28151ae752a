"""Worlds of the BARN challenge: who arrives, and how much later than the shortest way takes.

    git clone https://github.com/Daffan/the-barn-challenge
    python benchmarks/barn.py the-barn-challenge/jackal_helper/worlds/BARN --every 10 -o rows.jsonl
    python benchmarks/barn.py ... --plant '{kind: unicycle, hand_point_m: 0.05, max_turn_rad_s: 4.0}'

Each world becomes a scenario as by `airground import barn`: the robot is as wide as BARN's, keeps 0.1 m from all
cylinders and knows those within 4 m; the UAV knows all of them. The shortest way keeps what the law keeps; that
is more for a robot that turns.
"""

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from typing import Any

import yaml

from airground_drake.model.geometry import outline
from airground_drake.model.geometry.paths import NoPath, shortest_path
from airground_drake.report.metrics import outcome
from airground_drake.scenario.imported import Sizes, barn
from airground_drake.scenario.load import from_data
from airground_drake.scenario.outlines import outlines_of
from airground_drake.scenario.schema import Scenario
from airground_drake.scenario.world import make_world
from airground_drake.sim.simulation import simulate

SIZES = Sizes(0.215, 0.1)
METHODS = ("a", "d")


def shortest_s(scenario: Scenario) -> float | None:
    """How long the shortest way of the UGV takes at the speed of its preset, s; None without a way."""
    rows = outline.joined(*(outlines_of(scenario, each) for each in scenario.barriers.values()))
    (ugv,) = scenario.ugvs.values()
    try:
        way = shortest_path(ugv.start_m[:2], ugv.target_m[:2], rows, make_world(scenario).keep(0, rows))
    except NoPath:
        return None
    return way.length_m / ugv.preset.speed_m_s


def rows_of(path: Path, plant: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """What came of each method in a world, for a robot with a plant (a key of scenarios)."""
    data = yaml.safe_load(barn(path, path.stem, [], SIZES).text)
    data["ugvs"]["ugv1"] |= {"plant": plant} if plant else {}
    scenario = from_data(data, str(path))
    least = shortest_s(scenario)
    for method in METHODS:
        trace = simulate(scenario, method)
        arrived = [event["t_s"] for event in trace.events if event["kind"] == "arrival" and event["robot"] == "ugv1"]
        yield {
            "world": path.stem, "method": method, "kept": outcome(trace)["kept"], "shortest_s": least,
            "arrived_s": arrived[0] if arrived else None,
        }  # fmt: skip


def main() -> None:
    """Run the worlds, write a line for each run, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="with files world_0.world, world_1.world and so on")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="every N-th world (default: all)")
    parser.add_argument("--plant", type=yaml.safe_load, default={}, help="of the robot, as in a scenario")
    parser.add_argument("-o", "--output", type=Path, metavar="JSONL", help="of rows; worlds that are in it are not run")
    given = parser.parse_args()
    worlds = sorted(given.folder.glob("world_*.world"), key=lambda path: int(path.stem.removeprefix("world_")))
    if not worlds:
        sys.exit(f"error: {given.folder}: no file world_N.world is in it")
    rows: list[dict[str, Any]] = []
    if given.output and given.output.exists():
        rows = [json.loads(line) for line in given.output.read_text(encoding="utf-8").splitlines()]
    done = {row["world"] for row in rows}
    for path in worlds[:: given.every]:
        if path.stem not in done:
            new = list(rows_of(path, given.plant))
            rows += new
            if given.output:
                with given.output.open("a", encoding="utf-8") as stream:
                    stream.writelines(json.dumps(row) + "\n" for row in new)
    print("| method | worlds | with a way | arrived | too near | time over the shortest: median | most |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for method in METHODS:
        own = [row for row in rows if row["method"] == method]
        over = [row["arrived_s"] / row["shortest_s"] for row in own if row["arrived_s"] and row["shortest_s"]]
        feasible, short = sum(bool(row["shortest_s"]) for row in own), sum(not row["kept"] for row in own)
        times = f"{median(over):.2f} | {max(over):.2f}" if over else "- | -"
        print(f"| {method} | {len(own)} | {feasible} | {sum(bool(r['arrived_s']) for r in own)} | {short} | {times} |")


if __name__ == "__main__":
    main()
