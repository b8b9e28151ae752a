"""Every mutant, and the test that notices it: `python benchmarks/mutants.py [--only WORD]`.

A mutant is one edit of the package, made in a temporary copy. `benchmarks/mutation/chosen.txt` lists edits that matter,
each with the tests that must notice it. These run on the copy until one fails; that test must pass on the package as it
is. Prints a line for each mutant. Exit code 1 if one survives.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from mutation.chosen import CHOSEN
from mutation.mutant import PACKAGE, Mutant

ROOT = Path(__file__).resolve().parents[1]
COPIED = (PACKAGE, "tests", "benchmarks", "docs", "examples", "reports", "pyproject.toml", "README.md")
LONGEST_S = 900
"""Time limit of the tests of a mutant, s: a mutant may run for ever."""


def failing(copy: Path, tests: Sequence[str], compiled: Path) -> str:
    """The first of the tests that fails in a copy, or that the time limit ends; '' if all pass.

    Args:
        copy: of the repository.
        tests: what pytest takes.
        compiled: folder for what numba compiles.
    """
    paths = os.pathsep.join(map(str, (copy, copy / "tests")))
    environment = {"PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1", "NUMBA_CACHE_DIR": str(compiled)}
    options = ("-m", "", "-n", "0", "-x", "-v", "--no-header", "-p", "no:cacheprovider")
    command = (sys.executable, "-m", "pytest", *options, *tests)
    try:
        done = subprocess.run(
            command, cwd=copy, env=os.environ | environment, capture_output=True, text=True, check=False,
            timeout=LONGEST_S,
        )  # fmt: skip
    except subprocess.TimeoutExpired as late:
        begun = (late.stdout or b"").decode(errors="replace").rstrip().rpartition("\n")[2]
        return begun.strip()
    failed = re.findall(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", done.stdout, flags=re.MULTILINE)
    return failed[0] if failed else ""


def noticed_by(mutant: Mutant, copy: Path, compiled: Path) -> str:
    """The test that fails on the mutant and passes on the package as it is; '' if there is none."""
    file = copy / PACKAGE / mutant.path
    text = file.read_text(encoding="utf-8")
    file.write_text(mutant.edited(text), encoding="utf-8")
    try:
        if "@njit" not in text:
            failed = failing(copy, mutant.tests, compiled)
        else:  # numba does not compile the callers in other files again
            with tempfile.TemporaryDirectory() as anew:
                failed = failing(copy, mutant.tests, Path(anew))
    finally:
        shutil.copy2(ROOT / PACKAGE / mutant.path, file)
    return "" if failed and failing(copy, [failed], compiled) else failed


def main() -> int:
    """Break, test, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", action="append", default=[], metavar="WORD", help="mutants with this in name or path")
    words = parser.parse_args().only
    mutants = [each for each in CHOSEN if not words or any(word in f"{each.name} {each.path}" for word in words)]
    survived = 0
    with tempfile.TemporaryDirectory() as name:
        copy, compiled = Path(name) / "copy", Path(name) / "compiled"
        copy.mkdir()
        for part in COPIED:
            whole = shutil.copytree if (ROOT / part).is_dir() else shutil.copy2
            whole(ROOT / part, copy / part)
        for mutant in mutants:
            test = noticed_by(mutant, copy, compiled)
            survived += not test
            print(f"{mutant.name}: {test or 'NOT NOTICED'}", flush=True)
    print(f"{len(mutants)} mutants, {survived} not noticed")
    return int(survived > 0)


if __name__ == "__main__":
    sys.exit(main())
