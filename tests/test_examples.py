"""The examples run, from a directory of their own, as somebody would run them who has installed the package."""

import importlib
import importlib.util
import json
import os
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import matplotlib as mpl
import numpy as np
import pytest

from airground_drake.check.command import checked
from airground_drake.check.line import AGREES
from airground_drake.report.__main__ import main
from airground_drake.report.model import of
from airground_drake.report.screen import first_screen
from airground_drake.scenario.load import load
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import load as load_trace
from airground_drake.verify.judging import judge

pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).parent.parent / "examples"
OPTIONS = ("-p", "airground_drake.study.testing.plugin", "-p", "no:cacheprovider", "--hypothesis-profile=ci")
"""Of pytest; the profile draws the same examples each time."""


def imported(name: str) -> ModuleType:
    specification = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def pytest_in(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTEST_", "HYPOTHESIS_"))}
    command = [sys.executable, "-m", "pytest", *OPTIONS, *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


FAILING = """
from airground_drake.study.testing import assert_holds

def test_goal(airground_trace):
    assert_holds(airground_trace("minimal", "a", set={"duration_s": 1.0}), "LIVE-GOAL")
"""


def test_the_tests_of_a_downstream_user_under_several_workers(tmp_path: Path) -> None:
    """All pass, each run is simulated once; one that fails says why, and its traceback ends in the user's test."""
    shutil.copytree(EXAMPLES / "downstream_tests", tmp_path / "mine", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "mine" / "test_goal.py").write_text(FAILING)
    done = pytest_in(tmp_path, "-n", "2", "--basetemp", str(tmp_path / "kept"), "mine")
    assert re.search(r"^=+ 1 failed, 8 passed in", done.stdout, re.MULTILINE), done.stdout + done.stderr
    made = [path.parent for path in (tmp_path / "kept" / "airground_traces").glob("*/meta.json")]
    assert sorted(path.name.rpartition("-")[0] for path in made) == ["depot-a", *4 * ["depot-d"], "minimal-a"]
    assert "LIVE-GOAL is refuted, on run a of minimal (method a, seed 0)" in done.stdout
    assert "value: tolerance left about where a robot must end: \N{MINUS SIGN}8.9" in done.stdout
    assert "_require" not in done.stdout


def test_the_notebook_runs_and_has_no_output_in_it() -> None:
    cells = json.loads((EXAMPLES / "first_steps.ipynb").read_text(encoding="utf-8"))["cells"]
    namespace: dict[str, object] = {"__name__": "notebook"}
    with mpl.rc_context({"backend": "agg"}):
        for cell in cells:
            if cell["cell_type"] == "code":
                assert cell["outputs"] == []
                exec(compile("".join(cell["source"]), cell["id"], "exec"), namespace)
    assert {"a", "d"} == set(namespace["runs"])  # type: ignore[call-overload]


PRINTED = {
    "run": "LIVE-GOAL: holds",
    "sweep": "2.5",
    "own_policy": "ugv1   arrival",
    "own_claim": "SLOW is refuted",
    "own_diagram": "triggered at 0.84806, 7.13125, 13.41443, 19.69762 s",
}
"""A part of what each short script prints."""


@pytest.mark.parametrize("name", PRINTED)
def test_a_short_script_shows_one_thing(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = EXAMPLES / f"{name}.py"
    assert len(path.read_text("utf-8").splitlines()) <= (70 if name == "own_diagram" else 40)  # with a block of its own
    runpy.run_path(str(path), run_name="__main__")
    assert PRINTED[name] in capsys.readouterr().out


def test_a_bicycle_keeps_its_distance_if_its_drift_is_declared(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the numbers of the documentation; with less, the run says that they do not hold."""
    monkeypatch.syspath_prepend(EXAMPLES)
    plant = {"kind": "my_robots/bicycle.py:Bicycle", "drift_m_s": 1.2, "cover_m": 0.21}
    settings = {"ugvs.ugv1.max_speed_m_s": 1.5, "control.sensing_range_m": 5.0, "runs.d.expected": {}}
    found = {}
    for drift in (1.2, 0.6):
        scenario = load("minimal", {**settings, "ugvs.ugv1.plant": {**plant, "drift_m_s": drift}})
        trace = simulate(scenario, "d")
        found[drift] = {verdict.claim.id: verdict.status for verdict in judge(trace)}
        assert trace.heading("ugv1") is not None
    assert set(found[1.2].values()) == {"holds"}
    assert found[0.6]["SAFE-HYP"] == "refuted"


def test_a_robot_on_wheels_holds_what_it_declares(tmp_path: Path) -> None:
    """A report of it, made headless: the UAV leads it round the shelf, and all of its claims are as declared."""
    options = ["-o", str(tmp_path / "report"), "--format", "json", "--allow-plugins"]
    assert main([str(EXAMPLES / "turtlebot" / "turtlebot.yaml"), *options]) == 0
    report = json.loads((tmp_path / "report" / "report.json").read_text())
    found = {(claim["id"], claim["run"]): claim["status"] for claim in report["claims"]}
    assert {found[claim, run] for claim in ("SAFE-TRACE", "SAFE-HYP") for run in "ad"} == {"holds"}
    assert found["SAFE-BUDGET", ""] == "proved"
    assert [*report["provenance"]["third_party"]] == ["turtlebot.py:TurtleBot"]
    trace = load_trace(tmp_path / "report" / "trace" / "d")
    assert 0.01 < trace.sampled("tb.drift_m_s").max() < 0.1
    assert 0.1 < trace.sampled("tb.cover_m").max() < 0.105
    assert report["runs"]["d"]["events"][-1]["kind"] == "arrival"
    assert re.search(
        r"tb showed 0\.0\d+ of 0\.1 m/s drift and 0\.101 of 0\.105 m cover", first_screen(of(report)).beware[-1]
    )


def test_a_controller_of_ones_own_is_judged_by_its_steps(tmp_path: Path) -> None:
    """All is as declared, though a pair came so near that a longer step would have broken its distance."""
    options = ["-o", str(tmp_path / "report"), "--format", "json", "--allow-plugins"]
    assert main([str(EXAMPLES / "own_controller.yaml"), *options]) == 0
    report = json.loads((tmp_path / "report" / "report.json").read_text())
    found = {(claim["id"], claim["run"]): claim for claim in report["claims"]}
    assert {found[claim, "d"]["status"] for claim in ("SAFE-TRACE", "SAFE-HYP", "LIVE-GOAL")} == {"holds"}
    assert found["SAFE-TRACE", "d"]["exercised"] > 0
    assert {found[claim, "d"]["status"] for claim in ("GATE-PLAN", "LIVE-HYP")} == {"not_run"}
    assert {line.outcome for line in checked(tmp_path / "report", 60.0)} == {AGREES}


def test_a_supervisor_of_priorities_gets_where_a_fixed_order_does_not() -> None:
    """As its README says; whatever the supervisor, the distance is kept."""
    own = imported("priorities/priorities")
    corner, wall = own.SCENES.values()
    found = {name: (own.run(corner, decide), own.run(wall, decide)) for name, decide in own.supervisors().items()}
    assert {name: [each.arrived_s for each in both] for name, both in found.items()} == {
        "fixed order": [None, None],
        "rule": [pytest.approx(18.15), pytest.approx(20.7)],
        "table": [pytest.approx(18.05), None],
    }
    rng = np.random.default_rng(5)
    taught_badly = own.run(corner, lambda _: int(rng.integers(3)))
    every = [taught_badly, *(each for both in found.values() for each in both)]
    assert min(each.nearest_m for each in every) > 2.0 - 1e-9
    table = np.array(json.loads(own.TABLE.read_text()))
    assert table.shape == own.train(episodes=1).shape


def test_a_learned_policy_is_trained_and_helps(monkeypatch: pytest.MonkeyPatch) -> None:
    """What was learnt beats how it began on maps that it has not seen, and is a policy with which a UGV arrives."""
    monkeypatch.syspath_prepend(EXAMPLES)
    learned = importlib.import_module("learned_policy")
    weights, ((before, same), (_, now)) = learned.train(rounds=2, size=3, maps=3, jobs=1)
    assert weights.shape == learned.START.shape
    assert before == same
    assert now < 0.0
    both = np.array([learned.START, json.loads(learned.WEIGHTS.read_text())])
    untrained, trained = np.mean([row for row in (learned.returns(both, number) for number in range(8)) if row], axis=0)
    assert trained > untrained + 3.0
    policy = {"name": "learned_policy:Learned", "parameters": {"speed_m_s": 3.0}}
    scenario = load("minimal", {"intervention.policies": [policy], "intervention.budget_s": 60.0})  # of a busy machine
    trace = simulate(scenario, "d")
    assert [event["t_s"] for event in trace.events if event["kind"] == "arrival" and event["robot"] == "ugv1"]


@pytest.mark.parametrize("kind", ["CrossEntropy", "MultiArmedBandit"])
def test_samplers_of_verifai_go_where_it_is_less(kind: str) -> None:
    pytest.importorskip("verifai")
    found = []
    for _ in range(2):
        sampler, points = getattr(imported("verifai_sampler"), kind)(dimensions=2, seed=3), []
        for _ in range(150):
            points.append(sampler.ask())
            sampler.tell(points[-1], points[-1][:, 0] - 0.3)
        found.append(np.concatenate(points))
    assert found[0].shape == (150, 2)
    assert ((found[0] >= 0.0) & (found[0] < 1.0)).all()
    assert np.mean(found[0][100:, 0]) < np.mean(found[0][:50, 0])
    np.testing.assert_array_equal(*found)
