"""Joint plans for robots as moving discs among discs: prioritised safe-interval planning, pure planar geometry.

`roadmap` is where robots can be, `kernels` holds the compiled loops, `timed` the exact distances of timed motions,
`single` plans for one robot among those that are planned already, `joint` tries orders and `smoothing` straightens.
Times are in s from the beginning of the plan, places in m in the plane of the caller's world frame.
"""
