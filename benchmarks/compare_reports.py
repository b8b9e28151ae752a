"""Are two reports' verdicts the same? `python benchmarks/compare_reports.py BEFORE AFTER` (folders of reports).

Compares report by report, found by name in both folders: every claim's status, expectation, margin (to the last digit;
not GATE-TIME's, which is measured), unit and count of what exercised it, the mutants' refutations, the reproduction
table, the findings of the audit, and events. Exit code: 0 equal, 1 not, 2 nothing to compare.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

MEASURED = {"GATE-TIME"}


def facts(report: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """(what, value) of everything that must not change."""
    for claim in report["claims"]:
        for field in ("status", "expected", "unit", *(() if claim["id"] in MEASURED else ("margin",))):
            yield f"{claim['id']} {claim['run'] or 'model'}: {field}", claim[field]
        yield f"{claim['id']} {claim['run'] or 'model'}: exercised", claim.get("exercised")  # older reports have none
    for mutant in report["mutants"]:
        yield f"{mutant['claim']} mutant {mutant['mutant'].rpartition(': ')[2]}", (mutant["status"], mutant["refuted"])
    for row in report["reproduction"]:
        yield f"reproduction {row['id']}", (row["ours"], row["status"])
    for item in report["audit"]:
        yield f"audit {item['id']}", (item["demonstrated"], item["paper"], item["ours"])
    for name, run in report["runs"].items():
        yield f"events of run {name}", run["events"]


def differences(before: Path, after: Path) -> list[str]:
    """What differs between two reports, one line each."""
    one, two = (dict(facts(json.loads((folder / "report.json").read_text("utf-8")))) for folder in (before, after))
    lines = [f"{what}: only {'before' if what in one else 'after'}" for what in sorted(one.keys() ^ two.keys())]
    shared = (what for what in one if what in two)
    lines += [f"{what}: {one[what]!r} before, {two[what]!r} after" for what in shared if one[what] != two[what]]
    return [line[:300] for line in lines]


def main() -> int:
    """Compare and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=Path)
    parser.add_argument("after", type=Path)
    options = parser.parse_args()
    names = sorted(path.parent.name for path in options.before.glob("*/report.json"))
    if not names:
        print(f"no reports in {options.before}", file=sys.stderr)
        return 2
    wrong = 0
    for name in names:
        found = differences(options.before / name, options.after / name)
        wrong += len(found)
        count = len(list(facts(json.loads((options.before / name / "report.json").read_text("utf-8")))))
        print(f"{name}: {count} facts, {len(found)} differ", *found, sep="\n  ")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
