"""Reports: report.json is the truth; HTML, JUnit and the figures render it.

Enters: findings and traces.
Leaves: report.json, pages, figures, replays, exported files.
May import: `base`, `check`, `model`, `uav`, `ugv`, `scenario`, `sim`, `verify`.
"""
