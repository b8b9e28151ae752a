"""Joint plans for robots as moving discs among discs: prioritised safe-interval planning, pure planar geometry.

`roadmap` makes the graph on which robots move, `intervals` finds when it is free and searches it, `timed` has the exact
distances of timed motions. `single` plans for one robot among those planned already, `joint` tries orders, `smoothing`
straightens ways. Times are in s from the beginning of the plan, places in m in the plane of the caller's world frame.
"""
