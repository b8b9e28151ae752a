"""Code shared by claims about the model: theorems with hypotheses (`theorem.py`), trigger levels (`levels.py`)."""
