"""The documentation: Python blocks run, links lead somewhere, what is generated is current, recipes work."""

import json
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from airground_drake.commands.falsify import main as falsify
from airground_drake.report.__main__ import main
from airground_drake.scenario.load import load
from airground_drake.scenario.shipped import shipped_files
from airground_drake.sim import graphviz
from airground_drake.study.campaign.spec import load_spec

ROOT = Path(__file__).parent.parent
PAGES = sorted(path for folder in (".", "docs", "examples") for path in (ROOT / folder).glob("*.md"))
EXAMPLES = ROOT / "examples"


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL)


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_python_blocks_run(page: Path) -> None:
    for block in blocks(page, "python"):
        exec(compile(block, str(page), "exec"), {"__name__": "docs"})


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere_and_lines_are_short(page: Path) -> None:
    assert max(map(len, page.read_text(encoding="utf-8").splitlines())) <= 120
    for target, anchor in re.findall(r"\]\((?!https?:)([^)#]+)#?([^)]*)\)", page.read_text(encoding="utf-8")):
        found = page.parent / target
        assert found.exists(), target
        headings = re.findall(r"^#+ (.+)$", found.read_text(encoding="utf-8"), re.MULTILINE) if anchor else []
        assert not anchor or anchor in {heading.lower().replace(" ", "-") for heading in headings}, anchor


def test_generated_parts_are_current() -> None:
    shipped = shipped_files()["minimal"].read_text(encoding="utf-8")
    assert blocks(ROOT / "README.md", "yaml") == [re.sub(r"^#.*\n", "", shipped, flags=re.MULTILINE)]
    generate = runpy.run_path(str(ROOT / "docs" / "generate.py"))
    gallery = generate["gallery"](["minimal"])
    assert gallery.count("<svg") == 2  # two runs
    assert "    airground report minimal\n" in gallery
    for name, text in generate["pages"]().items():
        assert (ROOT / "docs" / name).read_text(encoding="utf-8") == text, "run python docs/generate.py"
    diagrams = generate["diagrams"]()
    assert {f"../diagrams/{path.name}" for path in (ROOT / "diagrams").iterdir()} == set(diagrams)
    for name, text in diagrams.items():
        assert graphviz.is_current(name, text, (ROOT / "docs" / name).read_text(encoding="utf-8")), "run it, too"
        other = next(text for each, text in diagrams.items() if each != name and each[-4:] == name[-4:])
        assert not graphviz.is_current(name, text, other)
    marks = [mark for page in PAGES for mark in re.findall(r"<!-- (\w+): made", page.read_text(encoding="utf-8"))]
    assert sorted(marks) == sorted(generate["parts"]())
    for part in generate["parts"]().values():
        assert len(part().splitlines()) > 20


@pytest.mark.slow
def test_the_tutorial_from_an_empty_folder(tmp_path: Path) -> None:
    """Its files as they come, its commands in the order of the page; the first one installs, which CI does.

    What the page shows of their output is what they print, but for the ends of lines.
    """
    steps = re.findall(r"```(\w+)\n(.*?)```", (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8"), re.DOTALL)
    script = ["set -eu", f'python() {{ {sys.executable} "$@"; }}', 'airground() { python -P -m airground_drake "$@"; }']
    for language, text in steps:
        name = re.match(r"# file: (\S+)\n", text)
        if language != "text":
            script.append(f"cat > {name[1]} <<'END'\n{text}END" if language == "python" and name else text)
    # draws the same again
    options = "-p airground_drake.study.testing.plugin -p no:cacheprovider --hypothesis-profile=ci"
    environment = {**os.environ, "PYTEST_ADDOPTS": options}
    command = ["bash", "-c", "\n".join(script)]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 passed" in done.stdout
    assert "exit code 1\n" in done.stdout
    shown = [text for language, text in steps if language == "text"]
    assert len(shown) == 3
    assert [text for text in shown if " ".join(text.split()) not in " ".join(done.stdout.split())] == []
    events = json.loads((tmp_path / "second" / "report.json").read_text())["runs"]["d"]["events"]
    assert {event["robot"] for event in events if event["kind"] == "arrival"} >= {"ugv1", "ugv2", "ugv3"}
    (sent,) = {event["policy"] for event in events if event["kind"] == "proposal"}
    assert sent == "shortest.py:Shortest"


def test_everything_in_my_robots_is_explained() -> None:
    page = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
    shown = re.findall(r"(?:^# file: |\(../examples/)(my_robots/[\w.]+)", page, re.MULTILINE)
    assert sorted(shown) == sorted(f"my_robots/{path.name}" for path in (EXAMPLES / "my_robots").glob("*.py"))


@pytest.mark.slow
def test_everything_that_can_be_added_works_from_a_folder_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(EXAMPLES))
    assert load(str(EXAMPLES / "shelves.yaml")).obstacles["shelf"].radius_m == 3.0
    options = ["-o", str(tmp_path / "report"), "--format", "json", "--allow-plugins"]
    assert main([str(EXAMPLES / "mine.yaml"), *options]) == 0
    document = json.loads((tmp_path / "report" / "report.json").read_text())
    found = {claim["id"]: claim["status"] for claim in document["claims"]}
    assert (found["CORRIDOR"], found["STABLE"], found["SAFE-TRACE"]) == ("holds", "proved", "holds")
    kinds = [event["kind"] for event in document["runs"]["d"]["events"] if event["robot"] == "ugv1"]
    assert {"accept", "arrival"} <= set(kinds)
    reached = document["runs"]["d"]["metrics"]["final_position_m"]
    assert reached["uav"][:2] == pytest.approx(reached["ugv1"][:2], abs=0.01)


@pytest.mark.slow
def test_a_sampler_of_ones_own_looks_for_violations(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = [str(EXAMPLES / "pushed.yaml"), "--sampler", "my_robots/climb.py:Climb", "--allow-plugins"]
    assert falsify([*command, "-n", "6", "--jobs", "1", "-o", str(tmp_path / "worst.yaml")]) == 0
    assert "6 tried by my_robots/climb.py:Climb" in capsys.readouterr().out


def test_docs_and_examples_import_only_what_is_documented_to_stay() -> None:
    stays = set(re.findall(r"^::: (\S+)", (ROOT / "docs" / "extending.md").read_text(encoding="utf-8"), re.MULTILINE))
    for path in (*PAGES, *EXAMPLES.rglob("*.py"), *EXAMPLES.rglob("*.ipynb")):
        used = set(re.findall(r"(?:from|import) (airground_drake[\w.]*)", path.read_text(encoding="utf-8")))
        assert used <= {"airground_drake", *stays}, path


def test_the_spec_that_is_shown_makes_draws(tmp_path: Path) -> None:
    (text,) = blocks(ROOT / "docs" / "commands.md", "yaml")
    (tmp_path / "speeds.yaml").write_text(text, encoding="utf-8")
    spec = load_spec(tmp_path / "speeds.yaml")
    assert spec.draw(3).ugvs["ugv1"].preset.speed_m_s == spec.values(3)["ugvs.ugv1.preset.speed_m_s"]
