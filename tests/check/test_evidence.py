"""Every number of a claim's entry is established, or its key is among those that are taken as recorded."""

from __future__ import annotations

import json
import os
import random
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from check.tampering.base import claim_of, copy, edited_claim, write
from hypothesis import settings

from airground_drake import check
from airground_drake.check.claims import KNOWN
from airground_drake.check.evidence import AS_RECORDED, KEYS, as_recorded
from airground_drake.check.report import AGREES, check_report

DOCS = Path(__file__).parents[2] / "docs"
SAMPLE = 60
"""Numbers that the suite changes; `pytest --hypothesis-profile=fuzz` changes one of every key."""
AS_RIGHT = "evidence.pairs.*.row"
"""At an instant between two segments either row is right."""


def numbers(value: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[tuple[str | int, ...], float]]:
    """Every number and truth value in JSON, and where it is."""
    if isinstance(value, dict):
        for key, part in value.items():
            yield from numbers(part, (*path, key))
    elif isinstance(value, list):
        for k, part in enumerate(value):
            yield from numbers(part, (*path, k))
    elif isinstance(value, (bool, int, float)):
        yield path, value


def changed(value: Any, path: tuple[str | int, ...]) -> Any:
    """A copy with another number at a place."""
    copied = json.loads(json.dumps(value))
    part = copied
    for key in path[:-1]:
        part = part[key]
    old = part[path[-1]]
    part[path[-1]] = not old if isinstance(old, bool) else old + 1 if isinstance(old, int) else old * 1.01 + 1e-3
    return copied


def is_listed(claim: str, path: tuple[str | int, ...]) -> bool:
    """Whether a key is among those that are taken as recorded."""
    names = ["*" if isinstance(key, int) else key for key in path]
    keys = [key.split(".") for key in (*as_recorded(claim), AS_RIGHT)]
    return any(all(a in ("*", b) for a, b in zip(key, names, strict=False)) for key in keys if len(key) <= len(names))


def test_a_number_that_was_changed_is_refused_unless_its_key_is_listed(report: Path) -> None:
    document = json.loads((report / "report.json").read_text())
    one_of_each: dict[Any, tuple[str | int, ...]] = {}
    for k, claim in enumerate(document["claims"]):
        for path, _ in numbers(claim):
            kind = claim["id"], claim["run"], *("*" if isinstance(key, int) else key for key in path)
            if not is_listed(claim["id"], path):
                one_of_each.setdefault(kind, ("claims", k, *path))
    chosen = list(one_of_each)
    if settings.default.derandomize:
        chosen = random.Random(1).sample(chosen, SAMPLE)
    folder = copy(report, report.with_name(f"changed_{os.getpid()}"))
    accepted = []
    for kind in chosen:
        write(folder / "report.json", json.dumps(changed(document, one_of_each[kind])).encode())
        if all(line.outcome == AGREES for line in check_report(folder)):
            accepted.append(kind)
    assert not accepted


@pytest.mark.parametrize("part", ["evidence", "where", "inputs"])
@pytest.mark.parametrize(("claim", "run"), [("SAFE-TRACE", "d"), ("SAFE-INV", ""), ("LIVE-PROG", "d")])
def test_nothing_new_slips_in(
    claim: str, run: str, part: str, report: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = copy(report, tmp_path / "r")
    with edited_claim(folder, claim, run) as entry:
        entry[part]["proved_besides"] = 1.0
    assert check.main(["--json", str(folder)]) == 1
    [refused] = [one for one in json.loads(capsys.readouterr().out)["checks"] if one["outcome"] == "DISAGREES"]
    assert (refused["claim"], refused["run"]) == (claim, run)


def test_what_is_taken_as_recorded_is_said(report: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert check.main(["--json", str(report)]) == 0
    listed = json.loads(capsys.readouterr().out)["as_recorded"]
    document = json.loads((report / "report.json").read_text())
    for one in listed:
        assert set(one["keys"]) <= {*as_recorded(one["claim"])}
        assert claim_of(document, one["claim"], one["run"])
    assert check.main([str(report)]) == 0
    values = sum(sum(one["keys"].values()) for one in listed)
    assert capsys.readouterr().out.splitlines()[-2].startswith(f"{values} values under ")


def test_every_key_that_is_listed_is_in_the_documentation() -> None:
    text = (DOCS / "checker.md").read_text()
    said = text[text.index("## Taken as recorded") : text.index("## What it reads")]
    for claim, keys in AS_RECORDED.items():
        item = next(item for item in said.split("\n- ") if f"**{claim}**" in item)
        for key in keys:
            assert f"`{key.removeprefix('evidence.')}`" in item, (claim, key)


def test_every_module_and_claim_is_in_the_documentation() -> None:
    folder = Path(check.__file__).parent
    stems = {path.stem for path in folder.glob("*.py")} - {"__init__", "__main__"}
    lines = [line for line in str(check.__doc__).splitlines() if line.startswith("    ")]
    listed = {word.strip(",") for line in lines for word in line[:31].split()}
    assert stems <= listed
    text = (DOCS / "checker.md").read_text()
    said = text[text.index("## What each check establishes") : text.index("## Taken as recorded")]
    summary = (DOCS / "verification.md").read_text()
    for claim in KNOWN:
        assert re.search(rf"^- \*\*[^*]*\b{claim}\b[^*]*\*\*", said, re.MULTILINE), claim
        assert claim in summary, claim


def test_entries_consist_of_what_is_known(report: Path) -> None:
    claims = json.loads((report / "report.json").read_text())["claims"]
    assert all({*claim} <= KEYS for claim in claims)
