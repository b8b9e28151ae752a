"""`python -m airground_drake.report case_a`: simulate all runs of a scenario, check the claims, write the report."""

from __future__ import annotations

from airground_drake import interruption

if __name__ == "__main__":
    interruption.end_on_signals()  # before the imports, which take seconds

import argparse
import json
import platform
import shlex
import shutil
import subprocess
import sys
import time
import webbrowser
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from airground_drake import files, graphviz, trace
from airground_drake.diagram import build_diagram
from airground_drake.errors import (
    AirgroundError,
    FolderError,
    LimitError,
    PluginError,
    ReportError,
    ScenarioError,
    UnknownNameError,
    one_line,
)
from airground_drake.report import audit, document, folder, html, junit
from airground_drake.report.figures import moments, pictures, zeno_refine
from airground_drake.report.figures.draw import draw
from airground_drake.report.figures.panels import Figure
from airground_drake.runs import simulate_all
from airground_drake.scenarios import plugins
from airground_drake.scenarios.estimate import DEFAULT_LIMITS, GIB, Limits, within
from airground_drake.scenarios.load import load, shipped
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify import Verdict, cache_folder, verify, verify_model
from airground_drake.verify.finding import PLAIN_NAME
from airground_drake.verify.mutants import refute_mutants
from airground_drake.verify.registry import model_claims
from airground_drake.verify.stl import cross_check as stl

EXIT_USAGE, EXIT_TOOL = 2, 4
FORMATS = ("html", "json", "junit")
AUDIT, AUDITED = "audit", "case_a"
"""`report audit` is the report of the scenario AUDITED with every finding about the paper."""
AUDIT_TITLE = "The paper's formulas and numbers, audited"
AUDIT_DESCRIPTION = (
    "Case A with all its runs and proofs, and every finding about the paper: its formula, ours, and evidence made by a "
    "run, a proof or a computation."
)
PACKAGES = ("airground_drake", "drake", "numpy", "scipy", "numba", "pandas", "matplotlib")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Returns:
        Exit code: 0 all claims as expected, 1 a claim differs, 2 usage or bad scenario, 3 inconclusive,
        4 tool error.
    """
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.scenario is None and not options.list:
        parser.error("a scenario is needed (see --list)")
    if options.list:
        print("\n".join([*shipped(), AUDIT]))
        return 0
    command = ["python", "-m", "airground_drake.report", *(sys.argv[1:] if arguments is None else arguments)]
    try:
        overrides = [*options.set, *([] if options.seed is None else [f"seed={options.seed}"])]
        audited = options.scenario == AUDIT
        scenario, digest = load(AUDITED if audited else options.scenario, overrides)
        if not options.allow_plugins:
            plugins.refuse(scenario, str(options.scenario))
        if audited:
            scenario.name, scenario.title, scenario.description = AUDIT, AUDIT_TITLE, AUDIT_DESCRIPTION
        kept = None if options.no_cache else cache_folder()
        output = options.output or Path("reports") / scenario.name
        limits = Limits(options.limit_steps, options.limit_memory * GIB)
        report = write_report(scenario, digest, output, options.format, shlex.join(command), kept, audited, limits)
        _read_back(output, options.format, report)
    except LimitError as error:
        print(f"error: {error}; see --limit-steps and --limit-memory", file=sys.stderr)
        return EXIT_USAGE
    except (ScenarioError, PluginError, UnknownNameError, FolderError) as error:
        print(f"error: {error}", file=sys.stderr)
        return EXIT_USAGE
    except (AirgroundError, OSError) as error:
        print(f"error: {one_line(str(error))}", file=sys.stderr)
        return EXIT_TOOL
    overall = report["overall"]
    print(f"{scenario.name}: {overall['status'].replace('_', ' ')}. {overall['why']}\n{one_line(str(output))}")
    if options.open and "html" in options.format:
        webbrowser.open((output / "report.html").resolve().as_uri())
    return document.exit_code(report)


def write_report(
    scenario: Scenario,
    digest: str,
    output: Path,
    formats: Sequence[str] = FORMATS,
    command: str = "",
    kept: Path | None = None,
    audited: bool = False,
    limits: Limits = DEFAULT_LIMITS,
) -> dict[str, Any]:
    """Simulate every run, judge it, and write everything to a folder.

    Args:
        scenario: validated scenario.
        digest: SHA-256 of its file.
        output: folder, created if need be; the files of an earlier report are replaced.
        formats: which of html, json and junit to write; traces and diagram are always written.
        command: how to make this report again.
        kept: folder of kept findings about the model, see `verify_model`; None: every proof anew.
        audited: add all findings about the paper, also those that take other runs, and the proofs' mutants.
        limits: what the scenario may ask for.

    Returns:
        The document, as in report.json.

    Raises:
        LimitError: if the scenario asks for more than the limits.
        FolderError: if the folder holds something that is no report.
        PluginError: if the scenario names a policy, route or task that cannot be made.
        OSError: if the folder cannot be written.
    """
    within(scenario, limits)
    started, clock = datetime.now(UTC), time.perf_counter()
    required = [claim.id for claim in model_claims(added=scenario.claims)]
    folder.prepare(output)
    if kept is not None and kept.is_dir():
        files.sweep(kept)
    _progress(f"simulating {', '.join(scenario.runs)}")
    traces = simulate_all(scenario)
    _progress("checking claims")
    verdicts = [verdict for of_run in traces.values() for verdict in stl.merge(verify(of_run), stl.cross_check(of_run))]
    _progress("proving")
    verdicts += verify_model(scenario, kept=kept)
    if audited:
        _progress("auditing the paper")
    findings = audit.whole(scenario, verdicts) if audited else ()
    mutants = refute_mutants(scenario, kept=kept) if audited else ()
    dot = graphviz.dot(build_diagram(plugins.without(scenario)))
    drawn = graphviz.svg(dot)
    provenance = _provenance(scenario, started, command)

    _progress("writing")
    _drop_stale(output, set(traces))
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
        plates += pictures.draw(report["audit"])
        files.write_text(output / "report.html", html.render(report, plates, drawn))
        written.append("report.html")
    report = document.sealed(report, output, written)
    if "json" in formats:
        files.write_json(output / "report.json", report)
    _progress("")
    return report


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m airground_drake.report",
        description="Simulate all runs of a scenario, check the claims on them, and write the report.",
        epilog="exit codes: 0 as expected, 1 a claim differs, 2 usage or bad scenario, 3 inconclusive, 4 tool error, "
        "130 interrupted (SIGINT), 143 terminated (SIGTERM)",
    )
    parser.add_argument("scenario", nargs="?", help="name of a shipped scenario, path to a YAML file, or audit")
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help=f"default: reports/<scenario>; {folder.RULE}")
    parser.add_argument(
        "--format", type=_formats, default=FORMATS, help="comma-separated: html,json,junit (default: all)"
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="override a key of the scenario"
    )
    parser.add_argument("--seed", type=int, metavar="N", help="seed of the decision noise")
    parser.add_argument(
        "--no-cache", action="store_true", help="redo every proof instead of reusing one whose inputs are unchanged"
    )
    parser.add_argument(
        plugins.OPTION, action="store_true", help="import and run what the scenario names as module:Class"
    )
    parser.add_argument(
        "--limit-steps", type=_positive, default=DEFAULT_LIMITS.work, metavar="N",
        help="refuse a scenario that asks for more: robots moved by one step, over all runs (default: %(default).0g)",
    )  # fmt: skip
    parser.add_argument(
        "--limit-memory", type=_positive, default=DEFAULT_LIMITS.memory / GIB, metavar="GIB",
        help="refuse a scenario that asks for more (default: %(default)g)",
    )  # fmt: skip
    parser.add_argument("--open", action="store_true", help="open the report in a browser")
    parser.add_argument("--list", action="store_true", help="list the shipped scenarios")
    return parser


def _formats(text: str) -> tuple[str, ...]:
    chosen = tuple(text.split(","))
    unknown = [name for name in chosen if name not in FORMATS]
    if unknown:
        raise argparse.ArgumentTypeError(f"{', '.join(unknown)!r} is not allowed; formats are {', '.join(FORMATS)}")
    return chosen


def _read_back(folder: Path, formats: Sequence[str], report: dict[str, Any]) -> None:
    """See that the report is there, and says what was written.

    Raises:
        ReportError: if not.
        OSError: if a file cannot be read.
    """
    written = {"html": "report.html", "json": "report.json", "junit": "junit.xml"}
    for path in (folder / written[each] for each in formats):
        text = path.read_text(encoding="utf-8")
        try:
            same = bool(text) and (path.suffix != ".json" or json.loads(text) == report)
        except ValueError:
            same = False
        if not same:
            raise ReportError(f"{path}: read back, it is not what was written")


def _positive(text: str) -> float:
    value = float(text)
    if not value > 0.0:
        raise argparse.ArgumentTypeError(f"{text} is not allowed; wanted: a number above 0")
    return value


def _drop_stale(folder: Path, current: set[str]) -> None:
    """Remove what an earlier report has left that this one may not replace: pages, certificates, traces of others."""
    for name in ("report.json", "report.html", "junit.xml"):
        (folder / name).unlink(missing_ok=True)
    shutil.rmtree(folder / "certificates", ignore_errors=True)
    for meta in folder.glob("trace/*/meta.json"):
        if meta.parent.name not in current:
            shutil.rmtree(meta.parent)


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


def _progress(text: str) -> None:
    if sys.stderr.isatty():
        print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)


if __name__ == "__main__":
    interruption.leave(main())
