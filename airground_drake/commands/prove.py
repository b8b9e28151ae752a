"""`airground prove`: have Coq check the theorems of the package, or prove the runs of a report."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from airground_drake.base.registry import DISTANCES
from airground_drake.base.usage import positive, refuse
from airground_drake.report.sentences import counted
from airground_drake.scenario.options import Parser, option, parser_of

if TYPE_CHECKING:
    from airground_drake.verify.proofs.runs import Proved

EXIT_UNPROVED = 1


def parser() -> Parser:
    return parser_of(
        "prove",
        "Let Coq check the package's theorems (without DIR), or prove that the runs of a report keep their distances "
        "(with DIR).",
        {
            "report": option("folder of a report", "DIR", Path, nargs="?"),
            "--run": option("prove only this run of DIR, even if the scenario does not expect it to pass; may be "
                            "repeated", "NAME", action="append", default=[]),
            "--limit": option("seconds for one call of Coq (default: %(default)g)", "S", positive, default=600.0),
            "--record": "without DIR: write the record of this check",
        },
        "Exit codes: 0 proved (with DIR: each run that is named, or whose distances the scenario expects to be kept); "
        "1 something is not proved, or differs from its record; 2 usage, Coq is not installed, or a file cannot be "
        "read.",
    )  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    from airground_drake.verify.proofs.coq import CoqError

    options = parser().parse_args(arguments)
    if options.report and options.record:
        return refuse("--record and DIR exclude each other: the record is of the package's theorems")
    if options.run and not options.report:
        return refuse("--run needs DIR: it names a run of a report")
    try:
        return _runs(options) if options.report else _theorems(record=options.record, limit_s=options.limit)
    except CoqError as error:
        return refuse(error, EXIT_UNPROVED)


def _theorems(*, record: bool, limit_s: float) -> int:
    from airground_drake.verify.proofs import coq
    from airground_drake.verify.proofs.theorems import THEOREMS

    checked = coq.check(limit_s=limit_s)
    for name, theorem in THEOREMS.items():
        print(f"{name}: {theorem.statement}")
        if theorem.silent_on:
            print(f"    does not say: {theorem.silent_on}")
        print(f"    axioms: {', '.join(checked.axioms[name]) or 'none'}")
    print(
        f"Coq {checked.coq}: {len(checked.axioms)} theorems in {len(checked.sha256)} files, compiled in "
        f"{checked.compile_s:.0f} s, checked again by coqchk in {checked.again_s:.0f} s"
    )
    if record:
        print(coq.write_record(checked))
    differing = coq.differences(checked)
    for line in differing:
        print(line)
    return EXIT_UNPROVED if differing else 0


def _runs(options: argparse.Namespace) -> int:
    from airground_drake.report import proved
    from airground_drake.verify.proofs.runs import prove_report

    code = 0
    for proof in prove_report(options.report, options.run, options.limit):
        print("\n".join(_lines(proof)), flush=True)
        if (proof.about["expected"] or options.run) and not proof.distances.proved:
            code = EXIT_UNPROVED
    if proved.write(options.report):
        print(f"{options.report / 'report.html'} says so beside {DISTANCES}")
    return code


def _lines(proof: Proved) -> list[str]:
    lines = []
    pairs, lawful = proof.about["pairs"], proof.about["lawful_pairs"]
    some = f" by {counted(lawful, 'pair')} (of robots without lag, and with balls at rest)" if lawful < pairs else ""
    for what, answer in (
        (f"all {pairs} distances kept at all times", proof.distances),
        (f"avoidance law obeyed without error{some}", proof.law),
    ):
        if answer.proved:
            lines.append(f"run {proof.run}: {what}: proved in {answer.seconds:.1f} s ({answer.file})")
        else:
            lines.append(f"run {proof.run}: {what}: not proved: {answer.why}")
    if not proof.about["expected"]:
        lines.append(f"run {proof.run}: the scenario does not ask for it: it does not expect {DISTANCES} to hold")
    return lines
