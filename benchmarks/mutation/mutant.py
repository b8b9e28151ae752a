"""A mutant: one edit of one file of the package, and what may catch it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

PACKAGE = "airground_drake"


class DoesNotApplyError(Exception):
    """The text that an edit is to replace is not there, or not once: the code has changed, and the list must."""


@dataclass(frozen=True)
class Mutant:
    """One edit.

    Attributes:
        name: what is broken, in words; unique.
        path: file, below the package.
        old: text that is there exactly once.
        new: what takes its place.
        runs: which probes are run, in this order, until one catches it; see `probe.PROBES`.
        proofs: claims about the model that are judged (of case A) if no probe catches it.
        tamperings: claims whose tamperings the checker must refuse, if nothing before catches it.
        tests: what pytest runs if nothing before catches it.
        equivalent: why nothing can catch it, if so.
    """

    name: str
    path: str
    old: str
    new: str
    runs: tuple[str, ...] = ("crowd d", "crowd c", "case_b d")
    proofs: tuple[str, ...] = ()
    tamperings: tuple[str, ...] = ()
    tests: tuple[str, ...] = ()
    equivalent: str = ""

    def apply(self, root: Path) -> Path:
        """Edit the copy of the package below `root`.

        Raises:
            DoesNotApplyError: if `old` is not there once.
        """
        file = root / PACKAGE / self.path
        text = file.read_text(encoding="utf-8")
        if text.count(self.old) != 1:
            raise DoesNotApplyError(f"{self.name}: {text.count(self.old)} times in {self.path}: {self.old!r}")
        file.write_text(text.replace(self.old, self.new), encoding="utf-8")
        return file

    def compiled(self, root: Path) -> bool:
        """Whether compiled functions are in the file: numba then knows callers in other files by stale results."""
        return "@njit" in (root / PACKAGE / self.path).read_text(encoding="utf-8")
