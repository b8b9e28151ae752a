"""A cache of findings of experiments about the model: equal code and inputs give an equal finding.

An entry is a file with the claim, its inputs, a digest of the code, the versions of the engines, the finding and the
finding's SHA-256. It is used only if everything matches and the finding passes. Otherwise the claim is decided again,
so a damaged entry only costs time. A forged entry with a matching digest is not detected: see docs/verification.md.
"""

import contextlib
import json
import os
import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from airground_drake.base import files
from airground_drake.base.registry import MODEL_CLAIMS
from airground_drake.base.statuses import PASSING
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Chart, Finding

SCHEMA = "airground_drake.finding/2"
LARGEST_BYTES = 16_000_000  # a larger entry is not read
ENGINES = ("numpy", "scipy", "numba")  # packages whose versions are part of a finding's key


def cached_finding(claim: ModelClaim, inputs: dict[str, Any], folder: Path | None = None) -> Finding:
    # folder: where findings are kept; None: computed anew. Third-party code is not part of the key, so never kept.
    if folder is None or not claim.kept or claim.id not in MODEL_CLAIMS.own:
        return claim.judge(inputs)
    path = folder / f"{key(claim, inputs)}.json"
    if (kept := _read(path, claim, inputs)) is not None:
        return kept
    finding = claim.judge(inputs)
    if finding.status in PASSING:
        made = finding.to_json()
        with contextlib.suppress(OSError):  # a folder that cannot be written keeps nothing
            files.write_json(path, {**content(claim, inputs), "finding": made, "sha256": _digest(made)})
    return finding


def cache_folder() -> Path:
    """The cache folder: $AIRGROUND_DRAKE_CACHE, or airground_drake in the user's cache folder."""
    if chosen := os.environ.get("AIRGROUND_DRAKE_CACHE"):
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "airground_drake"


def key(claim: ModelClaim, inputs: Mapping[str, Any]) -> str:
    return files.sha256(json.dumps(content(claim, inputs), sort_keys=True, allow_nan=False).encode())


def content(claim: ModelClaim, inputs: Mapping[str, Any]) -> dict[str, Any]:
    """All inputs of a finding: the claim, its constants, our code, the engines' versions."""
    return {"schema": SCHEMA, "claim": claim.id, "inputs": inputs, "code": _code(), "engines": _engines()}


@cache
def _code() -> str:
    return code_digest(Path(__file__).parent.parent)


def code_digest(package: Path) -> str:
    """SHA-256 of the paths and contents of all Python files of a package and its sub-packages."""
    digests = {str(path.relative_to(package)): files.sha256(path.read_bytes()) for path in package.rglob("*.py")}
    return files.sha256(json.dumps(digests, sort_keys=True).encode())


@cache
def _engines() -> dict[str, str]:
    return {"python": platform.python_version()} | {name: version(name) for name in ENGINES}


def _read(path: Path, claim: ModelClaim, inputs: Mapping[str, Any]) -> Finding | None:
    """The cached finding, if the entry is valid and about this claim."""
    try:
        entry = json.loads(files.read_bytes(path, LARGEST_BYTES))
        made, digest = entry.pop("finding"), entry.pop("sha256")
        sound = digest == _digest(made) and made["status"] in PASSING
        about = json.dumps(entry, sort_keys=True) == json.dumps(content(claim, inputs), sort_keys=True)
        figure = Chart(**made["figure"]) if made["figure"] else None
        finding = Finding(**made | {"figure": figure, "from_cache": True})
    except (OSError, ValueError, TypeError, AttributeError, KeyError, RecursionError):
        return None
    return finding if sound and about else None


def _digest(finding: Mapping[str, Any]) -> str:
    """SHA-256 of a finding, to detect damage; non-finite numbers raise ValueError."""
    return files.sha256(json.dumps(finding, sort_keys=True, allow_nan=False).encode())
