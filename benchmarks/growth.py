"""How the cost of a run grows with robots, obstacles, duration and decisions: `python benchmarks/growth.py --large`.

Random teams that cross a field of random obstacles under method (d), one row for each size: CPU time, s, of the
simulation (building its diagram included), of the claims, of the report's document, figures and page, and of the
independent checker on all files of the report; claims about the model are left out. `exponent` is the slope of the
logarithm of simulation, claims, report and check against that of the size, from the row before. Every row is of the
same process, so that ratios mean something where the seconds do not.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd

from airground_drake.base import files
from airground_drake.campaign.course import Course
from airground_drake.check.report import check_report
from airground_drake.report import document, html
from airground_drake.report.after_runs import provenance
from airground_drake.report.figures.draw import draw
from airground_drake.run import trace
from airground_drake.run.simulation import simulate
from airground_drake.scenarios.load import load
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify import verify

AXES: dict[str, tuple[float, ...]] = {
    "ugvs": (2, 4, 8),
    "obstacles": (3, 10, 30),
    "duration_s": (10.0, 20.0, 40.0),
    "zeta_m": (100.0, 1.0, 0.25),
}
LARGE: dict[str, tuple[float, ...]] = {
    "ugvs": (2, 5, 20, 50, 100, 200),
    "obstacles": (3, 30, 300, 1000, 3000),
    "duration_s": (10.0, 40.0, 160.0, 640.0),
    "zeta_m": (100.0, 2.0, 1.0, 0.5, 0.25),
}
USUAL = {"ugvs": 4, "obstacles": 8, "duration_s": 20.0, "zeta_m": 2.0}
STAGES = ("simulation", "claims", "report", "check")


def scenario_of(ugvs: float, obstacles: float, duration_s: float, zeta_m: float) -> Scenario:
    """A team on a field as wide as it needs to be."""
    course = Course((int(ugvs),) * 2, (int(obstacles),) * 2, width_m=max(16.0, 6.0 * ugvs, 2.0 * obstacles))
    given = {
        "duration_s": duration_s,
        "decision.threshold.zeta_m": zeta_m,
        "decision.release_m": 0.5 * zeta_m,
        "intervention.policies": [{"name": "detour", "parameters": {"speed_m_s": 2.5}}],
        "runs": {"d": {"method": "d"}},
    }
    return load("minimal", given | course.values(np.random.default_rng(1), 2.0, 2.0))[0]


def measured(scenario: Scenario) -> dict[str, float]:
    """CPU time of each stage, s, and how much there was to do."""
    seconds: dict[str, float] = {}

    def timed(stage: str, work: Callable[[], Any]) -> Any:
        started = time.process_time()
        found = work()
        seconds[stage] = time.process_time() - started
        return found

    run = timed("simulation", lambda: simulate(scenario, "d"))
    verdicts = timed("claims", lambda: verify(run))
    with TemporaryDirectory() as made:
        folder = Path(made)

        def report() -> None:
            whole = document.build(scenario, "", {"d": run}, verdicts, provenance(scenario, files_at, ""))
            names = [f"trace/d/{name}" for name in trace.save(run, folder / "trace" / "d")]
            files.write_text(folder / "report.html", html.render(whole, draw(scenario, {"d": run}), ""))
            files.write_json(folder / "report.json", document.sealed(whole, folder, [*names, "report.html"]))

        files_at = pd.Timestamp.now("UTC").to_pydatetime()
        timed("report", report)
        timed("check", lambda: check_report(folder))
    return {"rows": len(run.signals), "decisions": len(run.decisions)} | seconds


def main() -> None:
    """Measure, print, and write JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--large", action="store_true", help="up to 200 UGVs, 3,000 obstacles, 640 s")
    parser.add_argument("--axes", nargs="*", choices=AXES, default=list(AXES), help="which to vary (default: all)")
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    measured(scenario_of(**USUAL | {"duration_s": 1.0}))
    rows: list[dict[str, Any]] = []
    for axis in options.axes:
        before: dict[str, Any] = {}
        for size in (LARGE if options.large else AXES)[axis]:
            given = USUAL | {axis: size}
            row: dict[str, Any] = {"axis": axis, "size": size, **measured(scenario_of(**given))}
            row["times real time"] = given["duration_s"] / row["simulation"]
            if before and axis != "zeta_m":
                step = math.log(size / before["size"])
                slopes = [math.log(row[stage] / before[stage]) / step for stage in STAGES]
                row["exponents"] = " ".join(f"{slope:.1f}" for slope in slopes)
            rows.append(row)
            before = row
            print({name: f"{each:.3g}" if isinstance(each, float) else each for name, each in row.items()}, flush=True)
    table = pd.DataFrame(rows)
    print("\n" + table.to_string(index=False, float_format="%.3g", na_rep=""))
    if options.json:
        table.to_json(options.json, orient="records", indent=1)


if __name__ == "__main__":
    main()
