"""What the terminal cost of (26) changes under method (c).

    python benchmarks/terminal.py case_b pocket --weights 0 0.25 0.46 2

Each run is one row: how many proposals, how many of them accepted at first; the costs of accepting throughout over
those of refusing throughout at the first decisions; and where the first UGV ends.
"""

from __future__ import annotations

import argparse

from airground_drake.run.simulation import simulate
from airground_drake.scenarios.load import load


def row(name: str, weight_s: float) -> str:
    """Of a scenario's run (c) with that weight."""
    trace = simulate(load(name, [f"gatekeeper.terminal_weight_s={weight_s}"])[0], "c")
    firsts = trace.decisions.groupby("issued_s", sort=False).first()
    ratios = [
        f"{one.policy} {one.accept_throughout / one.refuse_throughout:.2f} ({one.decision})"
        for one in firsts.head(2).itertuples()
    ]
    x, y, _ = trace.position(trace.ugvs[0])[-1]
    accepted = int((firsts["decision"] == "accept").sum())
    return f"| {name} | {weight_s:g} | {len(firsts)} | {accepted} | {', '.join(ratios)} | ({x:.2f}, {y:.2f}) |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenarios", nargs="+")
    parser.add_argument("--weights", nargs="+", type=float, default=[0.0, 0.25])
    options = parser.parse_args()
    print("| scenario | weight s | proposals | accepted | accepting / refusing | ends at m |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name in options.scenarios:
        for weight_s in options.weights:
            print(row(name, weight_s), flush=True)


if __name__ == "__main__":
    main()
