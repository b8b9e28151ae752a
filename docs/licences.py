"""`python docs/licences.py`: the licences of all packages in constraints.txt, from the packages' own metadata."""

from __future__ import annotations

import re
from importlib.metadata import PackageMetadata, metadata
from pathlib import Path

from airground_drake.base import files

ROOT = Path(__file__).parent.parent
PREFIX = "License :: "


def main() -> None:
    """Write the file; the pinned packages must be installed."""
    lines = [
        "Made by: python docs/licences.py",
        "",
        "Licences of the packages in constraints.txt, as they declare them; airground_drake itself is BSD-3-Clause.",
        "",
        *(f"{name}  {version}  {licence(metadata(name))}" for name, version in pinned()),
    ]
    files.write_text(Path(__file__).with_name("licences.txt"), "\n".join(lines) + "\n")


def pinned() -> list[tuple[str, str]]:
    """Name and version of each package in constraints.txt."""
    return re.findall(r"^([\w.-]+)==(\S+)$", (ROOT / "constraints.txt").read_text(encoding="utf-8"), re.MULTILINE)


def licence(of: PackageMetadata) -> str:
    """The licence that a package declares: an expression, else classifiers, else the first line of a text."""
    if expression := of.get("License-Expression"):
        return str(expression)
    names = [entry.split(" :: ")[-1] for entry in of.get_all("Classifier") or () if entry.startswith(PREFIX)]
    text = (of.get("License") or "").strip().splitlines() or ["not declared"]
    return "; ".join(names) or text[0][:60]


if __name__ == "__main__":
    main()
