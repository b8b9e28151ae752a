"""What of a scenario is code of others."""

from __future__ import annotations

import pytest

from airground_drake import graphviz
from airground_drake.diagram import build_diagram
from airground_drake.errors import ScenarioError
from airground_drake.scenarios.plugins import plugins, refuse, without
from airground_drake.scenarios.schema import Policy, Scenario


def test_what_is_registered_is_none(case_a: Scenario) -> None:
    assert plugins(case_a) == {}
    refuse(case_a, "case_a")


def test_all_that_can_be_named_is_looked_at(case_a: Scenario) -> None:
    case_a.uav.task, case_a.gatekeeper.route, case_a.claims = "m:Task", "m:Route", {"MINE": "m:Claim"}
    case_a.intervention.policies.append(Policy("m:Policy"))
    assert plugins(case_a) == {
        "uav.task": "m:Task",
        "gatekeeper.route": "m:Route",
        "intervention.policies.1.name": "m:Policy",
        "claims.MINE": "m:Claim",
    }
    with pytest.raises(ScenarioError, match=r"^mine.yaml: uav.task: 'm:Task' is not allowed; .* --allow-plugins$"):
        refuse(case_a, "mine.yaml")
    refuse(case_a, "mine.yaml", keys=[])


def test_the_diagram_without_it_is_the_same(case_a: Scenario) -> None:
    drawn = graphviz.dot(build_diagram(case_a))
    case_a.uav.task, case_a.gatekeeper.route = "no_such:Task", "no_such:Route"
    case_a.intervention.policies[0].name = "no_such:Policy"
    assert graphviz.dot(build_diagram(without(case_a))) == drawn
