"""Claims about the model and its constants; each file is named after its claim.

Safety begins with `safe_inv.py`, the trigger with `zeno_proof.py`, the threshold with `thr_root.py`. Several share
`theorem.py` (a theorem and its hypotheses) and `levels.py` (the trigger).
THR-DDM simulates `first_passages.py`, ZENO-REFINE `refined_paths.py`.
"""
