"""The table and the explanations of the benchmark of liveness, on made-up runs."""

from typing import Any

import liveness
import maps


def robot(arrival: float | None, **more: Any) -> dict[str, Any]:
    return {"arrival_s": arrival, "end_m": [1.0, 2.0], "short_m": 0.0 if arrival else 9.0, "touches": [], **more}


def row(seed: int, method: str, *robots: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {
        "seed": seed, "ugvs": len(robots), "density": 1.0, "walls": False, "method": method,
        "plan": "feasible", "lower_bound_s": [20.0] * len(robots), "robots": list(robots), "least_ugv_m": None,
        "least_obstacle_m": 2.0, "triggers": 1, "messages": 2, "decisions": 3, **more,
    }  # fmt: skip


STUCK = robot(None, touches=["obstacle_1"], reasons={"not_cheaper": 4, "kept": 2}, triggers=1)


def test_table_counts_who_arrived() -> None:
    rows = [row(0, "d", robot(30.0), robot(20.0)), row(1, "d", robot(20.0), STUCK, least_obstacle_m=1.9)]
    cells = liveness.table(rows)[-1].split(" | ")
    assert cells[:8] == ["| 2", "1", "d", "2", "1", "3 of 4", "-", "1.9000"]
    assert cells[8:10] == ["1", "1.00"]


def test_unfinished_courses_and_broken_distances_are_explained() -> None:
    rows = [row(0, "d", robot(30.0)), row(7, "d", STUCK), row(8, "c", STUCK), row(9, "d", error="SimulationError: x")]
    rows += [row(3, "d", robot(30.0), least_obstacle_m=maps.SAFE_M - 1e-6)]
    assert list(liveness.explanations(rows, "d")) == [
        "seed 7, 1 UGVs: ugv1 at (1.00, 2.00), 9.00 m short, touching obstacle_1; 1 triggers, decisions: kept 2, "
        "not_cheaper 4",
        "seed 9, 0 UGVs: SimulationError: x",
        "seed 3, 1 UGVs: below d: None m to UGVs, 1.999999 m to obstacles",
    ]


def test_feasibility_of_a_course() -> None:
    times, status = liveness.bounds(maps.draw(0, 4))
    assert status == liveness.FEASIBLE
    assert len(times) == 4
    assert min(times) >= (maps.COURSE_M - 2.0 * maps.STRIP_M) / maps.PRESET_M_S
    dense = [liveness.bounds(maps.draw(seed, 1, 3.0, walls=True))[1] for seed in range(3)]
    assert liveness.SEPARATED in dense
