"""The replay in a real browser: any name is shown, and the page's policy admits its own scripts and no other."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from airground_drake.report.replay import page as pages
from airground_drake.report.replay.scene import Scene

WAIT_MS = 120_000
NAMES, OBSTACLES = ("__proto__", "constructor", "uav"), ("toString", "valueOf", "rock")

pytestmark = pytest.mark.slow


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A page that is closed at the end: one that goes on drawing by software takes the processor from the next."""
    opened = browser.new_page()
    opened.set_default_timeout(WAIT_MS)
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def file(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a scene whose robots and obstacles have the names of what every JavaScript object has."""
    robots = tuple(replace(body, name=name) for body, name in zip(scene.robots, NAMES, strict=True))
    obstacles = tuple(replace(each, name=name) for each, name in zip(scene.barriers, OBSTACLES, strict=True))
    path = tmp_path_factory.mktemp("replay") / "replay.html"
    path.write_text(pages.page(replace(scene, robots=robots, barriers=obstacles)), "utf-8")
    return path


def test_any_name_is_shown_and_the_policy_blocks_nothing_of_the_page(page: Page, file: Path) -> None:
    errors, said = list[str](), list[str]()
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda message: said.append(message.text))
    page.goto(file.as_uri())
    if page.inner_text("#replay-clock") == "no WebGL":
        pytest.skip("this browser has no WebGL")
    page.locator(".replay-name.state0").first.wait_for(state="attached")
    shown = [text.split()[0] for text in page.locator(".replay-name").all_inner_texts()]
    assert sorted(shown) == sorted([*NAMES, *OBSTACLES])
    assert not errors
    assert not [line for line in said if "Content Security Policy" in line]
