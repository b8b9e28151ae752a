"""A run: simulate it, look at it, judge it.

python examples/run.py
"""

from __future__ import annotations

from airground_drake import judge, load, simulate

if __name__ == "__main__":
    trace = simulate(load("case_a", {"seed": 1}), "d")
    for event in trace.events:
        print(f"{event['t_s']:7.3f} s  {event['robot']:5}  {event['kind']}")
    print(trace.messages.groupby("kind").size().to_string())
    for verdict in judge(trace):
        margin = "" if verdict.margin is None else f", margin {verdict.margin:.3g} {verdict.unit}"
        print(f"{verdict.claim.id}: {verdict.status}{margin}")
