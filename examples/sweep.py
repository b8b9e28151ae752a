"""A sweep: one key of a scenario with several values, and what becomes of the run.

python examples/sweep.py
"""

from __future__ import annotations

import pandas as pd

from airground_drake import load, simulate


def sweep(key: str, values: list[float]) -> pd.DataFrame:
    """First trigger and arrival of ugv1 in run d of case A, s, by value of the key; NaN without one."""
    rows = []
    for value in values:
        events = simulate(load("case_a", {key: value}), "d").events
        first = {e["kind"]: e["t_s"] for e in reversed(events) if e["robot"] == "ugv1"}
        rows.append({key: value, "trigger_s": first.get("trigger"), "arrival_s": first.get("arrival")})
    return pd.DataFrame(rows, dtype=float).set_index(key)


if __name__ == "__main__":
    print(sweep("decision.threshold.zeta_m", [2.5, 3.0, 4.0]).to_string())
