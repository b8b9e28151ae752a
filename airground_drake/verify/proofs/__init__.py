"""General theorems, proved once and checked by Coq (`coq/*.v`); what they need is checked in every report."""

from airground_drake.verify.proofs.record import Standing, standing
from airground_drake.verify.proofs.theorems import THEOREMS, Theorem

__all__ = ["THEOREMS", "Standing", "Theorem", "standing"]
