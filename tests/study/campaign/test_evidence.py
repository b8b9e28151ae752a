"""Conclusions, on rows that were made up."""

import json
import re
from typing import Any

import numpy as np
import pandas as pd
import pytest

from airground_drake.base import files
from airground_drake.base.errors import UnknownNameError
from airground_drake.commands.campaign import _code, _summary
from airground_drake.study.campaign.conduct import Stopping
from airground_drake.study.campaign.evidence import evidence
from airground_drake.study.campaign.page import lines_of, page
from airground_drake.study.campaign.rows import COLUMNS, INVALID, JUDGED, STOPPED, Row, blank
from airground_drake.study.campaign.statistics import clopper_pearson, confidence_sequence, outward
from airground_drake.study.campaign.store import table_of as table
from airground_drake.study.campaign.work import died

NAN = float("nan")


def row(index: int, status: str = "holds", **more: Any) -> Row:
    drawn = json.dumps(more.pop("drawn", {"gain": index, "start": [0.0, float(index % 7)]}))
    common = {"index": index, "run": "d", "method": "d", "ended": JUDGED, "claim": "SAFE-TRACE", "status": status}
    filled = {"as_expected": status == "holds", "exercised": 1.0, "margin": 0.1 * index, "unit": "m", "ugvs": 1}
    return blank() | common | filled | {"drawn": drawn} | more


def stopped(index: int, run: str, ended: str = STOPPED) -> Row:
    return blank() | {"index": index, "run": run, "ended": ended, "drawn": "{}"}


def conclude(rows: list[Row], **more: Any) -> dict[str, Any]:
    found = files.strict(evidence(table(rows), **more)) | {"name": "x", "title": "", "spec": "x.yaml", "stopped": None}
    json.dumps(found, allow_nan=False)
    return dict(found)


def counts(claim: dict[str, Any]) -> list[int]:
    return [claim[name] for name in ("tested", "refuted", "undecided", "idle")]


def shown(found: dict[str, Any]) -> str:
    return page(found, pd.DataFrame(columns=list(COLUMNS)))


def word(found: dict[str, Any]) -> tuple[str, str]:
    banner = re.search(r'<p class="headline (\w+)">(.*?)</p>', shown(found), re.DOTALL)
    assert banner is not None
    return banner[1], " ".join(re.sub(r"<[^>]*>", " ", banner[2]).split())


def test_untested_runs_are_ignored_and_undecided_ones_count_against_the_claim() -> None:
    rows = [row(i) for i in range(90)]
    rows += [row(90, "refuted"), row(91, "inconclusive"), row(92, exercised=0.0, margin=-1.0)]
    (claim,) = conclude(rows)["claims"]
    assert counts(claim) == [92, 1, 1, 1]
    assert claim["fixed"] == pytest.approx([clopper_pearson(1, 92).low, clopper_pearson(2, 92).high])
    assert claim["anytime"] == pytest.approx([confidence_sequence(1, 92).low, confidence_sequence(2, 92).high])
    assert (claim["differs"], claim["undecided_draws"]) == (1, [91])
    assert [each["index"] for each in claim["worst"]] == [0, 1, 2, 3, 4]


def test_an_unfinished_run_is_undecided() -> None:
    """A run that was stopped, and a draw whose process died; not a draw without a valid scenario."""
    rows = [row(i, "refuted" if i < 20 else "holds") for i in range(89)]
    rows += [row(89, "inconclusive"), stopped(90, "d"), *died(91, {})]
    (claim,) = conclude([*rows, stopped(92, "c"), stopped(93, "", INVALID)])["claims"]
    assert counts(claim) == [92, 20, 3, 0]
    assert claim["fixed"] == pytest.approx([clopper_pearson(20, 92).low, clopper_pearson(23, 92).high])
    for below, value in ((True, confidence_sequence(23, 92).high), (False, confidence_sequence(20, 92).low)):
        met = [Stopping("SAFE-TRACE", below, value * share).met(rows) for share in (0.999, 1.001)]
        assert met == [not below, below]


def test_a_draw_with_one_unfinished_run_is_not_judged_and_meets_no_rule() -> None:
    rows = [each for i in range(200) for each in (row(i, run="b"), stopped(i, "c"))]
    found = conclude(rows)
    assert (found["ended"], found["not_judged"][1]["index"]) == ({STOPPED: 200}, 1)
    assert [claim["run"] for claim in found["claims"]] == ["b"]
    assert word(found) == ("open", "? 200 of 200 draws were not finished")
    rule = Stopping.parse("SAFE-TRACE < 0.1")
    assert not any(rule.met(rows[2 * i : 2 * i + 2]) for i in range(200))


@pytest.mark.parametrize(
    ("rows", "looks"),
    [
        ([row(0)], ("good", "✓ Every claim as declared")),
        ([row(0, exercised=0.0, as_expected=False)], ("open", "? 1 of 1 claims never tested")),
        ([row(0), row(1, exercised=0.0, as_expected=False)], ("good", "✓ Every claim as declared")),
        ([row(0, "refuted")], ("bad", "✗ 1 of 1 claims not as declared")),
        ([row(0, "refuted", as_expected=True)], ("tuned", "≈ 1 of 1 claims refuted, as the scenario admits")),
        ([row(0, "inconclusive")], ("open", "? 1 of 1 claims undecided in some draws")),
        (died(0, {}), ("open", "? 1 of 1 draws were not finished")),
        ([row(0), *died(1, {})], ("open", "? 1 of 1 claims undecided in some draws")),
        ([row(0, claim="", status="")], ("open", "? Nothing was judged")),
    ],
)
def test_page_exit_code_and_text_agree(rows: list[Row], looks: tuple[str, str]) -> None:
    found = conclude(rows)
    assert word(found) == looks
    assert _code(found) == {"good": 0, "tuned": 0, "bad": 1, "open": 3}[looks[0]]
    assert ("  undecided: " in _summary(found, looked=False)) == (looks[0] == "open")


@pytest.mark.parametrize(
    ("status", "exercised", "tested"),
    [
        ("holds", 1.0, True), ("holds", 0.0, False), ("holds", NAN, True), ("proved", 0.0, False),
        ("supported", 0.0, False), ("refuted", 0.0, True), ("inconclusive", 0.0, True), ("error", NAN, True),
    ],
)  # fmt: skip
def test_evidence_and_stopping_rules_agree_on_what_was_tested(status: str, exercised: float, tested: bool) -> None:
    rows = [row(i, status, exercised=exercised) for i in range(3)]
    (claim,) = conclude(rows)["claims"]
    rule = Stopping.parse("SAFE-TRACE < 0.1")
    rule.met(rows)
    assert [claim[name] for name in ("refuted", "undecided", "tested")] == rule._counts.get("d", [0, 0, 0])
    assert claim["tested"] == 3 * tested
    assert tested or claim["anytime"] == [0.0, 1.0]


def test_it_finds_the_keys_by_which_a_claim_fails() -> None:
    """By quarters of a number, or by values unless there are too many; never by a seed or by chance."""
    rng = np.random.default_rng(0)
    policies = [[], [{"name": "hostile"}], [{"name": "towards"}], [0.5], None, True]
    by_number, by_value, by_chance = [], [], []
    for i in range(400):
        gain, noise, other = rng.random(3).tolist()
        bad, drawn = gain > 0.75 and noise > 0.5, {"gain": gain, "other": other, "noise": noise}
        by_number.append(row(i, "refuted" if bad else "holds", drawn=drawn))
        drawn = {"policies": policies[i % 6], "gain": gain, "label": f"draw {i}"}
        by_value.append(row(i, "refuted" if i % 6 == 0 else "holds", drawn=drawn))
        drawn = {"seed": i, **{f"key{k}": value for k, value in enumerate(rng.random(12).tolist())}}
        by_chance.append(row(i, "refuted" if i > 200 else "holds", drawn=drawn))
    (claim,) = conclude(by_number)["claims"]
    where = claim["fails_where"]
    assert (set(where["keys"]), where["by_chance"] < 2e-3) == ({"gain", "noise"}, True)
    assert sum(cell["runs"] for cell in where["cells"]) == 400
    assert sum(cell["refuted"] for cell in where["cells"]) == claim["refuted"]
    gains = [json.loads(each["drawn"])["gain"] for each in by_number]
    for least, most in ([float(end) for end in cell["where"]["gain"].split(" to ")] for cell in where["cells"]):
        assert sum(least - 5e-5 <= gain <= most + 5e-5 for gain in gains) == 100
    where = conclude(by_value)["claims"][0]["fails_where"]
    bad_cells = [cell for cell in where["cells"] if cell["refuted"]]
    assert {cell["where"]["policies"] for cell in bad_cells} == {"[]"}
    assert conclude(by_chance)["claims"][0]["fails_where"] is None
    by_two = []
    for i in range(4000):  # so many that several p-values are 0
        other, gain, noise = rng.random(3).tolist()
        drawn = {"other": other, "gain": gain, "noise": noise}
        by_two.append(row(i, "refuted" if gain + 0.3 * noise > 0.65 else "holds", drawn=drawn))
    (claim,) = (found := conclude(by_two))["claims"]
    assert claim["fails_where"]["keys"] == ["gain", "noise"]
    bars = shown(found | {"spec": "x.yaml"})
    assert all(f">{', '.join(cell['where'].values())}</text>" in bars for cell in claim["fails_where"]["cells"])
    near = [row(i, "refuted" if i < 20 else "holds", drawn={"far": 1e6 + i / 10}) for i in range(40)]
    assert len(conclude(near)["claims"][0]["fails_where"]["cells"]) == 4


def test_a_single_violation_is_not_related_to_any_key() -> None:
    """A cell with one run of 40 has it with probability 1/40; the chi-squared distribution says 0.0003."""
    values = np.random.default_rng(0).random((40, 2)).tolist()
    for bad in range(40):
        rows = [
            row(i, "refuted" if i == bad else "holds", drawn=dict(zip("xy", values[i], strict=True))) for i in range(40)
        ]
        where = conclude(rows)["claims"][0]["fails_where"]
        assert where is None or where["by_chance"] > 1e-2


def test_the_worst_draws_are_refuted_ones_without_a_margin_and_margins_have_their_units() -> None:
    rows = [row(0, exercised=0.0, margin=NAN, unit=""), row(1, margin=0.2, unit="s"), row(2, "refuted", margin=NAN)]
    rows += [row(3, "refuted", margin=-3.0, unit="m/s"), row(4, margin=0.3, unit="s")]
    found = conclude(rows)
    (claim,) = found["claims"]
    assert [each["index"] for each in claim["worst"]] == [2, 3, 1, 4]
    assert (claim["unit"], claim["margins"]["0"], claim["margins"]["1"]) == ("s", 0.2, 0.3)
    text = shown(found | {"spec": "my specs/x.yaml"})
    assert "draw 2 (refuted, no margin); draw 3 (-3 m/s, refuted); draw 1 (0.2 s)" in text
    assert "airground campaign &#39;my specs/x.yaml&#39; --only 2" in text


def test_bounds_in_words_are_rounded_outward() -> None:
    (claim,) = (found := conclude([row(i, "refuted" if i < 9 else "holds") for i in range(40)]))["claims"]
    low, high = map(float, re.findall(r"probability of a violation (\S+) to (\S+);", _summary(found, looked=False))[0])
    assert low <= claim["fixed"][0] < claim["fixed"][1] <= high < claim["fixed"][1] + 0.01
    assert outward((0.0, 1.0)) == (0.0, 1.0)
    (line,) = lines_of(conclude([row(i) for i in range(95)]))
    assert float(line.text.rpartition("at most ")[2].split()[0]) >= confidence_sequence(0, 95).high


def test_a_claim_that_holds_against_its_declaration_is_marked() -> None:
    rows = [row(i, as_expected=False) for i in range(5)]
    assert lines_of(conclude(rows))[0].mark == "no"
    assert "never refuted in 5 runs, 5 not as declared" in lines_of(conclude(rows))[0].text
    rows += [row(5, "refuted", as_expected=True)]
    assert "refuted in 1 of 6 runs, 5 not as declared" in lines_of(conclude(rows))[0].text


def test_the_page_says_first_what_was_found_and_what_separates_failures() -> None:
    rows = [
        row(i, "refuted" if i % 4 == 1 else "holds", drawn={"gain": i % 4, "<script>": "<img src=x>"})
        for i in range(80)
    ]
    rows += [row(i, run="b", drawn={}) for i in range(80)]
    rows[1]["what"] = "announced position, ugv1 at 1.05 s"
    found = conclude(rows) | {"name": "<b>"}
    says = [tuple(line) for line in lines_of(found)]
    assert [mark for mark, _ in says] == ["no", "yes"]
    first = "; broken first: announced position (1); probability 0.1"
    assert says[0][1].startswith(f"SAFE-TRACE in run d: refuted in 20 of 80 runs{first}")
    assert says[1][1].startswith("SAFE-TRACE in run b: never refuted in 80 runs; probability of a violation at most 0.")
    text = page(found, table(rows))
    assert "SAFE-TRACE in run d fails in 20 of 20 runs with gain 1, and in 0 of 20 runs with gain" in text
    assert text.index("refuted in 20 of") < text.index("What separates failures") < text.index("How likely a violation")
    assert not re.search(r'<script|<img|<b>|(?:src|href)="(?!#)', text)


def test_without_independent_draws_there_is_no_interval() -> None:
    found = conclude([row(i) for i in range(9)], dependent=["ugvs.u.start_m"])
    (claim,) = found["claims"]
    assert (claim["tested"], claim["fixed"], claim["anytime"]) == (9, None, None)
    assert "come from a Halton sequence or a grid:\n<code>ugvs.u.start_m</code>.</p>" in shown(found)
    assert _summary(found, looked=False).endswith("no intervals: draws are not independent (ugvs.u.start_m)")


def test_marks_are_found_in_distributions_and_no_draw_is_no_error() -> None:
    rows = [row(i, first_trigger_s=float(i)) for i in range(10)] + [row(10, first_trigger_s=NAN)]
    (times,) = conclude(rows, marks={"first_trigger_s": 7.0})["times"]
    assert (times["first_trigger_s"]["share_below_mark"], times["first_trigger_s"]["count"]) == (0.7, 10)
    assert conclude([])["claims"] == []


def test_a_rule_is_met_when_the_bound_is_low_or_high_enough() -> None:
    rule = Stopping.parse("SAFE-TRACE < 0.1")
    met = [rule.met([row(i)]) for i in range(100)]
    first = met.index(True)
    assert all(met[first:])
    assert confidence_sequence(0, first + 1).high < 0.1 <= confidence_sequence(0, first).high
    for untested in ([row(0, exercised=0.0)], [row(0, run="b"), row(0, run="c", exercised=0.0)]):
        rule = Stopping.parse("SAFE-TRACE < 0.1")
        assert not any(rule.met(untested) for _ in range(200))
    rule = Stopping.parse("SAFE-TRACE > 0.5")
    assert [rule.met([row(i, "refuted")]) for i in range(50)][-1]


def test_a_bad_rule_is_refused() -> None:
    for text in ("SAFE-TRACE", "SAFE-TRACE = 0.1", "SAFE-TRACE < 2", "SAFE-TRACE < e"):
        with pytest.raises(ValueError, match="wanted: CLAIM < PROBABILITY"):
            Stopping.parse(text)
    for text, claims in (("SAFE-INV < 0.1", ()), ("LIVE-HYP < 0.1", ["SAFE-TRACE"])):
        with pytest.raises(UnknownNameError, match="allowed: SAFE-TRACE"):
            Stopping.parse(text, claims)


def test_a_rule_is_given_draws_in_their_order_however_they_end() -> None:
    """Otherwise short draws would decide, and slow failures would come too late."""
    seen = list[int]()

    class Rule(Stopping):
        def met(self, rows: list[Row]) -> bool:
            seen.append(rows[0]["index"])
            return rows[0]["index"] == 2

    rule = Rule("SAFE-TRACE", below=True, value=0.1)
    met = [rule.met_in_order(index, [row(index)]) for index in (3, 1, 2, 0)]
    assert (met, seen, rule.last) == ([False, False, False, True], [0, 1, 2], 2)
