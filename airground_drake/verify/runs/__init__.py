"""Claims about a run, decided from its trace alone; one claim, one file, named by its identifier.

Nothing here imports the code that it judges. What several claims share: `pairs.py` (who keeps apart from whom),
`instants.py` (control samples, interventions), `control_law.py` (avoidance inequalities), `triggers.py`
(recorded and recomputed), `proposals.py` (as recorded), `acceptances.py` (under method (d)), `sensing.py` (what a UGV
senses), `gate_record.py` (a recorded decision), `convex_bounds.py` (of its optimum). That the code does what it is
designed to do is tested: `tests/oracles` judges runs by other code.
"""
