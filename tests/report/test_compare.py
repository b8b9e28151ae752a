"""Two reports compared: what is worse, what only differs, and which files are refused."""

import copy
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from report.cases import FINE, built, make_scenario, make_traces, verdict

from airground_drake import commands
from airground_drake.base.errors import ReportError
from airground_drake.base.statuses import NOT_EXERCISED, STATUSES
from airground_drake.report import compare
from airground_drake.report.model import of

Json = dict[str, Any]


def main(arguments: list[str]) -> int:
    return commands.main(["compare", *arguments])


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
    found["audit"] = [{"id": 1, "demonstrated": True, "paper": 1, "ours": 2}]
    apart = {"first": "ugv1", "second": "o", "min_distance_m": 3.0, "safe_distance_m": 2.0, "t_s": 1.0}
    found["seeds"] = [{"run": "c", "seed": seed, "kept": True, "home": True, **apart} for seed in (1, 2)]
    return json.loads(json.dumps(found))


def test_every_verdict_has_a_place_in_the_order() -> None:
    assert sorted(name for alike in compare.ORDER for name in alike) == sorted([*STATUSES, NOT_EXERCISED, "gone"])


WORSE: dict[str, Callable[[Json], object]] = {
    "refuted": lambda found: claim(found, "a").update(status="refuted", as_expected=False),
    "not tested": lambda found: claim(found, "").update(exercised=0),
    "an error": lambda found: claim(found, "a").update(status="error", as_expected=False),
    "as bad, and expected no longer": lambda found: claim(found, "a_printed").update(as_expected=False),
    "better, and not expected": lambda found: claim(found, "a_printed").update(status="holds", as_expected=False),
    "a claim that is gone": lambda found: found["claims"].pop(0),
    "a refuted claim that is gone": lambda found: found["claims"].remove(claim(found, "a_printed")),
    "a row": lambda found: found["reproduction"][0].update(status="not_reproduced"),
    "a row that is gone": lambda found: found["reproduction"].pop(),
    "a finding": lambda found: found["audit"][0].update(demonstrated=False),
    "a finding that is gone": lambda found: found["audit"].pop(),
    "a claim that is missing": lambda found: found["overall"].update(status="inconclusive"),
    "a distance under another seed": lambda found: found["seeds"][0].update(kept=False),
    "an arrival under another seed": lambda found: found["seeds"][0].update(home=False),
    "a seed that is gone": lambda found: found["seeds"].pop(),
}
OTHER: dict[str, Callable[[Json], object]] = {
    "a margin": lambda found: claim(found, "").update(margin=0.4),
    "a margin that is gone": lambda found: claim(found, "").update(margin=None),
    "a count": lambda found: claim(found, "").update(exercised=4),
    "no better and no worse": lambda found: claim(found, "a").update(status="supported"),
    "holds, of late": lambda found: claim(found, "a_printed").update(status="holds", as_expected=True),
    "an expectation": lambda found: claim(found, "a").update(expected="nothing"),
    "a new claim": lambda found: found["claims"].append({**found["claims"][0], "id": "NEW", "status": "refuted"}),
    "a time": lambda found: found["runs"]["c"]["events"][0].update(t_s=14.0),
    "a distance": lambda found: found["runs"]["c"]["metrics"]["final_position_m"].update(ugv1=[0.0, 0.0, 0.0]),
    "a fault": lambda found: found["runs"]["c"]["faults"].append({"t_s": 1.0, "robot": "ugv1", "what": "x"}),
    "a seed's distance": lambda found: found["seeds"][0].update(min_distance_m=0.1),
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
    assert main([folders[0], folders[0], "--exact"]) == 0
    assert capsys.readouterr().out.endswith("nothing changed; no regressions\n")
    assert main([*folders, "--json"]) == code
    found = json.loads(capsys.readouterr().out)
    assert (found["schema"], found["regressions"] > 0) == (compare.SCHEMA, bool(code))
    text = page.read_text(encoding="utf-8")
    for part in compare.compared(of(before), of(after)).keys() - {"regressions", "overall"}:
        assert text.count(f'<h2 id="{part}">') == bool(found[part])
        for each in found[part]:
            about = str(each.get("claim") or each.get("id") or each["robot"])
            assert f'<th scope="row">{about}' in text or f"<td>{about}</td>" in text


def test_numbers_are_compared_to_their_size(before: Json) -> None:
    assert [*compare.differences([1e6, 1.0], [1e6 + 0.009, 1.0 + 3e-8])] == [("1", 1.0, 1.0 + 3e-8)]
    after = copy.deepcopy(before)
    claim(after, "a_printed")["margin"] = -0.1  # of -0.2
    after["runs"]["c"]["events"][1]["t_s"] += 1.0
    changes = compare.compared(of(before), of(after))
    assert [each["relative"] for each in changes["margins"]] == [0.5]
    assert [each["n"] for each in changes["events"]] == [1]


def test_inputs_that_differ_come_first_and_rounding_is_only_counted(
    before: Json, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """An input that changes in its last digit is told; so is a key that only one report has. Titles are no inputs."""
    after = copy.deepcopy(before)
    resolved = after["scenario"]["resolved"]
    resolved["control"]["motion_gain_1_s"] += 1e-15
    resolved["title"] = "another"
    obstacle = next(iter(resolved["obstacles"]))
    resolved["obstacles"]["new"] = resolved["obstacles"].pop(obstacle)
    after["provenance"]["drake"] = "9.9"
    before["provenance"]["third_party"] = {"mine.py:Plant": "1" * 64, "mine.py:Policy": "2" * 64}
    after["provenance"]["third_party"] = {"mine.py:Plant": "3" * 64, "mine.py:Policy": "2" * 64}
    claim(after, "")["margin"] += 1e-12
    after["reproduction"][0]["ours"] = [each + 1e-13 for each in after["reproduction"][0]["ours"]]
    claim(after, "").update(exercised=4)
    folders = [str(save(tmp_path / "before", before)), str(save(tmp_path / "after", after))]
    assert main(folders) == 0
    lines = capsys.readouterr().out.splitlines()
    told = [line.partition(":")[0].strip() for line in lines[: lines.index("exercised:")]]
    places = {f"obstacles.{obstacle}", "obstacles.new"}
    assert told[0] == "inputs"
    assert set(told[1:]) == {"control.motion_gain_1_s", "version of drake", "SHA-256 of mine.py", *places}
    assert "2 numbers changed by no more than rounding: --json has all" in lines
    assert "1 exercised changed; no regressions" in lines[-1]
    assert main([folders[0], folders[0]]) == 0
    assert main([*folders, "--exact"]) == 1
    claim(after, "")["margin"] -= 1e-12
    same = copy.deepcopy(before) | {"provenance": after["provenance"]}
    assert main([folders[0], str(save(tmp_path / "same", same)), "--exact"]) == 0


@pytest.mark.parametrize(
    "text",
    [b"", b"[]", b"{}", b"[" * 10**5, b'{"schema": "airground_drake.report/1"}',
     b'{"schema": "airground_drake.report/4", "claims": 3}'],
)  # fmt: skip
def test_what_is_no_report_is_one_line_and_exit_code_2(
    text: bytes, before: Json, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = save(tmp_path / "good", before)
    (tmp_path / "report.json").write_bytes(text)
    for folders in ((good, tmp_path), (tmp_path, good), (good, tmp_path / "none")):
        assert main([str(folder) for folder in folders]) == 2
        assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda found: claim(found, "a").update(status="fine"), "claims.0.status: 'fine' is not allowed; "),
        (lambda found: claim(found, "a").update(margin="wide"), "claims.0.margin: 'wide' is not allowed; "),
        (lambda found: claim(found, "a").update(margin=float("inf")), "ValueError: Infinity is not finite"),
        (lambda found: claim(found, "a").update(exercised=10**30), "ValueError: an integer of 31 digits"),
        (lambda found: found.update(provenance={"third_party": 3}), "provenance: {'third_party': 3} is not allowed; "),
        (lambda found: found["scenario"].update(title="\ud800"), "UnicodeEncodeError"),
        (lambda found: found["scenario"]["resolved"].update(seed="x"), "scenario.resolved.seed: 'x' is not allowed; "),
        (lambda found: found["overall"]["counts"].update(fine=1), "overall.counts.fine.[key]: 'fine' is not allowed; "),
        (lambda found: found["runs"]["c"]["events"][0].update(t_s="nan"), "runs.c.events.0.t_s: 'nan' is not"),
        (lambda found: found.pop("audit"), "audit: missing; Field required"),
    ],
)  # fmt: skip
def test_values_of_another_kind_are_no_report(
    change: Callable[[Json], object], why: str, before: Json, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = copy.deepcopy(before)
    change(bad)
    assert main([str(save(tmp_path / "a", before)), str(save(tmp_path / "b", bad))]) == 2
    assert f"b/report.json is not a report that can be used: {why}" in capsys.readouterr().err


def test_two_claims_of_one_name_are_refused(before: Json) -> None:
    """The later one could hide the violation of the other."""
    after = copy.deepcopy(before)
    after["claims"].insert(0, {**claim(after, "a"), "status": "refuted", "as_expected": False})
    with pytest.raises(ReportError, match="the report after has several entries of the same id and run; wanted: one"):
        compare.compared(of(before), of(after))


def test_what_the_clock_measured_is_not_compared(before: Json) -> None:
    reports = [copy.deepcopy(before), copy.deepcopy(before)]
    for late, report in enumerate(reports):
        clock = {"wall_s": 1.0 + late, "realtime_factor": 3.0 - late}
        report["runs"]["c"]["metrics"] |= clock | {"gatekeeper": {"time_s": {"p50": 0.5 + late}, "late": late}}
    assert not compare.compared(*map(of, reports))["metrics"]


def test_the_page_shows_the_regression_first_and_nothing_foreign(
    before: Json, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    after = copy.deepcopy(before)
    claim(after, "a").update(status="refuted", as_expected=False, id="<script>alert(1)</script>")
    claim(after, "")["margin"] += 1e-12
    after["scenario"]["title"] = "<img src=x onerror=alert(1)>"
    folders = [save(tmp_path / "before", before), save(tmp_path / "after", after)]
    page = tmp_path / "out" / "compare.html"
    assert main([*map(str, folders), "--html", str(page)]) == 1
    text = page.read_text(encoding="utf-8")
    headline = text[text.index('class="headline bad"') :].partition("</p>")[0]
    assert "SAFE-TRACE a: holds -&gt; none" in headline
    assert "<summary>1 changed by no more than rounding</summary>" in text
    assert not re.search(r"<(script|img|link|iframe)\b", text)
    assert "default-src 'none'" in text
    assert "http://" not in text.replace("http://www.w3.org/", "")
    assert "&lt;script&gt;" in text
    capsys.readouterr()
    assert main([*map(str, folders), "--html", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert said == f"error: {tmp_path} cannot be written: not a regular file; wanted: a file for the page\n"
