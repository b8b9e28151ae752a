"""`airground judge POSITIONS --scenario NAME`: judge recorded positions, such as those of a laboratory."""

from __future__ import annotations

import argparse
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from airground_drake.base import files
from airground_drake.base.errors import FAULT_WIDTH, one_line
from airground_drake.base.usage import Parser, overridable, refuse

if TYPE_CHECKING:
    import pandas as pd

MOST_LISTED = 20
"""Most pairs that are printed; those of least margin come first."""


def parser() -> argparse.ArgumentParser:
    """Make the parser."""
    parser = Parser(
        prog="airground judge",
        description="Judge sampled positions of robots from any source: which distances were kept, and by how much "
        "the samples miss the avoidance law.",
        epilog="exit codes: 0 every distance is kept, 1 one is not, 2 usage, or a file that cannot be used",
    )
    parser.add_argument(
        "positions", type=Path, metavar="FILE", help="CSV or Parquet with the columns t_s, body, x_m, y_m, z_m"
    )
    parser.add_argument(
        "--scenario", required=True, metavar="NAME", help="name of a shipped scenario, or path to a YAML file"
    )
    overridable(parser)
    parser.add_argument("--json", action="store_true", help="print every pair as JSON")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Judge, and print every pair; the exit codes are in the help."""
    options = parser().parse_args(arguments)
    from airground_drake.check import positions
    from airground_drake.scenarios.load import load, resolved

    scenario = resolved(load(options.scenario, options.set))
    try:
        found, covered = positions.judge(_table(options.positions), scenario)
    except (positions.UnusableError, ValueError) as error:
        return refuse(f"{options.positions}: {str(error)[:FAULT_WIDTH]}")
    broken = [one for one in found if not one.kept]
    if options.json:
        pairs = [{**one._asdict(), "kept": one.kept} for one in found]
        document = {"kept": not broken, "covered": covered._asdict(), "pairs": pairs}
        print(json.dumps(document | {"not_judged": positions.NOT_JUDGED}, indent=1))
        return int(bool(broken))
    print(f"The samples cover {covered.lasting_s:g} s, from t = {covered.first_s:.10g} s; "
          f"the scenario lasts {covered.duration_s:g} s.")  # fmt: skip
    print(f"{len(found) - len(broken)} of {len(found)} distances were kept. Least margins first:")
    for one in found[:MOST_LISTED]:
        law = "the law is not judged: samples are not equally spaced"
        if one.missed_m is not None:
            promised = f"{one.guarantee_m:.6g} m" if one.guarantee_m else "no distance"
            law = f"misses the law by e = {one.missed_m:.6g} m per period, which promises {promised}"
        verdict = "kept" if one.kept else "NOT KEPT"
        print(one_line(f"{one.first}, {one.second}: {verdict}, {one.least_m:.6g} of {one.safe_m:.6g} m; {law}"))
    print("".join(f"Not judged: {each}.\n" for each in positions.NOT_JUDGED), end="")
    return int(bool(broken))


def _table(path: Path) -> pd.DataFrame:
    """Read a table; ValueError if the file does not contain one."""
    import pandas as pd

    content = files.read_bytes(path, links=True)
    return files.read_table(content) if content[:4] == b"PAR1" else pd.read_csv(io.BytesIO(content))
