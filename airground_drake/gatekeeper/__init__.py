"""The accept/refuse decision, eqs (21)-(29): prediction, problem, solution routes."""
