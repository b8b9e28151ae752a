"""Joint plans for robots as moving discs among obstacles of any shape: pure planar geometry.

The policy `coordinate` calls `joint`, which first plans for one robot after the other. For each of them `single` plans
a way among the robots planned before. It uses the graph of `roadmap` and the search of `intervals`. If that fails,
`first_plan` searches joint steps (`lacam`, `pibt`) on a `coarse` roadmap, and `network` turns them into times.
`neighbourhoods` improves a plan, and straightens its ways. `timed` has exact distances of timed motions.
Times are in s from the beginning of the plan, places in m in the plane of the caller's world frame.
"""
