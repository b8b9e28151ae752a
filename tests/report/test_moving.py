"""First screens of runs beside obstacles that move: every sentence follows from findings, and none calls them safe."""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import cache
from typing import Any

import persons
import pytest

from airground_drake.report import document, summary
from airground_drake.report.outcomes import courses
from airground_drake.run.simulation import simulate
from airground_drake.scenarios.load import load
from airground_drake.verify.judging import judge_all

Document = dict[str, Any]
OWN = "No robot itself brought a distance below the required one."
STILL = "Still proved: no robot brought itself too near; all other distances."
HEADLINES = {
    "standing": (
        "[≈] person ran into ugv1 at 4.83 s (0.00 m, required 0.30 m); ugv1 retreated at its limit, 1.00 m/s. " + OWN
    ),
    "squeezed": (
        "[≈] ugv1 was caught between person and wall back, 5.80 to 6.00 s: person came to 0.00 m by its own motion; "
        "0.30 m from back was kept. It had nowhere to retreat, and stood. " + OWN
    ),
    "on the goal": (
        "[✗] Safe, but ugv1 does not arrive: from 5.4 s it stood 0.81 m from its target, on which person stands (never "
        "nearer than 0.36 m)."
    ),
    "too fast": (
        "[✗] person moved at 1.18 m/s at 0.00 s, declared 0.60: 0.30 m from person is not promised from then on. "
    )
    + STILL,
}


@cache
def made(name: str) -> Document:
    scenario = persons.scenario(name)
    traces = {run: persons.run(name, run) for run in scenario.runs}
    verdicts = judge_all(scenario, traces.values())
    return document.build(scenario, traces, verdicts, {"package": "0.1.0", "seed": 1, "started": "now"})


def screen(of: Document) -> str:
    return summary.text(of)


def edited(name: str, edit: Callable[[Document], object]) -> Document:
    found = copy.deepcopy(made(name))
    edit(found)
    return found


def of_claim(found: Document, claim: str) -> Document:
    return next(each for each in found["claims"] if each["id"] == claim)


@pytest.mark.parametrize("name", HEADLINES)
def test_the_headline_says_what_happened(name: str) -> None:
    headline = screen(made(name)).splitlines()[0]
    assert headline.startswith(HEADLINES[name])
    assert headline.removeprefix(HEADLINES[name]).endswith("not as declared.")
    assert len(headline) < len(HEADLINES[name]) + 35


@pytest.mark.parametrize("name", [*HEADLINES, "leaving", "two kinds"])
def test_no_screen_calls_anybody_safe_beside_what_moves(name: str) -> None:
    says = screen(made(name))
    assert "people are safe" not in says
    mover = courses(made(name))[0].movers[0]
    assert f"a robot can keep its distance from {mover}" in says.split("Do not conclude that")[1]


def test_without_the_finding_about_own_doing_nobody_is_cleared() -> None:
    for name in ("standing", "squeezed"):
        for status in ("refuted", "error"):
            found = edited(name, lambda each, status=status: of_claim(each, "SAFE-OWN").update(status=status))
            says = screen(found)
            assert says.startswith("[✗] Not safe")
            assert OWN not in says


def test_a_robot_that_hits_a_wall_besides_is_not_cleared() -> None:
    def hit(found: Document) -> None:
        found["runs"]["a"]["metrics"]["min_distance_m"]["ugv1"]["back"]["value"] = 0.2

    says = screen(edited("squeezed", hit))
    assert says.startswith("[✗]")
    assert OWN not in says
    assert "was kept" not in says.splitlines()[0]


def test_what_is_still_proved_follows_from_the_other_hypotheses_and_from_own_doing() -> None:
    def broken(found: Document) -> None:
        of_claim(found, "SAFE-HYP")["counterexample"]["also_broken"] = ["speed limit"]

    says = screen(edited("too fast", broken)).splitlines()[0]
    assert "Still proved: no robot brought itself too near." in says
    unproved = edited("too fast", lambda found: of_claim(found, "SAFE-INV").update(status="inconclusive"))
    assert "distances from walls" not in screen(unproved).splitlines()[0]
    own = edited("too fast", lambda found: of_claim(found, "SAFE-OWN").update(status="inconclusive"))
    assert "Still proved: all other distances." in screen(own).splitlines()[0]


def test_a_person_is_never_proved_and_what_is_proved_names_its_pairs() -> None:
    says = screen(made("on the goal"))
    row = next(line for line in says.splitlines() if line.startswith("d "))
    assert "proved, except from person" in row
    says = screen(made("two kinds"))
    told = "Proved: (d) keeps every distance between robots and from bodies at rest, and drives no robot too near to"
    assert told in " ".join(says.split())
    counted = edited("on the goal", forget_who_moves)
    row = next(line for line in screen(counted).splitlines() if line.startswith("d "))
    assert row.count("proved") == 1  # the entry of the metrics is what keeps a person from being called proved


def forget_who_moves(found: Document) -> None:
    for run in found["runs"].values():
        for others in run["metrics"]["min_distance_m"].values():
            for other in others.values():
                other.pop("moves", None)


def test_who_stands_elsewhere_is_not_kept_away_by_a_person() -> None:
    assert "kept_away" in made("on the goal")["runs"]["a"]["metrics"]["on_the_way"]["ugv1"]
    gone = edited("on the goal", lambda found: [
        run["metrics"]["on_the_way"]["ugv1"].pop("kept_away") for run in found["runs"].values()
    ])  # fmt: skip
    assert screen(gone).startswith("[✗] Safe, but not all arrive: ugv1 is standing still")
    assert screen(made("leaving")).startswith("[✓] All arrive safely")


@pytest.mark.parametrize(
    ("obstacle", "says"),
    [
        (
            {"moves": {"waypoints_m": [[0.0, 1.0, 0.0], [0.0, 9.0, 0.0]], "speed_m_s": 0.5, "start_s": 2.0}},
            "[≈] d: ugv1 starts 1.00 m from thing, required 2.00 m: nobody's doing.",
        ),
        (
            {"position_m": [1.2, 0.0, 0.0], "radius_m": 0.6, "appears_s": 1.0},
            "[✗] Not safe. Under (d), thing appears on ugv1 (nobody's doing).",
        ),
    ],
)
def test_nobody_is_blamed_for_how_a_run_begins_or_for_what_appears(obstacle: dict[str, Any], says: str) -> None:
    changes = {"obstacles": {"thing": obstacle}, "runs": {"d": {"method": "d"}}, "duration_s": 4.0}
    scenario = load("minimal", changes)
    traces = {"d": simulate(scenario, "d")}
    verdicts = judge_all(scenario, traces.values())
    found = screen(document.build(scenario, traces, verdicts, {"package": "0.1.0", "seed": 1, "started": "now"}))
    assert says in " ".join(found.split())
