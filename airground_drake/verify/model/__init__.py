"""What claims about the model share.

A theorem and its hypotheses (`theorem.py`), the trigger (`levels.py`). Of experiments: paths of THR-DDM
(`first_passages.py`) and of ZENO-REFINE (`refined_paths.py`).
"""
