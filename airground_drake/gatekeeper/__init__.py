"""Accepting or refusing an intervention, eqs (21)-(29): prediction, problem, solution routes, answer."""
