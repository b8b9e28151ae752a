"""Pictures of findings about the paper."""

from __future__ import annotations

from airground_drake.report.audit.thresholds import threshold_findings
from airground_drake.report.figures import pictures
from airground_drake.scenarios.load import load


def test_what_is_computed_is_drawn_with_its_marks() -> None:
    items = threshold_findings(load("case_a")[0], {})
    drawn = {figure.id: figure for figure in pictures.draw(items)}
    assert list(drawn) == ["audit-2", "audit-3", "audit-4"]
    assert "root with c2/c1: (0.465, 0.384)" in drawn["audit-2"].caption
    assert "exact, by finite differences: (0.1, 0.438)" in drawn["audit-3"].caption
    assert "6.07 m/s" in drawn["audit-4"].caption
    assert all(figure.panels[0].table.rows and figure.beside == name for name, figure in drawn.items())


def test_what_comes_of_runs_is_drawn_from_what_is_kept_of_them() -> None:
    ways = {
        "printed": {"preset_x_m": 1.3, "way_m": [[1.0, 0.0], [1.3, 3.0]]},
        "ours": {"preset_x_m": -1.3, "way_m": [[1.0, 0.0], [-1.3, 13.0]]},
    }
    gaps = {"t_s": [0.0, 1.0], "c_m": [3.0, 0.8], "d_m": [3.0, 2.0]}
    kept = {"distance_to_the_nearest_obstacle": gaps, "safe_distance_m": 2.0}
    sides, intrusion = pictures.draw([{"id": 7, "evidence": ways}, {"id": 8}, {"id": 10, "evidence": kept}])
    assert "end of x = -1.3 m: (13, -1.3)" in sides.caption
    assert {row[0] for row in intrusion.panels[0].table.rows} == {"c", "d", "safe distance"}
