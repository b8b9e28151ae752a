"""Mutants of the package, and the runs that judge each; see `benchmarks/mutants.py`."""
