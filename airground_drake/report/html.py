"""report.html: one self-contained page that renders report.json, the figures and the diagram.

Its content security policy admits only its own style sheet and script, by their digests. Without the script it lacks
the filter of claims, nothing else.
"""

import xml.etree.ElementTree as ET
from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from hashlib import sha256
from html import unescape
from importlib import resources
from typing import Any

import yaml
from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from latex2mathml.converter import convert_to_element
from markupsafe import Markup, escape

from airground_drake.base.statuses import PASSING, outcome
from airground_drake.report import attention, rules
from airground_drake.report.figures import findings
from airground_drake.report.figures.findings import of_chart
from airground_drake.report.figures.panels import Figure, Table
from airground_drake.report.model import Claim, Report
from airground_drake.report.proved import place
from airground_drake.report.screen import first_screen
from airground_drake.report.sentences import MARKS, as_text, grouped, number, split, unbroken
from airground_drake.report.view import canvas, svg
from airground_drake.ugv.reasons import WORDS
from airground_drake.verify.finding import Chart

STYLE, SCRIPT = "report.css", "report.js"  # the style sheet and the script of the page, among the templates
NOTHING = "'none'"  # in a content security policy: no source at all
MAX_DIAGRAM_CHARS = 500_000
MAX_SCENARIO_CHARS = 20_000
LINE_CHARS = 110
# Kinds of evidence shown instead of a passing verdict, so as not to overstate it.
KINDS = ("declared", "stuck")
MAX_DISTANCE_ROWS = 120
MAX_INTERVENTIONS = 40  # maximum number of proposals listed per run
MAX_FAULTS = 40  # maximum number of kinds of faults listed per run

# Sections of the page, in order, by their identifiers; an empty section is left out.
SECTIONS = {
    "happened": "What happened",
    "safe": "Is it safe?",
    "intervened": "When did the UAV step in?",
    "reproduction": "Compared with the paper",
    "choices": "What we changed",
    "audit": "Errors in the paper",
    "diagram": "How it is wired",
    "claims": "All checks",
    "provenance": "How to run it again",
}
# Names of linked sections on the first screen.
LINKS = {"claims": "proof", "intervened": "timing, choice", "reproduction": "all numbers"}
# Sections of the figures; the others are maps of what happened.
PLACES = {"distances": "safe", "timelines": "intervened"}

# How a status is shown: icon, word, class (which sets the colour): never by colour alone.
CHIPS = {
    "as_expected": ("✓", "as declared", "good"),
    "not_as_expected": ("✗", "not as declared", "bad"),
    "proved": ("✓", "proved", "good"),
    "holds": ("✓", "holds", "good"),
    "supported": ("✓", "supported", "good"),
    "not_exercised": ("∅", "not tested", "idle"),
    "declared": ("≈", "declared", "tuned"),
    "stuck": ("■", "stuck, as declared", "tuned"),
    "refuted": ("✗", "refuted", "bad"),
    "inconclusive": ("?", "inconclusive", "open"),
    "error": ("!", "error", "open"),
    "not_run": ("○", "not run", "open"),
    "reproduced": ("✓", "reproduced", "good"),
    "calibrated": ("≈", "calibrated", "tuned"),
    "by_construction": ("=", "by construction", "tuned"),
    "ambiguous": ("?", "ambiguous", "open"),
    "not_reproduced": ("✗", "not reproduced", "bad"),
    "no_way": ("?", "no way found", "open"),
    "demonstrated": ("✓", "demonstrated", "good"),
    "not_demonstrated": ("✗", "not demonstrated", "bad"),
}
MAX_ROWS, MAX_COLUMNS, MAX_CELL_CHARS = 40, 10, 200  # maximum size of a table; report.json has all of it


def page(report: Report, figures: Sequence[Figure], diagram_svg: str | None = None) -> str:
    # figures: those of the runs, as drawn by `figures.draw`; charts of claims and of findings are added here.
    # diagram_svg: the block diagram; left out if it is no SVG or too large to inline.
    every = [*figures, *_of_claims(report), *findings.draw([finding.model_dump() for finding in report.audit])]
    distances = [(name, pair) for name, run in report.runs.items() for pair in run.pairs()]
    distances.sort(key=lambda named: named[1].margin_m)
    plates = grouped((figure.beside or PLACES.get(figure.id, "happened"), figure) for figure in every)
    diagram = _diagram(diagram_svg, report.scenario.name)
    resting = grouped(dict.fromkeys((assumed, claim.id) for claim in report.claims for assumed in claim.assumptions))
    sections = {
        "happened": bool(report.runs),
        "safe": bool(distances),
        "intervened": "intervened" in plates or any(run.metrics.messages for run in report.runs.values()),
        "reproduction": bool(report.reproduction),
        "choices": bool(report.choices),
        "audit": bool(report.audit),
        "diagram": bool(diagram),
    }
    return environment().get_template("report.html.j2").render(
        report=report,
        resolved=report.scenario.resolved.data(),
        first=first_screen(report),
        linked={name: words for name, words in LINKS.items() if sections.get(name, True)},
        sections=[(name, title) for name, title in SECTIONS.items() if sections.get(name, True)],
        plates=plates,
        diagram=diagram,
        groups=_by_claim(report.claims),
        outcomes=list(dict.fromkeys(map(_shown, report.claims))),
        attention=attention.items(report),
        assumptions=dict(sorted(resting.items(), key=lambda item: -len(item[1]))),
        distances=distances[:MAX_DISTANCE_ROWS],
        left_out=max(0, len(distances) - MAX_DISTANCE_ROWS),
    )  # fmt: skip


def render_beside(template: str, **content: Any) -> str:
    """A page beside the report, without scripts, from a template of this package."""
    policy = Markup(security_policy(stylesheet()))
    return environment().get_template(template).render(policy=policy, script="", **content)


@cache
def environment() -> Environment:
    environment = environment_of("airground_drake.report")
    style = stylesheet()
    script = _template(SCRIPT)
    environment.filters.update(
        num=number, as_text=as_text, yaml=as_yaml, together=attention.faults_together, inline=Markup, mathml=mathml,
        evidence=evidence_tables, proof=place, records=tables, unbroken=unbroken,
    )  # fmt: skip
    environment.globals.update(
        chips=CHIPS, shown=_shown, reasons=WORDS, max_faults=MAX_FAULTS, max_interventions=MAX_INTERVENTIONS,
        marks=MARKS, rules=rules,
        policy=Markup(security_policy(style, script)), style=Markup(style), script=Markup(script),
    )  # fmt: skip
    return environment


def _shown(claim: Claim) -> str:
    """The chip of a claim, a key of `CHIPS`: its outcome, or the kind of its evidence."""
    kind = claim.evidence.get("kind")
    return kind if kind in KINDS and claim.status in PASSING else outcome(claim.status, claim.exercised)


def stylesheet() -> str:
    # The last rules recolour drawings on a dark page; they name no ancestor, which would not match inside <use>.
    dark = "\n".join(
        f'[{name}="{light}"] {{ {name}: {dark}; }}'
        for light, dark in canvas.DARK.items()
        for name in ("fill", "stroke")
    )
    text = f"svg text:not([fill]) {{ fill: {canvas.DARK['black']}; }}"
    return f"{_template(STYLE)}@media screen and (prefers-color-scheme: dark) {{\n{dark}\n{text}\n}}\n"


def _template(name: str) -> str:
    return resources.files(__package__).joinpath("templates", name).read_text(encoding="utf-8")


def security_policy(style: str, script: str = "") -> str:
    """A page's content security policy, which admits only this style sheet and this script."""
    return (
        f"default-src 'none'; style-src {digest(style)}; script-src {digest(script) if script else NOTHING}; "
        "base-uri 'none'; form-action 'none'"
    )


def digest(text: str) -> str:
    """A script or style sheet as a content security policy names it."""
    return f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'"


def evidence_tables(claim: Claim) -> list[Table]:
    on = f", run {claim.run}" if claim.run else ""
    return [
        *tables(claim.counterexample or {}, f"{claim.id}, counterexample{on}"),
        *tables(claim.evidence, f"{claim.id}, evidence{on}"),
    ]


def as_yaml(x: Any) -> str:
    """A scenario as YAML, truncated; non-ASCII is escaped, so that nothing changes the writing direction."""
    text: str = yaml.safe_dump(x, default_flow_style=None, sort_keys=False, width=LINE_CHARS)
    cut = "\n… cut here; report.json has all of it" if len(text) > MAX_SCENARIO_CHARS else ""
    return text[:MAX_SCENARIO_CHARS] + cut


def _diagram(source: str | None, name: str) -> str | None:
    if source is None or len(source) > MAX_DIAGRAM_CHARS:
        return None
    try:
        return svg.inline(
            source, "diagram", f"Block diagram of {name}", "The systems of the simulation and their connections.",
            natural_size=True,
        )  # fmt: skip
    except ValueError:
        return None


def _by_claim(claims: Sequence[Claim]) -> list[dict[str, Any]]:
    """Claims of the same identifier together, those with a deviation first."""
    groups = [
        {
            "id": name,
            "claims": members,
            "fine": all(claim.as_expected is not False for claim in members),
            "settled": all(claim.as_expected and claim.status in PASSING and not claim.run for claim in members),
            "verdicts": _together(members),
        }
        for name, members in grouped((claim.id, claim) for claim in claims).items()
    ]
    return sorted(groups, key=lambda group: bool(group["fine"]))


def _together(members: Sequence[Claim]) -> list[tuple[Claim, str]]:
    """Equal verdicts of a claim with their runs; "all 3" if three runs have the same."""
    runs = sum(bool(claim.run) for claim in members)
    alike = grouped(((_shown(claim), claim.as_expected or claim.expected), claim) for claim in members)
    names = [(those[0], [claim.run for claim in those if claim.run]) for those in alike.values()]
    return [(claim, f"all {runs}" if len(where) == runs > 1 else ", ".join(where)) for claim, where in names]


def _of_claims(report: Report) -> Iterator[Figure]:
    """The charts of claims, where `rules.CHARTS` puts them, or else beside the claim."""
    places = {*SECTIONS, *(f"audit-{finding.id}" for finding in report.audit)}
    with canvas.style():
        for number, claim in enumerate(report.claims):
            if claim.figure:
                place = rules.CHARTS.get(claim.id)
                beside = place if place in places else claim.id
                heading = claim.run and f"Run {claim.run}"
                yield of_chart(Chart(**claim.figure), f"chart-{number}", heading, beside)


@cache
def mathml(latex: str) -> Markup:
    """A formula as a block of MathML; a formula that the library cannot typeset is shown as it is written."""
    # The library does not escape text, and a third-party claim may contain anything: `ET` writes the elements.
    # latex: one row, without delimiters; a formula of several rows is given as several.
    try:
        root = convert_to_element(latex, display="block")
    except Exception:  # the library has an exception for each mistake, without a common base
        return Markup("<code>{}</code>").format(escape(latex))
    for element in root.iter():
        if element.tag == "mover":
            element.set("accent", "true")  # a dot over a letter keeps its size
        element.text = unescape(element.text or "") or None
        for name in ("href", "style"):
            element.attrib.pop(name, None)
    return Markup(ET.tostring(root, encoding="unicode"))


def tables(evidence: Mapping[str, Any], caption: str) -> list[Table]:
    single = {key: value for key, value in evidence.items() if not _records(value)}
    rows = tuple((in_words(key), _cell(value)) for key, value in single.items())
    made = [Table(caption, ("quantity", "value"), rows[:MAX_ROWS])] if rows else []
    for key, value in evidence.items():
        if records := _records(value):
            made.append(_table(f"{caption}: {in_words(key)}", records))
    return made


def _records(value: Any) -> list[tuple[str, Mapping[str, Any]]]:
    """The records in a list, by number, or in a record, by key; empty if the value is neither."""
    items = value.items() if isinstance(value, Mapping) else enumerate(value, 1) if isinstance(value, list) else ()
    records = [(str(key), record) for key, record in items]
    return records if all(isinstance(record, Mapping) and record for _, record in records) else []


def _table(caption: str, records: Sequence[tuple[str, Mapping[str, Any]]]) -> Table:
    keys = list(dict.fromkeys(key for _, record in records for key in record))
    shown, left_out = keys[:MAX_COLUMNS], len(keys) - MAX_COLUMNS
    rows = tuple((head, *(_cell(record[key]) if key in record else "" for key in shown)) for head, record in records)
    more = [f"{len(rows) - MAX_ROWS} more rows"] if len(rows) > MAX_ROWS else []
    if left_out > 0:
        more.append(f"{left_out} more columns")
    note = f" ({', '.join(more)} in report.json)" if more else ""
    return Table(f"{caption}{note}", ("", *map(in_words, shown)), rows[:MAX_ROWS])


def in_words(key: str) -> str:
    """The name and the unit in a key, in one text: "min distance, m"."""
    return ", ".join(filter(None, split(key)))


def _cell(value: Any) -> str:
    text = as_text(value)
    return text if len(text) <= MAX_CELL_CHARS else f"{text[:MAX_CELL_CHARS]}…"


def environment_of(*packages: str) -> Environment:
    """An environment for the templates of these packages: it escapes every value and refuses undefined names."""
    return Environment(
        loader=ChoiceLoader([PackageLoader(package) for package in packages]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
