"""The scenario file: schema, loading, validation, and the shipped scenarios.

Enters: YAML, maps.
Leaves: a valid Scenario, and its World.
May import: `base`, `model`, `uav`, `ugv`.
"""
