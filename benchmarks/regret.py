"""Costs of the plans of method (c) on the closed loop, where (23) is an approximation: a table.

    python benchmarks/regret.py [scenario ...] [--route relaxed]

A plan that changes its mode adds velocities of two different paths. Here the plan of each decision, the constant plans
and all plans of 6 blocks are rolled out on the closed loop. The regret of a plan is its cost above the cheapest
constant plan, and above the cheapest of all plans, in units of the cheaper constant plan's cost. The largest regrets of
a run are printed.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.scenario.load import load
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify.runs.gate_record import DecisionRecord, rows_of

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from oracles.closed_loops import roll_out, stacked
from oracles.predictions import scene_of

BLOCKS = 6
"""Blocks of stages: all plans that are constant on blocks are rolled out."""
MOST = 30
"""Most decisions of a run that are compared, evenly spaced."""


def main() -> None:
    """Simulate, roll out and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenarios", nargs="*", default=["case_a", "case_b", "soft_gate"], help="names or files")
    parser.add_argument("--route", help="how (26) is solved; default: as the scenario says")
    options = parser.parse_args()
    print("| scenario | decisions | regret against constant plans | against plans of 6 blocks |")
    print("| --- | --- | --- | --- |")
    for name in options.scenarios:
        trace = simulate(load(name, [f"gatekeeper.route={options.route}"] if options.route else []), "c")
        planned = [row for row in rows_of(trace) if row.planned]
        chosen = np.linspace(0, len(planned) - 1, min(MOST, len(planned))).round().astype(int)
        found = [regrets(trace, planned[k]) for k in dict.fromkeys(chosen.tolist())]
        most = np.max(found, axis=0, initial=-np.inf)
        print(f"| {name} | {len(found)} | {most[0]:.3g} | {most[1]:.3g} |", flush=True)


def regrets(trace: Trace, row: DecisionRecord) -> tuple[float, float]:
    """The regret of a decision's plan, against the constant plans and against all that are rolled out."""
    plans = [row["plan"], *plans_of_blocks(row.stages)]
    loops = stacked([scene_of(trace, row, plan) for plan in plans])
    ways = np.array(list(roll_out(trace, loops))).swapaxes(0, 1)  # (plans, S, 3)
    each = ways.shape[1] // row.stages
    cost = row.cost(ways[:, each - 1 :: each]) / row.scale
    return float(cost[0] - min(cost[1], cost[-1])), float(cost[0] - cost[1:].min())


def plans_of_blocks(stages: int) -> Array:
    """All plans of BLOCKS blocks, (2^BLOCKS, N); the first is all 0, the last all 1."""
    modes = (np.arange(2**BLOCKS)[:, None] >> np.arange(BLOCKS)) % 2
    return modes[:, np.arange(stages) * BLOCKS // stages].astype(np.float64)


if __name__ == "__main__":
    main()
