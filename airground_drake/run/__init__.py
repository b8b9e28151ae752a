"""From a scenario to what its runs leave behind: simulation, events, traces.

Used by claims, reports, campaigns and tests.
"""
