"""Errors e of the avoidance inequalities in every shipped run, and the distances that they guarantee: a table.

    python benchmarks/guarantees.py [scenario ...]

For each run the pair with the smallest guaranteed distance, see SAFE-HYP: e, in metres per control period; the loss of
safe distance, e / (A h); the guaranteed distance. Under method (d) also how many accepted interventions met the premise
of LIVE-GATE.
"""

from __future__ import annotations

import argparse

from airground_drake.scenario.load import load
from airground_drake.scenario.shipped import shipped
from airground_drake.sim.simulation import simulate
from airground_drake.verify import judge
from airground_drake.verify.claims.live_gate import LiveGate


def main() -> None:
    """Simulate, judge and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenarios", nargs="*", default=shipped(), help="names or files; default: all that are shipped")
    applies_to = accepted = 0
    print("| scenario | run | SAFE-HYP | pair | d, m | e, m/period | e/(A h), m | guarantee, m | LIVE-GATE |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for name in parser.parse_args().scenarios:
        scenario = load(name)
        for run in scenario.runs:
            trace = simulate(scenario, run)
            (verdict,) = judge(trace, ["SAFE-HYP"])
            evidence, (met, found) = verdict.evidence, LiveGate().seen_in(trace)
            applies_to, accepted = applies_to + met, accepted + found
            count = f"{met} of {found}" if found else ""
            row = "all pairs | their own | 0 | 0 | their own"
            if evidence["e_m"] > 0.0:
                worst = evidence["pairs"][0]
                safe, promised = worst["safe_distance_m"], worst["guarantee_m"]
                row = (
                    f"{worst['first']}, {worst['second']} | {safe:.6g} | {worst['e_m']:.6g} | {safe - promised:.6g} | "
                )
                row += f"{promised:.6g}"
            print(f"| {scenario.name} | {run} | {verdict.status} | {row} | {count} |", flush=True)
    print(f"\nThe premise of LIVE-GATE was met by {applies_to} of {accepted} accepted interventions.")


if __name__ == "__main__":
    main()
