"""Formulas as MathML."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pytest

from airground_drake.audit.typeset import FORMULAS
from airground_drake.report.mathml import mathml
from airground_drake.verify.claim import Claim
from airground_drake.verify.registry import model_claims, run_claims

CLAIMS = [*run_claims(), *model_claims()]


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: str(claim.id))
def test_every_claim_has_a_plain_sentence_and_a_formula_that_can_be_typeset(claim: Claim) -> None:
    assert claim.summary.endswith(".")
    assert 20 < len(claim.summary) <= 110
    assert claim.latex
    for row in claim.latex:
        well_typeset(row)


@pytest.mark.parametrize("number", FORMULAS)
def test_every_formula_of_a_finding_can_be_typeset(number: int) -> None:
    for row in [row for rows in FORMULAS[number] for row in rows]:
        well_typeset(row)


def well_typeset(row: str) -> None:
    root = ET.fromstring(mathml(row))
    assert root.tag.endswith("math")
    assert not [element.text for element in root.iter() if "\\" in (element.text or "") or "&" in (element.text or "")]


def test_what_cannot_be_typeset_is_shown_as_it_is() -> None:
    assert mathml(r"<b> \frac{") == r"<code>&lt;b&gt; \frac{</code>"


def test_a_formula_of_others_stays_text() -> None:
    shown = mathml(r"\text{<script>a()</script>} \href{javascript:a()}{x} \style{color:red}{y} < \lVert z \rVert")
    assert "<script" not in shown
    assert "javascript" not in shown
    assert "&lt;script&gt;" in shown or "<code>" in shown
