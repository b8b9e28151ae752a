"""Runs in one compiled loop, bit by bit equal to those of Drake's Simulator.

`noise` has Drake's stream of noise, `loop` the compiled loop, `run` sets a run up, calls planner and gatekeepers, and
makes the trace. Drake makes the runs that the loop does not support: see `run.Batch`.
"""
