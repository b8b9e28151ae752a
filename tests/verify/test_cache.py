"""Findings are kept by what they depend on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import airground_drake
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify import cache
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Finding


class Counting(ModelClaim):
    """A claim that counts how often it is decided."""

    id, statement, formula, method, equations = "COUNTING", "s", "f", "m", "e"
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
    claim = Counting(Finding("proved", certificates={"a": "b"}))
    first = cache.find([claim], [{"x": 1.0}], folder=tmp_path)
    assert cache.find([claim], [{"x": 1.0}], folder=tmp_path) == first
    assert claim.calls == 1
    cache.find([claim], [{"x": 2.0}], folder=tmp_path)
    cache.find([claim], [{"x": 1.0}], folder=None)
    assert claim.calls == 3


def test_what_was_left_open_is_tried_again(tmp_path: Path) -> None:
    for found in (Finding("inconclusive"), RuntimeError("no luck"), Finding("proved", margin=float("nan"))):
        claim = Counting(found)
        for _ in range(2):
            (made,) = cache.find([claim], [{}], folder=tmp_path)
        assert claim.calls == 2
        assert made.status in ("inconclusive", "error")
    assert not list(tmp_path.iterdir())


def test_a_kept_finding_that_cannot_be_read_is_made_anew(tmp_path: Path) -> None:
    claim = Counting(Finding("proved"))
    cache.find([claim], [{}], folder=tmp_path)
    (kept,) = tmp_path.iterdir()
    kept.write_text("{", encoding="utf-8")
    assert cache.find([claim], [{}], folder=tmp_path)[0].status == "proved"
    assert claim.calls == 2


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
