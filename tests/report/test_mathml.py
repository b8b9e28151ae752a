"""Formulas as MathML."""

import xml.etree.ElementTree as ET

from airground_drake.report.audit.item import FORMULAS
from airground_drake.report.html import mathml
from airground_drake.verify.registry import model_claims, run_claims


def test_every_formula_of_claims_and_findings_can_be_typeset() -> None:
    claims = [*run_claims(), *model_claims()]
    for claim in claims:
        assert claim.summary.endswith(".")
        assert 20 < len(claim.summary) <= 110
        assert claim.latex
    formulas = [row for claim in claims for row in claim.latex]
    for row in [*formulas, *(row for found in FORMULAS.values() for rows in found for row in rows)]:
        root = ET.fromstring(mathml(row))
        assert root.tag.endswith("math")
        assert not [e.text for e in root.iter() if "\\" in (e.text or "") or "&" in (e.text or "")]


def test_a_formula_that_cannot_be_typeset_or_is_hostile_stays_text() -> None:
    assert mathml(r"<b> \frac{") == r"<code>&lt;b&gt; \frac{</code>"
    shown = mathml(r"\text{<script>a()</script>} \href{javascript:a()}{x} \style{color:red}{y} < \lVert z \rVert")
    assert "<script" not in shown
    assert "javascript" not in shown
    assert "&lt;script&gt;" in shown or "<code>" in shown
