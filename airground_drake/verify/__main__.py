"""`python -m airground_drake.verify DIR/trace/d SAFE-TRACE`: judge claims on a saved run or about its model."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import yaml

from airground_drake import trace
from airground_drake.errors import AirgroundError
from airground_drake.scenarios.load import load
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify import Verdict, verify, verify_model
from airground_drake.verify.registry import MODEL_CLAIMS, RUN_CLAIMS

EXIT_DIFFERS, EXIT_USAGE = 1, 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Returns:
        Exit code: 0 all as the scenario expects, 1 a claim differs, 2 usage, or a run or scenario that cannot be used.
    """
    parser = argparse.ArgumentParser(
        prog="python -m airground_drake.verify",
        description="Judge claims anew, on a saved run or about a scenario's model; nothing is taken from a cache.",
    )
    parser.add_argument("target", help="folder of a saved run (DIR/trace/RUN), or a scenario, shipped or a YAML file")
    parser.add_argument("claims", nargs="*", metavar="CLAIM", help="identifiers (default: all that apply)")
    parser.add_argument("--json", action="store_true", help="print the whole verdicts as JSON")
    options = parser.parse_args(arguments)
    known = [*RUN_CLAIMS, *MODEL_CLAIMS]
    if unknown := [name for name in options.claims if name not in known]:
        parser.error(f"unknown claim {', '.join(unknown)}; claims are {', '.join(known)}")
    try:
        verdicts = _judge(options.target, options.claims or known)
    except (AirgroundError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return EXIT_USAGE
    if missing := set(options.claims) - {verdict.claim.id for verdict in verdicts}:
        print(f"error: {', '.join(sorted(missing))} says nothing about {options.target}", file=sys.stderr)
        return EXIT_USAGE
    if options.json:
        print(json.dumps([verdict.to_json() for verdict in verdicts], indent=1, allow_nan=False))
    else:
        print("".join(f"{_line(verdict)}\n" for verdict in verdicts), end="")
    return 0 if all(verdict.as_expected for verdict in verdicts) else EXIT_DIFFERS


def _line(verdict: Verdict) -> str:
    """A verdict in one line."""
    finding = verdict.finding
    name = f"{verdict.claim.id} {verdict.run}" if verdict.run else verdict.claim.id
    margin = "" if finding.margin is None else f", margin {finding.margin:.6g} {finding.unit}"
    expected = "" if verdict.as_expected else f", expected {verdict.expected}"
    return f"{name}: {finding.status}{margin}{expected}"


def _judge(target: str, wanted: Sequence[str]) -> list[Verdict]:
    """Verdicts on the claims wanted, as far as they say anything about the target."""
    about_model = [name for name in wanted if name in MODEL_CLAIMS]
    folder = Path(target)
    if not (folder / "meta.json").is_file():
        return verify_model(load(target)[0], claims=about_model)
    run = trace.load(folder)
    about_run = [name for name in wanted if name in RUN_CLAIMS]
    return verify(run, about_run) + verify_model(_scenario_of(run), claims=about_model)


def _scenario_of(run: trace.Trace) -> Scenario:
    """The resolved scenario that a trace carries, validated again."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scenario.yaml"
        path.write_text(yaml.safe_dump(run.scenario, sort_keys=False), encoding="utf-8")
        return load(str(path))[0]


if __name__ == "__main__":
    sys.exit(main())
