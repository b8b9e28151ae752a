"""Mutants of the package, what is run on each, and the page about them; see `benchmarks/mutants.py`."""
