"""The results as a page of the documentation."""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Sequence
from typing import Any

WIDTH = 120
STAGES = {
    "claim": "by a claim about a run",
    "checker": "by the independent checker alone",
    "proof": "by a proof about the model",
    "tampering": "by a tampered report that is not refused any more",
    "test": "by a test only",
    "nothing": "by nothing",
}
HEAD = """\
Made by `python benchmarks/mutants.py --json mutants.json --page docs/mutants.md`: each mutant is one edit of the
package in a temporary copy. Short runs (scenarios `crowd`, `bodies`, `case_a`, `case_b`, `soft_gate`) are judged by
their claims and by the independent checker; where they say nothing else than on the package as it is, the experiments
that are about the edited code, tampered reports (mutants of the checker), and at last the tests of the file. A mutant
counts for the first of these that catches it. What demands less (mutants of claims and of the checker) says the same on
honest runs: it takes a run, or a report, that must be refused.
"""
ELSEWHERE = """\
Mutants that the tests make in place: wiring, layers, automata and gatekeepers in `tests/hypotheses`; mutants that a
claim must refute in `tests/verify/runs/test_exec.py` (EXEC) and `tests/verify/runs/test_gate_model.py` (GATE-MODEL),
and broken traces in the other files of `tests/verify/runs`. Tampered reports: `tests/check/tampering`, see
[the checker](checker.md).
"""


def page(results: Sequence[dict[str, Any]], others: Sequence[str] = ()) -> str:
    """The results by what caught them, and the names of mutants of which there is none."""
    lines = ["<!-- Made by: python benchmarks/mutants.py --page -->", "# Mutants", "", *HEAD.splitlines(), ""]
    count = Counter(each["stage"] for each in results)
    lines += [
        f"{len(results)} mutants:",
        "",
        *(f"- {count[s]} caught {says}" for s, says in STAGES.items() if count[s]),
    ]
    lines += ["", "Judged on the code as it was at commit:", ""]
    commits = Counter(each.get("commit") or "not recorded" for each in results)
    lines += [f"- {commit}: {number}" for commit, number in commits.most_common()]
    for stage, says in STAGES.items():
        mine = [each for each in results if each["stage"] == stage]
        if mine:
            lines += ["", f"## Caught {says}", ""]
            for each in mine:
                by = each["equivalent"] or "; ".join(each["by"][:4]) + ("; ..." if len(each["by"]) > 4 else "")
                text = f"- **{each['name']}** (`{each['path']}`): {by or 'survives, and is not equivalent'}"
                lines += textwrap.wrap(
                    text, WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
                )
    if others:
        lines += ["", "## Not judged yet", ""]
        lines += textwrap.wrap(
            f"{len(others)} mutants of the list, of which the file of results has none: {'; '.join(others)}.", WIDTH
        )
    lines += ["", "## Elsewhere", "", *ELSEWHERE.splitlines()]
    return "\n".join(lines) + "\n"
