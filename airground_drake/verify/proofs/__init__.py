"""General theorems, checked once by Coq (`coq/*.v`); every report checks their hypotheses."""

from airground_drake.verify.proofs.record import Standing, standing
from airground_drake.verify.proofs.theorems import THEOREMS, Theorem

__all__ = ["THEOREMS", "Standing", "Theorem", "standing"]
