"""What tests make instead of running the simulator: scenarios, traces, and problems of the gatekeeper.

- `scenarios`: resolved ones, small or of case A, and changes of them.
- `layout`: the one way to make a trace; `simulation` makes one by a small simulation, `paths` along given corners.
- `runs`: traces that many tests share; `edits` returns edited copies; `decisions` records six of a gatekeeper.
- `problems` and `closed_loop`: problems (26) and closed loops without a run.

Nothing here is shared with the checkers; of the package the avoidance inequalities and the rules of the gatekeeper's
answer are used.
"""
