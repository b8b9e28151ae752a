"""Findings are kept by what they depend on."""

import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import airground_drake
from airground_drake.base import files
from airground_drake.scenario.schema import Scenario
from airground_drake.verify import cache
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Finding

FOUND = Finding("proved", margin=2.0, exercised=1, evidence={"runs": {"a": [1.0]}})


class Counting(ModelClaim):
    id, statement, formula, method, equations = "THR-DDM", "s", "f", "m", "e"
    assumptions, does_not_establish, kept = (), "n", True

    def __init__(self, found: Finding | Exception = FOUND) -> None:
        self.found, self.calls = found, 0

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        return {}

    def check(self, inputs: dict[str, Any]) -> Finding:
        self.calls += 1
        if isinstance(self.found, Exception):
            raise self.found
        return self.found


def test_findings_are_kept_by_their_inputs(tmp_path: Path) -> None:
    claim = Counting()
    assert cache.cached_finding(claim, {"x": 1.0}, tmp_path) == FOUND
    assert cache.cached_finding(claim, {"x": 1.0}, tmp_path) == replace(FOUND, from_cache=True)
    assert claim.calls == 1
    cache.cached_finding(claim, {"x": 2.0}, tmp_path)
    cache.cached_finding(claim, {"x": 1.0}, None)
    assert claim.calls == 3


@pytest.mark.parametrize(
    "found", [Finding("inconclusive"), RuntimeError("no luck"), replace(FOUND, margin=float("nan"))]
)
def test_an_undecided_claim_is_tried_again(tmp_path: Path, found: Finding | Exception) -> None:
    claim = Counting(found)
    for _ in range(2):
        assert cache.cached_finding(claim, {}, tmp_path).status not in ("proved", "supported")
    assert claim.calls == 2
    assert not list(tmp_path.iterdir())


def entry(**changes: Any) -> bytes:
    """An entry of `Counting` for {} that says another margin than 2, with changes to its finding."""
    finding = replace(FOUND, margin=1.0).to_json() | changes
    digest = files.sha256(json.dumps(finding, sort_keys=True).encode())
    return json.dumps({**cache.content(Counting(), {}), "finding": finding, "sha256": digest}).encode()


UNUSABLE: dict[str, bytes] = {
    "not JSON": b"{",
    "not UTF-8": b"\xff\xfe",
    "a list": b"[]",
    "deep": b"[" * 100_000,
    "no finding": json.dumps(cache.content(Counting(), {})).encode(),
    "an unknown status": entry(status=["proved"]),
    "a margin of NaN": entry(margin=float("nan")),
    "an infinite margin": entry().replace(b"1.0", b"1e999"),
    "a field too many": entry(more=1),
    "a flipped bit": entry().replace(b'"margin": 1.0', b'"margin": 3.0'),
    "a refutation": entry(status="refuted", counterexample={"x": 1}),
    "another claim": entry().replace(b"THR-DDM", b"ANOTHER"),
    "another code": entry().replace(cache._code().encode(), b"0" * 64),
    "another engine": entry().replace(b'"numba"', b'"numbb"'),
    "large": entry() + b" " * cache.LARGEST_BYTES,
}


@pytest.mark.parametrize("what", UNUSABLE)
def test_an_unusable_entry_is_made_anew(tmp_path: Path, what: str) -> None:
    claim, file = Counting(), tmp_path / f"{cache.key(Counting(), {})}.json"
    file.write_bytes(entry())
    assert cache.cached_finding(claim, {}, tmp_path).margin == 1.0
    file.write_bytes(UNUSABLE[what])
    assert cache.cached_finding(claim, {}, tmp_path) == FOUND
    assert claim.calls == 1


@pytest.mark.parametrize("make", [os.mkfifo, Path.mkdir, lambda path: path.symlink_to("/dev/zero")])
def test_only_regular_files_are_read(tmp_path: Path, make: Callable[[Path], None]) -> None:
    make(tmp_path / f"{cache.key(Counting(), {})}.json")
    assert cache.cached_finding(Counting(), {}, tmp_path) == FOUND


def test_an_entry_under_another_key_is_made_anew(tmp_path: Path) -> None:
    """What was proved for a dwell says nothing of a trigger without."""
    claim = Counting()
    cache.cached_finding(claim, {"dwell_s": 1.0}, tmp_path)
    (kept,) = tmp_path.iterdir()
    kept.rename(tmp_path / f"{cache.key(claim, {'dwell_s': 0.0})}.json")
    assert not cache.cached_finding(claim, {"dwell_s": 0.0}, tmp_path).from_cache


def test_claims_that_are_not_listed_are_decided_anew(tmp_path: Path) -> None:
    """Third-party code is not part of the key."""
    claim = Counting()
    claim.id = "OWN"
    assert not any(cache.cached_finding(claim, {}, tmp_path).from_cache for _ in range(2))


def test_the_key_covers_every_file_of_the_package_where_it_is(tmp_path: Path) -> None:
    (tmp_path / "sub" / "deeper").mkdir(parents=True)
    for name in ("a.py", "sub/b.py", "sub/deeper/c.py"):
        (tmp_path / name).write_text("x = 1\n", encoding="utf-8")
    digests = [cache.code_digest(tmp_path)]
    (tmp_path / "sub/deeper/c.py").write_text("x = 2\n", encoding="utf-8")
    digests.append(cache.code_digest(tmp_path))
    (tmp_path / "sub/b.py").rename(tmp_path / "sub/deeper/b.py")
    assert len({*digests, cache.code_digest(tmp_path)}) == 3
    assert cache.code_digest(Path(airground_drake.__file__).parent) == cache._code()
