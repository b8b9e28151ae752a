"""Computations that several claims use; no module here knows a claim.

`geometry.py`: exact geometry of straight motion, and which pairs come near each other at all. `outlines.py`: distances
from walls, polygons and prisms. `shortfalls.py`: the avoidance inequality, and by how much positions miss it, exactly.
`signs.py`: signs of (16)-(19) in ball arithmetic.
"""
