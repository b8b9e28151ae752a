"""What claims about a run share, all of it from the trace alone; nothing here imports the code that it judges.

Who keeps apart from whom (`pairs.py`), whose doing it was that they did not (`encounters.py`, `passive.py`), control
samples and interventions (`instants.py`), avoidance inequalities (`control_law.py`) and parameters (`demands.py`),
triggers recorded and recomputed (`triggers.py`), proposals as recorded (`proposals.py`), acceptances under method (d)
(`acceptances.py`), a recorded decision (`gate_record.py`) and its optimum (`convex_bounds.py`). That the code does what
it is designed to do is tested: `tests/oracles` judges runs by other code.
"""
