"""The first screen: each cell by itself, and what no screen may say whatever the verdicts are."""

import copy
import random
from collections.abc import Callable
from typing import Any

import pytest

from airground_drake.base.statuses import PASSING, STATUSES
from airground_drake.report import html, screen
from airground_drake.report.model import SCHEMA, of
from airground_drake.report.screen import FirstScreen, Row, first_screen

Document = dict[str, Any]
Edit = Callable[[Document], object]

AT_HOME, NEAR = [9.0, 0.0, 0.0], {"value": 0.5, "t_s": 3.0, "safe_distance_m": 0.3}
RUN_CLAIMS = ("SAFE-TRACE", "SAFE-HYP", "SAFE-OWN", "LIVE-GOAL", "ZENO-TRACE", "THR-TRIG", "THR-QUALITY")
PROOFS = ("SAFE-INV", "SAFE-GATE", "SAFE-BUDGET", "ZENO-PROOF")
SUBJECTS = {"SAFE-TRACE": "distances", "LIVE-GOAL": "arrival"}


SEED = {"run": "d", "kept": False, "home": True, "seed": 1, "first": "r1", "second": "rock", "min_distance_m": 0.2,
        "safe_distance_m": 0.3, "t_s": 4.0}  # fmt: skip


def screen_of(document: Document) -> FirstScreen:
    return first_screen(of(document))


def claim(name: str, run: str = "", status: str = "holds", **more: Any) -> Document:
    known = {"id": name, "run": run, "status": status, "expected": "holds", "as_expected": True, "exercised": 1}
    return known | {"subject": SUBJECTS.get(name, ""), "evidence": {}, "inputs": {}, "counterexample": None} | more


def ran() -> Document:
    metrics = {
        "min_distance_m": {"r1": {"rock": dict(NEAR)}}, "min_robot_distance_m": {}, "final_position_m": {},
        "came_near": [{"first": "r1", "second": "rock", **NEAR}], "duration_s": 20.0, "on_the_way": {}, "stalls": [],
        "interventions": [], "messages": None, "without_proposals": [], "lost_at_the_end": [], "above_at_start": [],
    }  # fmt: skip
    metrics["final_position_m"] = dict.fromkeys(("r1", "r2", "fly"), AT_HOME)
    events = [{"kind": "arrival", "robot": robot, "t_s": t} for robot, t in (("r1", 12.0), ("r2", 14.5), ("fly", 15.0))]
    return {"zeta_m": 1.0, "events": events, "faults": [], "metrics": metrics}


def document(*edits: Edit, methods: str = "d") -> Document:
    robot: Document = {"start_m": AT_HOME, "target_m": AT_HOME, "preset": {"waypoints_m": [AT_HOME] * 2}, "plant": []}
    resolved = {
        "name": "small", "ugvs": {"r1": dict(robot), "r2": dict(robot)},
        "uav": {"name": "fly", "start_m": AT_HOME, "target_m": AT_HOME},
        "obstacles": {"rock": {}, "crate": {"known_to_uav": False}},
        "runs": {name: {"method": name, "composition": "augmented", "set": {}} for name in methods},
        "arrival_tolerance_m": 0.1, "control": {"period_s": 0.05},
        "decision": {"threshold": {"rule": "fixed"}, "noise_m_sqrt_s": 0.1},
    }  # fmt: skip
    found: Document = {
        "schema": SCHEMA, "provenance": {},
        "scenario": {"name": "small", "title": "", "description": "", "resolved": resolved}, "seeds": [], "audit": [],
        "runs": {name: ran() for name in methods}, "reproduction": [], "choices": [],
        "claims": [*(claim(name, run) for run in methods for name in RUN_CLAIMS),
                   *(claim(name, status="proved", inputs={"dwell_s": 0.5}) for name in PROOFS)],
        "overall": {"status": "as_expected", "checks": 11, "as_expected": 11, "differs": [], "undecided": [],
                    "missing": [], "undemonstrated": [], "unpromised": []},
    }  # fmt: skip
    for edit in edits:
        edit(found)
    return found


def judged(name: str, **changes: Any) -> Edit:
    return lambda found: [each.update(changes) for each in found["claims"] if each["id"] == name]


def metric(name: str, value: Any) -> Edit:
    return lambda found: [run["metrics"].update({name: value}) for run in found["runs"].values()]


def hit(other: str = "rock", t_s: float = 5.0, robot: str = "r1", key: str = "obstacle") -> Edit:
    event = {"kind": "collision", "robot": robot, key: other, "t_s": t_s}
    return lambda found: [run["events"].append(event) for run in found["runs"].values()]


def gap(value: float, other: str = "rock", t_s: float = 5.0) -> Edit:
    least = {"value": value, "t_s": t_s, "safe_distance_m": 0.3}
    return lambda found: [
        run["metrics"]["min_distance_m"]["r1"].update({other: least}) for run in found["runs"].values()
    ]


def met(doing: str, other: str = "man", **more: Any) -> Edit:
    return judged("SAFE-TRACE", evidence={"encounters": [{"first": "r1", "second": other, "doing": doing, **more}]})


def away(robot: str = "r1", **way: Any) -> Edit:
    def edit(found: Document) -> None:
        for run in found["runs"].values():
            run["events"] = [event for event in run["events"] if event["robot"] != robot]
            run["metrics"]["final_position_m"] = run["metrics"]["final_position_m"] | {robot: [1.0, 0.0, 0.0]}
            run["metrics"]["on_the_way"][robot] = {"stands": False, "creeps": False, "left_s": None} | way

    return edit


def crowd(*left_s: float) -> Edit:
    """More UGVs, that have so long to go."""

    def edit(found: Document) -> None:
        ugvs = found["scenario"]["resolved"]["ugvs"]
        for k, each_s in enumerate(left_s, 3):
            ugvs[f"r{k}"] = ugvs["r1"]
            away(f"r{k}", left_s=each_s)(found)

    return edit


def lost(at_s: float) -> Edit:
    return lambda found: found["scenario"]["resolved"]["uav"].update(lost_at_s=at_s)


def another_uav(found: Document) -> None:
    given = found["scenario"]["resolved"]
    given["uavs"] = {"fly": given.pop("uav"), "hover": {"start_m": AT_HOME, "target_m": AT_HOME}}
    for run in found["runs"].values():
        run["metrics"]["final_position_m"]["hover"] = AT_HOME


def man(found: Document) -> None:
    found["scenario"]["resolved"]["obstacles"]["man"] = {"moves": {"waypoints_m": [AT_HOME] * 2, "speed_m_s": 1.0}}


def printed(found: Document) -> None:
    runs = found["scenario"]["resolved"]["runs"]
    runs["p" if "p" in runs else "d"]["composition"] = "recursion_listed"


def lagging(found: Document) -> None:
    found["scenario"]["resolved"]["ugvs"]["r1"]["plant"] = [{"kind": "lag", "time_constant_s": 0.2}]


def fault(found: Document) -> None:
    found["runs"]["d"]["faults"] = [{"robot": "r1"}]


def sent(*ends: tuple[float | None, str]) -> Edit:
    """Proposals to r1, by when they were accepted and how they ended."""
    return metric("interventions", [
        {"robot": "r1", "accepted_s": accepted_s, "ended": {"how": how, "t_s": 9.0, "reason": "waits"}}
        for accepted_s, how in ends
    ])  # fmt: skip


HELD = metric("stalls", [{"robot": "r1", "from_s": 3.0, "until_s": 20.0, "held_by": ["rock", "crate"]}])
MISSED = judged("SAFE-HYP", status="refuted")
FAST = judged("SAFE-HYP", evidence={"beside_moving": [{"second": "man", "too_fast_s": 3.0}]}, status="refuted")
SHORT = judged("SAFE-TRACE", status="refuted", as_expected=False)
KEPT = "r1\N{EN DASH}rock 0.500 ≥ 0.3 m at 3.00 s"
UNDER_WAY = "caused by earlier commands of the robots"
REPORT = "contradicts its proof: please report"

SAFE: list[tuple[list[Edit], str, list[str]]] = [
    ([], "yes", ["distances kept, proved", KEPT]),
    ([man], "yes", ["distances kept, proved except for moving obstacles", KEPT]),
    ([judged("SAFE-HYP", status="inconclusive")], "yes", ["distances kept, not proved", KEPT]),
    ([judged("SAFE-GATE", status="error")], "yes", ["distances kept, not proved", KEPT]),
    ([judged("SAFE-BUDGET", status="error")], "yes", ["distances kept, proved", KEPT]),
    ([judged("SAFE-BUDGET", status="error"), lagging], "yes", ["distances kept, not proved", KEPT]),
    ([printed], "yes", ["distances kept, not proved", KEPT]),
    ([man, FAST], "yes", ["distances kept, not proved", KEPT, "man was faster than declared"]),
    ([judged("SAFE-TRACE", exercised=0)], "none", ["nothing came near: untested", KEPT]),
    ([judged("SAFE-TRACE", status="not_run")], "open", ["not known", "the check: not run"]),
    ([metric("came_near", [])], "yes", ["distances kept, proved", KEPT]),
    ([metric("came_near", []), gap(0.4, t_s=0.0)], "yes",
     ["distances kept, proved", "r1\N{EN DASH}rock 0.400 ≥ 0.3 m at the start"]),
    ([gap(0.2), SHORT], "no", ["too close", "r1\N{EN DASH}rock 0.200 < 0.3 m at 5.00 s", REPORT]),
    ([gap(0.2)], "no", ["too close", "r1\N{EN DASH}rock 0.200 < 0.3 m at 5.00 s", REPORT]),
    ([gap(0.2999999), MISSED], "no",
     ["too close", "r1\N{EN DASH}rock 0.2999999 < 0.3 m at 5.00 s"]),
    ([gap(-0.1), MISSED], "no", ["too close", "r1\N{EN DASH}rock overlap 0.100 m at 5.00 s"]),
    ([SHORT, judged("SAFE-TRACE", as_expected=True), MISSED], "no",
     ["too close (as declared)"]),
    ([hit(), hit("crate", 4.0, "r2"), SHORT, MISSED], "no",
     ["collision", "r2\N{EN DASH}crate at 4.00 s", "1 more collision"]),
    ([man, gap(0.1, "man", 4.0), hit(), MISSED], "no",
     ["collision", "r1\N{EN DASH}rock at 5.00 s", "1 more pair too close"]),
    ([man, gap(0.1, "man", 6.0), hit(), MISSED], "no",  # r1 counts up to 5 s
     ["collision", "r1\N{EN DASH}rock at 5.00 s"]),
    ([man, gap(0.1, "man"), met("other")], "no",
     ["too close", "r1\N{EN DASH}man 0.100 < 0.3 m at 5.00 s", "not caused by the robots"]),
    ([man, gap(0.1, "man"), met("nobody")], "no",
     ["too close", "r1\N{EN DASH}man 0.100 < 0.3 m at 5.00 s", "not caused by the robots"]),
    ([man, hit("man"), met("robot")], "no",
     ["collision", "r1\N{EN DASH}man at 5.00 s", "caused by the robots", REPORT]),
    ([man, hit("man"), met("under way")], "no",
     ["collision", "r1\N{EN DASH}man at 5.00 s", UNDER_WAY]),
    ([man, hit("man"), met("both")], "no",
     ["collision", "r1\N{EN DASH}man at 5.00 s", "caused partly by earlier commands of the robots"]),
    ([man, hit("man"), met("other"), judged("SAFE-OWN", status="refuted")], "no",
     ["collision", "r1\N{EN DASH}man at 5.00 s"]),
    ([man, gap(0.1, "man"), gap(0.2), met("other"), MISSED], "no",
     ["too close", "r1\N{EN DASH}man 0.100 < 0.3 m at 5.00 s", "1 more pair too close"]),  # of the rock it is not known
    ([man, hit("man"), FAST, met("other")], "no",
     ["collision", "r1\N{EN DASH}man at 5.00 s", "not caused by the robots", "man was faster than declared"]),
]  # fmt: skip


@pytest.mark.parametrize(("edits", "mark", "lines"), SAFE)
def test_safe(edits: list[Edit], mark: str, lines: list[str]) -> None:
    assert screen_of(document(*edits)).rows[0].safe == (mark, lines)


@pytest.mark.parametrize(
    ("edits", "mark", "lines"),
    [
        ([], "yes", ["2 of 2, by 14.5 s"]),
        ([away("fly")], "partly", ["2 of 2, by 14.5 s", "the UAV did not"]),
        ([away(stands=True)], "partly", ["1 of 2 (as declared)", "r1 stopped"]),
        ([away(stands=True), HELD], "partly", ["1 of 2 (as declared)", "r1 stopped, held by rock and crate"]),
        ([away(stands=True, kept_away={"by": "man"}), HELD], "partly",
         ["1 of 2 (as declared)", "r1 stopped, man occupies its target"]),
        ([away(stands=True), metric("lost_at_the_end", ["r1"]), HELD, judged("LIVE-GOAL", as_expected=False)], "partly",
         ["1 of 2", "r1 stopped, no way found"]),
        ([away(creeps=True), fault, judged("LIVE-GOAL", as_expected=None)], "partly",
         ["1 of 2", "r1 hardly moving, the policy failed"]),
        ([away(), sent((None, "refused"))], "partly",
         ["1 of 2 (as declared)", "r1 still driving, refused all proposals"]),
        ([away("r1", left_s=4.21), away("r2", left_s=234.0)], "partly",
         ["0 of 2 (as declared)", "r1 still driving, 4.2 s to go", "r2 still driving, 230 s to go"]),
        ([away("r1", left_s=4.21), away("r2", left_s=4.23)], "partly",
         ["0 of 2 (as declared)", "r1, r2 still driving, 4.2 s to go"]),
        ([away("r1", stands=True), away("r2", left_s=1.0)], "no",
         ["0 of 2 (as declared)", "r1 stopped", "r2 still driving, 1 s to go"]),
        ([crowd(1.0, 2.0, 3.0, 4.0, 5.0, 5.0)], "partly",
         ["2 of 8 (as declared)", *(f"r{k + 2} still driving, {k} s to go" for k in range(1, 5)), "2 more UGVs"]),
        ([hit("r2", key="other")], "no", ["0 of 2 (as declared)", "r1 collided with r2", "r2 collided with r1"]),
        ([hit(t_s=13.0)], "yes", ["2 of 2, by 14.5 s"]),  # r1 was there before
    ],
)  # fmt: skip
def test_arrived(edits: list[Edit], mark: str, lines: list[str]) -> None:
    assert screen_of(document(*edits)).rows[0].arrived == (mark, lines)


@pytest.mark.parametrize(
    ("method", "edits", "lines"),
    [
        ("a", [], ["\N{EN DASH}"]),
        ("d", [], ["never called"]),
        ("d", [lambda found: found["runs"]["d"]["events"].append({"kind": "trigger", "robot": "r1", "t_s": 1.0})],
         ["called 1 time, sent none"]),
        ("d", [fault], ["never called", "policy failed 1 time"]),
        ("d", [sent((1.0, "over"), (1.0, "given up"), (None, "refused"), (None, "withdrawn first"), (None, "lost"))],
         ["5 sent: 1 accepted, 1 dropped later, 1 never arrived, 1 refused, 1 unanswered",
          "why refused: waiting looked cheaper"]),
        ("b", [sent((1.0, "released"), (None, "withdrawn first"))], ["2 sent: 1 not begun, 1 obeyed"]),
        ("d", [metric("messages", {"proposals": 1, "withdrawals": 1, "answers": 3, "always_on": {"proposals": 40}})],
         ["never called", "5 messages (40 if always on)"]),
        ("d", [lost(2.0)], ["never called", "fly was lost at 2 s"]),
        ("d", [lost(999.0)], ["never called"]),
    ],
)  # fmt: skip
def test_uav_proposals(method: str, edits: list[Edit], lines: list[str]) -> None:
    assert screen_of(document(*edits, methods=method)).rows[0].uav == ("", lines)


def only(run: str, *edits: Edit) -> Edit:
    def edit(found: Document) -> None:
        part = {**found, "runs": {run: found["runs"][run]}, "claims": [c for c in found["claims"] if c["run"] == run]}
        for each in edits:
            each(part)

    return edit


BAD = hit(), MISSED, SHORT


@pytest.mark.parametrize(
    ("methods", "edits", "told"),
    [
        ("ad", [], [("yes", "With or without the UAV (a, d): 2 of 2 arrive, every distance kept.")]),
        ("abd", [only("a", away(stands=True)), only("b", *BAD)],
         [("yes", "With the UAV (d): 2 of 2 arrive, every distance kept."),
          ("no", "With the UAV (b): 1 of 2 arrive, r1 and rock collide.")]),
        ("ad", [man, hit("man"), met("other")],
         [("no", "With or without the UAV (a, d): 1 of 2 arrive, r1 and man collide (not caused by the robots).")]),
        ("ad", [only("a", away(stands=True))],
         [("yes", "With the UAV (d): 2 of 2 arrive, every distance kept."),
          ("partly", "Without the UAV (a): 1 of 2 arrive, every distance kept.")]),
        ("d", [away("r1", left_s=2.0), away("r2", left_s=2.0)],
         [("partly", "With the UAV (d): 0 of 2 arrive before the run ends, every distance kept.")]),
        ("d", [judged("SAFE-TRACE", status="error")], [("open", "With the UAV (d): 2 of 2 arrive, safety not known.")]),
        ("d", [lambda found: found["seeds"].append(SEED)],
         [("no", "With the UAV (d): 2 of 2 arrive, distances kept here, but not with every seed.")]),
        ("dp", [printed, only("p", gap(0.1))],
         [("yes", "With the UAV (d): 2 of 2 arrive, every distance kept.")]),
        ("d", [another_uav], [("yes", "With the UAVs (d): 2 of 2 arrive, every distance kept.")]),
    ],
)  # fmt: skip
def test_headline(methods: str, edits: list[Edit], told: list[tuple[str, str]]) -> None:
    assert screen_of(document(*edits, methods=methods)).headline == told


def checks(question: str, *edits: Edit) -> list[tuple[str, str]]:
    found = screen_of(document(*edits, methods="cd"))
    return [(check.mark, check.answer) for check in found.checks if check.question == question]


def test_triggers() -> None:
    proved, gaps = (
        "at least 0.5 s between two triggers, proved",
        judged("ZENO-TRACE", evidence={"smallest_gap": {"gap_s": 3.61}}),
    )
    assert checks("Zeno-free?") == [("yes", f"{proved}; no robot triggered twice")]
    assert checks("Zeno-free?", gaps) == [("yes", f"{proved}; least gap 3.61 s")]
    for dwell_s, mark in ((0.049, "partly"), (0.05, "yes")):
        assert checks("Zeno-free?", judged("ZENO-PROOF", inputs={"dwell_s": dwell_s}))[0][0] == mark
    assert checks("Zeno-free?", judged("ZENO-TRACE", status="error")) == [("yes", proved)]
    (bare,) = checks("Zeno-free?", judged("ZENO-PROOF", status="refuted"))
    assert bare == ("no", "no least time between two triggers is proved; no robot triggered twice")
    assert checks("Zeno-free?", only("c", judged("ZENO-TRACE", status="refuted")))[0][:1] == ("no",)


def test_threshold() -> None:
    def timed(found: Document) -> None:
        found["runs"]["d"]["events"].append({"kind": "trigger", "robot": "r1", "t_s": 0.0})
        quality = {"counts": {"false": 1, "missed": 2}, "latest": {"late_s": 0.01}, "earliest": {"late_s": -0.034}}
        only("d", judged("THR-QUALITY", evidence=quality, status="refuted"))(found)

    def lower(found: Document) -> None:
        found["runs"]["d"]["zeta_m"] = 0.0311
        found["scenario"]["resolved"]["runs"]["d"]["set"] = {"decision.threshold.rule": "printed"}

    for value_m, told in ((0.4, "0.4"), (2.22e-15, "0")):
        reached = judged(
            "THR-TRIG", evidence={"ugvs": [{"largest_decision_variable_m": x_m} for x_m in (value_m, 0.0)]}
        )
        assert checks("Threshold correct?", reached) == [("none", f"0 triggers at 1 m (set by hand), {told} m reached")]
    assert checks("Threshold correct?", timed, lower) == [
        ("none", "0 triggers at 1 m (set by hand)"),
        ("no", "1 trigger at 0.0311 m (by (19) as printed), 1 false, 2 missed, at most 0.03 s off"),
    ]
    (above,) = checks("Threshold correct?", timed, metric("above_at_start", ["r1"]))
    assert above[1].endswith(", r1 above the threshold from the start")
    assert checks("Threshold correct?", judged("THR-TRIG", status="error"))[0][0] == "open"


def test_seeds_and_paper() -> None:
    rows = [SEED | {"kept": seed < 7, "seed": seed, "min_distance_m": 0.9 - 0.1 * seed} for seed in (1, 2, 7)]
    assert checks("Other seeds?", lambda found: found["seeds"].extend(rows)) == [
        ("no", "d: distances kept in 2 of 3, all arrive in 3"),
        ("", "the worst: r1\N{EN DASH}rock 0.200 < 0.3 m at 4.00 s, run d, seed 7"),
    ]
    statuses = ("reproduced", "calibrated", "calibrated", "not_reproduced")
    (told,) = checks(
        "Paper reproduced?", lambda found: found["reproduction"].extend({"id": "", "status": s} for s in statuses)
    )
    assert told == ("partly", "3 of 4 numbers match (1 without tuning, 2 after calibration), 1 not")


def test_what_is_not_as_declared_and_what_not_to_conclude() -> None:
    differs = [
        {"id": "SAFE-TRACE", "run": "d", "status": "refuted"},
        {"id": "LIVE-GOAL", "run": "d", "status": "error"},
        {"id": "SAFE-HYP", "run": "d", "status": "inconclusive"},
    ]
    over = {"status": "not_as_expected", "as_expected": 9, "differs": differs, "unpromised": [{}, {}]}
    shown = screen_of(document(man, lambda found: found["overall"].update(over), methods="abd"))
    assert shown.declared == ("no", [
        "9 of 11 checks are as the scenario declares",
        "d: distances failed, d: arrival could not be checked, d: SAFE-HYP undecided",
        "2 more checks: nothing is promised",
    ])  # fmt: skip
    assert [told.partition(":")[0] for told in shown.beware] == [
        "the UAV helps", "robots can keep away from man", "robots arrive from other starts or in reality",
    ]  # fmt: skip
    own = [{"robot": f"r{k}", "drift_m_s": 0.1, "declared_drift_m_s": 0.2, "cover_m": cover_m, "declared_cover_m": 0.5}
           for k, cover_m in enumerate((0.1, 0.3, 0.2))]  # fmt: skip
    told = screen_of(document(judged("SAFE-HYP", evidence={"own_plants": own}))).beware[-1]
    assert told.endswith("r1 showed 0.1 of 0.2 m/s drift and 0.3 of 0.5 m cover here")


def shaken(found: Document, seed: int) -> Document:
    """30 % of all statuses are others, and some runs are missing."""
    changed, rng = copy.deepcopy(found), random.Random(seed)
    for each in changed["claims"]:
        if rng.random() < 0.3:
            each["status"] = rng.choice(STATUSES)
    changed["runs"] = {name: run for name, run in changed["runs"].items() if rng.random() < 0.9}
    return changed


def require_true(found: Document, shown: FirstScreen) -> None:
    for row in shown.rows:
        if row.run in found["runs"]:
            _require_true_row(found, row)
    collided = [row.run for row in shown.rows if row.facts and row.facts.collided]
    assert not collided or any(line.mark == "no" for line in shown.headline)
    assert 1 <= len(shown.headline) <= 2
    assert len(shown.beware) <= 3


def _require_true_row(found: Document, row: Row) -> None:
    run = found["runs"][row.run]
    gaps = [one for robot in run["metrics"]["min_distance_m"].values() for one in robot.values()]
    broken = any(one["value"] < one["safe_distance_m"] - 1e-9 for one in gaps)
    broken |= any(event["kind"] == "collision" for event in run["events"])
    statuses = {each["id"]: each["status"] for each in found["claims"] if each["run"] in ("", row.run)}
    told = " ".join(row.safe.lines)
    if broken:
        assert row.safe.mark == "no"
        assert "proved" not in told
    if row.kept:
        assert statuses["SAFE-TRACE"] in PASSING
    if "kept, proved" in told:
        assert row.run == "d"
        assert statuses["SAFE-HYP"] in PASSING
        assert statuses["SAFE-INV"] == statuses["SAFE-GATE"] == "proved"
    if "not caused by the robots" in told:
        assert statuses["SAFE-OWN"] != "refuted"


WORLDS: list[list[Edit]] = [
    [], [man], [hit()], [man, hit("man"), met("other")], [gap(0.2)], [man, gap(0.1, "man"), met("under way")],
    [away(stands=True), HELD], [man, FAST], [lagging, hit("r2", key="other")],
]  # fmt: skip


@pytest.mark.parametrize("edits", WORLDS)
def test_whatever_the_verdicts_nothing_untrue_is_said(edits: list[Edit]) -> None:
    for seed in range(120):
        found = shaken(document(*edits, methods="abcd"), seed)
        require_true(found, screen_of(found))
        assert max(map(len, screen.text(of(found)).splitlines())) <= screen.WIDTH
    template = html.environment().get_template("first.html.j2")
    assert 'class="headline' in template.render(first=screen_of(found), linked={}, sections=[])
