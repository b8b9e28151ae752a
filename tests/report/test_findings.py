"""Pictures of findings about the paper."""

import xml.etree.ElementTree as ET

import numpy as np

from airground_drake.report.audit.formulas import formula_findings
from airground_drake.report.audit.thresholds import threshold_findings
from airground_drake.report.figures import findings
from airground_drake.report.figures.findings import of_finding
from airground_drake.report.view import canvas
from airground_drake.scenario.load import load
from airground_drake.verify.finding import Chart


def test_what_is_computed_is_drawn_with_its_marks() -> None:
    scenario = load("case_a")
    drawn = {
        figure.id: figure for figure in findings.draw([*threshold_findings(scenario, {}), *formula_findings(scenario)])
    }
    assert set(drawn) == {f"audit-{number}" for number in (3, 4, 5, 17, 18)}
    for name, says in {
        "audit-3": "by finite differences: (0.1, 0.438)",
        "audit-4": "6.07 m/s: (6.07, 3)",
        "audit-5": "10, finite differences: (10, 0.09)",
        "audit-17": "reported, case_b: (0.764, 10.6)",
        "audit-18": "one, finite differences: (6.05, 0.496)",
    }.items():
        assert says in drawn[name].caption
    assert all(figure.panels[0].table.rows and figure.beside == name for name, figure in drawn.items())


def test_what_the_papers_table_says_no_override_changes() -> None:
    overrides = ["decision.threshold.zeta_m=4", "decision.threshold.noise_m_sqrt_s=2", "decision.threshold.drift_m_s=1"]
    kept, changed = (threshold_findings(load("case_a", given), {}) for given in ([], overrides))
    for number in (4, 5, 18):
        before, after = (next(each for each in found if each["id"] == number) for found in (kept, changed))
        assert (before["paper"], before["ours"], before["finding"]) == (after["paper"], after["ours"], after["finding"])


def test_logarithmic_axes_show_the_values_themselves_and_points_without_extent_can_be_drawn() -> None:
    x, still = np.array([0.1, 1000.0]), np.ones(2)
    for at, shown in ((x, {"0.1", "10", "1000", "x, m", "y, s", "line", "mark"}), (still, {"line", "mark"})):
        with canvas.style():
            figure = of_finding(Chart("Powers", "x, m", "y, s", {"line": (at, at)}, {"mark": (1.0, 1.0)}, log="xy"), 1)
        texts = ET.fromstring(figure.panels[0].svg).iter("{http://www.w3.org/2000/svg}text")
        assert shown <= {"".join(each.itertext()).strip() for each in texts}
