"""What claims about the model share: a theorem and its hypotheses (`theorem.py`), the trigger (`levels.py`)."""
