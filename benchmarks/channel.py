"""Who arrives when messages are late and lost: `python benchmarks/channel.py --seeds 3 --jobs 2 -o channel.jsonl`.

Simulates method (d) with every delay, loss and seed of the channel; without loss the seed changes nothing, and there is
one. A scenario is a shipped one or `map0`, `map1`, ...: random maps with four UGVs (`maps.py`). With `--ugvs` positions
between UGVs are lost, too. Each run becomes a line of JSON; runs that the file has are not made again. At the end there
is a table: when the last UGV arrived, or how many did not; with several seeds the latest. All maps make one row. Below
it: what was judged otherwise than `holds`, and UGVs that did not arrive though they had accepted something.

    python benchmarks/channel.py --scenarios swap crossing doorway lab --delays 0 --losses 0 --ugvs 0 0.1 0.5 --seeds 3
    python benchmarks/channel.py --scenarios map{0..29} --delays 0 1 --losses 0 0.5

With `--asynchronous` positions between UGVs are late and lost, under that law, in place of messages from and to UAVs.
"""

import argparse
import json
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import maps

from airground_drake.scenario.load import from_data, load, validated
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.simulation import simulate
from airground_drake.verify import judge

SCENARIOS = ["case_a", "case_b", "lab", "swap", "crossing", "intersection", "doorway", "turtlebots"]
CLAIMS = ("SAFE-TRACE", "SAFE-OWN", "SAFE-HYP", "LIVE-HYP")
MAP, TEAM = "map", 4
KEYS = ("scenario", "delay_s", "loss", "ugvs_loss", "seed")


def over(scenario: str, **changes: Any) -> Scenario:
    """Run d of a shipped scenario or of a random map, with a channel."""
    if scenario.removeprefix(MAP).isdecimal():
        course = maps.draw(int(scenario.removeprefix(MAP)), TEAM)
        given = from_data(maps.scenario_of(course, [{"name": "coordinate"}]), course.name)
    else:
        given = load(scenario)
    return validated(replace(given, runs={"d": given.runs["d"]}, reproduction=[]), changes)


def run(
    scenario: str, delay_s: float, loss: float, ugvs_loss: float = 0.0, seed: int = 1, *, asynchronous: bool = False
) -> dict[str, Any]:
    """One run, in numbers."""
    links = {"delay_s": delay_s, "loss": loss}
    changes: dict[str, Any] = {"channel": links | {"seed": seed}}
    if ugvs_loss:
        changes["channel"]["ugvs"] = {"loss": ugvs_loss}
    if asynchronous:
        changes = {"channel": {"seed": seed, "ugvs": links}, "control.law": "asynchronous"}
    trace = simulate(over(scenario, **changes), "d")
    arrived = {
        event["robot"]: event["t_s"]
        for event in trace.events if event["kind"] == "arrival" and event["robot"] in trace.ugvs
    }  # fmt: skip
    accepted = {*trace.decisions.loc[trace.decisions["decision"] == "accept", "robot"]}
    sent = trace.messages.drop_duplicates(["kind", "number", "attempt"])
    return {
        "scenario": scenario, "delay_s": delay_s, "loss": loss, "ugvs_loss": ugvs_loss, "seed": seed,
        "arrived": len(arrived), "of": len(trace.ugvs), "last_s": max(arrived.values(), default=None),
        "starved": sorted(accepted - {*arrived}), "messages": len(sent), "repeated": int((sent["attempt"] > 0).sum()),
        "verdicts": {verdict.claim.id: verdict.status for verdict in judge(trace, CLAIMS)},
    }  # fmt: skip


def table(rows: list[dict[str, Any]]) -> list[str]:
    """When the last UGV arrived, by scenario, delay and losses; then all that is not as it should be."""
    cells, others = defaultdict[Any, list[dict[str, Any]]](list), defaultdict[str, list[str]](list)
    for row in rows:
        row["row"] = "random maps" if row["scenario"].removeprefix(MAP).isdecimal() else f"`{row['scenario']}`"
        cells[row["row"], row["delay_s"], row["loss"], row["ugvs_loss"]].append(row)
        where = " ".join(f"{row[key]}" for key in KEYS)
        for claim, status in row["verdicts"].items():
            if status != "holds":
                others[f"{claim} {status}"].append(where)
        if row["starved"]:
            others["not arrived though it accepted"].append(f"{where}: {' '.join(row['starved'])}")
    columns = sorted({(row["delay_s"], row["ugvs_loss"]) for row in rows})
    losses = sorted({row["loss"] for row in rows})
    heads = [f"{delay:g} s{f', {100 * lost:g} % between UGVs' if lost else ''}" for delay, lost in columns]
    lines = [f"| scenario | {' | '.join(heads)} |", "| --- " * (1 + len(columns)) + "|"]
    for name in dict.fromkeys(row["row"] for row in rows):
        shown = [" / ".join(_cell(cells[name, delay, loss, lost]) for loss in losses) for delay, lost in columns]
        lines.append(f"| {name} | " + " | ".join(shown) + " |")
    return [*lines, "", *(f"{what}: {len(where)}: {'; '.join(sorted(where))}" for what, where in others.items())]


def _cell(rows: list[dict[str, Any]]) -> str:
    """The latest arrival, s; in bold, how many UGVs did not arrive, of how many; -: no run."""
    if not rows:
        return "-"
    missing, every = sum(row["of"] - row["arrived"] for row in rows), sum(row["of"] for row in rows)
    return f"**{missing} of {every}**" if missing else f"{max(row['last_s'] for row in rows):.1f}"


def _counts(_: str, __: float, loss: float, ugvs_loss: float, seed: int) -> bool:
    """Whether the seed of a run matters, or is the first one."""
    return seed == 1 or loss + ugvs_loss > 0.0


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenarios", nargs="+", default=SCENARIOS)
    parser.add_argument("--delays", nargs="+", type=float, default=[0.0, 0.1, 0.3, 1.0])
    parser.add_argument("--losses", nargs="+", type=float, default=[0.0, 0.1, 0.5])
    parser.add_argument("--ugvs", nargs="+", type=float, default=[0.0], help="losses of positions between UGVs")
    parser.add_argument("--asynchronous", action="store_true", help="positions between UGVs, under that law")
    parser.add_argument("--seeds", type=int, default=1, help="of the channel: 1 up to this")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, default=Path("channel.jsonl"))
    given = parser.parse_args()
    rows = [json.loads(line) for line in given.output.read_text().splitlines()] if given.output.exists() else []
    made = {tuple(row[key] for key in KEYS) for row in rows}
    wanted = product(given.scenarios, given.delays, given.losses, given.ugvs, range(1, given.seeds + 1))
    with ProcessPoolExecutor(given.jobs) as pool, given.output.open("a", encoding="utf-8") as file:
        left = [keys for keys in wanted if keys not in made and _counts(*keys)]
        for future in as_completed([pool.submit(run, *keys, asynchronous=given.asynchronous) for keys in left]):
            rows.append(future.result())
            print(json.dumps(rows[-1]), file=file, flush=True)
    order = [*dict.fromkeys([*SCENARIOS, *(row["scenario"] for row in rows)])]
    print("\n".join(table(sorted(rows, key=lambda row: order.index(row["scenario"])))))


if __name__ == "__main__":
    main()
