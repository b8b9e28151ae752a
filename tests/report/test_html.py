"""The page: escaped, self-contained, well-formed, accessible."""

from __future__ import annotations

import json
import re
from base64 import b64encode
from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256
from html.parser import HTMLParser

import pytest
import yaml
from report.cases import FINE, Kept, built, event, make_scenario, make_trace, make_traces, verdict

from airground_drake.base.statuses import STATUSES
from airground_drake.report import attention, document, html, pages
from airground_drake.report.figures import draw
from airground_drake.report.figures.panels import Figure
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Run, Scenario
from airground_drake.verify.claim import Verdict
from airground_drake.verify.finding import Finding

HOSTILE, PLACEHOLDER = "<script>alert('$x$')</script>", "placeholder"


class Page(HTMLParser):
    """What the tests look at in a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.parents: list[tuple[str, str]] = []
        self.open: list[str] = []
        self.unbalanced: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self.parents.append((tag, self.open[-1] if self.open else ""))
        if tag not in ("meta", "br", "link", "wbr", "input"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.unbalanced.append(tag)

    def of(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]


DIAGRAM = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><text>plant</text></svg>'


@pytest.fixture(scope="module")
def hostile_page() -> str:
    """Everything in report.json that somebody could have written there is hostile: also names, in a forged report."""
    scenario = make_scenario(PLACEHOLDER)
    scenario = replace(scenario, name=PLACEHOLDER, title=HOSTILE, description=HOSTILE)
    scenario.choices[0].reason = scenario.reproduction[0].why = HOSTILE
    scenario.runs[PLACEHOLDER] = Run("b")
    traces = make_traces(scenario)
    traces[PLACEHOLDER] = make_trace(scenario, PLACEHOLDER, events=[event(1.0, PLACEHOLDER, PLACEHOLDER)])
    traces[PLACEHOLDER].meta["faults"].append({"t_s": 1.0, "robot": HOSTILE, "policy": HOSTILE, "what": HOSTILE})
    claim = type(
        "Hostile",
        (Kept,),
        {
            **dict.fromkeys(("id", "summary", "statement", "formula", "method", "exercised_by"), HOSTILE),
            "latex": (HOSTILE, rf"\text{{{HOSTILE}}} \href{{javascript:alert(1)}}{{x}}"),
            "assumptions": (HOSTILE,),
        },
    )
    finding = Finding("refuted", -1.0, HOSTILE, {HOSTILE: HOSTILE}, {"x": HOSTILE}, {HOSTILE: [HOSTILE]})
    report = built(scenario, traces, [*FINE, Verdict(claim(), PLACEHOLDER, finding, "holds")])
    figures = draw.draw(scenario, traces)
    report = json.loads(json.dumps(report).replace(PLACEHOLDER, HOSTILE))
    report["provenance"][HOSTILE] = report["provenance"]["command"] = HOSTILE
    return html.render(report, figures, DIAGRAM)


def test_faults_are_told_once_each_cut_and_without_what_turns_or_breaks_lines() -> None:
    alike = [{"t_s": 0.5 * k, "robot": f"ugv{k % 2}", "policy": "p", "what": "ValueError: no"} for k in range(900)]
    other = {"t_s": 7.0, "robot": "ugv1", "policy": "q", "what": "\u202eevil\n\x1b[2J" + "x" * 9000}
    one, cut = attention.faults_together([*alike, other])
    assert (one["count"], one["first_s"], one["last_s"], one["robots"]) == (900, 0.0, 449.5, ["ugv0", "ugv1"])
    assert cut["what"].startswith("\\u202eevil\\n\\x1b[2J")
    assert len(cut["what"]) < attention.MAX_FAULT_CHARS + 30
    assert html.as_yaml({"a": "\u202e"}) == '{a: "\\u202E"}\n'


@pytest.fixture(scope="module")
def page(scenario: Scenario, traces: dict[str, Trace], drawn: list[Figure]) -> str:
    return html.render(built(scenario, traces, FINE), drawn, DIAGRAM)


@pytest.fixture(params=["page", "hostile_page"])
def text(request: pytest.FixtureRequest) -> str:
    return str(request.getfixturevalue(request.param))


def test_hostile_names_are_escaped(hostile_page: str) -> None:
    assert hostile_page.count("<script") == len(html.SCRIPTS)
    assert "javascript:" not in hostile_page
    assert hostile_page.count("&lt;script&gt;") > 30
    assert not any(name.startswith("on") for _, attributes in Page(hostile_page).tags for name in attributes)


def test_self_contained(text: str) -> None:
    page = Page(text)
    assert not any(tag in ("link", "iframe", "img", "object", "embed") for tag, _ in page.tags)
    assert not any("style" in attributes for _, attributes in page.tags)
    assert page.of("script") == [{}] * len(html.SCRIPTS)
    targets = [a[name] for _, a in Page(text).tags for name in ("href", "src", "data", "action") if name in a]
    assert targets
    assert all(target and target.startswith("#") for target in targets)
    assert "@import" not in text
    assert "url(http" not in text.replace(" ", "").replace('"', "")
    assert len(text.encode()) < 1_500_000


def test_the_policy_admits_the_style_sheet_and_the_scripts_of_the_page_and_nothing_else(text: str) -> None:
    only_its_own(text)


def test_so_does_the_policy_of_pages_beside_the_report() -> None:
    only_its_own(pages.render("index.html.j2", entries=[], problems=[], name="reports", mark="ours"))


def only_its_own(text: str) -> None:
    (policy,) = (str(meta["content"]) for meta in Page(text).of("meta") if "http-equiv" in meta)
    allowed = dict(part.split(" ", 1) for part in policy.split("; "))
    assert {name: allowed.pop(name) for name in ("default-src", "base-uri", "form-action")} == dict.fromkeys(
        ("default-src", "base-uri", "form-action"), "'none'"
    )
    for tag, directive in (("style", "style-src"), ("script", "script-src")):
        blocks = re.findall(rf"<{tag}>(.*?)</{tag}>", text, re.DOTALL)
        digests = [b64encode(sha256(block.encode()).digest()).decode() for block in blocks]
        assert allowed.pop(directive) == (" ".join(f"'sha256-{digest}'" for digest in digests) or "'none'")
    assert not allowed


def test_well_formed_with_unique_ids_and_live_links(text: str) -> None:
    page = Page(text)
    assert page.unbalanced == []
    assert page.open == []
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))


def test_links_lead_somewhere(page: str) -> None:
    parsed = Page(page)
    ids = {attributes["id"] for _, attributes in parsed.tags if "id" in attributes}
    assert {str(a["href"])[1:] for a in parsed.of("a")} <= ids


def test_accessible(text: str) -> None:
    page = Page(text)
    assert page.of("html")[0]["lang"] == "en"
    assert len(page.of("h1")) == 1
    assert page.of("title")
    assert {a.get("scope") for a in page.of("th")} == {"row", "col"}
    assert len(page.of("caption")) == len(page.of("table")) > 10
    assert page.of("a")[0] == {"class": "skip", "href": "#content"}
    drawings = page.of("svg")
    assert len(drawings) == sum(a.get("role") == "img" for a in drawings) > 5
    for tag in ("title", "desc"):
        assert page.parents.count((tag, "svg")) == len(drawings)


def first(text: str) -> str:
    """The first screen, without tags and white space."""
    found = text[text.index('<section class="first"') : text.index("<nav")]
    return " ".join(re.sub("<[^>]*>", " ", found).split())


def test_the_first_screen_answers_and_is_in_the_title(page: str) -> None:
    assert "What needs attention" not in page
    assert first(page).startswith("✗ No method brings everyone home safely. Under (a), ugv1 comes within 1.99999 m of")
    assert "3 checks as declared: 1 deliberate failure." in first(page)
    assert page.index("Do not conclude") < page.index('id="happened"') < page.index('id="claims"')
    assert "refuted, as declared" in page
    assert "<title>case_a: No method brings everyone home safely." in page


def test_an_unexpected_refutation_is_on_the_first_screen(
    scenario: Scenario, traces: dict[str, Trace], drawn: list[Figure]
) -> None:
    failed = verdict("c", "refuted", margin=-0.25, unit="m", where={"robot": "ugv1"}, counterexample={"t_s": 4.25})
    report = built(scenario, traces, [FINE[0], failed, FINE[2]])
    assert report["overall"]["exit_code"] == 1
    text = html.render(report, drawn)
    assert 'class="headline bad"' in text
    assert "SAFE-TRACE on run c (refuted, expected holds)" in first(text)
    attention = text[text.index("What needs attention") : text.index('id="happened"')]
    assert '<a href="#claim-SAFE-TRACE">ugv1: margin missed by 0.25 m, 4.250 s</a>' in attention


def test_what_was_not_tested_has_a_chip_of_its_own_that_needs_no_colour(
    scenario: Scenario, traces: dict[str, Trace], page: str
) -> None:
    text = html.render(built(scenario, traces, [*FINE, verdict("c", exercised=0), verdict("c", exercised=12)]), [])
    summary = text[text.index('<span class="verdicts">') : text.index('<span class="plain">')]
    assert summary.count("not tested") == 1
    assert "\N{EMPTY SET}" in summary
    assert "1 not tested" in first(text)
    assert '<td data-label="Exercised">12</td>' in text
    assert "<dt>Exercised by</dt><dd>pairs</dd>" in text
    assert "not tested" not in first(page)


def test_sections_that_would_say_nothing_are_absent(scenario: Scenario, traces: dict[str, Trace]) -> None:
    bare = replace(scenario, name="mine", reproduction=[], choices=[], runs={"a": scenario.runs["a"]})
    text = html.render(built(bare, {"a": traces["a"]}, FINE[:1]), [])
    headings = re.findall(r'<h2 id="(\w+)">', text)
    assert headings == ["happened", "safe", "claims", "provenance"]


def test_a_row_that_is_not_reproduced_shows(scenario: Scenario, traces: dict[str, Trace]) -> None:
    changed = replace(scenario.reproduction[1], id="A5", paper=[10.6])
    text = html.render(built(replace(scenario, reproduction=[changed]), traces, FINE), [])
    assert "not reproduced: A5" in first(text)
    assert "differs by 3.9 s, 0.1 s are allowed; speed set" in text


def test_the_reason_that_decided_is_shown_with_its_cost_and_so_is_a_failing_solver(
    scenario: Scenario, traces: dict[str, Trace]
) -> None:
    """The best plan refused first: that accepting throughout costs less than refusing throughout decides nothing."""
    decisions = traces["c"].decisions.assign(
        decision="refuse", reason=["waits", "kept"], status=["optimal", "solver_failed"], objective=350.0,
        accept_throughout=[350.3, 340.0], refuse_throughout=468.8, issued_s=14.6,
    )  # fmt: skip
    report = built(scenario, {**traces, "c": replace(traces["c"], decisions=decisions)}, FINE)
    assert report["runs"]["c"]["metrics"]["gatekeeper"]["solver_failures"] == 1
    text = " ".join(html.render(report, []).split())
    assert "refuse: the best plan began by refusing and accepted later (cost 350 of the best plan, 350.3 to" in text
    assert "ugv1 refused 1 proposal because the best plan began by refusing and accepted later" in text
    assert "This is how method (c) starves a robot" in text
    assert "the solver failed 1 time," in text


def test_an_empty_report_renders(scenario: Scenario) -> None:
    empty = replace(scenario, runs={}, reproduction=[], choices=[])
    text = html.render(document.build(empty, "", {}, [], {}), [], "no svg")
    assert "Nothing was run." in first(text)
    assert Page(text).unbalanced == []


def test_numbers_for_reading() -> None:
    assert [html.number(x) for x in (None, 3, 14.0, -0.21984, 2.5e-14, "x")] == [
        "\N{EN DASH}", "3", "14", "\N{MINUS SIGN}0.2198", "2.5e\N{MINUS SIGN}14", "x",
    ]  # fmt: skip
    assert html.value([3.3, 5.1], "m") == "(3.3, 5.1) m"
    assert html.value(1.0, "yes/no") == "yes"
    assert html.value(None, "m") == "no value"


def test_a_scenario_for_reading_is_yaml() -> None:
    data = {"a": [{"x": 1.5, "long": "y" * 90}, {"x": None}], "b": {}}
    assert yaml.safe_load(html.as_yaml(data)) == data
    assert html.as_yaml(["z" * 90_000]).endswith("report.json has all of it")


def test_readers_of_many_names_know_every_status() -> None:
    known: Callable[[str], bool] = html.CHIPS.__contains__
    assert all(map(known, (*STATUSES, *document.EXIT_CODES, "reproduced", "calibrated", "not_reproduced")))
