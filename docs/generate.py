"""The parts of the documentation that are generated from the code.

`python docs/generate.py` writes what is committed; `docs/site.py` puts the rest into the site.
"""

from __future__ import annotations

import argparse
import html
import inspect
import re
import runpy
import textwrap
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import get_args

from airground_drake import load, simulate
from airground_drake.base import files
from airground_drake.base.registry import (
    METHODS,
    MODEL_CLAIMS,
    POLICIES,
    ROUTES,
    RUN_CLAIMS,
    SAMPLERS,
    UAV_TASKS,
    Registry,
    parameters,
)
from airground_drake.commands import COMMANDS
from airground_drake.report.view.plane import thumbnail_of
from airground_drake.scenario import json_schema
from airground_drake.scenario.keys import sections
from airground_drake.scenario.shipped import shipped
from airground_drake.sim import graphviz
from airground_drake.sim.diagram import build_diagram, method_drawn
from airground_drake.verify.claim import Claim
from airground_drake.verify.proofs import THEOREMS, runs

DOCS = Path(__file__).parent
EXAMPLES = DOCS.parent / "examples"
WIDTH = 120

_PAPER = runpy.run_path(str(DOCS / "equations.py"))
DEVIATIONS, KINDS = _PAPER["DEVIATIONS"], get_args(_PAPER["Kind"])
EQUATIONS = {row.place[1:-1] for row in DEVIATIONS if row.place.startswith("(")}
"""Numbers of the paper's equations."""

REGISTRIES = {
    "Policies": POLICIES, "Routes": ROUTES, "Tasks of the UAV": UAV_TASKS, "Samplers of `airground falsify`": SAMPLERS,
}  # fmt: skip

SCENARIO = json_schema.scenario_schema(installed=False)

_RECIPE = re.compile(r"```(?P<language>\w+)\n# file: (?P<name>\S+)\n.*?```", re.DOTALL)
_NUMBER = re.compile(r"(?<!` )(?<![\w\]])\((\d{1,2})[a-e]?\)(?:-\((\d{1,2})[a-e]?\))?")


def main() -> None:
    """Write the generated files that are committed and not current."""
    for name, text in (pages() | diagrams()).items():
        path = DOCS / name
        if not (path.exists() and graphviz.is_current(name, text, path.read_text(encoding="utf-8"))):
            files.write_text(path, text)


def pages() -> dict[str, str]:
    """Committed files that follow from the code, by name."""
    schema = json_schema.text(installed=False)
    return {
        "extending.md": extending(),
        "names.md": names(),
        "../airground_drake/scenario/shipped/scenario.schema.json": schema,
    }


def diagrams() -> dict[str, str]:
    """The block diagrams of the paper's two cases, as reports show them, by name."""
    content: dict[str, str] = {}
    for name in ("case_a", "case_b"):
        scenario = load(name)
        text = graphviz.dot(build_diagram(scenario, method_drawn(scenario)))
        content |= {f"../diagrams/{name}.dot": text, f"../diagrams/{name}.svg": graphviz.svg(text)}
    return content


def parts() -> dict[str, Callable[[], str]]:
    """What the site puts in the place of marks such as `<!-- claims: made when the site is built -->`, by name."""
    return {
        "claims": claims, "commands": commands, "equations": equations, "theorems": theorems,
    }  # fmt: skip


def gallery(scenarios: Sequence[str] = ()) -> str:
    """What each of some scenarios (default: all) shows, pictures of its first and last run, and the command."""
    lines = [
        "# Gallery",
        "",
        "The shipped scenarios, each with the paths of its first and of its last run. A line is the way of a UGV and "
        "begins in a ring, a cross is its target, grey is an obstacle in its safe circle.",
    ]
    for name in scenarios or shipped():
        scenario = load(name)
        runs = [run for run, spec in scenario.runs.items() if spec.composition == "augmented"]
        lines += ["", f"## {html.escape(scenario.title or name, quote=False)}", "", '<div class="gallery">']
        for run in dict.fromkeys((runs[0], runs[-1])):
            drawn = thumbnail_of(simulate(scenario, run, engine="batch"), f"{name}-{run}")
            says = METHODS[scenario.runs[run].method].says
            lines.append(f"<figure>{drawn}<figcaption>Run {run}: {says}</figcaption></figure>")
        lines += ["</div>", "", f"    airground report {name}"]
    return "\n".join([*lines, ""])


def extending() -> str:
    """The page as it is, with the files of examples/ in its blocks that begin `# file: name`."""

    def as_it_is(block: re.Match[str]) -> str:
        text = (EXAMPLES / block["name"]).read_text(encoding="utf-8")
        return f"```{block['language']}\n# file: {block['name']}\n{text}```"

    return _RECIPE.sub(as_it_is, (DOCS / "extending.md").read_text(encoding="utf-8"))


def theorems() -> str:
    """Each theorem: its statement, its hypotheses, and the claims that check these."""
    lines, file = [], ""
    checks = {"airground prove DIR": runs.THEOREMS, **{name: claim.theorems for name, claim in _claims()}}
    for name, theorem in THEOREMS.items():
        if file != (file := name.partition(".")[0]):
            lines += ["", f"### {file}", ""]
        checked_by = [where for where, theorems in checks.items() if {name, file} & {*theorems}]
        takes = f" *Takes:* {' '.join(theorem.hypotheses)}" if theorem.hypotheses else ""
        where = f" *Checked by:* {', '.join(checked_by)}." if theorem.hypotheses else ""
        about = "" if theorem.equation == "ours" else f", {theorem.equation}"
        lines.append(f"- **`{name}`**{about}: {theorem.statement}{takes}{where}")
    return "\n".join(lines)


def equations() -> str:
    """What has become of each place of the paper: code, deviation and its reason, findings and claims."""
    claimed = defaultdict(list)
    for name, claim in _claims():
        for number in _numbers(claim.equations):
            claimed[f"({number})"].append(f"[{name}](claims.md#{name.lower()})")
    lines = []
    for kind in KINDS:
        places = "; ".join(row.place for row in DEVIATIONS if row.kind == kind)
        lines += [f"- **{kind}**: {places}."]
    for row in DEVIATIONS:
        lines += ["", f"### {row.place}: {row.says}", "", f"**{row.kind.capitalize()}.** {row.here}".rstrip()]
        lines += ["", f"*Why:* {row.why}"] * bool(row.why)
        entries = {
            "code": [f"`{place.replace(':', '.')}`" for place in row.realised_in],
            "findings": [f"[{number}](#findings)" for number in row.findings],
            "claims": claimed[row.place],
        }
        told = [f"- {what}: {', '.join(found)}" for what, found in entries.items() if found]
        lines += ["", *told] if told else []
    return "\n".join(lines)


def _numbers(text: str) -> list[str]:
    """Equation numbers in a text, ranges expanded."""
    found: list[str] = []
    for first, last in _NUMBER.findall(text):
        found += [str(number) for number in range(int(first), int(last or first) + 1)]
    return [number for number in dict.fromkeys(found) if number in EQUATIONS]


def _claims() -> Iterator[tuple[str, type[Claim]]]:
    for registry in (MODEL_CLAIMS, RUN_CLAIMS):
        for name in registry.own:
            yield name, registry.load(name, of=Claim)


def claims() -> str:
    """What every claim says of itself."""
    lines = []
    for name, claim in _claims():
        about = "the model" if name in MODEL_CLAIMS.own else "a run"
        lines += [
            f"## {name}",
            "",
            f"About {about}; usually `{claim.expected}`. Equations: {claim.equations}. "
            f"Code: `{claim.__module__.removeprefix('airground_drake.')}`.",
            "",
            f"**{claim.summary}** {claim.statement}",
            "",
            *(line for row in claim.latex for line in (f"$${row}$$", "")),
            f"*Decided by:* {claim.method}",
            "",
            "*Assumes:*",
            "",
            *(f"- {assumption}" for assumption in claim.assumptions),
            "",
            f"*Exercised by:* {claim.exercised_by}.",
            "",
            f"*Does not establish:* {claim.does_not_establish}",
            "",
        ]
    return "\n".join(lines)


def commands() -> str:
    """What every command takes."""
    lines = []
    for name, command in COMMANDS.items():
        parser = import_module(command.module).parser()
        lines += [f"### {name}", "", f"`{parser.prog}`: {parser.description}", ""]
        for action in parser._actions:  # argparse gives them in no other way, but as text as wide as the terminal
            if not isinstance(action, argparse._HelpAction):
                lines.append(f"- {_argument(action)}: {html.escape((action.help or '') % vars(action), quote=False)}.")
        said = (parser.epilog or "").splitlines()
        if len(said) == 1:
            said = [f"{said[0][:1].upper()}{said[0][1:].removesuffix('.')}."]
        else:
            said = ["Its help goes on:", "", *(f"    {line}" for line in said)] if said else []
        lines += ["", *said, ""] if said else [""]
    return "\n".join(lines)


def _argument(action: argparse.Action) -> str:
    """An argument or option, as on a command line."""
    choices = "{" + ",".join(map(str, action.choices)) + "}" if action.choices else ""
    value = action.metavar or choices or (action.dest.upper() if action.option_strings else action.dest)
    if not action.option_strings:
        return f"`{value}`"
    takes = f" {value}" if action.nargs != 0 else ""
    return ", ".join(f"`{option}{takes}`" for option in action.option_strings)


def names() -> str:
    """The page of all names: keys, methods, policies and the like with their parameters, claims."""
    lines = [
        "# Names", "",
        *wrapped(
            "What a scenario may name: made from the code by `python docs/generate.py`. `airground list` prints it "
            "with what installed packages add, such as `airground list policies coordinate` and "
            "`airground list keys control`."
        ), "",
        "## Keys of a scenario file", "",
        *wrapped("NAME stands for a name of your own, N for the number of an item. A unit is in brackets."), "",
        *keys(),
        "## Methods", "", *(f"- `{method.id}`: {method.says}" for method in METHODS.values()), "",
    ]  # fmt: skip
    for title, registry in REGISTRIES.items():
        lines += [f"## {title}", ""]
        for name in registry.own:
            lines += wrapped(_entry(registry, name))
        lines.append("")
    lines += ["## Claims", "", *wrapped("[Claims](claims.md) has what each assumes and does not establish."), ""]
    for name, claim in _claims():
        about = "the model" if name in MODEL_CLAIMS.own else "a run"
        lines += wrapped(f"- `{name}` (about {about}): {claim.summary}")
    return "\n".join([*lines, ""])


def _entry(registry: Registry, name: str) -> str:
    kind = registry.load(name, of=object)
    says = " ".join((inspect.getdoc(kind) or "").split("\n\n")[0].split())
    given = parameters(kind)
    return f"- `{name}`: {says}" + (f" Parameters: {', '.join(f'`{each}`' for each in given)}." if given else "")


def keys() -> Iterator[str]:
    """Every key of a scenario file."""
    for section in sections(SCENARIO):
        yield from (f"### {section.title or 'The file'}", "", *wrapped(section.says), "")
        for entry in section.entries:
            yield from wrapped(f"- `{entry.key}` ({entry.allowed}): {entry.says}")
        yield ""


def wrapped(text: str) -> list[str]:
    """A paragraph or an item of a list, in lines."""
    return textwrap.wrap(text, WIDTH, subsequent_indent="  " * text.startswith("- "), break_on_hyphens=False)


if __name__ == "__main__":
    main()
