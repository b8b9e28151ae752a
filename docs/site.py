"""The parts of the site that are made when it is built: a hook of `mkdocs build`.

Marks such as `<!-- claims: made when the site is built -->` are replaced by what `generate.py` makes of the code.

Pages link to files of the repository by their paths there. Each linked file outside of these pages becomes a page under
`repository/`, and links lead to it. Formulas become MathML, which needs neither a script nor a network. With
AIRGROUND_SAMPLES=1 the reports of all shipped scenarios are made (some minutes) and shown; the value `case_a,dwell`
makes only these.
"""

from __future__ import annotations

import os
import posixpath
import re
import runpy
import subprocess
import sys
import tempfile
from html import unescape
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files, InclusionLevel
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parent.parent
OUTSIDE = "repository"
"""Folder of the site for files outside docs/."""
ALWAYS = ("CHANGELOG.md", "SECURITY.md", "examples/README.md")
"""Pages outside docs/ that the navigation of the site leads to."""
LANGUAGES = {".py": "python", ".yaml": "yaml", ".toml": "toml", ".sh": "bash"}
SAMPLES = os.environ.get("AIRGROUND_SAMPLES", "")

GENERATE = runpy.run_path(str(Path(__file__).with_name("generate.py")))
PARTS = GENERATE["parts"]()

_MARK = re.compile(r"<!-- (\w+): made when the site is built.*?-->")
_LINK = re.compile(r"(?<=\]\()(?!https?:|#|mailto:)([^)#\s]+)(#[^)\s]*)?(?=\))")
_FORMULA = re.compile(r'<(span|div) class="arithmatex">(?:\\\(|\\\[)(.*?)(?:\\\)|\\\])</\1>', re.DOTALL)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are not in docs/."""
    to_look_at = [(f"docs/{page.src_uri}", page.content_string) for page in files.documentation_pages()]
    to_look_at.append(("mkdocs.yml", " ".join(f"]({place})" for place in ALWAYS)))
    seen: set[str] = set()
    while to_look_at:
        place, text = to_look_at.pop()
        for target, _ in _LINK.findall(text):
            uri = page_of(posixpath.normpath(posixpath.join(posixpath.dirname(place), target)))
            if uri.startswith(f"{OUTSIDE}/") and uri not in seen:
                seen.add(uri)
                found = uri.removeprefix(f"{OUTSIDE}/")
                content = shown(ROOT / found if (ROOT / found).exists() else ROOT / found.removesuffix(".md"))
                files.append(File.generated(config, uri, content=content, inclusion=InclusionLevel.NOT_IN_NAV))
                to_look_at.append((found, content))
    files.append(File.generated(config, "gallery.md", content=GENERATE["gallery"]()))
    files.append(File.generated(config, "samples.md", content=samples(files, config)))
    return files


def page_of(place: str) -> str:
    """The page of the site that shows a file or a folder of the repository."""
    if place.startswith("docs/"):
        return place.removeprefix("docs/")
    return f"{OUTSIDE}/{place}" if place.endswith(".md") else f"{OUTSIDE}/{place}.md"


def shown(path: Path) -> str:
    """A file of the repository as a page."""
    name = path.relative_to(ROOT).as_posix()
    if path.suffix == ".md":
        return path.read_text(encoding="utf-8")
    if path.is_dir():
        listed = sorted(each.name for each in path.iterdir() if each.suffix in (*LANGUAGES, ".md", ".ipynb", ".dot"))
        return f"# {name}\n\n" + "\n".join(f"- [{each}]({path.name}/{each})" for each in listed) + "\n"
    return f"# {name}\n\n````{LANGUAGES.get(path.suffix, 'text')}\n{path.read_text(encoding='utf-8')}\n````\n"


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """Fill marks, and turn links to files of the repository into links to their pages."""
    markdown = _MARK.sub(lambda mark: PARTS[mark[1]](), markdown)
    uri = page.file.src_uri
    place = uri.removeprefix(f"{OUTSIDE}/") if uri.startswith(f"{OUTSIDE}/") else f"docs/{uri}"
    beside = posixpath.dirname(
        place if place.endswith(".md") and (ROOT / place).exists() else place.removesuffix(".md")
    )

    def turned(link: re.Match[str]) -> str:
        target = page_of(posixpath.normpath(posixpath.join(beside, link[1])))
        return posixpath.relpath(target, posixpath.dirname(uri) or ".") + (link[2] or "")

    return _LINK.sub(turned, markdown) if uri not in ("gallery.md", "samples.md") else markdown


def on_page_content(html: str, **_: Any) -> str:
    """Formulas as MathML."""

    def typeset(found: re.Match[str]) -> str:
        made = convert(unescape(found[2]), display="block" if found[1] == "div" else "inline")
        return made.replace("<mover>", '<mover accent="true">')  # dots, hats and bars; nothing else is set over

    return _FORMULA.sub(typeset, html)


def samples(files: Files, config: MkDocsConfig) -> str:
    """The page of sample reports, which are added to the site."""
    lines = ["# Reports of the shipped scenarios", ""]
    if not SAMPLES:
        return "\n".join([*lines, "This copy of the site was built without them: `AIRGROUND_SAMPLES=1 mkdocs build`."])
    listed = [sys.executable, "-m", "airground_drake", "list", "scenarios"]
    text = subprocess.run(listed, check=True, capture_output=True, text=True).stdout
    titles = dict(re.findall(r"^  (\w+) +(.*)$", text, re.MULTILINE)) | {"audit": "What is wrong in the paper"}
    wanted = list(titles) if SAMPLES == "1" else SAMPLES.split(",")
    folder = Path(tempfile.mkdtemp())
    for name in wanted:
        report = [sys.executable, "-m", "airground_drake.report", name, "-o", str(folder / name)]
        subprocess.run([*report, "--format", "html,json"], check=True, stdout=subprocess.DEVNULL)
        place = f"samples/{name}/report.html"
        files.append(File.generated(config, place, abs_src_path=str(folder / name / "report.html")))
        lines.append(f"- [{titles[name]}]({place}) (`airground report {name}`)")
    return "\n".join([*lines, "", "Made by this version when the site was built."])
