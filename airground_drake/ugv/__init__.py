"""Accepting or refusing an intervention, eqs (21)-(29): prediction, problem, solution routes, answer.

Enters: a proposal, and what the UGV sees.
Leaves: an answer, with its reason.
May import: `base`, `model`, `uav`.
"""
