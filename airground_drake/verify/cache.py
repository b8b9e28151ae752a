"""Findings of experiments about the model, kept by content: equal code and inputs, equal finding.

An entry is a file that says what it is about: claim, inputs, digest of the code, versions of the engines, the finding
and its SHA-256. It is taken if all of that is what is asked for and the finding passes and has that digest. Anything
else is decided anew, so that a damaged entry costs time and no more. An entry that somebody forged with its digest is
believed: see docs/verification.md.
"""

from __future__ import annotations

import contextlib
import json
import os
import platform
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from airground_drake.base import files
from airground_drake.base.statuses import PASSING
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Finding

SCHEMA = "airground_drake.finding/2"
LARGEST_BYTES = 16_000_000
"""A larger entry is not read."""
KEPT = ("ZENO-REFINE", "THR-DDM")
"""The claims whose findings are kept: experiments that take seconds."""
ENGINES = ("numpy", "scipy", "numba")
"""Packages whose versions are part of a finding's key."""


def found(claim: ModelClaim, inputs: dict[str, Any], folder: Path | None = None) -> Finding:
    """The finding of a claim for its inputs.

    Args:
        claim: the claim.
        inputs: what it is about, strict JSON.
        folder: where findings of `KEPT` are kept; None: computed anew, kept nowhere.
    """
    kept = _read(folder, claim, inputs)
    if kept is not None:
        return kept
    made = claim.judge(inputs)
    _keep(folder, claim, inputs, made)
    return made


def cache_folder() -> Path:
    """Where findings are kept: $AIRGROUND_DRAKE_CACHE, or airground_drake in the user's cache folder."""
    if chosen := os.environ.get("AIRGROUND_DRAKE_CACHE"):
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "airground_drake"


def key(claim: ModelClaim, inputs: Mapping[str, Any]) -> str:
    """SHA-256 of everything that a finding depends on."""
    return files.sha256(json.dumps(content(claim, inputs), sort_keys=True, allow_nan=False).encode())


def content(claim: ModelClaim, inputs: Mapping[str, Any]) -> dict[str, Any]:
    """Everything that a finding depends on: the claim, its inputs, our code, the engines' versions."""
    return {"schema": SCHEMA, "claim": claim.id, "inputs": inputs, "code": _code(), "engines": _engines()}


@cache
def _code() -> str:
    return code_digest(Path(__file__).parent.parent)


def code_digest(package: Path) -> str:
    """SHA-256 of all Python files of a package, those of its sub-packages too: where they are and what they say."""
    digests = {str(path.relative_to(package)): files.sha256(path.read_bytes()) for path in package.rglob("*.py")}
    return files.sha256(json.dumps(digests, sort_keys=True).encode())


@cache
def _engines() -> dict[str, str]:
    found = {"python": platform.python_version()}
    for name in ENGINES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def _keep(folder: Path | None, claim: ModelClaim, inputs: Mapping[str, Any], finding: Finding) -> None:
    """Write an entry, whole or not at all, of a finding that passes."""
    if folder is None or claim.id not in KEPT or finding.status not in PASSING:
        return
    made = finding.to_json()
    with contextlib.suppress(OSError):  # a folder that cannot be written keeps nothing
        entry = {**content(claim, inputs), "finding": made, "sha256": _digest(made)}
        files.write_json(_path(folder, claim, inputs), entry)


def _read(folder: Path | None, claim: ModelClaim, inputs: Mapping[str, Any]) -> Finding | None:
    """The finding that was kept, if there is a sound one."""
    if folder is None or claim.id not in KEPT:
        return None
    path = _path(folder, claim, inputs)
    try:
        if not path.is_file() or path.stat().st_size > LARGEST_BYTES:
            return None
        entry = json.loads(path.read_text(encoding="utf-8"))
        made, digest = entry.pop("finding"), entry.pop("sha256")
        sound = digest == _digest(made) and made["status"] in PASSING
        finding = Finding(**made | {"evidence": TypeAdapter(claim.record).validate_python(made["evidence"])})
    except (OSError, ValueError, TypeError, AttributeError, KeyError, RecursionError):
        return None
    about = json.dumps(entry, sort_keys=True) == json.dumps(content(claim, inputs), sort_keys=True)
    return replace(finding, from_cache=True) if sound and about else None


def _digest(finding: Mapping[str, Any]) -> str:
    """SHA-256 of a finding: a bit that flips on a disk is noticed."""
    return files.sha256(json.dumps(finding, sort_keys=True, allow_nan=False).encode())


def _path(folder: Path, claim: ModelClaim, inputs: Mapping[str, Any]) -> Path:
    return folder / f"{key(claim, inputs)}.json"
