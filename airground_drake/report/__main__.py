"""`python -m airground_drake.report case_a`: simulate all runs of a scenario, check the claims, write the report."""

from airground_drake.base import interruption

if __name__ == "__main__":
    interruption.begin()  # before the imports, which take seconds

import argparse
import shlex
import sys
import webbrowser
from collections.abc import Sequence
from pathlib import Path

from airground_drake.base import errors
from airground_drake.base.progress import progress_bar
from airground_drake.base.usage import EXIT_TOOL, formats_of, positive, refuse, whole
from airground_drake.report import folder
from airground_drake.scenario import plugins
from airground_drake.scenario.estimate import DEFAULT_LIMITS, GIB, Limits, estimate
from airground_drake.scenario.options import Parser, option, parser_of
from airground_drake.scenario.shipped import AUDIT, shipped

FORMATS = tuple(folder.PAGES)
AUDITED = "case_a"  # `report audit` reports on this scenario, with every finding about the paper
AUDIT_TITLE = "The paper's formulas and numbers, audited"
AUDIT_DESCRIPTION = (
    "Case A with all its runs and proofs, and every finding about the paper: its formula, ours, and evidence made by a "
    "run, a proof or a computation."
)


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    if options.scenario is None and not options.list:
        parser().error("a scenario is needed (see --list)")
    if options.list:
        print("\n".join([*shipped(), AUDIT]))
        return 0
    command = ["airground", "report", *(sys.argv[1:] if arguments is None else arguments)]
    try:
        return _reported(options, errors.one_line(shlex.join(command)))
    except errors.LimitError as error:
        return refuse(f"{error}; see --limit-steps and --limit-memory")
    except (errors.ScenarioError, errors.PluginError, errors.UnknownNameError, errors.FolderError) as error:
        return refuse(error)
    except BrokenPipeError:  # the output pipe is closed
        raise
    except (errors.AirgroundError, OSError) as error:
        return refuse(error, EXIT_TOOL)


def _reported(options: argparse.Namespace, command: str) -> int:
    from airground_drake.scenario.load import load
    from airground_drake.scenario.notes import notes

    overrides = [*options.set, *([] if options.seed is None else [f"seed={options.seed}"])]
    audited = options.scenario == AUDIT
    scenario = load(AUDITED if audited else options.scenario, overrides)
    if audited:
        scenario.name, scenario.title, scenario.description = AUDIT, AUDIT_TITLE, AUDIT_DESCRIPTION
    from airground_drake.report import make  # slow to import: only for a valid scenario
    from airground_drake.verify.cache import cache_folder

    kept = None if options.no_cache else cache_folder()
    output = options.output or Path("reports") / scenario.name
    limits = Limits(options.limit_steps, options.limit_memory * GIB)
    if not options.quiet and (announced := estimate(scenario).announcement):
        print(announced, file=sys.stderr)
    for note in () if options.quiet else notes(scenario):
        print(f"note: {note}", file=sys.stderr)
    if not options.quiet and scenario.map is not None:
        print(scenario.map.cells, file=sys.stderr)
    with (
        plugins.admitted(scenario, options.scenario, allow=options.allow_plugins),
        plugins.shown(options.show_policy_output),
        progress_bar(quiet=options.quiet, verbose=options.verbose) as progress,
    ):
        wanted = make.Wanted(options.format, command, kept, audited, limits, options.seeds)
        made = make.write_report(scenario, output, wanted, progress)
    from airground_drake.report import attention, model, screen  # imported while the runs were simulated

    report = model.of(made)
    overall = report.overall
    for line in attention.failures({name: run.faults for name, run in report.runs.items()}):
        print(line, file=sys.stderr)
    if not options.quiet:
        for item in attention.beforehand(report):
            print(f"{item.words}{f', run {item.run}' if item.run else ''}")
        print(screen.text(report))
        print(f"{scenario.name}: {overall.status.replace('_', ' ')}. {overall.why}")
        print(errors.one_line(str(output)))
    if options.open and "html" in options.format:
        webbrowser.open((output / "report.html").resolve().as_uri())
    return overall.exit_code


def parser() -> Parser:
    return parser_of("report", "Simulate all runs of a scenario, check the claims on them, and write the report.", {
        "scenario": {"nargs": "?", "help": "name of a shipped scenario, path to a YAML file, or audit (of the paper)"},
        "-o --output": f"default: reports/<scenario>; {folder.RULE}",
        "--format": option("comma-separated: html,json,junit (default: all)", kind=formats_of(FORMATS),
                           default=FORMATS),
        "--set": None,
        "--seed": None,
        "--seeds": option("also simulate every run with the seeds 1 to N, and count those with which all distances "
                          "are kept, and those with which all robots arrive", "N", whole(1), default=0),
        "--no-cache": "repeat experiments about the model instead of reusing earlier results",
        plugins.OPTION: None,
        plugins.SHOW: None,
        "--limit-steps": "refuse a scenario with more simulated steps, counted per robot, over all runs (default: "
        "%(default).0g)",
        "--limit-memory": option("refuse a scenario that needs more memory (default: %(default)g)", "GIB", positive,
                                 default=DEFAULT_LIMITS.memory / GIB),
        "--open": "open the report in a browser",
        "--list": "list the shipped scenarios",
        "-q --quiet": "print only errors",
        "-v --verbose": "print how long each step took",
    }, "exit codes: 0 as expected, 1 a claim differs, 2 usage or bad scenario, 3 inconclusive, 4 tool error, 130 "
        "interrupted (SIGINT), 143 terminated (SIGTERM)", exclusive=("-q --quiet", "-v --verbose"))  # fmt: skip


if __name__ == "__main__":
    interruption.run(main)
