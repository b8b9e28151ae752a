"""Claims about a run, decided from its trace alone; one claim, one file, named by its identifier.

Nothing here imports the code that it judges. What several claims share: `pairs.py` (who keeps apart from whom),
`control_samples.py`, `interventions.py`, `trigger_record.py`, `trigger_replay.py`, `gate_record.py` (a recorded
decision), `convex_bounds.py` (of its optimum).
"""
