"""Runs as theorems: Coq proves those that keep their distances and refuses the others; files say what traces say."""

import copy
import json
import math
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.edits import with_cells, with_scenario

from airground_drake.base.arrays import Array
from airground_drake.base.errors import TraceError
from airground_drake.commands import main
from airground_drake.model.plants.plant import Plant
from airground_drake.model.plants.unicycle import Unicycle
from airground_drake.scenario.schema import Obstacle, Preset, Run, SafeDistance, Scenario, Uav, Ugv
from airground_drake.sim import trace
from airground_drake.sim.trace import Trace
from airground_drake.study.testing.plugin import Simulations
from airground_drake.verify.claim import followed
from airground_drake.verify.proofs import export
from airground_drake.verify.proofs.export import demands, distances_file, recorded, without_vectors
from airground_drake.verify.proofs.readback import ReadbackError, compare
from airground_drake.verify.proofs.record import FOLDER, digest
from airground_drake.verify.proofs.runs import Workshop, broken_rules, expects_kept, prove
from airground_drake.verify.proofs.table import too_near

UGV, ROCK = "ugv1", "obstacle_1"
REFUSED = f"Coq refuses {UGV} and {ROCK}, 2 m"


@pytest.fixture
def workshop(compiled: Path, coq_version: str, tmp_path: Path) -> Workshop:
    folder = shutil.copytree(compiled, tmp_path / "workshop")
    return Workshop(folder, coq_version, {path.name: digest(FOLDER / path.name) for path in folder.glob("*.v")})


@pytest.mark.slow
def test_case_a_keeps_its_distances_and_obeys_the_law(run: Simulations, workshop: Workshop) -> None:
    """CI proves run d of case B."""
    distances, law, rounded = prove(workshop, run("case_a", "c"))
    assert (distances.proved, distances.why) == (True, "")
    assert (law.proved, law.why) == (True, "")
    assert distances.axioms
    assert rounded.most_m <= 2.0**-61
    said = (workshop.folder / "run_c.v").read_text(encoding="utf-8")
    assert "2 <= norm (sub (position run_c ugv1 t) (position run_c obstacle_1 t)) /\\" in said


def moved(of: Trace, row: int, place: Array) -> Trace:
    return with_cells(of, "states", row, [f"{UGV}.{axis}_m" for axis in "xyz"], place)


NEAREST = 10
"""A row of the trace that follows."""


def near_the_rock(of: Trace) -> tuple[Trace, Array, Array]:
    """The rows about the one in which UGV1 is nearest to an obstacle, its position, and the way from there, m."""
    rock = np.array(of.scenario.obstacles[ROCK].position_m)
    offsets = of.position(UGV) - rock
    row = int(np.argmin(np.linalg.norm(offsets, axis=1)))
    return short(of, 2 * NEAREST, row - NEAREST), rock, offsets[row]


@pytest.mark.slow
def test_a_step_through_an_obstacle_is_refused_though_both_of_its_ends_keep_the_distance(
    run: Simulations, workshop: Workshop
) -> None:
    few, rock, offset = near_the_rock(run("case_a", "d"))
    through = moved(few, NEAREST, rock - 1.1 * offset)
    assert np.linalg.norm(through.position(UGV) - rock, axis=1).min() >= 2.0
    distances, law, _ = prove(workshop, through)
    assert distances.why.startswith(f"{REFUSED}. In exact arithmetic ")
    assert not law.proved
    gaps = {gap.demand.lemma: gap for gap in law.missed}
    assert gaps[f"{UGV}_and_{ROCK}"].begin_s == few.t[NEAREST - 1]
    said = (workshop.folder / law.file).read_text(encoding="utf-8")
    assert said.count("\nEntry ") == law.entries >= 12


@pytest.mark.slow
@pytest.mark.parametrize(("short_m", "kept"), [(6e-14, False), (-6e-14, True)])
def test_some_rounding_errors_short_is_too_short(
    short_m: float, kept: bool, run: Simulations, workshop: Workshop
) -> None:
    few, rock, offset = near_the_rock(run("case_a", "d"))
    place = rock + offset * ((2.0 - short_m) / np.linalg.norm(offset))
    distances, law, _ = prove(workshop, moved(few, NEAREST, place))
    assert distances.proved is kept
    assert [(one.demand.lemma, round(one.short_m, 15)) for one in distances.too_near] == (
        [] if kept else [(f"{UGV}_and_{ROCK}", pytest.approx(short_m, abs=2e-15))]
    )
    assert law.proved or {gap.demand.lemma for gap in law.missed} == {f"{UGV}_and_{ROCK}"}


def test_every_pair_that_comes_too_near_is_named_with_its_distance_and_time(run: Simulations) -> None:
    few = short(run("case_a", "d"))
    rocks = [np.array(few.scenario.obstacles[name].position_m) for name in (ROCK, "obstacle_2")]
    through = moved(moved(few, 1, rocks[0] - [1.0, 0.0, 0.0]), 2, rocks[0] + [3.0, 0.0, 0.0])  # past it on one line
    towards = moved(moved(through, 3, rocks[1] + [9.0, 0.0, 0.0]), 4, rocks[1] + [0.5, 0.0, 0.0])
    found = {one.demand.lemma: one for one in too_near(recorded(towards))}
    assert {f"{UGV}_and_{ROCK}", f"{UGV}_and_obstacle_2"} <= {*found}
    nearest = found[f"{UGV}_and_{ROCK}"]
    assert (nearest.least_m, nearest.short_m) == (0.0, 2.0)
    assert nearest.t_s == pytest.approx(few.t[1] + (few.t[2] - few.t[1]) / 4.0)
    at_end = found[f"{UGV}_and_obstacle_2"]
    assert (at_end.least_m, at_end.short_m, at_end.t_s) == (0.5, 1.5, few.t[4])
    assert too_near(recorded(few)) == []


def short(of: Trace, rows: int = 5, first: int = 0) -> Trace:
    return replace(of, states=of.states.iloc[first : first + rows].reset_index(drop=True))


WALLS: dict[str, dict[str, Any]] = {
    "room": {"segment_m": [[-6.0, -2.0], [6.0, -2.0], [6.0, 6.0], [-6.0, 6.0]], "height_m": 3.0},
    "ell": {"polygon_m": [[4, 2], [5, 2], [5, 4], [4.5, 4], [4.5, 3], [4, 3]], "heading_rad": 0.1, "height_m": 1.0},
    "post": {"position_m": [-4.0, 3.0, 0.0], "radius_m": 0.25, "height_m": 4.0, "distance_m": 0.5},
    "cart": {"size_m": [0.6, 0.4], "moves": {"waypoints_m": [[-3.5, -1.0], [-3.5, 2.0]], "speed_m_s": 1.0}},
    "person": {"radius_m": 0.25, "moves": {"waypoints_m": [[3.0, -1.0], [3.0, 2.0]], "speed_m_s": 1.0}},
}


def among_walls(of: Trace, **others: dict[str, Any]) -> Trace:
    """Its positions, in a world of walls, a prism and bodies that move; robots keep 0.9 m."""
    way = np.linspace(-1.0, -0.8, len(of.t))
    table = of.states.assign(**{
        f"{name}.{axis}_m": places
        for name, x in (("cart", -3.5), ("person", 3.0))
        for axis, places in zip("xyz", (x, way, 0.0), strict=True)
    })  # fmt: skip
    changed = with_scenario(of, obstacles=WALLS | others, safe_distance__obstacle_m=0.9)
    return replace(changed, states=table)


@pytest.mark.slow
def test_distances_from_walls_prisms_and_bodies_that_move_are_proved(run: Simulations, workshop: Workshop) -> None:
    few = among_walls(short(run("case_a", "d")))
    distances, law, rounded = prove(workshop, few)
    assert (distances.proved, distances.why) == (True, "")
    assert (law.proved, law.why) == (True, "")
    assert rounded.most_m <= 2.0**-61
    said = (workshop.folder / "run_d.v").read_text(encoding="utf-8")
    assert "clear run_d ugv1 room room_ground (9 / 10) t /\\" in said
    assert "clear run_d uav cart cart_solid (9 / 10) t" in said
    assert "clear run_d uav post post_solid (3 / 4) t" in said
    assert law.entries == 3


def test_a_wall_that_a_robot_steps_through_is_too_near(run: Simulations) -> None:
    few = short(run("case_a", "d"))
    x, y, z = few.position(UGV)[2]
    through = among_walls(
        moved(few, 3, np.array([x, y + 3.0, z])), wall_1={"segment_m": [[0.0, y + 1.5], [2.0, y + 1.5]]}
    )
    [found] = too_near(recorded(through))
    assert (found.demand.lemma, found.least_m, found.short_m) == (f"{UGV}_and_wall_1", 0.0, 0.9)
    assert few.t[2] < found.t_s < few.t[3]


@pytest.mark.parametrize(("key", "value"), [("appears_s", 2.0), ("disappears_s", 1.0)])
def test_a_body_that_no_theorem_is_about_is_refused_by_name(key: str, value: float, run: Simulations) -> None:
    late = among_walls(short(run("case_a", "d")), late={"position_m": [9.0, 9.0, 0.0], key: value})
    with pytest.raises(TraceError, match=rf"^run d: late has {key}; no theorem is about such a body$"):
        recorded(late)


def test_a_key_that_nobody_has_thought_of_is_refused(run: Simulations, monkeypatch: pytest.MonkeyPatch) -> None:
    few = among_walls(short(run("case_a", "d")))
    recorded(few)
    monkeypatch.setattr(export, "COVERED", export.COVERED - {"heading_rad"})
    with pytest.raises(TraceError, match="ell has heading_rad"):
        recorded(few)


@pytest.mark.slow
def test_tiny_coordinates_are_rounded_and_it_is_said_by_how_much(run: Simulations, workshop: Workshop) -> None:
    few = short(run("case_a", "d"))
    tiny = moved(few, 2, few.position(UGV)[2] + np.array([0.0, 0.0, 1e-100]))
    distances, _, rounded = prove(workshop, tiny)
    assert distances.proved
    assert (rounded.coordinates, rounded.most_m) == (1, 1e-100)


@pytest.mark.slow
def test_names_that_mean_something_in_coq_are_replaced(run: Simulations, workshop: Workshop) -> None:
    few = short(run("case_a", "d"))
    names = {"ugv1": "norm", "ugv2": "ugv1_and_uav", "obstacle_2": "forall", "obstacle_3": "Type"}
    meta = json.dumps(few.meta, ensure_ascii=False)
    table = few.states
    for old, new in names.items():
        meta = meta.replace(f'"{old}"', f'"{new}"')
        table = table.rename(columns=lambda name, old=old, new=new: name.replace(f"{old}.", f"{new}."))
    distances, law, _ = prove(workshop, replace(few, meta=json.loads(meta), states=table))
    assert distances.proved, distances.why
    assert law.proved, law.why


def test_every_pair_is_to_keep_its_kind_of_distance_and_both_radii() -> None:
    here, way = [0.0] * 3, Preset([[0.0] * 3, [1.0, 0.0, 0.0]])
    scenario = Scenario(
        name="bodies",
        ugvs={"one": Ugv(here, here, way, radius_m=0.1), "two": Ugv(here, here, way, radius_m=0.2)},
        uav=Uav("above", start_m=here, radius_m=0.4),
        obstacles={"rock": Obstacle(here, radius_m=0.8)},
        safe_distance=SafeDistance(obstacle_m=2.0, ugv_m=3.0, air_ground_m=1.0),
        runs={"d": Run("d")},
    )
    assert [(each.first, each.second, float(each.safe_m)) for each in demands(scenario)] == [
        ("one", "rock", 2.9), ("two", "rock", 3.0), ("above", "rock", 3.2),
        ("one", "two", 3.3), ("one", "above", 1.5), ("two", "above", 1.6),
    ]  # fmt: skip


EDITS_OF_WALLS: list[tuple[Callable[[str], str], str]] = [
    (lambda text: re.sub(r"(room_ground := \[\n\[P \(-0x)", r"\g<1>1", text), "a position differs"),
    (
        lambda text: re.sub(r"(room_solid := \[\n)\[.*?\];\n", r"\1", text),
        "room_solid: the sets in the file have other corners",
    ),
    (lambda text: text.replace("clear run_d uav room room_solid", "clear run_d uav room room_ground"), "of every pair"),
    (lambda text: text.replace("room_ground (9 / 10) t /\\", "room_ground (8 / 10) t /\\"), "of every pair"),
    (lambda text: text.replace("cart_places := Track", "cart_places := at_rest 5"), "cart"),
]


def test_files_are_compared_without_the_vectors_that_prove_them(run: Simulations) -> None:
    exact = recorded(among_walls(short(run("case_a", "d"))))
    text, bare = distances_file(exact), distances_file(exact, vectors=False)
    assert without_vectors(text) == without_vectors(bare) == bare
    assert text.count("_vectors :=") == 12
    smuggled = re.sub(r"\]\]\)%Z\.\n", "]])%Z. Definition norm := 0.\n", text, count=1)
    assert without_vectors(smuggled) not in (bare, text)


EDITS: list[tuple[Callable[[str], str], str]] = [
    (lambda text: text.replace(";\nP 0x", ";\nP 0x1", 1), "a position differs from the trace"),
    (lambda text: text.replace("Run 0x1", "Run 0x2", 1), "the times are not those of the trace"),
    (lambda text: text.replace("nat.\nDefinition", "nat.\n\nDefinition").replace("ugv1 := 3", "ugv1 := 4"), "numbered"),
    (lambda text: text.replace("->\n  (2 <=", "->\n  (1 <="), "does not claim the scenario's distance of every pair"),
    (lambda text: text.replace(" /\\\n   1 <= norm (sub (position run_d ugv1 t) (position run_d uav t))", ""), "every"),
    (lambda text: text.replace("->\n  (2 <=", "->\n  False /\\ (2 <="), "every pair"),
    (lambda text: text.replace("forall t, 0 <= t", "forall t, 1 <= t"), "not about all of the run's time"),
    (lambda text: text.replace("Definition run_d := Run", "Definition run_e := Run"), "0 times; wanted: once"),
    (lambda text: text.replace(f"{ROCK}_places := at_rest 5", f"{ROCK}_places := at_rest 4"), "1 places in the file"),
]


def test_a_scenario_says_which_runs_are_to_keep_their_distances(run: Simulations) -> None:
    of = run("case_a", "d")
    for expected, kept in (("holds", True), ("exercised", True), ("holds or refuted", False)):
        assert expects_kept(with_scenario(of, runs__d__expected={"SAFE-TRACE": expected})) is kept


@pytest.fixture
def made(tmp_path: Path, run: Simulations) -> Path:
    """What there is to prove of a report: case A (d), its first rows."""
    trace.save(short(run("case_a", "d")), tmp_path / "report" / "trace" / "d")
    return tmp_path / "report"


def _each_forged_value_is_found(made: Path, found: dict[str, Any]) -> None:
    """What can be computed without Coq is compared, and nothing is added to proofs.json."""
    traces = {"d": trace.load(made / "trace" / "d")}
    assert broken_rules(made / "proofs", traces)[1] == []
    for *parents, key, value in (
        ("certified", True), ("theory", {}), ("runs", "d", "certified", True), ("runs", "d", "rounded_by_m", -5.0),
        ("runs", "d", "rounded_coordinates", -1), ("runs", "d", "distances", "theorem", "all_safe_for_ever"),
        ("runs", "d", "distances", "axioms", []), ("runs", "d", "law", "axioms", ["False.exists"]),
        ("runs", "d", "law", "theorem", "lawful"), ("runs", "d", "law", "certified", True),
    ):  # fmt: skip
        forged = copy.deepcopy(found)
        place = forged
        for parent in parents:
            place = place[parent]
        place[key] = value
        (made / "proofs" / "proofs.json").write_text(json.dumps(forged), encoding="utf-8")
        assert len(broken_rules(made / "proofs", traces)[1]) == 1, (parents, key)


@pytest.mark.slow
@pytest.mark.usefixtures("compiled_before")
def test_the_command_proves_a_report_and_writes_down_what_it_found(
    made: Path, coq_version: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["prove", str(made)]) == 0
    assert "run d: all 12 distances kept at all times: proved in " in capsys.readouterr().out
    found = json.loads((made / "proofs" / "proofs.json").read_text(encoding="utf-8"))
    assert found["coq"] == coq_version
    assert found["runs"]["d"]["distances"]["proved"] is found["runs"]["d"]["law"]["proved"] is True
    assert sorted(path.name for path in (made / "proofs").iterdir()) == ["proofs.json", "run_d.v", "run_d_law.v"]
    _each_forged_value_is_found(made, found)

    of = trace.load(made / "trace" / "d")
    rock = np.array(of.scenario.obstacles[ROCK].position_m)
    trace.save(moved(of, 3, rock), made / "trace" / "d")
    assert main(["prove", str(made), "--run", "d"]) == 1
    said = capsys.readouterr().out
    assert f"run d: all 12 distances kept at all times: not proved: {REFUSED}" in said
    assert sorted(path.name for path in (made / "proofs").iterdir()) == ["proofs.json", "run_d.v", "run_d_law.v"]
    found = json.loads((made / "proofs" / "proofs.json").read_text(encoding="utf-8"))
    _forged_distances_are_found(made, found)


def _forged_distances_are_found(made: Path, found: dict[str, Any]) -> None:
    """Of a run that Coq refused, too: the page shows how near which pairs came."""
    traces = {"d": trace.load(made / "trace" / "d")}
    assert broken_rules(made / "proofs", traces)[1] == []
    near = found["runs"]["d"]["distances"]["too_near"]
    for forged in ([], near[:-1], [{**near[0], "least_m": 1.9}, *near[1:]], [{**near[0], "t_s": 9.0}, *near[1:]]):
        found["runs"]["d"]["distances"]["too_near"] = forged
        (made / "proofs" / "proofs.json").write_text(json.dumps(found), encoding="utf-8")
        assert len(broken_rules(made / "proofs", traces)[1]) == 1, forged


def test_what_cannot_be_proved_for_want_of_coq_or_of_files_is_said(
    made: Path, coq_version: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for arguments, why in (
        ([str(tmp_path)], "wanted: the folder of a report"),
        ([str(made), "--run", "e"], "unknown run of .* 'e'; allowed: d"),
        (["--run", "d"], "--run needs DIR"),
        ([str(made), "--record"], "--record and DIR exclude"),
    ):
        assert main(["prove", *arguments]) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1
        assert re.search(why, said), said
    (made / "trace" / "d" / "states.parquet").write_bytes(b"")
    assert main(["prove", str(made)]) == 2
    assert "SHA-256" in capsys.readouterr().err
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main(["prove"]) == 2
    assert "coqc is not on the PATH: install Coq" in capsys.readouterr().err


def turning(of: Trace, **plant: Any) -> Trace:
    meta = copy.deepcopy(dict(of.meta))
    for name in ("ugv1", "ugv2"):
        meta["scenario"]["ugvs"][name]["plant"] = [plant]
    meta["scenario"]["safe_distance"].update(obstacle_m=1.5, ugv_m=0.5, air_ground_m=0.8)
    meta["scenario"]["obstacles"]["wall_1"] = {"segment_m": [[-6.0, -3.0], [6.0, -3.0]]}
    given, table = replace(of, meta=meta), of.states
    for name in ("ugv1", "ugv2"):
        bodies = followed(given, name)
        table = table.assign(**{f"{name}.{key}": bodies[:, i] for i, key in enumerate(given.plant(name).signals)})
    return replace(of, meta=meta, states=table)


UNICYCLE: dict[str, Any] = {"kind": "unicycle", "hand_point_m": 0.2}


@pytest.mark.slow
def test_bodies_of_unicycles_keep_their_distances_and_the_law_keeps_them(run: Simulations, workshop: Workshop) -> None:
    few = short(turning(run("case_a", "d"), **UNICYCLE), 20)
    distances, law, _ = prove(workshop, few)
    assert (distances.proved, distances.why) == (True, "")
    assert (law.proved, law.why, law.entries) == (True, "", 12)
    said = (workshop.folder / "run_d.v").read_text(encoding="utf-8")
    assert "(3 / 2) <= norm (sub (x ugv1 t) (x obstacle_1 t)) /\\" in said
    assert "In corners wall_1_ground -> hull" in said
    said = (workshop.folder / law.file).read_text(encoding="utf-8")
    assert re.search(r"^Entry 0 19 \(Together \(b ugv1\) \(b obstacle_1\) points .* \(3 / 2\)\)", said, re.M)


@pytest.mark.slow
def test_bodies_with_a_lag_keep_their_distances_and_the_law_is_judged_of_the_others(
    run: Simulations, workshop: Workshop
) -> None:
    few = short(turning(run("case_a", "d"), kind="lag", time_constant_s=0.2), 20)
    distances, law, _ = prove(workshop, few)
    assert (distances.proved, law.proved, law.entries) == (True, True, 3), "the UAV has no lag"


def test_room_comes_from_the_numbers_of_a_plant(run: Simulations) -> None:
    few = short(turning(run("case_a", "d"), **UNICYCLE), 20)
    chords, steered = recorded(few), recorded(few, steered=True)
    speed, h = few.scenario.ugvs["ugv1"].max_speed_m_s, few.scenario.control.period_s
    half = math.asin(speed * h / 0.4)
    dip = speed * h * half / (4.0 * math.sin(half) / half)
    assert float(chords.off_m["ugv1"]) == pytest.approx(dip, rel=1e-9)
    assert float(steered.off_m["ugv1"]) == pytest.approx(0.2 + dip, rel=1e-9)
    assert "uav" not in chords.off_m
    apart = np.linalg.norm(few.body("ugv1") - few.position("ugv1"), axis=1)
    assert (apart <= float(steered.off_m["ugv1"])).all()
    [pair] = [each for each in steered.demands if each.lemma == f"{UGV}_and_{ROCK}"]
    assert (
        pair.body_m + steered.off_m["ugv1"] <= pair.safe_m <= pair.body_m + steered.off_m["ugv1"] + Fraction(1, 10**12)
    )


def test_a_plant_that_nobody_has_thought_of_is_refused(run: Simulations, monkeypatch: pytest.MonkeyPatch) -> None:
    few = short(turning(run("case_a", "d"), **UNICYCLE))
    recorded(few)
    monkeypatch.setattr(Unicycle, "unproved", Plant.unproved)
    with pytest.raises(TraceError, match=r"^run d: ugv1 has the plant unicycle; no theorem is about such a body$"):
        recorded(few)


EDITS_OF_BODIES: list[tuple[Callable[[str], str], str]] = [
    (lambda text: re.sub(r"(_off \(i : nat\) : R := nth i \[.*?)\(\d+ / \d+\)", r"\g<1>0", text), "other lengths"),
    (
        lambda text: text.replace("((3 / 2) <= norm (sub (x ugv1 t)", "(1 <= norm (sub (x ugv1 t)"),
        r"bodies_keep_\w+ does not claim",
    ),
    (
        lambda text: text.replace(
            "Hypothesis near_lines : forall i t,", "Hypothesis near_lines : False /\\ forall i t,"
        ),
        "about",
    ),
    (lambda text: text.replace("bodies_keep_their_distances", "bodies_keep"), "0 times; wanted: once"),
]


SAYING: list[tuple[Callable[[Trace], Trace], list[tuple[Callable[[str], str], str]]]] = [
    (short, EDITS),
    (lambda of: among_walls(short(of)), EDITS_OF_WALLS),
    (lambda of: short(turning(of, **UNICYCLE)), EDITS_OF_BODIES),
]


@pytest.mark.parametrize(("make", "edit", "why"), [(make, *edit) for make, edits in SAYING for edit in edits])
def test_a_file_that_says_something_else_than_the_trace_and_its_scenario_is_refused(
    make: Callable[[Trace], Trace], edit: Callable[[str], str], why: str, run: Simulations
) -> None:
    few = make(run("case_a", "d"))
    text = distances_file(recorded(few))
    compare(text, few)
    assert edit(text) != text
    with pytest.raises(ReadbackError, match=why):
        compare(edit(text), few)
