"""Pages beside the report, with its style sheet: one offline file each, no script, everything from reports escaped."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from airground_drake.report.html import environment, security_policy, stylesheet


def render(template: str, **content: Any) -> str:
    """A page from a template of this package."""
    policy = Markup(security_policy(stylesheet()))
    return environment().get_template(template).render(policy=policy, scripts=(), **content)
