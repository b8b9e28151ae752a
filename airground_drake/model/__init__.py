"""The model: geometry, bodies and their plants, the UGVs' law, the trigger; no Drake, no files.

Enters: numbers.
Leaves: numbers.
May import: `base`.
"""
