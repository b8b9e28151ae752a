"""Verdicts of claims, oracles and the checker on short runs of the package that is on the path.

    python probe.py

It reads requests from standard input, a line of JSON each: [file, "ways" | "runs", names of probes]. A child process
answers each: it imports the package as it is then, and writes its findings to the file as lists of source, where,
status and rule. The source is a claim, `oracle: <name>`, `checker: <claim>` or `run`. A line with the child's exit code
follows on standard output. Other packages are imported once, before. A child that needs too much time or memory is
ended.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import tempfile
import traceback
from importlib import import_module
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
PROBES = {
    "crowd b": (str(HERE / "crowd.yaml"), "b"),
    "crowd c": (str(HERE / "crowd.yaml"), "c"),
    "crowd d": (str(HERE / "crowd.yaml"), "d"),
    "bodies b": (str(HERE / "bodies.yaml"), "b"),
    "bodies c": (str(HERE / "bodies.yaml"), "c"),
    "bodies d": (str(HERE / "bodies.yaml"), "d"),
    "walls c": (str(HERE / "walls.yaml"), "c"),
    "walls d": (str(HERE / "walls.yaml"), "d"),
    "case_a a": ("case_a", "a"),
    "case_a nearest": ("case_a", "a_recursion_nearest"),
    "case_a listed": ("case_a", "a_recursion_listed"),
    "case_b c": ("case_b", "c"),
    "case_b d": ("case_b", "d"),
    "soft_gate c": ("soft_gate", "c"),
}
"""Name: scenario, run."""

Findings = list[list[Any]]


def ways(names: list[str]) -> Findings:
    """Runs alone: a digest of the trace of each."""
    from airground_drake.base import files
    from airground_drake.base.errors import AirgroundError
    from airground_drake.run import trace

    found: Findings = []
    for name in names:
        with tempfile.TemporaryDirectory() as there:
            try:
                trace.save(_simulated(name)[1], Path(there))
            except AirgroundError as error:
                return [*found, ["run", name, "stops", str(error)]]
            found.append(["way", name, files.sha256((Path(there) / "meta.json").read_bytes()), ""])
    return found


def runs(names: list[str]) -> Findings:
    """Every verdict, every oracle that finds a fault, and every check of the checker that does not agree."""
    from oracles import faults_of

    from airground_drake.base import files
    from airground_drake.base.errors import AirgroundError
    from airground_drake.check.command import LIMIT_S
    from airground_drake.check.line import AGREES
    from airground_drake.check.report import check_report
    from airground_drake.report import document
    from airground_drake.run import trace
    from airground_drake.verify import judge

    found: Findings = []
    for name in names:
        run = PROBES[name][1]
        try:
            scenario, of_run = _simulated(name)
        except AirgroundError as error:
            found.append(["run", name, "stops", str(error)])
            continue
        verdicts = judge(of_run)
        found += [[v.claim.id, name, v.status, ""] for v in verdicts]
        found += [[f"oracle: {of}", name, "fault", each[0].what] for of, each in faults_of(of_run).items()]
        with tempfile.TemporaryDirectory() as there:
            folder = Path(there)
            trace.save(of_run, folder / "trace" / run)
            report = document.build(scenario, {run: of_run}, verdicts, {"seed": scenario.seed})
            files.write_json(folder / "report.json", report)
            lines = [line for line in check_report(folder, LIMIT_S) if line.run]
        found += [[f"checker: {line.claim}", name, "disagrees", line.rule] for line in lines if line.outcome != AGREES]
    return found


def _simulated(name: str) -> tuple[Any, Any]:
    """The scenario of a probe with its one run, and the trace."""
    from airground_drake.run.simulation import simulate
    from airground_drake.scenarios.load import load

    source, run = PROBES[name]
    scenario = load(source)
    scenario.runs = {run: scenario.runs[run]}
    scenario.reproduction, scenario.choices = [], []
    return scenario, simulate(scenario, run)


OTHERS = (
    "cvxpy", "flint", "jinja2", "matplotlib", "numba", "pandas", "pyarrow.parquet", "pydrake.all", "scipy.optimize",
    "yaml",
)  # fmt: skip
"""Packages that every child needs."""
LONGEST_CPU_S, MOST_BYTES = 300, 12 << 30
"""Limits of a child: a mutant may run for ever, or fill the memory."""
KINDS = {"ways": ways, "runs": runs}


def serve() -> None:
    """Answer requests until there are no more."""
    for name in OTHERS:
        import_module(name)
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            _answer(*json.loads(line))
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


def _answer(file: str, kind: str, names: list[str]) -> None:
    """In the child; it does not return."""
    code = 1
    resource.setrlimit(resource.RLIMIT_CPU, (LONGEST_CPU_S, LONGEST_CPU_S))
    resource.setrlimit(resource.RLIMIT_DATA, (MOST_BYTES, MOST_BYTES))
    try:
        os.dup2(2, 1)  # printed text must not be taken for an answer
        Path(file).write_text(json.dumps(KINDS[kind](names)), encoding="utf-8")
        code = 0
    except BaseException:  # whatever a mutant does
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    serve()
