"""`airground falsify`, from outside."""

from pathlib import Path

import pytest
from commands.conftest import Airground

from airground_drake.commands import falsify as module
from airground_drake.scenario.load import load
from airground_drake.sim.simulation import simulate
from airground_drake.verify import judge

SPEC = """
name: pushed
scenario: minimal
set:
  duration_s: 8.0
  decision.threshold.zeta_m: 1.6
  intervention.policies: [{name: towards, parameters: {speed_m_s: 2.0, x_m: 5.0, y_m: 0.0}}]
  runs: {METHOD: {method: METHOD}}
draw:
  obstacles.rock.position_m: {uniform: [[4.0, -1.0, 0.0], [6.0, 1.0, 0.0]]}
"""
SAMPLER = """
import numpy as np

class Corner:
    def __init__(self, dimensions, seed):
        self.points = np.full((1, dimensions), 0.5)

    def ask(self):
        ASK

    def tell(self, points, values):
        TELL
"""
OWN = ("--sampler", "corner.py:Corner", "--allow-plugins")


@pytest.fixture
def falsified(tmp_path: Path, airground: Airground) -> Airground:
    def falsify(
        method: str, *more: str, code: int, ask: str = "return self.points", tell: str = "pass", duration: str = "8.0"
    ) -> str:
        text = SPEC.replace("METHOD", method).replace("8.0", duration)
        (tmp_path / "pushed.yaml").write_text(text, encoding="utf-8")
        (tmp_path / "corner.py").write_text(SAMPLER.replace("ASK", ask).replace("TELL", tell), encoding="utf-8")
        words = ("--jobs", 1, "-n", 2, "--shrink", 12, "-o", tmp_path / "found.yaml", *more)
        return airground("falsify", tmp_path / "pushed.yaml", *words, code=code)

    return falsify


@pytest.mark.slow
def test_a_violation_is_found_and_made_small(falsified: Airground, tmp_path: Path) -> None:
    assert "made small" in falsified("b", "--sampler", "halton", "-n", 16, code=1)
    for name in ("found", "found_small"):
        scenario = load(tmp_path / f"{name}.yaml")
        (verdict,) = judge(simulate(scenario, "b"), claims=["SAFE-TRACE"])
        assert verdict.status == "refuted"
    assert scenario.duration_s < 8.0


@pytest.mark.parametrize("there", ["found.yaml", "found_small.yaml"])
def test_nothing_is_overwritten(there: str, falsified: Airground, tmp_path: Path) -> None:
    (tmp_path / there).write_text("mine", encoding="utf-8")
    assert falsified("b", code=2) == f"error: {tmp_path / there} exists; name a file that does not\n"
    assert (tmp_path / there).read_text(encoding="utf-8") == "mine"
    assert {path.name for path in tmp_path.iterdir()} == {"pushed.yaml", "corner.py", there}


def test_a_name_that_is_too_long_for_the_small_scenario_is_refused_before_the_search(
    falsified: Airground, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_try", None)  # this begins the search
    falsified("b", "-o", str(tmp_path / f"{'x' * 249}.yaml"), code=2)
    assert {path.name for path in tmp_path.iterdir()} == {"pushed.yaml", "corner.py"}


@pytest.mark.usefixtures("in_this_process")
def test_without_a_violation_the_worst_is_kept(falsified: Airground, tmp_path: Path) -> None:
    assert "2 tried by cma" in (said := falsified("d", code=0))
    assert ": no counterexample" in said
    assert load(tmp_path / "found.yaml").name == "pushed_0"
    assert not (tmp_path / "found_small.yaml").exists()


@pytest.mark.usefixtures("in_this_process")
def test_without_a_violation_nothing_is_written_unless_it_is_asked_for(
    falsified: Airground, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, airground: Airground
) -> None:
    falsified("d", "-o", tmp_path / "kept.yaml", code=0)
    monkeypatch.chdir(tmp_path)
    airground("falsify", "pushed.yaml", "--jobs", 1, "-n", 1, "--sampler", "halton")
    assert {path.name for path in tmp_path.iterdir()} == {"pushed.yaml", "corner.py", "kept.yaml"}


@pytest.mark.usefixtures("in_this_process")
def test_a_sampler_whose_path_is_not_allowed_is_told_why(falsified: Airground) -> None:
    assert "robots/mine.py:Mine: folders and file have" in falsified("d", "--sampler", "../corner.py:Corner", code=2)


@pytest.mark.slow
@pytest.mark.usefixtures("in_this_process")
def test_a_time_is_made_long(falsified: Airground) -> None:
    assert "largest intervened_s" in falsified("b", "--most", "intervened_s", "--limit", "0.1", "-n", 16, code=1)


@pytest.mark.usefixtures("in_this_process")
def test_a_sampler_beside_the_spec_is_used(falsified: Airground, tmp_path: Path) -> None:
    assert "--allow-plugins" in falsified("d", *OWN[:2], code=2)
    said = falsified("d", *OWN, code=0, tell="points += 1")  # it may change its copy
    assert "2 tried by corner.py:Corner" in said
    assert load(tmp_path / "found.yaml").obstacles["rock"].position_m == [5.0, 0.0, 0.0]


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize(
    ("faulty", "said"),
    [
        ({"ask": "raise ValueError('no\\nmore')"}, "ask of sampler Corner: ValueError: no\\nmore"),
        ({"ask": "raise SystemExit(0)"}, "ask of sampler Corner: SystemExit: 0"),
        ({"ask": "return self.points[0]"}, "ask of sampler Corner: array (3,), wanted (k, 3), k at least 1"),
        ({"ask": "return self.points[:0]"}, "ask of sampler Corner: array (0, 3), wanted (k, 3), k at least 1"),
        ({"ask": "return self.points[:, :2]"}, "ask of sampler Corner: array (1, 2), wanted (k, 3), k at least 1"),
        ({"ask": "return self.points * np.nan"}, "ask of sampler Corner: a point outside [0, 1)"),
        ({"ask": "return 2 * self.points"}, "ask of sampler Corner: a point outside [0, 1)"),
        ({"tell": "exit()"}, "tell of sampler Corner: SystemExit: None"),
    ],
)
def test_a_sampler_that_fails_is_no_counterexample(
    faulty: dict[str, str], said: str, falsified: Airground, tmp_path: Path
) -> None:
    assert said in falsified("d", *OWN, code=4, **faulty)
    assert not (tmp_path / "found.yaml").exists()


@pytest.mark.usefixtures("in_this_process")
def test_a_claim_that_applies_to_no_run_is_refused(falsified: Airground) -> None:
    said = falsified("b", "--claim", "GATE-PLAN", code=2)
    assert "--claim: 'GATE-PLAN' is not allowed; wanted: one that applies to a run of" in said


@pytest.mark.usefixtures("in_this_process")
def test_where_nothing_is_measured_it_says_so(falsified: Airground, tmp_path: Path) -> None:
    said = falsified("a", "--most", "first_trigger_s", "--sampler", "halton", code=3, duration="0.1")
    assert said == "pushed: 2 tried by halton, no first_trigger_s in any of them: undecided\n"
    assert not (tmp_path / "found.yaml").exists()
