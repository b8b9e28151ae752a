"""What the tests about avoidance share."""

from __future__ import annotations

import re
from fractions import Fraction

from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.model.avoidance import mutants
from airground_drake.verify.model.avoidance.safe_dist import SafeDist
from airground_drake.verify.model.avoidance.safe_gate import SafeGate
from airground_drake.verify.model.avoidance.safe_inv import SafeInv
from airground_drake.verify.model.avoidance.safe_lemma import SafeLemma

CLAIMS: tuple[ModelClaim, ...] = (SafeLemma(), SafeInv(), SafeGate(), SafeDist())

MUTANTS = {f"{mutant.claim}: {mutant.says}": mutant for mutant in mutants.MUTANTS}


def evaluate(text: str, point: dict[str, Fraction]) -> Fraction:
    """A polynomial at a point; numbers become fractions, so that '1/20' is exact."""
    return Fraction(eval(re.sub(r"(?<![\w.*])(\d+)(?![\w.])", r"Fraction(\1)", text), {"Fraction": Fraction, **point}))
