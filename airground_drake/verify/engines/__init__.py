"""What proves and computes, and knows no claim.

`obligation.py` implications between polynomial inequalities with certificates, `rewriting.py` made from others,
`prover.py` proved in three ways, `smt.py` solvers in processes of their own; `ball_arithmetic.py` signs of elementary
functions; `symbolic_execution.py` code run on symbols; `rounding.py` vectors in binary64; `segments.py` exact geometry
of straight motion.
"""
