"""What claims about a run share, all of it from the trace alone; nothing here imports the code that it judges.

Who keeps apart from whom (`pairs.py`), whose doing it was that they did not (`encounters.py`, `passive.py`), avoidance
inequalities (`control_law.py`) and parameters (`demands.py`), triggers recorded and recomputed (`triggers.py`),
interventions, proposals and acceptances (`proposals.py`), recorded decisions (`gate_record.py`). That the code does
what it is designed to do is tested: `tests/oracles` judges runs by other code.
"""
