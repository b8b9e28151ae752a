"""`airground budget`: what is printed adds up, and the picture names each term."""

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from airground_drake.base.errors import ScenarioError
from airground_drake.commands.budget import main

RUNS = "runs={d: {method: d}}"


@pytest.mark.parametrize("scenario", ["turtlebots", "lagging", "case_a_unicycle", "case_a"])
def test_the_terms_add_up(scenario: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([scenario, "--json"]) == 0
    groups = json.loads(capsys.readouterr().out)
    assert groups
    for each in groups:
        added = sum(term["metres"] for term in each["terms"])
        assert each["promised_m"] + added == pytest.approx(each["in_the_law_m"], abs=1e-12)
        assert bool(each["terms"]) == (each["in_the_law_m"] > each["promised_m"])


def test_it_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["turtlebots"]) == 0
    told = capsys.readouterr().out
    assert "burger beside person, which may move: promised 0.200 m, in the law 0.300 m" in told
    assert "    hand_point_m of burger: 0.1000 m" in told


def test_beside_what_appears_it_says_what_has_to_be_clear(capsys: pytest.CaptureFixture[str]) -> None:
    late = "ugvs.ugv1.plant={kind: delay, delay_s: 0.5}"
    given = [late, "obstacles.rock.appears_s=2", "uav={start_m: [0, 0, 9], altitude_m: 9}", "control.sensing_range_m=9"]
    assert main(["minimal", *(word for change in given for word in ("--set", change))]) == 0
    told = capsys.readouterr().out
    assert "2.000 m of the body, also on its way of up to 3.000 m under commands already given" in told


def test_one_imperfection_is_shown_by_its_values(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Each value has its distances and its run; one that the scenario cannot have is named with the reason."""
    picture = tmp_path / "varied.svg"
    key = "ugvs.cart1.plant.time_constant_s"
    asked = ["lagging", "d", "--set", "duration_s=0.5", "--vary", f"{key}=0.1,0.3,-1", "--jobs", "1"]
    assert main([*asked, "-o", str(picture), "--json"]) == 0
    short, long, refused = json.loads(capsys.readouterr().out)
    for row, constant in ((short, 0.1), (long, 0.3)):
        main(["lagging", "--json", "--set", f"{key}={constant}"])
        pairs = [group for group in json.loads(capsys.readouterr().out) if group["kind"] == "ugv"]
        assert row["ugv law_m"] == max(group["in_the_law_m"] for group in pairs)
        nothing_near = "not_exercised"  # within half a second
        assert (row[key], row["SAFE-TRACE"], row["ugvs"]) == (constant, nothing_near, 2)
    assert (refused["ended"], refused["ugv law_m"]) == ("invalid", None)
    assert "-1 is not allowed" in refused["what"] or "-1.0 is not allowed" in refused["what"]
    assert ElementTree.parse(picture).getroot().tag.endswith("svg")
    with pytest.raises(ScenarioError, match=r"did you mean period_s\?"):
        main(["lagging", "d", "--vary", "control.perid_s=1"])
    assert main(["lagging", "d"]) == 2
    assert "wanted: --vary, or no run" in capsys.readouterr().err


def test_the_room_for_old_positions_is_shown_by_the_delay(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    old = ["--set", "channel={ugvs: {}}", "--set", "control.law=asynchronous", "--set", "duration_s=0.1", "--set", RUNS]
    asked = ["swap", "d", *old, "--vary", "channel.ugvs.delay_s=0,0.3", "--jobs", "1", "-o", str(tmp_path / "a.svg")]
    assert main([*asked, "--json"]) == 0
    assert [row["ugv old_positions_m"] for row in json.loads(capsys.readouterr().out)] == pytest.approx([0.1, 0.7])
    assert main(asked) == 0
    assert "1.000 -> 1.000 + 0.700" in capsys.readouterr().out


def test_third_party_code_is_not_imported(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether the scenario or a value names it, and though a file in the current folder has the scenario's name."""
    (tmp_path / "evil.py").write_text("raise SystemExit('imported')\n")
    (tmp_path / "minimal").touch()
    monkeypatch.chdir(tmp_path)
    asked, own = ["minimal", "d", "--jobs", "1", "--set", "duration_s=0.5"], "{name: 'evil.py:Evil'}"
    with pytest.raises(ScenarioError, match="only with --allow-plugins"):
        main([*asked, "--vary", "control.period_s=0.05", "--set", f"intervention.policies=[{own}]"])
    assert main([*asked, "--json", "--vary", f"intervention.policies=[{own}]"]) == 3
    (row,) = json.loads(capsys.readouterr().out)
    assert row["ended"] == "invalid"
    assert "only with --allow-plugins" in row["what"]
