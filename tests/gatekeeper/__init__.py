"""A package, so that it is found before the module of this name in `benchmarks/`."""
