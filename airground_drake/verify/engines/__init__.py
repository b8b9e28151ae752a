"""What computes for claims, and knows none.

`segments.py` exact geometry of straight motion, `boxes.py` what comes near at all, `shortfalls.py` what pairs miss of
their inequalities, exactly; `signs.py` signs of (16)-(19) in ball arithmetic.
"""
