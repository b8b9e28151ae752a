"""Claims about a run, decided from its trace alone; one claim, one file, named by its identifier.

Nothing here imports the code that it judges. What several claims share: `pairs.py` (who keeps apart from whom),
`instants.py` (control samples, interventions), `control_law.py` (what robots are to be commanded), `triggers.py`
(recorded and recomputed), `proposals.py` and `standing.py` (messages), `gate_record.py` (a recorded decision),
`convex_bounds.py` (of its optimum), `beginnings.py` and `closed_loops.py` (what a decision predicts).
"""
