"""report.html from report.json, the traces and the drawing of the diagram; `rebuild` makes it again to compare."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from airground_drake.report import html
from airground_drake.report.figures import findings, model
from airground_drake.report.figures.panels import Figure
from airground_drake.report.model import Report

BESIDE = 9  # finding about the paper beside which the figure of ZENO-REFINE is shown, if it is in the report


def page(report: Report, figures: Sequence[Figure], diagram_svg: str | None) -> str:
    claims = {claim.id: claim for claim in report.claims if not claim.run}
    plates = [*figures]
    if "ZENO-REFINE" in claims and (refined := model.refinement(claims["ZENO-REFINE"].evidence)):
        audited = any(finding.id == BESIDE for finding in report.audit)
        plates.append(replace(refined, beside=f"audit-{BESIDE}") if audited else refined)
    if "THR-CHOICE" in claims:
        chosen = model.bayes_risks(claims["THR-CHOICE"].inputs, claims["THR-CHOICE"].evidence)
        plates += [chosen] if chosen else []
    return html.render(
        report, [*plates, *findings.draw([finding.model_dump() for finding in report.audit])], diagram_svg
    )
