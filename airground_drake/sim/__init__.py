"""From a scenario to what its runs leave behind: simulation, events, traces.

Enters: a Scenario.
Leaves: a Drake Diagram, and the Trace of a run.
May import: `base`, `model`, `uav`, `ugv`, `scenario`.

Used by claims, reports, campaigns and tests.
"""
