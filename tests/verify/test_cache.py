"""Findings are kept by what they depend on."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest

import airground_drake
from airground_drake.base import files
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify import cache
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Finding


class Counting(ModelClaim):
    """A claim that counts how often it is decided."""

    id, statement, formula, method, equations = "THR-DDM", "s", "f", "m", "e"
    assumptions, does_not_establish = (), "n"

    def __init__(self, found: Finding | Exception) -> None:
        self.found, self.calls = found, 0

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        return {}

    def check(self, inputs: dict[str, Any]) -> Finding:
        self.calls += 1
        if isinstance(self.found, Exception):
            raise self.found
        return self.found


def test_findings_are_kept_by_their_inputs(tmp_path: Path) -> None:
    claim = Counting(Finding("proved", evidence={"a": "b"}))
    first = cache.found(claim, {"x": 1.0}, tmp_path)
    assert not first.from_cache
    assert cache.found(claim, {"x": 1.0}, tmp_path) == replace(first, from_cache=True)
    assert claim.calls == 1
    cache.found(claim, {"x": 2.0}, tmp_path)
    cache.found(claim, {"x": 1.0}, None)
    assert claim.calls == 3


def test_what_was_left_open_is_tried_again(tmp_path: Path) -> None:
    for found in (Finding("inconclusive"), RuntimeError("no luck"), Finding("proved", margin=float("nan"))):
        claim = Counting(found)
        for _ in range(2):
            made = cache.found(claim, {}, tmp_path)
        assert claim.calls == 2
        assert made.status in ("inconclusive", "error")
    assert not list(tmp_path.iterdir())


def put(folder: Path, content: bytes) -> None:
    """In the place of the one entry."""
    (kept,) = folder.iterdir()
    kept.unlink()
    kept.write_bytes(content)


def entry(**changes: Any) -> bytes:
    """One of COUNTING for {}, with changes to its finding."""
    finding = asdict(Finding("proved", margin=1.0, exercised=1)) | changes
    about = cache.content(Counting(Finding("proved")), {})
    text = json.dumps(finding, sort_keys=True, allow_nan=True)
    return json.dumps({**about, "finding": finding, "sha256": files.sha256(text.encode())}).encode()


UNUSABLE: dict[str, bytes] = {
    "nothing": b"",
    "not JSON": b"{",
    "not UTF-8": b"\xff\xfe",
    "a list": b"[]",
    "deep": b"[" * 100_000,
    "no finding": json.dumps(cache.content(Counting(Finding("proved")), {})).encode(),
    "a status that is none": entry(status="lol"),
    "a status of another type": entry(status=["proved"]),
    "a margin of NaN": entry(margin=float("nan")),
    "a margin beyond all": entry().replace(b"1.0", b"1e999"),
    "a field too many": entry(more=1),
    "a flipped bit": entry().replace(b'"margin": 1.0', b'"margin": 3.0'),
    "no digest": entry().replace(b'"sha256"', b'"sha265"'),
    "nothing that passes": entry(status="inconclusive"),
    "a refutation": entry(status="refuted", counterexample={"x": 1}),
    "another claim": entry().replace(b"THR-DDM", b"ANOTHER"),
    "another code": entry().replace(cache._code().encode(), b"0" * 64),
    "another engine": entry().replace(b'"numba"', b'"numbb"'),
    "another schema": entry().replace(b"finding/2", b"finding/1"),
    "large": entry() + b" " * cache.LARGEST_BYTES,
}


@pytest.mark.parametrize("what", UNUSABLE)
def test_an_entry_that_cannot_be_taken_is_made_anew(tmp_path: Path, what: str) -> None:
    claim = Counting(Finding("proved", margin=2.0, exercised=1))
    cache.found(claim, {}, tmp_path)
    put(tmp_path, UNUSABLE[what])
    found = cache.found(claim, {}, tmp_path)
    assert (found.margin, found.from_cache, claim.calls) == (2.0, False, 2)


def test_an_entry_as_it_should_be_is_taken(tmp_path: Path) -> None:
    claim = Counting(Finding("proved", margin=2.0, exercised=1))
    cache.found(claim, {}, tmp_path)
    put(tmp_path, entry())
    assert cache.found(claim, {}, tmp_path) == Finding("proved", 1.0, exercised=1, from_cache=True)


@pytest.mark.parametrize("make", [os.mkfifo, Path.mkdir, lambda path: path.symlink_to("/dev/zero")])
def test_what_is_no_file_is_not_read(tmp_path: Path, make: Callable[[Path], None]) -> None:
    make(tmp_path / f"{cache.key(Counting(Finding('proved')), {})}.json")
    assert cache.found(Counting(Finding("proved")), {}, tmp_path) == Finding("proved")


def test_an_entry_under_another_key_is_made_anew(tmp_path: Path) -> None:
    """What was proved for a dwell says nothing of a trigger without."""
    claim = Counting(Finding("proved"))
    cache.found(claim, {"dwell_s": 1.0}, tmp_path)
    (kept,) = tmp_path.iterdir()
    kept.rename(tmp_path / f"{cache.key(claim, {'dwell_s': 0.0})}.json")
    assert not cache.found(claim, {"dwell_s": 0.0}, tmp_path).from_cache
    assert claim.calls == 2


def test_claims_that_are_not_listed_are_decided_anew(tmp_path: Path) -> None:
    """A theorem's hypotheses take no longer to check than an entry takes to read; claims of others may change."""
    claim = Counting(Finding("proved"))
    claim.id = "OWN"
    for _ in range(2):
        assert not cache.found(claim, {}, tmp_path).from_cache
    assert claim.calls == 2
    assert not list(tmp_path.iterdir())


def test_the_key_covers_every_file_of_the_package_where_it_is(tmp_path: Path) -> None:
    (tmp_path / "sub" / "deeper").mkdir(parents=True)
    for name in ("a.py", "sub/b.py", "sub/deeper/c.py"):
        (tmp_path / name).write_text("x = 1\n", encoding="utf-8")
    digests = [cache.code_digest(tmp_path)]
    (tmp_path / "sub/deeper/c.py").write_text("x = 2\n", encoding="utf-8")
    digests.append(cache.code_digest(tmp_path))
    (tmp_path / "sub/b.py").rename(tmp_path / "sub/deeper/b.py")
    digests.append(cache.code_digest(tmp_path))
    assert len(set(digests)) == 3
    assert cache.code_digest(tmp_path) == digests[-1]
    package = Path(airground_drake.__file__).parent
    assert cache.code_digest(package) == cache._code()
