"""`python docs/sizes.py`: sizes of the largest packages that the package needs, in MB, from their own lists."""

from __future__ import annotations

import re
from importlib.metadata import Distribution, PackageNotFoundError, distribution

SHOWN_MB = 25


def main() -> None:
    """Print a line each, the largest first, and the sum of all."""
    found: dict[str, float] = {}
    to_look_at = ["airground_drake"]
    while to_look_at:
        name = to_look_at.pop()
        if name in found:
            continue
        try:
            package = distribution(name)
        except PackageNotFoundError:  # needed on another system or another Python only
            continue
        found[name] = megabytes(package)
        to_look_at += [
            re.split(r"[^\w.-]", wanted, maxsplit=1)[0].lower().replace("_", "-")
            for wanted in package.requires or ()
            if "extra ==" not in wanted
        ]
    for name, size in sorted(found.items(), key=lambda entry: -entry[1]):
        if size >= SHOWN_MB:
            print(f"{size:6.0f} {name}")
    print(f"{sum(found.values()):6.0f} all {len(found)} packages")


def megabytes(package: Distribution) -> float:
    """Size of the files of a package on the disk, MB."""
    paths = {path.locate() for path in package.files or ()}
    return sum(path.stat().st_size for path in paths if path.is_file()) / 1e6


if __name__ == "__main__":
    main()
