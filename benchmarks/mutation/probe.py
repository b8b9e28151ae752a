"""What claims and the checker find on short runs of the package that is on the path; run in a process of its own.

`python probe.py OUT runs|proofs|tamperings|report WHAT...` writes a list of findings as JSON: [source, what] each,
`source` being a claim, `checker: <claim>` or `run`.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
PROBES = {
    "crowd b": (str(HERE / "crowd.yaml"), "b"),
    "crowd c": (str(HERE / "crowd.yaml"), "c"),
    "crowd d": (str(HERE / "crowd.yaml"), "d"),
    "case_a a": ("case_a", "a"),
    "case_a nearest": ("case_a", "a_recursion_nearest"),
    "case_b c": ("case_b", "c"),
    "case_b d": ("case_b", "d"),
    "soft_gate c": ("soft_gate", "c"),
}
"""Name: scenario, run."""

Findings = list[list[Any]]


def runs(names: list[str]) -> Findings:
    """Every verdict, and every check of the independent checker that does not agree."""
    from airground_drake import files, trace
    from airground_drake.check.report import AGREES, check_report
    from airground_drake.errors import AirgroundError
    from airground_drake.report import document
    from airground_drake.scenarios.load import load
    from airground_drake.simulation import simulate
    from airground_drake.verify import verify
    from airground_drake.verify.stl import cross_check as stl

    found: Findings = []
    for name in names:
        source, run = PROBES[name]
        scenario = load(source)[0]
        scenario.runs = {run: scenario.runs[run]}
        scenario.reproduction = []
        try:
            of_run = simulate(scenario, run)
        except AirgroundError as error:
            found.append(["run", name, "stops", str(error)])
            continue
        verdicts = stl.merge(verify(of_run), stl.cross_check(of_run))
        found += [[v.claim.id, name, v.finding.status, ""] for v in verdicts]
        with tempfile.TemporaryDirectory() as there:
            folder = Path(there)
            trace.save(of_run, folder / "trace" / run)
            report = document.build(scenario, "", {run: of_run}, verdicts, {"seed": scenario.seed})
            files.write_json(folder / "report.json", report)
            lines = [line for line in check_report(folder) if line.run]
        found += [[f"checker: {line.claim}", name, "disagrees", line.rule] for line in lines if line.outcome != AGREES]
    return found


def proofs(names: list[str]) -> Findings:
    """Verdicts about the model of case A."""
    from airground_drake.scenarios.load import load
    from airground_drake.verify import verify_model

    verdicts = verify_model(load("case_a")[0], claims=names)
    return [[v.claim.id, "case_a", v.finding.status, ""] for v in verdicts]


def tamperings(names: list[str]) -> Findings:
    """Tamperings that are about these claims and are not refused by the rule that must; the first name is a report."""
    from check.tampering import TAMPERINGS, attempt

    found: Findings = []
    for name, tampering in TAMPERINGS.items():
        if tampering.claim in names[1:]:
            outcome = attempt(Path(names[0]), tampering.edit)
            if not outcome.is_by(tampering):
                found.append([f"tampering {name}", "case_b", "accepted" if outcome.code == 0 else "other rule", ""])
    return found


def report(names: list[str]) -> Findings:
    """Write the report of case B to the folder that is named, for `tamperings`."""
    from airground_drake.report.__main__ import main

    return [["report", names[0], str(main(["case_b", "-o", names[0], "--format", "json"])), ""]]


if __name__ == "__main__":
    kinds = {"runs": runs, "proofs": proofs, "tamperings": tamperings, "report": report}
    Path(sys.argv[1]).write_text(json.dumps(kinds[sys.argv[2]](sys.argv[3:])), encoding="utf-8")
