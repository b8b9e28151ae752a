"""Code shared by claims about a run; it uses the trace alone, and imports none of the code that it judges.

Pairs that must keep apart (`pairs.py`), causes of approaches (`encounters.py`, `passive.py`), avoidance inequalities
(`control_law.py`) and parameters (`demands.py`), recorded and recomputed triggers (`triggers.py`), proposals and
acceptances (`proposals.py`), recorded decisions (`gate_record.py`). Tests check that the code implements its design:
`tests/oracles` judges runs by separate code.
"""
