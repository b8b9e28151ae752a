"""Ways to solve (26), one file per route."""
