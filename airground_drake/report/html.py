"""report.html: one self-contained page that renders report.json, the figures and the diagram.

Its content security policy admits its own style sheet and scripts, by their digests, and nothing else; without scripts
it has everything but the filter of claims and the marks that move over the trajectories.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from functools import cache, partial
from hashlib import sha256
from importlib import resources
from typing import Any

import yaml
from jinja2 import Environment
from markupsafe import Markup

from airground_drake.base.statuses import PASSING, outcome
from airground_drake.report import attention, evidence, summary
from airground_drake.report.compare import is_rounding
from airground_drake.report.figures import svg
from airground_drake.report.figures.canvas import DARK
from airground_drake.report.figures.panels import Figure, Table
from airground_drake.report.mathml import mathml
from airground_drake.report.proved import place
from airground_drake.report.reproduction import YES_NO
from airground_drake.report.templating import environment_of

STYLE, SCRIPTS = "report.css", ("report.js", "scrubber.js")
"""The style sheet and the scripts of the page, among the templates."""
NOTHING = "'none'"
"""In a content security policy: no source at all."""
MAX_DIAGRAM_CHARS = 500_000
MAX_SCENARIO_CHARS = 20_000
LINE_CHARS = 110
KINDS = ("declared", "stuck")
"""Evidence of these kinds is shown instead of the verdict where that passes: it must not look like more than it is."""
MAX_DISTANCE_ROWS = 120
MAX_FAULTS = 40
"""Different ones of a run that are listed."""

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
"""Sections of the page, in order, by their identifiers; what has nothing to say is left out."""
PLACES = {"distances": "safe", **dict.fromkeys(("decision", "events", "threshold-choice"), "intervened")}
"""Sections of the figures; the others are maps of what happened."""
LOOKS = {"yes": "good", "partly": "tuned", "no": "bad", "open": "open", "none": "idle"}
"""Class of each mark of the first screen, which sets its colour: never by colour alone."""

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
    "demonstrated": ("✓", "demonstrated", "good"),
    "not_demonstrated": ("✗", "not demonstrated", "bad"),
}
"""How a status is shown: icon, word, class (which sets the colour): never by colour alone."""


def render(document: Mapping[str, Any], figures: Sequence[Figure], diagram_svg: str | None = None) -> str:
    """The page.

    Args:
        document: report.json, as built by `document.build`.
        figures: as drawn by `figures.draw` and the like, in the order of the page.
        diagram_svg: the exported block diagram; left out if it is not an SVG or too large to inline.
    """
    distances = _distances(document["runs"])
    claims = document["claims"]
    plates: dict[str, list[Figure]] = {}
    beside: dict[str, list[Figure]] = {}
    for figure in figures:
        if figure.beside:
            beside.setdefault(figure.beside, []).append(figure)
        else:
            plates.setdefault(PLACES.get(figure.id, "happened"), []).append(figure)
    diagram = _diagram(diagram_svg, str(document["scenario"]["name"]))
    sections = {
        "happened": bool(document["runs"]),
        "safe": bool(distances),
        "intervened": "intervened" in plates or any(r["metrics"]["gatekeeper"] for r in document["runs"].values()),
        "reproduction": bool(document["reproduction"]),
        "choices": bool(document["choices"]),
        "audit": bool(document["audit"]),
        "diagram": bool(diagram),
    }
    return environment().get_template("report.html.j2").render(
        report=document,
        headline=summary.headline(document),
        answers=summary.answers(document),
        methods=summary.methods(document),
        required=summary.required_m(document),
        beware=summary.do_not_conclude(document),
        declared=summary.as_declared(document),
        legend=summary.legend(document),
        sections=[(name, title) for name, title in SECTIONS.items() if sections.get(name, True)],
        plates=plates,
        beside=beside,
        diagram=diagram,
        groups=_by_claim(claims),
        outcomes=list(dict.fromkeys(map(_shown, claims))),
        attention=attention.items(document),
        assumptions=_assumptions(claims),
        distances=sorted(distances, key=lambda row: float(row["margin"]))[:MAX_DISTANCE_ROWS],
        left_out=max(0, len(distances) - MAX_DISTANCE_ROWS),
    )  # fmt: skip


@cache
def environment() -> Environment:
    """The environment of the report's page and of those beside it."""
    environment = environment_of("airground_drake.report")
    style = stylesheet()
    scripts = [_template(name) for name in SCRIPTS]
    environment.filters.update(
        num=number, value=value, yaml=as_yaml, together=attention.faults_together, inline=Markup, mathml=mathml,
        evidence=evidence_tables, proof=place, records=partial(evidence.tables, number=number), brief=brief,
        shown=shown,
    )  # fmt: skip
    environment.tests["rounding"] = is_rounding
    environment.globals.update(
        chips=CHIPS, shown=_shown, refused=attention.REFUSED, max_faults=MAX_FAULTS,
        marks=summary.MARKS, kinds=LOOKS, names=summary.MEANINGS,
        policy=Markup(security_policy(style, scripts)), style=Markup(style), scripts=list(map(Markup, scripts)),
    )  # fmt: skip
    return environment


def _shown(claim: Mapping[str, Any]) -> str:
    """What is shown of a claim, a key of `CHIPS`: its outcome, or the kind of its evidence."""
    kind = claim["evidence"].get("kind")
    return kind if kind in KINDS and claim["status"] in PASSING else outcome(claim["status"], claim["exercised"])


def stylesheet() -> str:
    """The style sheet of all pages."""
    return _template(STYLE) + _in_the_dark()


def _template(name: str) -> str:
    """The text of a file among the templates."""
    return resources.files(__package__).joinpath("templates", name).read_text(encoding="utf-8")


def security_policy(style: str, scripts: Sequence[str] = ()) -> str:
    """A page's content security policy: nothing but this style sheet and these scripts, from nowhere else."""
    return (
        f"default-src 'none'; style-src {digest(style)}; script-src {' '.join(map(digest, scripts)) or NOTHING}; "
        "base-uri 'none'; form-action 'none'"
    )


def digest(text: str) -> str:
    """A script or style sheet as a content security policy names it."""
    return f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'"


def _in_the_dark() -> str:
    """Rules that give the drawings other colours on a dark page; an ancestor in a selector is not seen from <use>."""
    rules = "\n".join(
        f'[{name}="{light}"] {{ {name}: {dark}; }}' for light, dark in DARK.items() for name in ("fill", "stroke")
    )
    text = f"svg text:not([fill]) {{ fill: {DARK['black']}; }}"
    return f"@media screen and (prefers-color-scheme: dark) {{\n{rules}\n{text}\n}}\n"


def evidence_tables(claim: Mapping[str, Any]) -> list[Table]:
    """Counterexample and evidence of a claim as tables."""
    on = f", run {claim['run']}" if claim["run"] else ""
    return [
        *evidence.tables(claim["counterexample"] or {}, f"{claim['id']}, counterexample{on}", number),
        *evidence.tables(claim["evidence"], f"{claim['id']}, evidence{on}", number),
    ]


def number(x: Any, digits: int = 4) -> str:
    """A number for reading, a dash for none."""
    if x is None:
        return "\N{EN DASH}"
    if isinstance(x, bool) or not isinstance(x, (int, float)):
        return str(x)
    if isinstance(x, int) or (x == int(x) and abs(x) < 1e6):
        return str(int(x))
    return f"{x:.{digits}g}".replace("-", "\N{MINUS SIGN}")


def value(x: Any, unit: str = "") -> str:
    """A quantity of the reproduction table: a number, a vector or yes/no, with its unit."""
    if x is None:
        return "no value"
    if unit == YES_NO:
        return "yes" if x else "no"
    text = f"({', '.join(number(each) for each in x)})" if isinstance(x, list) else number(x)
    return f"{text} {unit}".strip()


def brief(x: Any, unit: str = "") -> str:
    """A finding about the paper in a line: numbers with their units, named where there are several."""
    if isinstance(x, Mapping):
        return "; ".join(
            f"{name} {brief(item, of or unit)}" for key, item in x.items() for name, of in [evidence.split(key)]
        )
    if isinstance(x, list):
        return ", ".join(brief(item, unit) for item in x)
    if isinstance(x, bool):
        return "yes" if x else "no"
    return f"{number(x, 5)} {unit}".strip() if isinstance(x, int | float) else str(x)


def shown(x: Any) -> str:
    """What a change between two reports has on one side, for reading."""
    if isinstance(x, dict):
        return ", ".join(f"{name} {shown(item)}" for name, item in x.items())
    if isinstance(x, list):
        return f"({', '.join(map(shown, x))})"
    if isinstance(x, bool):
        return "yes" if x else "no"
    return number(x, 6) if isinstance(x, int | float) else str(x or "none").replace("_", " ")


def as_yaml(x: Any) -> str:
    """A scenario for reading; what is not ASCII is escaped, and so is what would turn or break lines."""
    text: str = yaml.safe_dump(x, default_flow_style=None, sort_keys=False, width=LINE_CHARS)
    return (
        text
        if len(text) <= MAX_SCENARIO_CHARS
        else f"{text[:MAX_SCENARIO_CHARS]}\n… cut here; report.json has all of it"
    )


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


def _by_claim(claims: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Claims of the same identifier together, those with a deviation first."""
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for claim in claims:
        groups.setdefault(claim["id"], []).append(claim)
    grouped = [
        {
            "id": name,
            "claims": members,
            "fine": all(claim["as_expected"] for claim in members),
            "settled": all(
                claim["as_expected"] and claim["status"] in PASSING and not claim["run"] for claim in members
            ),
            "verdicts": _together(members, sum(bool(claim["run"]) for claim in members)),
        }
        for name, members in groups.items()
    ]
    return sorted(grouped, key=lambda group: bool(group["fine"]))


def _together(members: Sequence[Mapping[str, Any]], runs: int) -> list[tuple[Mapping[str, Any], str]]:
    """Verdicts of a claim that are shown alike, each with its runs; all of them are several."""
    alike: dict[tuple[str, bool, str], tuple[Mapping[str, Any], list[str]]] = {}
    for claim in members:
        fine = bool(claim["as_expected"])
        key = _shown(claim), fine, "" if fine else str(claim["expected"])
        alike.setdefault(key, (claim, []))[1].extend(filter(None, [claim["run"]]))
    return [(claim, f"all {runs}" if len(names) == runs > 1 else ", ".join(names)) for claim, names in alike.values()]


def _assumptions(claims: Sequence[Mapping[str, Any]]) -> dict[str, list[str]]:
    """What is taken for granted, and by which claims; what most claims rest on first."""
    resting: dict[str, list[str]] = {}
    for claim in claims:
        for assumption in claim["assumptions"]:
            names = resting.setdefault(assumption, [])
            if claim["id"] not in names:
                names.append(claim["id"])
    return dict(sorted(resting.items(), key=lambda item: -len(item[1])))


def _distances(runs: Mapping[str, Mapping[str, Any]]) -> list[dict[str, Any]]:
    """All smallest distances, a row each with its margin."""
    return [
        {"run": run, "robot": robot, "other": other, "margin": found["value"] - found["safe_distance_m"], **found}
        for run, entry in runs.items()
        for kind in ("min_distance_m", "min_robot_distance_m")
        for robot, others in entry["metrics"][kind].items()
        for other, found in others.items()
    ]
