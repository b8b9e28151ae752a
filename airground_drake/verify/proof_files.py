"""cvc5's own proofs of a report's SMT-LIB certificates, for checkers of others.

    python -m airground_drake.verify.proof_files DIR

reads the scripts `DIR/certificates/<claim>/<name>.smt2` and writes `DIR/proofs/<claim>/<name>.cpc`, cvc5's proof in its
Cooperating Proof Calculus (CPC), wherever cvc5 finds one all of whose steps have a rule; and `DIR/proofs/index.json`,
which says for each script what became of it. The proof checker Ethos (C++) checks such a file with the signature of the
calculus that comes with cvc5, `proofs/eo/cpc/Cpc.eo`; it contains the script's assertions, to be compared with it.

The other format, Alethe, leaves holes in every one of these proofs (cvc5 1.4), and none at all for nonlinear steps.
cvc5's decision procedure for nonlinear arithmetic, cylindrical algebraic coverings, has no proof rule: its steps would
be `trust`. It is turned off here, and products are bounded by incremental linearisation alone, which decides less.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from airground_drake import files
from airground_drake.usage import Parser, refuse
from airground_drake.verify.engines.smt import Result, solve

LIMIT_S = 30.0
"""Wall-clock time for a script, s; cvc5 gives up before, by a count (see `smt`)."""
LARGEST_BYTES = 1_000_000
"""A larger proof is not kept."""


def proofs_of(folder: Path, limit_s: float = LIMIT_S) -> list[dict[str, Any]]:
    """Write what proofs there are beside the certificates of a report.

    Args:
        folder: of the report.
        limit_s: wall-clock time for each script, s.

    Returns:
        The index: `claim`, `script`, `outcome` ('complete', or why there is none), and of a proof `file`, `bytes`,
        `sha256`.

    Raises:
        OSError: if the folder cannot be read or written.
    """
    scripts = sorted(folder.glob("certificates/*/*.smt2"))
    found = solve([files.read_text(script) for script in scripts], "cvc5_proof", limit_s)
    index = [_kept(folder, script, result) for script, result in zip(scripts, found, strict=True)]
    files.write_json(folder / "proofs" / "index.json", index)
    return index


def _kept(folder: Path, script: Path, result: Result) -> dict[str, Any]:
    claim = script.parent.name
    entry: dict[str, Any] = {"claim": claim, "script": f"certificates/{claim}/{script.name}"}
    why = outcome(result)
    if why == "complete":
        file = folder / "proofs" / claim / f"{script.stem}.cpc"
        text = commands(result.proof)
        files.write_text(file, text)
        content = text.encode()
        entry |= {"file": f"proofs/{claim}/{file.name}", "bytes": len(content), "sha256": files.sha256(content)}
    return entry | {"outcome": why}


def commands(proof: str) -> str:
    """The proof without the brackets that cvc5 puts around all of it: what Ethos reads."""
    text = proof.strip()
    return text[1:-1].strip() + "\n" if text.startswith("(\n") and text.endswith("\n)") else text + "\n"


def outcome(result: Result) -> str:
    """'complete' for a proof that can be checked step by step, else why there is none."""
    if result.answer != "unsat":
        return f"no proof: {result.detail or result.answer}"
    trusted = result.proof.count(":rule trust")
    if trusted:
        return f"no proof: {trusted} of its steps have no rule"
    if not result.proof:
        return "no proof: cvc5 gives none"
    size = len(result.proof.encode())
    return "complete" if size <= LARGEST_BYTES else f"no proof: it has {size} bytes"


def parser() -> argparse.ArgumentParser:
    """What the command line takes."""
    parser = Parser(
        prog="airground proofs",
        description="Write cvc5's own proofs of a report's scripts.",
    )
    parser.add_argument("report", type=Path, metavar="DIR", help="folder with certificates/")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the proofs of a report, and say by claim how many there are; 2 if the folder is no report's."""
    folder = parser().parse_args(arguments).report
    if not (folder / "certificates").is_dir():
        return refuse(f"{folder} has no certificates")
    index = proofs_of(folder)
    for claim, count in Counter(entry["claim"] for entry in index).items():
        mine = [entry for entry in index if entry["claim"] == claim]
        lacking = [entry for entry in mine if "file" not in entry]
        print(f"{claim}: {count - len(lacking)} of {count} scripts have a proof")
        for entry in lacking:
            print(f"    {Path(entry['script']).stem}: {json.dumps(entry['outcome'])[1:-1]}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
