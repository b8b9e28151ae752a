"""An obligation that is proved."""

from __future__ import annotations

from airground_drake.verify.engines.obligation import Obligation, Term

STEP = Obligation(
    name="step",
    says="a step along an inequality keeps the distance",
    variables=("D", "d", "s", "h", "r"),
    goal="D + s*r - d",
    hypotheses={"safe": "D - d", "forward": "s", "within": "h - s", "inequality": "h*r + D - d"},
    strict={"period": "h"},
    multiplier=(Term(factors=("period",)),),
    certificate=(Term(factors=("forward", "inequality")), Term(factors=("safe", "within"))),
)
"""h (D + s r - d) = s (h r + D - d) + (D - d) (h - s)."""
