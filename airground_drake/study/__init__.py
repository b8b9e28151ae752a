"""Many runs, learning, recorded logs, users' tests: `campaign`, `environments`, `logs`, `testing`.

Enters: scenarios, specs of campaigns, logs.
Leaves: rows, evidence, environments, verdicts on logs.
May import: `base`, `check`, `model`, `uav`, `ugv`, `scenario`, `sim`, `verify`, `report`.
"""
