"""Bodies, shapes, plants, motions and the distances to keep; no Drake.

Controllers, gatekeepers, systems and events use it. Claims read safe distances from the scenario themselves.
"""
