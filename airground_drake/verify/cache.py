"""Findings of model claims, kept by content: equal code and inputs, equal finding."""

from __future__ import annotations

import contextlib
import json
import os
import platform
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from airground_drake import files
from airground_drake.registry import PASSING
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Finding

ENGINES = ("numpy", "scipy", "numba", "z3-solver", "cvc5", "python-flint", "sympy", "pyddm", "drake")
"""Packages whose versions are part of a finding's key."""


def find(
    claims: Sequence[ModelClaim], inputs: Sequence[dict[str, Any]], *, folder: Path | None = None
) -> list[Finding]:
    """The finding of each claim for its inputs.

    Args:
        claims: the claims.
        inputs: what each is about, strict JSON.
        folder: where findings are kept; None: computed anew, kept nowhere.
    """
    known = [_read(folder, key(claim, given)) for claim, given in zip(claims, inputs, strict=True)]
    todo = [i for i, found in enumerate(known) if found is None]
    made: Mapping[int, Finding] = {}
    if todo:
        # the solvers run in processes of their own and the experiments in compiled code: threads suffice
        with ThreadPoolExecutor(max_workers=2) as pool:
            made = dict(zip(todo, pool.map(lambda i: claims[i].judge(inputs[i]), todo), strict=True))
    findings = []
    for i, found in enumerate(known):
        finding = found if found is not None else made[i]
        if found is None and folder is not None and finding.status in (*PASSING, "refuted"):
            with contextlib.suppress(OSError):  # a folder that cannot be written keeps nothing
                files.write_json(folder / f"{key(claims[i], inputs[i])}.json", asdict(finding))
        findings.append(finding)
    return findings


def cache_folder() -> Path:
    """Where findings are kept: $AIRGROUND_DRAKE_CACHE, or airground_drake in the user's cache folder."""
    if chosen := os.environ.get("AIRGROUND_DRAKE_CACHE"):
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "airground_drake"


def key(claim: ModelClaim, inputs: Mapping[str, Any]) -> str:
    """SHA-256 of everything that a finding depends on: the claim, its inputs, our code, the engines' versions."""
    content = json.dumps([claim.id, inputs, _code(), _engines()], sort_keys=True, allow_nan=False)
    return files.sha256(content.encode())


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


def _read(folder: Path | None, name: str) -> Finding | None:
    """A finding that was kept; None if there is none that can be read."""
    if folder is None:
        return None
    try:
        return Finding(**json.loads((folder / f"{name}.json").read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None
