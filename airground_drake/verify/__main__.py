"""`python -m airground_drake.verify DIR/trace/d SAFE-TRACE`: judge claims on a saved run or about its model."""

from __future__ import annotations

from airground_drake.base import interruption

if __name__ == "__main__":
    interruption.begin()  # before the imports, which take seconds

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from airground_drake.base.errors import AirgroundError, FolderError, UnknownNameError
from airground_drake.base.progress import Progress, progress_bar
from airground_drake.base.statuses import NOT_EXERCISED, outcome
from airground_drake.base.usage import refuse
from airground_drake.scenario import plugins
from airground_drake.scenario.options import Parser, option, parser_of

if TYPE_CHECKING:
    from airground_drake.verify.claim import Verdict

EXIT_DIFFERS = 1


def parser() -> Parser:
    return parser_of(
        "verify",
        "Judge claims anew, on a saved run or about a scenario's model; nothing is taken from a cache.",
        {
            "target": "folder of a saved run (DIR/trace/RUN), or a scenario, shipped or a YAML file",
            "claims": option("identifiers (default: all that apply)", "CLAIM", nargs="*"),
            "--json": "print the whole verdicts as JSON",
            "-v --verbose": "say how long each claim took",
            plugins.OPTION: None,
        },
        "exit codes: 0 all as the scenario expects, 1 one is not (or is undecided), 2 usage, or a run or scenario that "
        "cannot be used, 4 tool error, 130 and 143 interrupted",
    )


def main(arguments: Sequence[str] | None = None) -> int:
    # Exit code: 0 all as the scenario expects, 1 a claim differs, 2 usage, or a run or scenario that cannot be used.
    options = parser().parse_args(arguments)
    try:
        with progress_bar(verbose=options.verbose) as progress:
            verdicts = _judge(options.target, options.claims, progress, allow_plugins=options.allow_plugins)
    except (AirgroundError, OSError) as error:
        return refuse(error)
    if missing := set(options.claims) - {verdict.claim.id for verdict in verdicts}:
        return refuse(f"{', '.join(sorted(missing))} says nothing about {options.target}")
    if options.json:
        print(json.dumps([verdict.to_json() for verdict in verdicts], indent=1, allow_nan=False))
    else:
        print("".join(f"{_line(verdict)}\n" for verdict in verdicts), end="")
    return EXIT_DIFFERS if any(verdict.as_expected is False for verdict in verdicts) else 0


def _line(verdict: Verdict) -> str:
    name = f"{verdict.claim.id} {verdict.run}" if verdict.run else verdict.claim.id
    margin = "" if verdict.margin is None else f", margin {verdict.margin:.6g} {verdict.unit}".rstrip()
    of = f" ({verdict.quantity})" if margin and verdict.quantity else ""
    idle = outcome(verdict.status, verdict.exercised) == NOT_EXERCISED
    status = f"{verdict.status}, not tested" if idle else verdict.status
    tested = f" [{verdict.exercised} {verdict.claim.exercised_by}]" if verdict.exercised is not None else ""
    expected = {True: "", False: f", expected {verdict.expected}", None: ", nothing promised"}[verdict.as_expected]
    return f"{name}: {status}{margin}{of}{tested}{expected}"


def _judge(target: str, wanted: Sequence[str], progress: Progress, *, allow_plugins: bool) -> list[Verdict]:
    # Third-party claims that a saved run names are imported only if they are wanted, and only if that is allowed.
    from airground_drake.scenario.load import from_data, load
    from airground_drake.scenario.shipped import shipped
    from airground_drake.sim import trace
    from airground_drake.verify import judge, judge_model
    from airground_drake.verify.registry import model_claims, run_claims

    folder = Path(target)
    run = trace.load(folder) if os.path.lexists(folder / "meta.json") else None
    if run is None and folder.is_dir() and target not in shipped():
        raise FolderError(f"{target} is not a saved run: it has no meta.json; wanted: DIR/trace/RUN, or a scenario")
    scenario = load(target) if run is None else from_data(run.meta["scenario"], target)
    added = {name: place for name, place in scenario.claims.items() if not wanted or name in wanted}
    imported = None if run is None else [f"claims.{name}" for name in added]
    with plugins.admitted(scenario, target, allow=allow_plugins, keys=imported):
        about_run = [claim.id for claim in run_claims(added=added)]
        about_model = [claim.id for claim in model_claims(added=added)]
        for name in wanted:
            if name not in (known := [*about_run, *about_model]):
                raise UnknownNameError("claim", name, known)
        about_run = [name for name in about_run if run is not None and name in (wanted or about_run)]
        about_model = [name for name in about_model if name in (wanted or about_model)]
        progress.stage("judging", len(about_run) + len(about_model), "claims")
        verdicts = [] if run is None else judge(run, about_run, progress)
        return verdicts + judge_model(scenario, claims=about_model, progress=progress)


if __name__ == "__main__":
    interruption.run(main)
