"""A sweep: a key of a scenario with several values, and what becomes of the run.

python examples/sweep.py
"""

from __future__ import annotations

from airground_drake import load, sweep

if __name__ == "__main__":
    found = sweep(load("case_a"), {"decision.threshold.zeta_m": [2.5, 3.0, 4.0]}, runs=["d"])
    print(found[["decision.threshold.zeta_m", "first_trigger_s", "arrival_s", "SAFE-TRACE"]].to_string(index=False))
