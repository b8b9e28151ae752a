"""The page: escaped, self-contained, well-formed, accessible."""

import re
from base64 import b64encode
from dataclasses import fields, is_dataclass, replace
from hashlib import sha256
from html.parser import HTMLParser
from typing import Any

import pytest
import yaml
from pydantic import BaseModel
from report.cases import FINE, Kept, built, event, make_scenario, make_trace, make_traces, verdict

from airground_drake.base.statuses import STATUSES
from airground_drake.report import attention, document, html, sentences
from airground_drake.report.figures import draw
from airground_drake.report.figures.panels import Figure
from airground_drake.report.model import of
from airground_drake.scenario.schema import Run, Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import Verdict
from airground_drake.verify.finding import Chart, Finding

HOSTILE, PLACEHOLDER = "<script>alert('$x$')</script>", "placeholder"
DIAGRAM = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><text>plant</text></svg>'


class Page(HTMLParser):
    """Tags with their attributes and parents, and unbalanced ones."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None], str]] = []
        self.open: list[str] = []
        self.unbalanced: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs), self.open[-1] if self.open else ""))
        if tag not in ("meta", "br", "link", "wbr", "input"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs), ""))

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.unbalanced.append(tag)

    def of(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes, _ in self.tags if name == tag]


@pytest.fixture(scope="module")
def hostile_page() -> str:
    scenario = make_scenario(PLACEHOLDER)
    scenario = replace(scenario, name=PLACEHOLDER, title=HOSTILE, description=HOSTILE)
    scenario.choices[0].reason = scenario.reproduction[0].why = HOSTILE
    scenario.runs[PLACEHOLDER] = Run("b")
    traces = make_traces(scenario)
    traces[PLACEHOLDER] = make_trace(scenario, PLACEHOLDER, events=[event(1.0, PLACEHOLDER, PLACEHOLDER)])
    traces[PLACEHOLDER].meta["faults"].append({"t_s": 1.0, "robot": HOSTILE, "policy": HOSTILE, "what": HOSTILE})
    texts = dict.fromkeys(("id", "subject", "summary", "statement", "formula", "method", "exercised_by"), HOSTILE)
    latex = (HOSTILE, rf"\text{{{HOSTILE}}} \href{{javascript:alert(1)}}{{x}}")
    claim = type("Hostile", (Kept,), {**texts, "latex": latex, "assumptions": (HOSTILE,)})
    chart = Chart(HOSTILE, HOSTILE, HOSTILE, {HOSTILE: ([1.0, 2.0], [1.0, 2.0])}, {HOSTILE: (1.0, 2.0)}, "", HOSTILE)
    finding = Finding("refuted", -1.0, HOSTILE, {HOSTILE: HOSTILE}, {"x": HOSTILE}, {HOSTILE: [HOSTILE]}, figure=chart)
    report = built(scenario, traces, [*FINE, Verdict.of(claim(), PLACEHOLDER, finding, "holds")])
    figures = draw.draw(scenario, traces)
    report["provenance"][HOSTILE] = report["provenance"]["command"] = HOSTILE
    return html.page(spoilt(of(report)), figures, DIAGRAM)


def spoilt(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return value.model_construct(**{name: spoilt(inner) for name, inner in value})
    if is_dataclass(value):
        return type(value)(**{field.name: spoilt(getattr(value, field.name)) for field in fields(value)})
    if isinstance(value, dict):
        return {spoilt(name): spoilt(inner) for name, inner in value.items()}
    if isinstance(value, list):
        return [*map(spoilt, value)]
    return value.replace(PLACEHOLDER, HOSTILE) if isinstance(value, str) else value


@pytest.fixture(scope="module")
def page(scenario: Scenario, traces: dict[str, Trace], drawn: list[Figure]) -> str:
    return html.page(of(built(scenario, traces, FINE)), drawn, DIAGRAM)


@pytest.fixture(params=["page", "hostile_page"])
def text(request: pytest.FixtureRequest) -> str:
    return str(request.getfixturevalue(request.param))


def test_hostile_names_are_escaped(hostile_page: str) -> None:
    assert hostile_page.count("<script") == 1
    assert "javascript:" not in hostile_page
    assert hostile_page.count("&lt;script&gt;") > 30
    assert not any(name.startswith("on") for _, attributes, _ in Page(hostile_page).tags for name in attributes)


def test_self_contained(text: str) -> None:
    page = Page(text)
    assert not any(tag in ("link", "iframe", "img", "object", "embed") or "style" in has for tag, has, _ in page.tags)
    assert page.of("script") == [{}]
    targets = [has[name] for _, has, _ in page.tags for name in ("href", "src", "data", "action") if name in has]
    assert all(target and target.startswith("#") for target in targets)
    assert not re.search(r"@import|url\(\s*['\"]?http", text)
    assert len(text.encode()) < 1_500_000


def test_the_policy_admits_the_style_sheet_and_the_script_of_the_page_and_nothing_else(text: str) -> None:
    beside = html.render_beside("index.html.j2", entries=[], problems=[], name="reports", mark="ours")
    for each in (text, beside):
        (policy,) = (str(meta["content"]) for meta in Page(each).of("meta") if "http-equiv" in meta)
        allowed = {"default-src": "'none'", "base-uri": "'none'", "form-action": "'none'"}
        for tag in ("style", "script"):
            blocks = re.findall(rf"<{tag}>(.*?)</{tag}>", each, re.DOTALL)
            digests = [b64encode(sha256(block.encode()).digest()).decode() for block in blocks]
            allowed[f"{tag}-src"] = " ".join(f"'sha256-{digest}'" for digest in digests) or "'none'"
        assert dict(part.split(" ", 1) for part in policy.split("; ")) == allowed


def test_well_formed_and_accessible(text: str) -> None:
    page = Page(text)
    assert (page.unbalanced, page.open) == ([], [])
    ids = [attributes["id"] for _, attributes, _ in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert page.of("html")[0]["lang"] == "en"
    assert len(page.of("h1")) == 1
    assert page.of("title")
    assert {a.get("scope") for a in page.of("th")} == {"row", "col"}
    assert len(page.of("caption")) == len(page.of("table")) > 10
    assert page.of("a")[0] == {"class": "skip", "href": "#content"}
    drawings = page.of("svg")
    assert len(drawings) == sum(a.get("role") == "img" for a in drawings) > 5
    for tag in ("title", "desc"):
        assert [(name, parent) for name, _, parent in page.tags].count((tag, "svg")) == len(drawings)


def test_links_lead_somewhere_and_the_title_has_the_headline(page: str) -> None:
    parsed = Page(page)
    assert {str(a["href"])[1:] for a in parsed.of("a")} <= {has["id"] for _, has, _ in parsed.tags if "id" in has}
    assert page.index("Do not conclude") < page.index('id="happened"') < page.index('id="claims"')
    assert "<title>case_a: With the UAV (c): " in page


def first(text: str) -> str:
    found = text[text.index('<section class="first"') : text.index("<nav")]
    return " ".join(re.sub("<[^>]*>", " ", found).split())


def test_what_fails_is_shown_first_and_what_was_not_tested_apart(
    scenario: Scenario, traces: dict[str, Trace], page: str
) -> None:
    failed = verdict("c", "refuted", margin=-0.25, unit="m", where={"robot": "ugv1"}, counterexample={"t_s": 4.25})
    text = html.page(of(built(scenario, traces, [failed, *FINE[1:], verdict("a", exercised=0)])), [])
    assert 'class="headline bad"' in text
    assert "c: distances failed" in first(text)
    told = text[text.index("What needs attention") : text.index('id="happened"')]
    assert '<a href="#claim-SAFE-TRACE">ugv1: margin missed by 0.25 m, 4.250 s</a>' in told
    chips = text[text.index('<span class="verdicts">') : text.index('<span class="plain">')]
    assert chips.count("not tested") == chips.count("\N{EMPTY SET}") == 1
    assert "What needs attention" not in page
    assert "not tested" not in page


def test_a_chart_stands_beside_its_claim_or_where_the_rules_put_it(
    scenario: Scenario, traces: dict[str, Trace]
) -> None:
    chart = Chart("Spare room", "t, s", "m", {"ugv1": ([0.0, 1.0], [2.0, 3.0])}, caption="All of it.")
    report = built(scenario, traces, [verdict("c", figure=chart), verdict("a")])
    report["claims"].append({**report["claims"][0], "id": "THR-CHOICE", "run": ""})
    text = html.page(of(report), [], None)
    headings = re.findall(r"<h[234]?(?: id=\"\w+\")?>([\w -]*(?:SAFE-TRACE|Spare room|step in|All checks)[^<]*)<", text)
    assert headings == ["When did the UAV step in?", "Spare room", "All checks", "SAFE-TRACE", "Spare room"]
    assert text.count("All of it.") == 2
    assert text.count('<p class="panel-title">Run c</p>') == 1


def test_sections_that_would_say_nothing_are_absent(scenario: Scenario, traces: dict[str, Trace]) -> None:
    bare = replace(scenario, name="mine", reproduction=[], choices=[], runs={"a": scenario.runs["a"]})
    text = html.page(of(built(bare, {"a": traces["a"]}, FINE[:1])), [])
    assert re.findall(r'<h2 id="(\w+)">', text) == ["happened", "safe", "claims", "provenance"]
    empty = html.page(of(document.build(bare, {}, [], {})), [], "no svg")
    assert "With or without the UAV (a): not run." in first(empty)
    assert Page(empty).unbalanced == []


def test_the_reason_that_decided_is_shown_with_its_cost_and_so_is_a_failing_solver(
    scenario: Scenario, traces: dict[str, Trace]
) -> None:
    """The best plan refused first: that accepting throughout costs less than refusing throughout decides nothing."""
    decisions = traces["c"].decisions.assign(
        decision="refuse", reason=["waits", "kept"], status=["optimal", "solver_failed"], objective=350.0,
        accept_throughout=[350.3, 340.0], refuse_throughout=468.8, issued_s=14.6,
    )  # fmt: skip
    report = built(scenario, {**traces, "c": replace(traces["c"], decisions=decisions)}, FINE)
    text = " ".join(html.page(of(report), []).split())
    assert "refuse: the best plan refuses now and accepts later (cost 350 of the best plan, 350.3 to" in text
    assert "ugv1 refused 1 proposal because the best plan began by refusing and accepted later" in text
    assert "the solver failed 1 time," in text
    report["runs"]["c"]["metrics"]["gatekeeper"]["closest_call"] |= {"decision": "accept", "reason": "first_stage"}
    assert "accept: the plan begins with this answer" in html.page(of(report), [])


def test_faults_are_told_once_each_cut_and_without_what_turns_or_breaks_lines() -> None:
    alike = [{"t_s": 0.5 * k, "robot": f"ugv{k % 2}", "policy": "p", "what": "ValueError: no"} for k in range(900)]
    other = {"t_s": 7.0, "robot": "ugv1", "policy": "q", "what": "\u202eevil\n\x1b[2J" + "x" * 9000}
    one, cut = attention.faults_together([*alike, other])
    assert (one["count"], one["first_s"], one["last_s"], one["robots"]) == (900, 0.0, 449.5, ["ugv0", "ugv1"])
    assert cut["what"].startswith("\\u202eevil\\n\\x1b[2J")
    assert len(cut["what"]) < attention.MAX_FAULT_CHARS + 30


def test_values_for_reading() -> None:
    assert [sentences.number(x) for x in (None, 14.0, -0.21984, 2.5e-14)] == [
        "\N{EN DASH}", "14", "\N{MINUS SIGN}0.2198", "2.5e\N{MINUS SIGN}14",
    ]  # fmt: skip
    assert [sentences.as_text(*x) for x in (([3.3, 5.1], "m"), (1.0, "yes/no"), (None, "m"))] == [
        "(3.3, 5.1) m", "yes", "\N{EN DASH}",
    ]  # fmt: skip
    assert sentences.as_text({"gap_m": 0.5, "there": True}) == "gap 0.5 m; there yes"
    data = {"a": [{"x": 1.5, "long": "y" * 90}, {"x": None}], "b": "\u202e"}
    assert yaml.safe_load(html.as_yaml(data)) == data
    assert html.as_yaml(data).isascii()
    assert html.as_yaml(["z" * 90_000]).endswith("report.json has all of it")
    assert html.CHIPS.keys() >= {*STATUSES, *document.EXIT_CODES, "reproduced", "calibrated", "not_reproduced"}
