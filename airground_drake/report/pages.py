"""Pages beside the report, with its style sheet: one offline file each, no script, everything from reports escaped."""

from __future__ import annotations

from functools import cache
from typing import Any

from jinja2 import Environment
from markupsafe import Markup

from airground_drake.report.compare import is_rounding
from airground_drake.report.html import CHIPS, number, security_policy, stylesheet
from airground_drake.report.templating import environment_of


def render(template: str, **content: Any) -> str:
    """A page from a template of this package."""
    return _environment().get_template(template).render(**content)


@cache
def _environment() -> Environment:
    environment = environment_of("airground_drake.report")
    environment.filters.update(num=number, inline=Markup, shown=shown)
    environment.tests["rounding"] = is_rounding
    style = stylesheet()
    environment.globals.update(chips=CHIPS, style=Markup(style), policy=Markup(security_policy(style)))
    return environment


def shown(value: Any) -> str:
    """What a change has on one side, for reading."""
    if isinstance(value, dict):
        return ", ".join(f"{name} {shown(item)}" for name, item in value.items())
    if isinstance(value, list):
        return f"({', '.join(map(shown, value))})"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return number(value, 6) if isinstance(value, int | float) else str(value or "none").replace("_", " ")
