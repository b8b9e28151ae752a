"""Joint plans for robots as moving discs among discs: prioritised safe-interval planning, pure planar geometry.

The policy `coordinate` calls `joint`, which tries orders of the robots. For each robot of an order `single` plans a way
among the robots planned before. It uses the graph of `roadmap` and the search of `intervals`. `smoothing` then
straightens the ways. `timed` has the exact distances of timed motions. Times are in s from the beginning of the plan,
places in m in the plane of the caller's world frame.
"""
