"""Bodies, shapes, plants and motions, and who keeps what distance from whom; no Drake, no numba.

Controllers, gatekeepers, systems and events use it. Claims read safe distances from the scenario themselves.
"""
