"""From the traces of a report to its folder: verdicts, figures, findings about the paper, files."""

import platform
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from airground_drake.base import files
from airground_drake.base.parallel import processes
from airground_drake.base.progress import Progress
from airground_drake.report import audit, document, folder, junit, metrics, model
from airground_drake.report.figures.draw import draw
from airground_drake.report.folder import PAGES
from airground_drake.report.html import page
from airground_drake.scenario import map_file, plugins
from airground_drake.scenario.schema import MapCells, Scenario
from airground_drake.sim import graphviz, trace
from airground_drake.sim.diagram import build_diagram, method_drawn
from airground_drake.sim.runs import simulate_seeds
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge_all
from airground_drake.verify.registry import model_claims

PACKAGES = ("airground_drake", "drake", "numpy", "scipy", "numba", "pandas", "matplotlib", "daqp")


def with_seeds(scenario: Scenario, own: Mapping[str, Trace], number: int, progress: Progress) -> list[dict[str, Any]]:
    """Outcomes of all runs with the seeds 1 to `number`, by run, then by seed; see `metrics.outcome`."""
    others = [seed for seed in range(1, number + 1) if seed != scenario.seed]
    outcomes = [metrics.outcome(trace) for trace in simulate_seeds(scenario, others, progress=progress)]
    outcomes += [metrics.outcome(trace) for trace in own.values() if 1 <= scenario.seed <= number]
    order = {name: k for k, name in enumerate(scenario.runs)}
    return sorted(outcomes, key=lambda row: (order[row["run"]], row["seed"]))


def finish(
    scenario: Scenario,
    traces: Mapping[str, Trace],
    output: Path,
    progress: Progress,
    formats: Sequence[str],
    provenance: Callable[[], dict[str, Any]],
    *,
    kept: Path | None,
    seeds: int,
    audited: bool,
) -> dict[str, Any]:
    """Judge and draw the runs, write the folder, and return the document; arguments as of `make.Wanted`."""
    of_seeds = with_seeds(scenario, traces, seeds, progress) if seeds else ()
    with processes(1) as another:
        drawn = another.submit(draw, scenario, traces) if "html" in formats else None
        verdicts = judge_all(scenario, traces.values(), kept=kept, progress=progress)
        findings = audit.of_runs(scenario, traces)
        if audited:
            progress.stage("auditing the paper")
            findings += audit.whole(scenario, verdicts)
        figures = drawn.result() if drawn else ()
    progress.stage("writing")
    origin = provenance()
    dot = graphviz.dot(build_diagram(plugins.without(scenario), method_drawn(scenario)))
    pages = {"diagram.dot": dot, "diagram.svg": graphviz.svg(dot)}
    required = [claim.id for claim in model_claims(added=scenario.claims) if claim.may_apply(scenario)]
    report = document.build(
        scenario, traces, verdicts, origin, audit=findings, audited=audited, required=required, seeds=of_seeds
    )
    report_model = model.of(report)
    if "junit" in formats:
        pages[PAGES["junit"]] = junit.render(report_model)
    if "html" in formats:
        pages[PAGES["html"]] = page(report_model, figures, pages["diagram.svg"])
    folder.clear(output)
    written = [*pages]
    for name, of_run in traces.items():
        written += [f"trace/{name}/{file}" for file in trace.save(of_run, output / "trace" / name)]
    for name, text in pages.items():
        files.write_text(output / name, text)
    if scenario.map is not None and scenario.map.cells is not None:
        written += _map_files(scenario.map.cells, output)
    report = document.sealed(report, output, written)
    if "json" in formats:
        files.write_json(output / PAGES["json"], report)
    return report


def _map_files(cells: MapCells, output: Path) -> list[str]:
    """Copy the files of a map into a report, if this process has read them; returns their names there."""
    copied = {folder.of_map(name): map_file.content(sha256) for name, sha256 in cells.sha256.items()}
    for name, content in copied.items():
        if content is not None:
            files.write_bytes(output / name, content)
    return [name for name, content in copied.items() if content is not None]


def provenance(scenario: Scenario, started: datetime, command: str) -> dict[str, Any]:
    """The provenance of the report: versions, machine, commit, seed, begin, command."""
    packages = versions()
    return {
        "package": packages.pop("airground_drake"),
        "drake": packages.pop("drake"),
        "python": platform.python_version(),
        "packages": packages,
        "solver": _solver(scenario, packages["daqp"]),
        "platform": platform.platform(),
        "git": document.commit(),
        "seed": scenario.seed,
        "started": started.isoformat(timespec="seconds"),
        "command": command,
        **({"third_party": digests} if (digests := plugins.digests(scenario)) else {}),
    }


def versions() -> dict[str, str]:
    installed = {}
    for name in PACKAGES:
        try:
            installed[name] = version(name)
        except PackageNotFoundError:
            installed[name] = "not installed"
    return installed


def _solver(scenario: Scenario, daqp: str) -> str:
    route, solver = scenario.gatekeeper.route, scenario.gatekeeper.solver
    if route != "mixed_integer":
        return f"that of the route {route}"
    return f"DAQP {daqp}, one thread" if solver == "daqp" else f"{solver}, through Drake, one thread"
