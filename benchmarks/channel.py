"""Who arrives when messages are late and lost: `python benchmarks/channel.py --seeds 3 --jobs 2 -o channel.jsonl`.

Simulates method (d) of shipped scenarios with every delay, loss and seed of the channel. With `--between ugvs` the
positions that UGVs tell each other are late and lost, under the asynchronous law, in place of messages from and to the
UAV. Each run becomes a line of JSON; runs that the file has are not made again. At the end there is a table: when the
last UGV arrived, or how many did not; with several seeds the latest. Below it: what was judged otherwise than in the
run without a channel.
"""

import argparse
import json
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

from airground_drake.scenario.load import load, validated
from airground_drake.sim.simulation import simulate
from airground_drake.verify import judge

SCENARIOS = ["case_a", "case_b", "lab", "swap", "crossing", "intersection", "doorway", "turtlebots"]
CLAIMS = ("SAFE-TRACE", "SAFE-OWN", "SAFE-HYP", "LIVE-HYP")


def run(scenario: str, delay_s: float, loss: float, seed: int, between: str = "all") -> dict[str, Any]:
    """One run, in numbers."""
    given, links = load(scenario), {"delay_s": delay_s, "loss": loss}
    changes: dict[str, Any] = {"channel": {**links, "seed": seed}}
    if between == "ugvs":  # no theorem is about (b) and (c) then
        given = replace(given, runs={"d": given.runs["d"]})
        changes = {"channel": {"seed": seed, "ugvs": links}, "control.law": "asynchronous"}
    trace = simulate(validated(given, changes), "d")
    arrived = [event["t_s"] for event in trace.events if event["kind"] == "arrival" and event["robot"] in trace.ugvs]
    sent = trace.messages.drop_duplicates(["kind", "number", "attempt"])
    return {
        "scenario": scenario, "delay_s": delay_s, "loss": loss, "seed": seed,
        "arrived": len(arrived), "of": len(trace.ugvs), "last_s": max(arrived, default=None), "messages": len(sent),
        "repeated": int((sent["attempt"] > 0).sum()),
        "verdicts": {verdict.claim.id: verdict.status for verdict in judge(trace, CLAIMS)},
    }  # fmt: skip


def table(rows: list[dict[str, Any]]) -> list[str]:
    """When the last UGV arrived, by scenario, delay and loss; then all verdicts that are not 'holds'."""
    cells, others = defaultdict[Any, list[dict[str, Any]]](list), defaultdict[str, list[str]](list)
    for row in rows:
        cells[row["scenario"], row["delay_s"], row["loss"]].append(row)
        where = f"{row['scenario']} {row['delay_s']:g} s {100 * row['loss']:g} % seed {row['seed']}"
        for claim, status in row["verdicts"].items():
            if status != "holds":
                others[f"{claim} {status}"].append(where)
    delays, losses = sorted({row["delay_s"] for row in rows}), sorted({row["loss"] for row in rows})
    lines = [
        "| scenario | " + " | ".join(f"{delay:g} s" for delay in delays) + " |",
        "| --- " * (1 + len(delays)) + "|",
    ]
    for scenario in dict.fromkeys(row["scenario"] for row in rows):
        shown = [" / ".join(_cell(cells[scenario, delay, loss]) for loss in losses) for delay in delays]
        lines.append(f"| `{scenario}` | " + " | ".join(shown) + " |")
    return [*lines, "", *(f"{what}: {len(where)}: {'; '.join(sorted(where))}" for what, where in others.items())]


def _cell(rows: list[dict[str, Any]]) -> str:
    """The latest arrival, s; in bold, how many UGVs did not arrive."""
    missing = sum(row["of"] - row["arrived"] for row in rows)
    return f"**{missing} not**" if missing else f"{max((row['last_s'] for row in rows), default=0.0):.1f}"


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenarios", nargs="+", default=SCENARIOS)
    parser.add_argument("--delays", nargs="+", type=float, default=[0.0, 0.1, 0.3, 1.0])
    parser.add_argument("--losses", nargs="+", type=float, default=[0.0, 0.1, 0.5])
    parser.add_argument("--seeds", type=int, default=1, help="of the channel: 1 up to this")
    parser.add_argument("--between", choices=["all", "ugvs"], default="all", help="whose messages are late and lost")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, default=Path("channel.jsonl"))
    given = parser.parse_args()
    rows = [json.loads(line) for line in given.output.read_text().splitlines()] if given.output.exists() else []
    made = {(row["scenario"], row["delay_s"], row["loss"], row["seed"]) for row in rows}
    wanted = product(given.scenarios, given.delays, given.losses, range(1, given.seeds + 1))
    with ProcessPoolExecutor(given.jobs) as pool, given.output.open("a", encoding="utf-8") as file:
        for future in as_completed([pool.submit(run, *each, given.between) for each in wanted if each not in made]):
            rows.append(future.result())
            print(json.dumps(rows[-1]), file=file, flush=True)
    print("\n".join(table(sorted(rows, key=lambda row: given.scenarios.index(row["scenario"])))))


if __name__ == "__main__":
    main()
