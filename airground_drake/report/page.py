"""report.html from report.json, the traces and the drawing of the diagram; `rebuild` makes it again to compare."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from airground_drake.report import html
from airground_drake.report.figures import findings, model
from airground_drake.report.figures.panels import Figure

BESIDE = 9  # finding about the paper beside which the figure of ZENO-REFINE is shown, if it is in the report


def page(report: Mapping[str, Any], figures: Sequence[Figure], diagram_svg: str | None) -> str:
    claims = {claim["id"]: claim for claim in report["claims"] if not claim["run"]}
    plates = [*figures]
    if "ZENO-REFINE" in claims and (refined := model.refinement(claims["ZENO-REFINE"]["evidence"])):
        audited = any(item["id"] == BESIDE for item in report["audit"])
        plates.append(replace(refined, beside=f"audit-{BESIDE}") if audited else refined)
    if "THR-CHOICE" in claims:
        chosen = model.bayes_risks(claims["THR-CHOICE"]["inputs"], claims["THR-CHOICE"]["evidence"])
        plates += [chosen] if chosen else []
    return html.render(report, [*plates, *findings.draw(report["audit"])], diagram_svg)
