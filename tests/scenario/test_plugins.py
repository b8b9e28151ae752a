"""What of a scenario is third-party code."""

import sys
from pathlib import Path
from textwrap import dedent

import pytest

from airground_drake.base.errors import PluginError, ScenarioError
from airground_drake.base.registry import POLICIES, ROUTES, is_plugin
from airground_drake.scenario.load import load
from airground_drake.scenario.plugins import admitted, plugins, refuse, without
from airground_drake.scenario.schema import Policy, Scenario
from airground_drake.scenario.shipped import shipped_files
from airground_drake.sim import graphviz
from airground_drake.sim.diagram import build_diagram
from airground_drake.sim.runs import simulate_all
from airground_drake.uav import policy
from airground_drake.verify import judge


def test_all_that_can_be_named_is_looked_at(case_a: Scenario) -> None:
    refuse(case_a, "case_a")
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


BESIDE = {
    "tricks.py": """
        from beside_helper import MOVED
        from airground_drake.uav.policy import Policy
        class Mine(Policy):
            def propose(self, seen):
                raise ValueError(f"asked beside, {MOVED}")
    """,
    "beside_helper.py": """
        from airground_drake.ugv.solution import Solution
        from airground_drake.model.law.tasks import FormationTask
        MOVED = "imported beside"
        class Route:
            def solve(self, problem, budget):
                return Solution(False, "refused_not_finite")
        class Task(FormationTask):
            pass
    """,
    "claims/own.py": """
        from airground_drake.verify.claim import TraceClaim
        from airground_drake.verify.finding import Finding
        class Own(TraceClaim):
            id, statement, formula, method, equations = "OWN", "It holds.", "1", "None.", "none"
            assumptions, does_not_establish, exercised_by = (), "Anything.", "things"
            def check(self, trace):
                return Finding("holds", exercised=len(trace.t))
    """,
}


def test_code_of_others_is_found_beside_the_scenario_file_wherever_it_runs(tmp_path: Path) -> None:
    for name, text in BESIDE.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(dedent(text))
    file = tmp_path / "mine.yaml"
    file.write_text(shipped_files()["minimal"].read_text())
    changes = {
        "uav.task": "beside_helper:Task",
        "gatekeeper.route": "beside_helper.py:Route",
        "intervention.policies": [{"name": "tricks.py:Mine"}],
        "claims": {"OWN": "claims/own.py:Own"},
        "runs": {"c": {"method": "c"}, "d": {"method": "d"}},
        "duration_s": 6.0,
        "decision.threshold.zeta_m": 0.5,
        "decision.release_m": 0.2,
    }
    scenario = load(file, changes)
    before = list(sys.path)
    with admitted(scenario, str(file), allow=True):
        trace = simulate_all(scenario)["d"]
        assert [verdict.status for verdict in judge(trace, ["OWN"])] == ["holds"]
        twice = [POLICIES.load("tricks.py:Mine", of=policy.Policy) for _ in range(2)]
        assert twice[0] is twice[1]
    assert sys.path == before
    assert {fault["what"] for fault in trace.meta["faults"]} == {
        "tricks.py:6 ValueError: asked beside, imported beside"
    }


def test_what_is_not_found_says_where_it_was_looked_for(case_a: Scenario, tmp_path: Path) -> None:
    file, before = tmp_path / "mine.yaml", list(sys.path)
    file.touch()
    with admitted(case_a, str(file), allow=False):
        assert sys.path == before
    case_a.intervention.policies[0].name = "no/such-file.py:It"
    with admitted(case_a, str(file), allow=True):
        with pytest.raises(PluginError, match=f"looked in {tmp_path}, .*Python's own folders$"):
            ROUTES.load("no_such_module:It", of=object)
        with pytest.raises(PluginError, match=f"looked in {tmp_path}"):
            simulate_all(case_a)
    with pytest.raises(ScenarioError, match="--allow-plugins"), admitted(case_a, str(file), allow=False):
        pytest.fail("admitted")


@pytest.mark.parametrize("name", ["../x.py:It", "/x.py:It", "a//x.py:It", "x.py:", "a b:x", "a:x:y", ":x", "a:x()"])
def test_what_is_no_module_or_file_below_a_folder_of_the_path_names_no_code(name: str) -> None:
    assert not is_plugin(name)


def test_the_diagram_without_it_is_the_same(case_a: Scenario) -> None:
    drawn = graphviz.dot(build_diagram(case_a))
    case_a.uav.task, case_a.gatekeeper.route = "no_such:Task", "no_such:Route"
    case_a.intervention.policies[0].name = "no_such:Policy"
    assert graphviz.dot(build_diagram(without(case_a))) == drawn
