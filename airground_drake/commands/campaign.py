"""`airground campaign SPEC -n 1000`: judge many draws of a scenario, and bound the probability of a violation."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from airground_drake.base import files
from airground_drake.base.errors import AirgroundError, one_line
from airground_drake.base.limits import MAX_SEED
from airground_drake.base.parallel import one_thread_each, processors
from airground_drake.base.progress import progress_bar
from airground_drake.base.statuses import NOT_EXERCISED, outcome
from airground_drake.base.usage import EXIT_TOOL, REFUSALS, positive, refuse, whole
from airground_drake.scenario import plugins
from airground_drake.scenario.estimate import DEFAULT_LIMITS, Limits
from airground_drake.scenario.options import Parser, option, parser_of
from airground_drake.scenario.shipped import argument
from airground_drake.study.campaign.rows import UNFINISHED

if TYPE_CHECKING:
    from airground_drake.study.campaign.spec import Spec

EXIT_REFUTED, EXIT_UNDECIDED = 1, 3


def parser() -> Parser:
    return parser_of("campaign", "Simulate and judge many draws of a scenario, and bound how likely a violation is.", {
        "spec": "YAML file: a scenario, and distributions over its keys",
        "-n --number": "draws (default: one, or all combinations of grids)",
        "-o --output": "new folder (default: campaigns/<name>); with --resume: that of the campaign; with --only: file "
        "of the scenario",
        "--resume": "continue the campaign in this folder",
        "--only": option("make only this draw, and write its scenario", "INDEX", whole(0, MAX_SEED)),
        "--engine": None,
        "--jobs": None,
        "-q --quiet": None,
        "--scheduler": option("use this Dask cluster, such as tcp://host:8786", "ADDRESS"),
        "--stop-when": option("end when the anytime-valid bound meets RULE: 'SAFE-TRACE < 1e-2'", "RULE"),
        "--limit-steps": "count a draw with more simulated steps, summed over robots and runs, as invalid "
        "(default: %(default).0g)",
        "--limit-time": option("stop a draw that takes longer (default: %(default)g)", "S", positive,
                               default=DEFAULT_LIMITS.time),
        plugins.OPTION: None,
    }, "exit codes: 0 every claim as expected in every draw, 1 one differs, 2 usage, bad spec or folder, 3 undecided, "
        "4 tool error, 130 and 143 interrupted; --resume continues an interrupted campaign")  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    if options.only is not None and (options.resume or options.stop_when or options.number is not None):
        return refuse("--only excludes -n, --resume and --stop-when")
    one_thread_each()
    from airground_drake.study.campaign.spec import load_spec

    try:
        spec = load_spec(options.spec)
        return _all(spec, options) if options.only is None else _only(spec, options)
    except (*REFUSALS, ValueError) as error:
        return refuse(error)
    except (AirgroundError, OSError) as error:
        return refuse(error, EXIT_TOOL)


def _all(spec: Spec, options: argparse.Namespace) -> int:
    from airground_drake.study.campaign import pool
    from airground_drake.study.campaign.conduct import Stopping, conduct

    stopping = Stopping.parse(options.stop_when, spec.claims) if options.stop_when else None
    folder = options.output or Path("campaigns") / spec.name
    jobs = min(options.jobs or processors(), options.number or spec.combinations)
    with (
        progress_bar(quiet=options.quiet) as progress,
        pool.cluster(options.scheduler) if options.scheduler else pool.local(jobs) as processes,
    ):
        result = conduct(
            spec, folder, processes, options.number, resume=options.resume, stopping=stopping,
            limits=_limits(options), engine=options.engine, progress=progress,
        )  # fmt: skip
    print(f"{_summary(result, looked=bool(options.stop_when or options.resume))}\n{one_line(str(folder))}")
    return _code(result)


def _only(spec: Spec, options: argparse.Namespace) -> int:
    from airground_drake.scenario.document import text_of
    from airground_drake.scenario.load import resolved
    from airground_drake.study.campaign.evidence import evidence
    from airground_drake.study.campaign.store import table_of
    from airground_drake.study.campaign.work import rows_of

    if not options.allow_plugins:
        spec.refuse_plugins()
    scenario = spec.draw(options.only)
    path = options.output or Path(f"{scenario.name}.yaml")
    text = text_of(resolved(scenario))
    with files.wanted(path, "a file for the scenario"):
        if not (path.is_file() and files.read_bytes(path) == text.encode()):  # the same draw may be asked for again
            files.try_to_create(path)
            files.write_text(path, text)
    rows = rows_of(spec, options.only, _limits(options), options.engine)
    for row in rows:
        margin = "" if math.isnan(row["margin"]) else f" {row['margin']:.6g} {row['unit']}"
        status = outcome(row["status"], row["exercised"]).replace(NOT_EXERCISED, "not tested")
        print(f"{row['run']:12} {row['claim'] or row['ended']:12} {status or row['what']}{margin}")
    print(f"airground report {argument(path)}")
    result = evidence(table_of(rows))
    for what in _undecided(result):
        print(f"undecided: {what}")
    return _code(result)


def _limits(options: argparse.Namespace) -> Limits:
    return Limits(options.limit_steps, DEFAULT_LIMITS.memory, options.limit_time, options.allow_plugins)


def _code(result: dict[str, Any]) -> int:
    if any(claim["differs"] for claim in result["claims"]):
        return EXIT_REFUTED
    return EXIT_UNDECIDED if _undecided(result) else 0


def _undecided(result: dict[str, Any]) -> list[str]:
    draws, ended = result["draws"], result["ended"]
    lines = [f"{ended[name]} of {draws} draws {name}" for name in UNFINISHED if name in ended]
    for claim in result["claims"]:
        if claim["undecided_draws"]:
            draws = ", ".join(map(str, claim["undecided_draws"]))
            lines.append(f"{_name(claim)}: {claim['undecided']} of {claim['tested']} runs, such as draw {draws}")
        elif claim["untested"]:
            lines.append(f"{_name(claim)}: the scenario expects it to be tested, and no draw did")
    return lines if result["claims"] else [*lines, "nothing was judged"]


def _name(claim: dict[str, Any]) -> str:
    return f"{claim['claim']} in run {claim['run']}"


def _summary(result: dict[str, Any], *, looked: bool) -> str:
    """The evidence as text. After intermediate looks only the anytime-valid bounds hold, so these are given then."""
    from airground_drake.study.campaign.statistics import outward

    ended = ", ".join(f"{count} {name}" for name, count in result["ended"].items())
    lines = [f"{result['name']}: {result['draws']} draws ({ended}), {result['simulated_s']:.0f} s simulated"]
    for claim in result["claims"]:
        outcome = f"{claim['refuted']} of {claim['tested']} refuted"
        if not claim["tested"]:
            outcome += ", not tested by any run"
        elif bounds := claim["anytime" if looked else "fixed"]:
            low, high = outward(bounds)
            outcome += f", probability of a violation {low:.2g} to {high:.2g}"
        differs = f"; {claim['differs']} not as expected" if claim["differs"] else ""
        lines.append(f"  {claim['run']:10} {claim['claim']:12} {outcome}{differs}")
    for swept in result.get("swept", ()):
        lines += [f"  by {swept['key']}:", *map(_by_value, swept["entries"])]
    if result["stopped"] is not None:
        lines.append(f"  stopped by its rule at draw {result['stopped']}; later draws are not counted")
    if result["dependent"]:
        lines.append(f"  no intervals: draws are not independent ({', '.join(result['dependent'])})")
    if result["not_judged"]:
        first = result["not_judged"][0]
        lines.append(f"  first that was not judged: draw {first['index']}, {first['ended']}: {first['what']}")
    return "\n".join([*lines, *(f"  undecided: {what}" for what in _undecided(result))])


def _by_value(entry: dict[str, Any]) -> str:
    refuted = [claim for claim, counts in entry["claims"].items() if counts["refuted"]]
    times = [
        f"{words} {entry[name]:.4g} s"
        for name, words in (("first_trigger_s", "first trigger"), ("arrival_s", "last arrival"))
        if entry[name] is not None
    ]
    parts = [f"{entry['arrived']} of {entry['ugvs']} arrived", *times]
    if refuted:
        parts.append(f"refuted: {', '.join(refuted)}")
    return f"    {entry['value']!s:10} {entry['run'] or 'none':10} {'; '.join(parts)}"
