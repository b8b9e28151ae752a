"""`airground falsify SPEC --claim ID`: search for a scenario that violates a claim, and minimise it."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from airground_drake.base import files
from airground_drake.base.errors import AirgroundError, Fault, PluginError, ScenarioError, UnknownNameError, one_line
from airground_drake.base.parallel import one_thread_each, processors
from airground_drake.base.progress import progress_bar
from airground_drake.base.registry import RUN_CLAIMS, SAMPLERS, is_plugin
from airground_drake.base.usage import EXIT_TOOL, REFUSALS, output_file, positive, refuse, whole
from airground_drake.report.rules import DISTANCES
from airground_drake.scenario import plugins
from airground_drake.scenario.estimate import DEFAULT_LIMITS
from airground_drake.scenario.hints import plugin_path
from airground_drake.scenario.options import Parser, option, parser_of
from airground_drake.scenario.shipped import argument
from airground_drake.study.campaign.rows import COLUMNS

if TYPE_CHECKING:
    from airground_drake.study.campaign.falsification import Best, Objective, Search
    from airground_drake.study.campaign.pool import Pool
    from airground_drake.study.campaign.spec import Spec

EXIT_FOUND, EXIT_UNDECIDED = 1, 3
TIMES = tuple(name for name in COLUMNS if name.endswith("_s") and name not in ("wall_s", "duration_s"))


def parser() -> Parser:
    return parser_of("falsify", "Search the draws of a campaign for a violation of a claim, and minimise it.", {
        "spec": None,
        "--claim": option("claim about runs (default: %(default)s)", "ID", default=DISTANCES),
        "--most": option("maximise this time instead of minimising a margin", choices=TIMES),
        "--limit": option("with --most: a longer time is a counterexample", "S", positive),
        "--sampler": option(f"{', '.join(SAMPLERS.allowed)} (default: %(default)s)", "NAME", default="cma"),
        "-n --number": {"help": "scenarios to try (default: %(default)s)", "default": 200},
        "--shrink": option("runs for minimising a counterexample (default: %(default)s)", "N", whole(0), default=300),
        "-o --output": option("new file for the counterexample, or else for the scenario nearest to one (default: "
                              "<name>_<sampler>.yaml, only for a counterexample)", "FILE", output_file),
        "--engine": None,
        "--jobs": None,
        "-q --quiet": None,
        plugins.OPTION: None,
    }, "exit codes: 0 no counterexample, 1 one was found, 2 usage, bad spec or output, 3 nothing was measured, 4 tool "
        "error, 130 and 143 interrupted")  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    if options.limit is not None and options.most is None:
        return refuse("--limit needs --most, which names the time")
    one_thread_each()
    from airground_drake.study.campaign.spec import load_spec

    try:
        return _run(load_spec(options.spec), options)
    except REFUSALS as error:
        return refuse(error)
    except (AirgroundError, OSError) as error:
        return refuse(error, EXIT_TOOL)


def _run(spec: Spec, options: argparse.Namespace) -> int:
    from airground_drake.study.campaign import pool
    from airground_drake.study.campaign.distributions import dimensions
    from airground_drake.study.campaign.falsification import Margin, Most, Search, falsify
    from airground_drake.study.campaign.search import Sampler

    limit = math.inf if options.limit is None else options.limit
    objective: Objective = Margin(options.claim) if options.most is None else Most(options.most, limit)
    if options.claim not in RUN_CLAIMS:
        raise UnknownNameError("claim about runs", options.claim, RUN_CLAIMS)
    if not dimensions(spec.drawn):
        raise ScenarioError(spec.source, "draw", Fault("nothing is drawn"), "wanted: keys to search over")
    if not SAMPLERS.accepts(options.sampler):
        allowed = f"one of {', '.join(SAMPLERS.allowed)}{plugin_path(options.sampler)}"
        raise ScenarioError("--sampler", "", options.sampler, allowed)
    if options.sampler not in SAMPLERS and is_plugin(options.sampler) and not options.allow_plugins:
        raise ScenarioError("--sampler", "", options.sampler, plugins.WANTED)
    if not options.allow_plugins:
        spec.refuse_plugins()
    try:
        with plugins.beside(spec.source, allow=options.allow_plugins):
            sampler = SAMPLERS.make(options.sampler, of=Sampler, dimensions=dimensions(spec.drawn), seed=spec.seed)
    except PluginError as error:
        raise ScenarioError("--sampler", "", Fault(str(error)), f"allowed: {', '.join(SAMPLERS.allowed)}") from None
    path: Path = options.output or Path(f"{spec.name}_{options.sampler.rpartition(':')[2]}.yaml")
    files.try_to_create(path)
    files.try_to_create(_small(path))
    limits = DEFAULT_LIMITS._replace(plugins=options.allow_plugins)
    search = Search(replace(spec, claims=(options.claim,)), objective, limits, options.engine)
    jobs = min(options.jobs or processors(), options.number)
    with progress_bar(quiet=options.quiet) as progress, pool.local(jobs) as processes:
        _try(search, processes)
        progress.stage(spec.name, options.number, "scenarios")
        best = falsify(search, sampler, options.number, processes, progress)
    tried = f"{spec.name}: {best.tried} tried by {options.sampler}"
    if not len(best.point):
        missing = options.most or f"violation and no margin of {options.claim}"
        print(f"{tried}, no {missing} in any of them: undecided")
        return EXIT_UNDECIDED
    print(f"{tried}, {objective.said(best.value)}: {'a' if best.found else 'no'} counterexample")
    if best.found or options.output:
        _save(search, best, path, options.shrink)
    return EXIT_FOUND if best.found else 0


def _try(search: Search, pool: Pool) -> None:
    """Judge the first draw, to check that the claim applies to its runs."""
    from airground_drake.study.campaign.rows import JUDGED
    from airground_drake.study.campaign.work import rows_of

    spec = search.spec
    for _, rows in pool(partial(rows_of, spec, limits=search.limits, engine=search.engine), [0]):
        if rows and all(row["ended"] == JUDGED and not row["claim"] for row in rows):
            raise ScenarioError("--claim", "", spec.claims[0], f"wanted: one that applies to a run of {spec.source}")


def _small(path: Path) -> Path:
    return path.with_stem(f"{path.stem}_small")


def _save(search: Search, best: Best, path: Path, tests: int) -> None:
    """Write the scenario of the best point, and a minimised one if it is a counterexample."""
    from airground_drake.base.limits import MAX_NAME
    from airground_drake.scenario.document import text_of
    from airground_drake.scenario.load import resolved
    from airground_drake.study.campaign.shrink import shrink

    def write(to: Path, data: dict[str, Any]) -> None:
        files.write_text(to, text_of(data))
        print(one_line(str(to)))

    scenario = search.spec.scenario_of(search.values(best.point), 0)
    data = resolved(scenario)
    write(path, data)
    for run in scenario.runs if best.found else ():
        alone = data | {"runs": {run: data["runs"][run]}}
        if search.fails(alone):
            smaller, used = shrink(alone, search.fails, tests)
            small = _small(path)
            write(small, smaller | {"name": f"{scenario.name[: MAX_NAME - len('_small')]}_small"})
            print(
                f"made small with {used} runs: {len(smaller['ugvs'])} UGVs, {len(smaller['obstacles'])} obstacles, "
                f"{smaller['duration_s']:g} s: airground report {argument(small)}"
            )
            return
