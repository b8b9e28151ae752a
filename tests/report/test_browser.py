"""The page in a real browser: no violation that axe-core finds, folds that links open, a filter, no script needed."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page
from report.cases import FINE, built, verdict

from airground_drake.commands import index
from airground_drake.report import audit, document, html
from airground_drake.report.figures import draw
from airground_drake.report.model import of
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace

NARROW, WIDE, WAIT_MS = 390, 1280, 120_000

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def page_file(scenario: Scenario, traces: dict[str, Trace], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page with everything on it, and few rows of a kind: the more rows, the longer axe takes."""
    near = {"first": "ugv1", "second": "obstacle_1", "t_s": 9.0, "min_distance_m": 1.75, "safe_distance_m": 2.0}
    evidence = {"pairs": [near], "tolerance_m": 1e-9}
    failed = verdict("c", "refuted", margin=-0.25, unit="m", where=near, counterexample=near, evidence=evidence)
    failed.claim.latex = (r"\min_t \lVert p_i(t) - q_j(t) \rVert \ge d_{ij}",)
    fault = {"t_s": 1.0, "robot": "ugv1", "policy": "detour", "what": "ValueError: no"}
    faulty = {**traces, "c": replace(traces["c"], meta={**traces["c"].meta, "faults": [fault]})}
    items = [{**item, "id": 90 + k} for k, item in enumerate(audit.of_runs(scenario, traces))]
    verdicts = [verdict("a", exercised=0), failed, FINE[2]]
    about = {"package": "0.1.0"}
    both = [*audit.of_runs(scenario, faulty), *items]
    report = document.build(scenario, faulty, verdicts, about, audit=both, required=["SAFE-INV"])
    figures = draw.draw(scenario, traces)
    for k, figure in enumerate(figures):
        cut = [replace(panel, table=replace(panel.table, rows=panel.table.rows[:4])) for panel in figure.panels]
        figures[k] = replace(figure, panels=tuple(cut))
    path = tmp_path_factory.mktemp("page") / "report.html"
    path.write_text(html.page(of(report), figures), "utf-8")
    return path


def opened(browser: Browser, file: Path, anchor: str = "", width: int = WIDE, **options: Any) -> Page:
    page = browser.new_context(viewport={"width": width, "height": 900}, **options).new_page()
    page.set_default_timeout(WAIT_MS)
    page.goto(f"{file.as_uri()}{anchor}")
    return page


def open_folds(page: Page) -> None:
    page.evaluate("document.querySelectorAll('details').forEach((fold) => { fold.open = true; })")


@pytest.mark.parametrize(
    ("width", "scheme", "folded"),
    [(WIDE, "light", True), (WIDE, "light", False), (NARROW, "light", False), (WIDE, "dark", False)],
)
def test_axe_finds_nothing(browser: Browser, page_file: Path, width: int, scheme: str, folded: bool) -> None:
    page = opened(browser, page_file, width=width, color_scheme=scheme)
    if not folded:
        open_folds(page)
    found = Axe().run(page, options={"resultTypes": ["violations"]})
    assert found.violations_count == 0, found.generate_report()
    assert page.evaluate("document.documentElement.scrollWidth") == width


def test_the_policy_blocks_nothing_of_the_page_and_whatever_else_is_slipped_in(
    browser: Browser, page_file: Path, tmp_path: Path
) -> None:
    said: list[str] = []
    page = opened(browser, page_file)
    page.on("console", lambda message: said.append(message.text))
    page.reload()
    assert said == []
    spoilt = tmp_path / "spoilt.html"
    slipped_in = "<script>document.title = 'taken'</script><img src='https://example.org/x.png'></main>"
    spoilt.write_text(page_file.read_text("utf-8").replace("</main>", slipped_in), "utf-8")
    page.goto(spoilt.as_uri())
    assert page.title() != "taken"
    assert sum("Content Security Policy" in line for line in said) == 2


def test_a_link_opens_the_fold_that_it_leads_into(browser: Browser, page_file: Path) -> None:
    page = opened(browser, page_file)
    page.click("#close-all")
    assert not page.is_visible("#claim-SAFE-TRACE")
    page.click(".attention a[href='#claim-SAFE-TRACE']")
    assert page.is_visible("#claim-SAFE-TRACE")


def test_claims_are_filtered_by_status_and_run(browser: Browser, page_file: Path) -> None:
    page = opened(browser, page_file)
    page.click("#open-all")
    rows = "details.claim tr[data-status]:not([hidden])"
    assert page.locator(rows).count() == 3
    page.select_option("#by-status", "not_exercised")
    assert page.locator(rows).count() == 1
    page.select_option("#by-run", "c")
    assert page.locator(rows).count() == 0
    assert page.inner_text("#shown") == "0 of 1 claims"


def test_it_reads_without_scripts(browser: Browser, page_file: Path) -> None:
    page = opened(browser, page_file, "#claim-SAFE-TRACE", java_script_enabled=False)
    assert not page.is_visible("#tools")
    assert page.locator("math").count() > 0
    assert page.is_visible("#claim-SAFE-TRACE")


def test_what_is_folded_is_not_printed(browser: Browser, page_file: Path) -> None:
    closed, everything = opened(browser, page_file), opened(browser, page_file)
    closed.click("#close-all")
    open_folds(everything)
    pages = [page.pdf().count(b"/Type /Page\n") for page in (closed, everything)]
    assert 0 < pages[0] < pages[1]


def test_on_a_phone_the_list_of_reports_shows_every_verdict(
    browser: Browser, scenario: Scenario, traces: dict[str, Trace], tmp_path: Path
) -> None:
    for name in ("reports_of_the_third_of_november_before_the_change", "b"):
        (tmp_path / name).mkdir()
        report = built(scenario, traces, FINE)
        report["scenario"]["title"] = "A UGV that a rock stops, and a UAV that shows it the way round; " * 2
        (tmp_path / name / "report.json").write_text(json.dumps(report))
    assert index.main([str(tmp_path)]) == 0
    page = opened(browser, tmp_path / index.PAGE, width=NARROW)
    assert page.locator(".chip").count() == 2
    places = "[...document.querySelectorAll('.chip, th a, code')].map((each) => each.getBoundingClientRect().right)"
    assert max(page.evaluate(places)) <= NARROW
    assert page.evaluate("[...document.querySelectorAll('.scroll')].every((e) => e.scrollWidth <= e.clientWidth)")
    assert Axe().run(page, options={"resultTypes": ["violations"]}).violations_count == 0
