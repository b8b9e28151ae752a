"""Two reports compared: what is worse, what only differs, and what is no report."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from report.cases import FINE, GOING_ROUND, SUCCESS, built, make_scenario, make_trace, make_traces, verdict

from airground_drake.commands.compare import main
from airground_drake.report import compare, document
from airground_drake.run import trace

Json = dict[str, Any]


def claim(found: Json, run: str) -> Json:
    return next(each for each in found["claims"] if each["run"] == run)


def save(folder: Path, report: Json) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "report.json").write_text(json.dumps(report))
    return folder


@pytest.fixture(scope="module")
def before() -> Json:
    scenario = make_scenario()
    counted = [*FINE, verdict("", "proved", "proved", exercised=3, margin=0.5)]
    found = built(scenario, make_traces(scenario), counted)
    found["audit"] = [{"id": "P1", "demonstrated": True, "paper": 1, "ours": 2}]
    return json.loads(json.dumps(found))


def test_the_schema_is_the_reports() -> None:
    assert document.SCHEMA == compare.REPORT


def test_every_verdict_has_a_place_in_the_order() -> None:
    from airground_drake.base.statuses import NOT_EXERCISED, STATUSES

    assert sorted(name for alike in compare.ORDER for name in alike) == sorted([*STATUSES, NOT_EXERCISED, "gone"])


def test_a_report_does_not_differ_from_itself(before: Json, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = save(tmp_path, before)
    assert main([str(folder), str(folder), "--exact"]) == 0
    assert capsys.readouterr().out == "nothing changed; no regressions\n"


WORSE: dict[str, Callable[[Json], object]] = {
    "refuted": lambda found: claim(found, "a").update(status="refuted", as_expected=False),
    "nothing to check": lambda found: claim(found, "").update(exercised=0),
    "an error": lambda found: claim(found, "a").update(status="error", as_expected=False),
    "as bad, and expected no longer": lambda found: claim(found, "a_printed").update(as_expected=False),
    "better, and not expected": lambda found: claim(found, "a_printed").update(status="holds", as_expected=False),
    "a claim that is gone": lambda found: found["claims"].pop(0),
    "a row": lambda found: found["reproduction"][0].update(status="not_reproduced"),
    "a row that is gone": lambda found: found["reproduction"].pop(),
    "a finding": lambda found: found["audit"][0].update(demonstrated=False),
    "a finding that is gone": lambda found: found["audit"].pop(),
    "a claim that is missing": lambda found: found["overall"].update(status="inconclusive"),
}
OTHER: dict[str, Callable[[Json], object]] = {
    "a margin": lambda found: claim(found, "").update(margin=0.4),
    "a margin that is gone": lambda found: claim(found, "").update(margin=None),
    "a count": lambda found: claim(found, "").update(exercised=4),
    "holds, of late": lambda found: claim(found, "a_printed").update(status="holds", as_expected=True),
    "an expectation": lambda found: claim(found, "a").update(expected="holds or refuted"),
    "a new claim": lambda found: found["claims"].append({**found["claims"][0], "id": "NEW", "status": "refuted"}),
    "a time": lambda found: found["runs"]["c"]["events"][0].update(t_s=14.0),
    "an event less": lambda found: found["runs"]["c"]["events"].pop(),
    "a run less": lambda found: found["runs"].pop("c"),
    "a value": lambda found: found["reproduction"][0].update(ours=[3.31, 5.1]),
}


@pytest.mark.parametrize(("change", "code"), [*((each, 1) for each in WORSE), *((each, 0) for each in OTHER)])
def test_only_what_is_worse_is_a_regression_and_the_page_has_every_change(
    change: str, code: int, before: Json, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    after = copy.deepcopy(before)
    (WORSE | OTHER)[change](after)
    folders = [str(save(tmp_path / "before", before)), str(save(tmp_path / "after", after))]
    page = tmp_path / "compare.html"
    assert main([*folders, "--html", str(page)]) == code
    assert ("worse: " in capsys.readouterr().out) == bool(code)
    assert main([*folders, "--exact"]) == 1
    capsys.readouterr()
    assert main([*folders, "--json"]) == code
    found = json.loads(capsys.readouterr().out)
    assert found["schema"] == compare.SCHEMA
    assert (found["regressions"] > 0) == bool(code)
    text = page.read_text(encoding="utf-8")
    for part in set(found) & {*compare.compared(before, after)} - {"regressions", "overall"}:
        assert text.count(f'<h2 id="{part}">') == bool(found[part])
        for each in found[part]:
            about = str(each.get("claim") or each.get("id") or each["robot"])
            assert f'<th scope="row">{about}' in text or f"<td>{about}</td>" in text


def test_the_page_names_the_regression_first_and_folds_what_is_rounding(before: Json, tmp_path: Path) -> None:
    after = copy.deepcopy(before)
    claim(after, "a").update(status="refuted", as_expected=False)
    claim(after, "")["margin"] += 1e-12
    folders = [str(save(tmp_path / "before", before)), str(save(tmp_path / "after", after))]
    assert main([*folders, "--html", str(tmp_path / "compare.html")]) == 1
    text = (tmp_path / "compare.html").read_text(encoding="utf-8")
    headline = text[text.index('class="headline bad"') :].partition("</p>")[0]
    assert "SAFE-TRACE a: holds -&gt; refuted (not as expected)" in headline
    assert "<summary>1 changed by no more than rounding</summary>" in text


def test_a_change_that_is_too_large_for_a_number_is_none(before: Json) -> None:
    small, large = copy.deepcopy(before), copy.deepcopy(before)
    claim(small, "")["margin"], claim(large, "")["margin"] = 1e-308, 1e308
    assert [change["relative"] for change in compare.compared(small, large)["margins"]] == [None]


def test_margins_have_their_relative_change(before: Json) -> None:
    after = copy.deepcopy(before)
    claim(after, "")["margin"] = 0.4
    (change,) = compare.compared(before, after)["margins"]
    assert (change["before"], change["after"], change["relative"]) == (0.5, 0.4, pytest.approx(-0.2))


BAD = [
    b"", b"[]", b"3", b"{}", b"[" * 10**5, b'{"schema": "airground_drake.report/1"}',
    b'{"schema": "airground_drake.report/2"}', b'{"schema": "airground_drake.report/2", "claims": 3}',
]  # fmt: skip


@pytest.mark.parametrize("text", BAD)
def test_what_is_no_report_is_exit_code_2(
    text: bytes, before: Json, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = save(tmp_path / "good", before)
    (tmp_path / "report.json").write_bytes(text)
    for folders in ((good, tmp_path), (tmp_path, good), (good, tmp_path / "none")):
        assert main([str(folder) for folder in folders]) == 2
        assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize(
    "change",
    [
        lambda found: claim(found, "a").update(status="fine"),
        lambda found: claim(found, "a").update(margin="wide"),
        lambda found: found.update(provenance=3),
        lambda found: found["scenario"].update(name=["x"]),
        lambda found: found["scenario"].pop("name"),
        lambda found: found["runs"]["c"]["events"][0].update(t_s="soon"),
        lambda found: claim(found, "a").update(exercised=10**30),
        lambda found: claim(found, "a").update(margin=float("inf")),
        lambda found: claim(found, "a").update(exercised="x"),
        lambda found: claim(found, "a").update(expected=["holds"]),
        lambda found: found["runs"]["c"]["events"][0].update(t_s="nan"),
        lambda found: found["runs"]["c"]["events"][0].update(t_s="1e999"),
        lambda found: found["scenario"].update(title="\ud800"),
        lambda found: found["overall"].update(status="fine"),
        lambda found: found.pop("audit"),
    ],
)
def test_values_of_another_kind_are_no_report(change: Callable[[Json], object], before: Json, tmp_path: Path) -> None:
    bad = copy.deepcopy(before)
    change(bad)
    assert main([str(save(tmp_path / "a", before)), str(save(tmp_path / "b", bad))]) == 2


@pytest.mark.parametrize("change", [{"schema": "airground_drake.report/1"}, {"mutants": []}])
def test_a_report_by_an_earlier_version_is_told_so(
    change: Json, before: Json, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    now, earlier = save(tmp_path / "now", before), save(tmp_path / "earlier", before | change)
    assert main([str(earlier), str(now)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "is by an earlier version: make the report again (CHANGELOG.md)" in said


class Seen(HTMLParser):
    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)


def test_a_page_that_cannot_be_written_is_named(
    before: Json, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = str(save(tmp_path / "before", before))
    assert main([folder, folder, "--html", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert said == f"error: {tmp_path} cannot be written: not a regular file; wanted: a file for the page\n"


def test_the_page_has_both_runs_drawn_and_nothing_foreign(before: Json, tmp_path: Path) -> None:
    scenario = make_scenario()
    after = copy.deepcopy(before)
    claim(after, "a").update(status="refuted", as_expected=False, id="<script>alert(1)</script>")
    after["scenario"]["title"] = "<img src=x onerror=alert(1)>"
    after["runs"]["../a"] = after["runs"]["a"]
    folders = [save(tmp_path / "before", before), save(tmp_path / "after", after)]
    for folder, shift in zip(folders, (0.0, 0.5), strict=True):
        moved = [(t + shift, x, y) for t, x, y in GOING_ROUND]
        trace.save(make_trace(scenario, "c", moved, SUCCESS), folder / "trace" / "c")
    page = tmp_path / "out" / "compare.html"
    assert main([*map(str, folders), "--html", str(page)]) == 1
    text = page.read_text(encoding="utf-8")
    tags = Seen(text).tags
    assert tags.count("svg") == 1
    assert not {"script", "img", "link", "iframe"} & set(tags)
    assert "default-src 'none'" in text
    assert "http://" not in text.replace("http://www.w3.org/", "")
    assert "Run a cannot be drawn" in text
    assert "&lt;script&gt;" in text
