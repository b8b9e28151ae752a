"""Making a report: simulate every run of a scenario, judge it, and write everything to a folder."""

from __future__ import annotations

import json
import platform
import subprocess
import time
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from airground_drake import files, graphviz, trace
from airground_drake.diagram import build_diagram
from airground_drake.errors import PluginError, ReportError
from airground_drake.progress import SILENT, Watch
from airground_drake.report import audit, document, folder, html, junit
from airground_drake.report.figures import moments, zeno_refine
from airground_drake.report.figures.draw import draw
from airground_drake.report.figures.findings import draw as draw_findings
from airground_drake.report.figures.panels import Figure
from airground_drake.report.folder import PAGES
from airground_drake.runs import simulate_all
from airground_drake.scenarios import plugins
from airground_drake.scenarios.estimate import DEFAULT_LIMITS, Limits, within
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify import Verdict, verify_all
from airground_drake.verify.finding import PLAIN_NAME
from airground_drake.verify.mutants import refute_mutants
from airground_drake.verify.registry import model_claims

PACKAGES = ("airground_drake", "drake", "numpy", "scipy", "numba", "pandas", "matplotlib")


def write_report(
    scenario: Scenario,
    digest: str,
    output: Path,
    formats: Sequence[str] = tuple(PAGES),
    command: str = "",
    kept: Path | None = None,
    audited: bool = False,
    limits: Limits = DEFAULT_LIMITS,
    watch: Watch = SILENT,
) -> dict[str, Any]:
    """Simulate every run, judge it, and write everything to a folder.

    Args:
        scenario: validated scenario.
        digest: SHA-256 of its file.
        output: folder, created if need be; nothing of an earlier report stays in it.
        formats: which of html, json and junit to write; traces and diagram are always written.
        command: how to make this report again.
        kept: folder of kept findings about the model, see `verify_model`; None: every proof anew.
        audited: add all findings about the paper, also those that take other runs, and the proofs' mutants.
        limits: what the scenario may ask for.
        watch: is told what is done.

    Returns:
        The document, as in report.json.

    Raises:
        LimitError: if the scenario asks for more than the limits.
        FolderError: if the folder holds something that is no report, or cannot be written; before the work.
        PluginError: if the scenario names a policy, route or task that cannot be made.
        OSError: if something cannot be written, after all.
    """
    within(scenario, limits)
    started, clock = datetime.now(UTC), time.perf_counter()
    required = [claim.id for claim in model_claims(added=scenario.claims)]
    folder.prepare(output)
    if kept is not None and kept.is_dir():
        files.sweep(kept)
    traces = simulate_all(scenario, watch=watch)
    verdicts = verify_all(scenario, traces.values(), kept=kept, watch=watch)
    if audited:
        watch.stage("auditing the paper")
    findings = audit.whole(scenario, verdicts) if audited else ()
    mutants = refute_mutants(scenario, kept=kept, watch=watch) if audited else ()
    dot = graphviz.dot(build_diagram(plugins.without(scenario)))
    drawn = graphviz.svg(dot)
    provenance = _provenance(scenario, started, command)

    watch.stage("writing")
    folder.clear(output)
    written = [f"certificates/{name}" for name in _save_certificates(output / "certificates", verdicts)]
    for name, of_run in traces.items():
        written += [f"trace/{name}/{file}" for file in trace.save(of_run, output / "trace" / name)]
    files.write_text(output / "diagram.dot", dot)
    files.write_text(output / "diagram.svg", drawn)
    written += ["diagram.dot", "diagram.svg"]
    provenance["wall_s"] = time.perf_counter() - clock
    report = document.build(
        scenario, digest, traces, verdicts, provenance, audit=findings, mutants=mutants, required=required
    )
    if "junit" in formats:
        files.write_text(output / "junit.xml", junit.render(report))
        written.append("junit.xml")
    if "html" in formats:
        plates = [*draw(scenario, traces), *_refinement(verdicts, audited), *moments.draw(report, traces)]
        plates += draw_findings(report["audit"])
        files.write_text(output / "report.html", html.render(report, plates, drawn))
        written.append("report.html")
    report = document.sealed(report, output, written)
    if "json" in formats:
        files.write_json(output / "report.json", report)
    return report


def read_back(folder: Path, formats: Sequence[str], report: dict[str, Any]) -> None:
    """See that the report is there, and says what was written.

    Raises:
        ReportError: if not.
        OSError: if a file cannot be read.
    """
    for path in (folder / PAGES[each] for each in formats):
        text = path.read_text(encoding="utf-8")
        try:
            same = bool(text) and (path.suffix != ".json" or json.loads(text) == report)
        except ValueError:
            same = False
        if not same:
            raise ReportError(f"{path}: read back, it is not what was written")


def _refinement(verdicts: Sequence[Verdict], audited: bool) -> list[Figure]:
    """The figure of ZENO-REFINE, if there is such a verdict: beside finding 9, where that is in the report."""
    drawn = [zeno_refine.draw(verdict.finding.evidence) for verdict in verdicts if verdict.claim.id == "ZENO-REFINE"]
    return [replace(figure, beside="audit-9") if audited else figure for figure in drawn if figure is not None]


def _save_certificates(folder: Path, verdicts: Sequence[Verdict]) -> list[str]:
    """Write every certificate to <folder>/<claim>/ and return their paths in the folder.

    Raises:
        PluginError: if a claim or a certificate has no plain name.
    """
    written = []
    for verdict in verdicts:
        for name, text in verdict.finding.certificates.items():
            if not (PLAIN_NAME.fullmatch(verdict.claim.id) and PLAIN_NAME.fullmatch(name)):
                raise PluginError(f"claim {verdict.claim.id!r}: {name!r} is no name for a certificate")
            files.write_text(folder / verdict.claim.id / name, text)
            written.append(f"{verdict.claim.id}/{name}")
    return written


def _provenance(scenario: Scenario, started: datetime, command: str) -> dict[str, Any]:
    versions = {}
    for name in PACKAGES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "not installed"
    return {
        "package": versions.pop("airground_drake"),
        "drake": versions.pop("drake"),
        "python": platform.python_version(),
        "packages": versions,
        "platform": platform.platform(),
        "git": _git(),
        "seed": scenario.seed,
        "started": started.isoformat(timespec="seconds"),
        "command": command,
    }


def _git() -> str:
    """Commit of the checkout that the package is imported from, with '+changes', or 'not a checkout'."""
    here = ["git", "-C", str(Path(__file__).parent)]
    try:
        tracked = subprocess.run([*here, "ls-files", "--error-unmatch", __file__], capture_output=True, check=False)
        if tracked.returncode != 0:
            return "not a checkout"
        commit = subprocess.run([*here, "rev-parse", "HEAD"], capture_output=True, text=True, check=True).stdout.strip()
        changed = subprocess.run([*here, "status", "--porcelain"], capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return "not a checkout"
    return commit + ("+changes" if changed else "")
