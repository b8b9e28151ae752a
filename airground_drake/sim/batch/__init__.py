"""Runs as one compiled loop, bit by bit the same as Drake's Simulator makes them.

`noise` has Drake's stream of noise, `loop` the compiled loop, `run` sets a run up, calls planner and gatekeepers, and
makes the trace. What the loop cannot do is for Drake: see `run.Batch`.
"""
