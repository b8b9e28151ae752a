"""`airground falsify`, from outside."""

from __future__ import annotations

from pathlib import Path

import pytest

from airground_drake.commands import falsify as module
from airground_drake.commands.falsify import main
from airground_drake.run.simulation import simulate
from airground_drake.scenarios.load import load
from airground_drake.verify import verify

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


def falsified(tmp_path: Path, method: str, *more: str, spec: str = SPEC) -> int:
    path = tmp_path / "pushed.yaml"
    path.write_text(spec.replace("METHOD", method), encoding="utf-8")
    return main([str(path), "--jobs", "1", "-n", "2", "--shrink", "12", "-o", str(tmp_path / "found.yaml"), *more])


@pytest.mark.slow
def test_a_violation_is_found_and_made_small(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert falsified(tmp_path, "b", "--sampler", "halton") == 1
    assert "made small" in capsys.readouterr().out
    for name in ("found", "found_small"):
        scenario = load(tmp_path / f"{name}.yaml")[0]
        (verdict,) = verify(simulate(scenario, "b"), claims=["SAFE-TRACE"])
        assert verdict.finding.status == "refuted"
    assert scenario.duration_s < 8.0


@pytest.mark.parametrize("there", ["found.yaml", "found_small.yaml"])
def test_nothing_is_overwritten(there: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / there).write_text("mine", encoding="utf-8")
    assert falsified(tmp_path, "b") == 2
    assert capsys.readouterr().err == f"error: {tmp_path / there} exists; name a file that does not\n"
    assert (tmp_path / there).read_text(encoding="utf-8") == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(["pushed.yaml", there])


@pytest.mark.parametrize("output", [".", "pushed.yaml/found.yaml", "x" * 251 + ".yaml", "/proc/found.yaml"])
def test_what_cannot_be_written_is_told_before_the_search(
    output: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(module, "_try", None)  # what begins the search
    assert falsified(tmp_path, "b", "-o", output) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["pushed.yaml"]


@pytest.mark.usefixtures("in_this_process")
def test_where_there_is_none_the_worst_is_kept(tmp_path: Path) -> None:
    assert falsified(tmp_path, "d") == 0
    assert load(tmp_path / "found.yaml")[0].name == "pushed_0"
    assert not (tmp_path / "found_small.yaml").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("in_this_process")
def test_a_time_is_made_long(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert falsified(tmp_path, "b", "--most", "intervened_s", "--limit", "0.1") == 1
    assert "largest intervened_s" in capsys.readouterr().out


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


def sampled(tmp_path: Path, ask: str = "return self.points", tell: str = "pass", *, allow: bool = True) -> int:
    text = SAMPLER.replace("ASK", ask).replace("TELL", tell)
    (tmp_path / "corner.py").write_text(text, encoding="utf-8")
    return falsified(tmp_path, "d", "--sampler", "corner.py:Corner", *["--allow-plugins"][:allow])


@pytest.mark.usefixtures("in_this_process")
def test_a_sampler_of_ones_own_is_found_beside_the_spec(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sampled(tmp_path, allow=False) == 2
    assert "--allow-plugins" in capsys.readouterr().err
    assert sampled(tmp_path, tell="points += 1") == 0  # what it does with its copy is its own business
    assert "2 tried by corner.py:Corner" in capsys.readouterr().out
    assert load(tmp_path / "found.yaml")[0].obstacles["rock"].position_m == [5.0, 0.0, 0.0]


@pytest.mark.parametrize("sampler", ["os:path", "os.path:join", "nowhere.py:Climb"])
def test_what_is_no_sampler_is_refused_before_the_search(
    sampler: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert falsified(tmp_path, "d", "--sampler", sampler, "--allow-plugins") == 2
    said = capsys.readouterr().err
    assert said.startswith(f"error: --sampler: sampler '{sampler}'")
    assert said.count("\n") == 1
    assert not (tmp_path / "found.yaml").exists()


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
        ({"ask": "return None"}, "ask of sampler Corner: "),
        ({"tell": "exit()"}, "tell of sampler Corner: SystemExit: None"),
    ],
)
def test_a_sampler_that_fails_is_no_counterexample(
    faulty: dict[str, str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert sampled(tmp_path, **faulty) == 4
    written = capsys.readouterr().err
    assert said in written
    assert written.count("\n") == 1
    assert not (tmp_path / "found.yaml").exists()


@pytest.mark.usefixtures("in_this_process")
def test_a_claim_that_applies_to_no_run_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert falsified(tmp_path, "d", "--claim", "GATE-OPT") == 2
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert "--claim: 'GATE-OPT' is not allowed; wanted: one that applies to a run of" in said.err


@pytest.mark.usefixtures("in_this_process")
def test_where_nothing_is_judged_nothing_is_said_of_a_margin(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    short = SPEC.replace("8.0", "0.1")
    assert falsified(tmp_path, "a", "--most", "first_trigger_s", "--sampler", "halton", spec=short) == 3
    said = capsys.readouterr().out
    assert said == "pushed: 16 tried by halton, never judged: no first_trigger_s in any of them\n"
    assert not (tmp_path / "found.yaml").exists()


def test_usage(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert falsified(tmp_path, "b", "--claim", "SAFE-INV") == 2
    assert falsified(tmp_path, "b", "--sampler", "nothing") == 2
    assert "allowed: cma, halton, random, module:Class or file.py:Class" in capsys.readouterr().err
    (tmp_path / "none.yaml").write_text("scenario: minimal\n", encoding="utf-8")
    assert main([str(tmp_path / "none.yaml")]) == 2
    assert "nothing is drawn" in capsys.readouterr().err
