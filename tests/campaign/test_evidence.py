"""What is concluded from rows, on rows that were made up."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pandas as pd
import pytest

from airground_drake.base.errors import UnknownNameError
from airground_drake.campaign.evidence import evidence, strict
from airground_drake.campaign.page import page, told
from airground_drake.campaign.rows import COLUMNS, INVALID, JUDGED, STOPPED, Row, blank
from airground_drake.campaign.statistics import clopper_pearson, confidence_sequence
from airground_drake.campaign.stopping import InOrder, Stopping
from airground_drake.campaign.work import died
from airground_drake.commands.campaign import _code, _summary

NAN = float("nan")


def row(index: int, status: str = "holds", **more: Any) -> Row:
    common = {"index": index, "run": "d", "method": "d", "ended": JUDGED, "claim": "SAFE-TRACE", "status": status}
    filled = {"as_expected": status == "holds", "exercised": 1.0, "margin": 0.1 * index, "unit": "m", "ugvs": 1}
    return blank() | common | filled | {"drawn": json.dumps({"gain": index, "start": [0.0, float(index % 7)]})} | more


def conclude(rows: list[Row], **marks: float) -> dict[str, Any]:
    found = strict(evidence(pd.DataFrame(rows, columns=list(COLUMNS)).astype(COLUMNS), marks))
    json.dumps(found, allow_nan=False)
    return dict(found)


def test_untested_runs_count_for_nothing_and_undecided_ones_against_the_claim() -> None:
    rows = [row(i) for i in range(90)] + [
        row(90, "refuted"),
        row(91, "inconclusive"),
        row(92, exercised=0.0, margin=NAN),
    ]
    (claim,) = conclude(rows)["claims"]
    assert [claim[name] for name in ("tested", "refuted", "undecided", "idle")] == [92, 1, 1, 1]
    assert claim["fixed"] == pytest.approx([clopper_pearson(1, 92).low, clopper_pearson(2, 92).high])
    assert claim["anytime"] == pytest.approx([confidence_sequence(1, 92).low, confidence_sequence(2, 92).high])
    assert (claim["differs"], claim["undecided_draws"]) == (1, [91])
    assert [each["index"] for each in claim["worst"]] == [0, 1, 2, 3, 4]


def test_what_was_not_finished_is_undecided() -> None:
    """A run that was stopped, and a draw whose process died; not one that was no valid scenario."""
    gone = [blank() | {"index": 90, "run": "d", "ended": STOPPED, "drawn": "{}"}, *died(91)]
    other = [blank() | {"index": 92, "run": "c", "ended": STOPPED, "drawn": "{}"}]
    other += [blank() | {"index": 93, "ended": INVALID, "drawn": "{}"}]
    rows = [row(i) for i in range(90)] + gone + other
    (claim,) = conclude(rows)["claims"]
    assert [claim[name] for name in ("tested", "refuted", "undecided", "idle")] == [92, 0, 2, 0]
    assert claim["fixed"] == pytest.approx([0.0, clopper_pearson(2, 92).high])
    value = confidence_sequence(2, 92).high
    rows = [each for each in rows if each["run"] != "c"]  # of which no rule is met
    assert [Stopping("SAFE-TRACE", True, value * share).met(rows) for share in (0.999, 1.001)] == [False, True]


def test_one_run_that_was_not_finished_is_no_draw_that_was_judged() -> None:
    stopped = blank() | {"run": "c", "ended": STOPPED, "what": "a route raised", "drawn": "{}"}
    rows = [each for i in range(200) for each in (row(i, run="b"), stopped | {"index": i})]
    found = conclude(rows)
    assert found["ended"] == {STOPPED: 200}
    assert found["not_judged"][1]["index"] == 1
    assert [claim["run"] for claim in found["claims"]] == ["b"]
    assert word(found) == ("open", "? 200 of 200 draws were not finished")
    rule = Stopping.parse("SAFE-TRACE < 0.1")
    assert not any(rule.met(rows[2 * i : 2 * i + 2]) for i in range(200))


def test_a_rule_waits_for_a_run_that_puts_nothing_to_the_test() -> None:
    rule = Stopping.parse("SAFE-TRACE < 0.1")
    assert not any(rule.met([row(i, run="b"), row(i, run="c", exercised=0.0)]) for i in range(200))


def shown(found: dict[str, Any]) -> str:
    """The page, without its figures."""
    of = {"name": "x", "title": "", "spec": "x.yaml", "stopped": None}
    return page(of | found, pd.DataFrame(columns=list(COLUMNS)))


def word(found: dict[str, Any]) -> tuple[str, str]:
    """How the banner of the page looks, and what it says."""
    text = shown(found)
    banner = re.search(r'<p class="headline (\w+)">(.*?)</p>', text, re.DOTALL)
    assert banner is not None
    return banner[1], " ".join(re.sub(r"<[^>]*>", " ", banner[2]).split())


@pytest.mark.parametrize(
    ("rows", "looks"),
    [
        ([row(0)], ("good", "✓ Every claim as declared")),
        ([row(0, exercised=0.0, as_expected=False)], ("open", "? 1 of 1 claims never tested")),
        ([row(0), row(1, exercised=0.0, as_expected=False)], ("good", "✓ Every claim as declared")),
        ([row(0, "refuted")], ("bad", "✗ 1 of 1 claims not as declared")),
        ([row(0, "refuted", as_expected=True)], ("tuned", "≈ 1 of 1 claims refuted, as the scenario admits")),
        ([row(0, "inconclusive")], ("open", "? 1 of 1 claims undecided in some draws")),
        (died(0), ("open", "? 1 of 1 draws were not finished")),
        ([row(0), *died(1)], ("open", "? 1 of 1 claims undecided in some draws")),
        ([row(0, claim="", status="")], ("open", "? Nothing was judged")),
    ],
)
def test_the_page_says_what_the_exit_code_says(rows: list[Row], looks: tuple[str, str]) -> None:
    found = conclude(rows)
    assert word(found) == looks
    assert _code(found) == {"good": 0, "tuned": 0, "bad": 1, "open": 3}[looks[0]]
    assert ("  undecided: " in _summary(found | {"name": "x"}, looked=False)) == (looks[0] == "open")


def test_a_claim_that_nothing_tested_has_no_bound_but_the_whole_interval() -> None:
    (claim,) = conclude([row(i, exercised=0.0, margin=NAN) for i in range(5)])["claims"]
    assert (claim["tested"], claim["fixed"], claim["anytime"]) == (0, [0.0, 1.0], [0.0, 1.0])


@pytest.mark.parametrize(
    ("status", "exercised", "tested"),
    [
        ("holds", 1.0, True), ("holds", 0.0, False), ("holds", NAN, True), ("proved", 0.0, False),
        ("supported", 0.0, False), ("refuted", 0.0, True), ("inconclusive", 0.0, True), ("error", NAN, True),
    ],
)  # fmt: skip
def test_reports_and_stopping_rules_agree_on_what_was_tested(status: str, exercised: float, tested: bool) -> None:
    rows = [row(i, status, exercised=exercised) for i in range(3)]
    (claim,) = conclude(rows)["claims"]
    rule = Stopping.parse("SAFE-TRACE < 0.1")
    rule.met(rows)
    counts = rule._counts.get("d", [0, 0, 0])
    assert [claim[name] for name in ("refuted", "undecided", "tested")] == counts
    assert claim["tested"] == 3 * tested


def test_values_that_are_no_numbers_can_be_where_a_claim_fails_unless_there_are_too_many() -> None:
    """Also under the pandas whose text is no object: lists of policies are drawn as such."""
    rng = np.random.default_rng(0)
    policies = [[], [{"name": "hostile"}], [{"name": "towards"}], [{"name": "noisy"}], None, True]
    rows = []
    for i in range(400):
        drawn = {"policies": policies[i % 6], "gain": rng.random(), "label": f"draw {i}"}
        rows.append(row(i, "refuted" if i % 6 == 1 else "holds", drawn=json.dumps(drawn)))
    (claim,) = conclude(rows)["claims"]
    assert sorted(claim["fails_where"]["keys"]) == ["gain", "policies"]
    bad = [cell for cell in claim["fails_where"]["cells"] if cell["refuted"]]
    assert {cell["where"]["policies"] for cell in bad} == {'[{"name": "hostile"}]'}


def test_it_finds_the_keys_by_which_a_claim_fails() -> None:
    rng = np.random.default_rng(0)
    rows = []
    for i in range(400):
        gain, noise, other = rng.random(3).tolist()
        bad = gain > 0.75 and noise > 0.5
        rows.append(
            row(i, "refuted" if bad else "holds", drawn=json.dumps({"gain": gain, "other": other, "noise": noise}))
        )
    (claim,) = conclude(rows)["claims"]
    where = claim["fails_where"]
    assert set(where["keys"]) == {"gain", "noise"}
    assert where["by_chance"] < 1e-6
    assert sum(cell["runs"] for cell in where["cells"]) == 400
    assert sum(cell["refuted"] for cell in where["cells"]) == claim["refuted"]


def test_the_page_says_first_what_was_found_and_what_separates_failures() -> None:
    rows = [row(i, "refuted" if i % 4 == 1 else "holds", drawn=json.dumps({"gain": i % 4})) for i in range(80)]
    found = conclude([*rows, *(row(i, run="b") for i in range(80))])
    says = [tuple(line) for line in told(found)]
    assert says[0][0] == "no"
    assert says[0][1].startswith("SAFE-TRACE in run d: refuted in 20 of 80 runs; probability 0.1")
    assert says[1][0] == "yes"
    assert says[1][1].startswith("SAFE-TRACE in run b: never refuted in 80 runs; probability of a violation at most 0.")
    text = shown(found)
    assert "SAFE-TRACE in run d fails in 20 of 20 runs with gain 1, and in 0 of 20 runs with gain" in text
    assert (
        text.index("refuted in 20 of 80") < text.index("What separates failures") < text.index("How likely a violation")
    )


def test_neither_a_seed_nor_chance_explains_where_a_claim_fails() -> None:
    """Nine draws whose seeds separate the violations, and gains that do not; then keys that have no effect."""
    rows = [
        row(i, "refuted" if i > 4 else "holds", drawn=json.dumps({"seed": i, "gain": float(i * 4 % 9)}))
        for i in range(9)
    ]
    assert conclude(rows)["claims"][0]["fails_where"] is None
    rng = np.random.default_rng(0)
    drawn = [json.dumps({f"key{k}": value for k, value in enumerate(rng.random(12).tolist())}) for _ in range(60)]
    rows = [row(i, "refuted" if i % 4 == 0 else "holds", drawn=each) for i, each in enumerate(drawn)]
    assert conclude(rows)["claims"][0]["fails_where"] is None


def test_no_interval_is_given_where_draws_are_not_independent() -> None:
    table = pd.DataFrame([row(i) for i in range(9)], columns=list(COLUMNS)).astype(COLUMNS)
    found = strict(evidence(table, dependent=["ugvs.u.start_m"])) | {"name": "x"}
    (claim,) = found["claims"]
    assert (claim["tested"], claim["fixed"], claim["anytime"]) == (9, None, None)
    assert "come from a Halton sequence or a grid:\n<code>ugvs.u.start_m</code>.</p>" in shown(found)
    said = _summary(found, looked=False)
    assert "probability" not in said
    assert "no intervals: draws are not independent (ugvs.u.start_m)" in said


def test_exit_code_3_says_what_is_undecided() -> None:
    rows = [row(0), row(7, "inconclusive"), row(1, claim="COMM", exercised=0.0, as_expected=False), *died(2)]
    said = _summary(conclude(rows) | {"name": "x"}, looked=False).splitlines()
    assert [line.removeprefix("  undecided: ") for line in said if "undecided" in line] == [
        "1 of 4 draws died",
        "SAFE-TRACE in run d: 2 of 3 runs, such as draw 7",
    ]
    said = _summary(conclude(rows[2:3]) | {"name": "x"}, looked=False).splitlines()
    assert said[-1] == "  undecided: COMM in run d: the scenario expects it to be tested, and no draw did"


def test_who_has_looked_is_told_the_bounds_that_hold_at_any_time() -> None:
    found = conclude([row(i) for i in range(50)]) | {"name": "x"}
    for looked, bound in ((False, clopper_pearson(0, 50)), (True, confidence_sequence(0, 50))):
        assert f"violation 0 to {bound.high:.2g}" in _summary(found, looked=looked)


def test_marks_are_found_in_distributions() -> None:
    rows = [row(i, first_trigger_s=float(i)) for i in range(10)] + [row(10, first_trigger_s=NAN)]
    (times,) = conclude(rows, first_trigger_s=7.5)["times"]
    assert times["first_trigger_s"]["share_below_mark"] == 0.8
    assert times["first_trigger_s"]["count"] == 10


def test_no_draw_at_all() -> None:
    found = conclude([])
    assert (found["draws"], found["claims"]) == (0, [])


def test_the_page_escapes_what_was_drawn_and_has_no_scripts() -> None:
    rows = [
        row(i, "refuted" if i % 2 else "holds", drawn=json.dumps({"x": i % 2, "<script>": "<img src=x>"}))
        for i in range(20)
    ]
    table = pd.DataFrame(rows, columns=list(COLUMNS)).astype(COLUMNS)
    text = page(conclude(rows) | {"name": "<b>", "title": "", "spec": "a.yaml", "stopped": None}, table)
    assert "<script" not in text
    assert "<img" not in text
    assert "<b>" not in text
    assert not re.search(r'(?:src|href)="(?!#)', text)


def test_a_campaign_stops_when_the_bound_is_low_or_high_enough() -> None:
    rule = Stopping.parse("SAFE-TRACE < 0.1")
    met = [rule.met([row(i)]) for i in range(100)]
    first = met.index(True)
    assert all(met[first:])
    assert confidence_sequence(0, first + 1).high < 0.1 <= confidence_sequence(0, first).high
    assert not any(Stopping.parse("SAFE-TRACE < 0.1").met([row(i, exercised=0.0)]) for i in range(100))
    assert any(map(Stopping.parse("SAFE-TRACE > 0.5").met, [[row(i, "refuted")] for i in range(50)]))


def test_rules_that_are_none() -> None:
    for text in ("SAFE-TRACE", "SAFE-TRACE = 0.1", "SAFE-TRACE < 2", "SAFE-TRACE < x"):
        with pytest.raises(ValueError, match="wanted: CLAIM < PROBABILITY"):
            Stopping.parse(text)
    with pytest.raises(UnknownNameError):
        Stopping.parse("SAFE-INV < 0.1")
    with pytest.raises(UnknownNameError, match=r"allowed: SAFE-TRACE$"):
        Stopping.parse("COMM < 0.1", ["SAFE-TRACE"])


def test_a_rule_is_given_draws_in_their_order_however_they_end() -> None:
    """Else those that end soon would decide, and what takes long, and fails, would come too late."""
    seen = list[int]()

    class Rule(Stopping):
        def met(self, rows: list[Row]) -> bool:
            seen.append(rows[0]["index"])
            return rows[0]["index"] == 3

    in_order = InOrder(Rule("SAFE-TRACE", below=True, value=0.1), [0, 1, 3, 4])
    met = [in_order.met(index, [row(index)]) for index in (4, 1, 3, 0)]
    assert (met, seen) == ([False, False, False, True], [0, 1, 3])
