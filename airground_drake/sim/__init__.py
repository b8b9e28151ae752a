"""From a scenario to the traces of its runs: simulation, events, records.

Enters: a Scenario.
Leaves: a Drake Diagram, and the Trace of a run.
May import: `base`, `model`, `uav`, `ugv`, `scenario`.

Used by claims, reports, campaigns and tests.
"""
