"""report.html from report.json, the traces and the drawing of the diagram; `rebuild` makes it again to compare."""

from collections.abc import Iterator, Sequence

from airground_drake.report import html, rules
from airground_drake.report.figures import findings
from airground_drake.report.figures.lines import of_chart
from airground_drake.report.figures.panels import Figure
from airground_drake.report.model import Report
from airground_drake.report.view import canvas
from airground_drake.verify.finding import Chart


def page(report: Report, figures: Sequence[Figure], diagram_svg: str | None) -> str:
    of_audit = findings.draw([finding.model_dump() for finding in report.audit])
    return html.render(report, [*figures, *_of_claims(report), *of_audit], diagram_svg)


def _of_claims(report: Report) -> Iterator[Figure]:
    """The charts of claims, where `rules.CHARTS` puts them, or else beside the claim."""
    places = {*html.SECTIONS, *(f"audit-{finding.id}" for finding in report.audit)}
    with canvas.style():
        for number, claim in enumerate(report.claims):
            if claim.figure:
                place = rules.CHARTS.get(claim.id)
                beside = place if place in places else claim.id
                heading = claim.run and f"Run {claim.run}"
                yield of_chart(Chart(**claim.figure), f"chart-{number}", heading, beside)
