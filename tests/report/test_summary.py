"""The first screen of a report: what happened decides its marks, and it says nothing that was not seen."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground_drake.base.statuses import PASSING, STATUSES, UNDECIDED
from airground_drake.report import summary
from airground_drake.report.phrases import Line

Document = dict[str, Any]
TARGET, STUCK, D = [0.0, 9.0, 0.0], [3.369, 5.102, 0.0], 2.0
PLAIN, PRINTED = "augmented", "recursion_listed"


def event(kind: str, t_s: float = 11.35) -> Document:
    return {"t_s": t_s, "robot": "ugv1", "kind": kind}


def claim(name: str, run: str = "", status: str = "holds", **more: Any) -> Document:
    known = {"id": name, "run": run, "status": status, "expected": status, "as_expected": True, "exercised": 6}
    return {**known, "evidence": {}, "counterexample": None, **more}


def run(method: str, least_m: float = D, end: list[float] = TARGET, *events: Document, **more: Any) -> Document:
    """A run in which ugv1 comes so near to a rock, and ends somewhere."""
    apart = {"value": 3.0, "t_s": 0.0, "safe_distance_m": 1.0}
    metrics = {
        "min_distance_m": {"ugv1": {"rock": {"value": least_m, "t_s": 11.35, "safe_distance_m": D}}, "uav": {}},
        "min_robot_distance_m": {"ugv1": {"uav": apart}, "uav": {"ugv1": apart}},
        "final_position_m": {"ugv1": end, "uav": [0.0, 9.0, 2.0]},
        "gatekeeper": None,
    }
    arrival = [event("arrival", 23.6)] * (end == TARGET)
    return {"method": method, "zeta_m": 3.0, "events": [*events, *arrival], "metrics": metrics | more}


HIT, TRIGGER = event("collision"), event("trigger", 14.479)
CRASH = run("b", 0.0, STUCK, HIT)
PROVED = [claim(name, status="proved") for name in ("SAFE-INV", "SAFE-GATE", "ZENO-PROOF")]


def document(runs: dict[str, Document | None], *claims: Document, **more: Any) -> Document:
    """A report of these runs (None: one that is missing), each judged as its distance says unless a claim is given."""
    given = {(each["id"], each["run"]) for each in claims}
    there = {name: each for name, each in runs.items() if each}
    kept = {name: each["metrics"]["min_distance_m"]["ugv1"]["rock"]["value"] >= D for name, each in there.items()}
    judged = [claim("SAFE-TRACE", name, "holds" if kept[name] else "refuted") for name in there]
    specs = {
        name: {"method": each["method"] if each else "c", "composition": PRINTED if "printed" in name else PLAIN}
        for name, each in runs.items()
    }
    resolved = {
        "runs": specs, "ugvs": {"ugv1": {"target_m": TARGET, "max_speed_m_s": 9.0, "preset": {"speed_m_s": 1.0}}},
        "uav": {"name": "uav", "target_m": [0.0, 9.0, 2.0]},
        "arrival_tolerance_m": 0.1, "decision": {"min_inter_event_s": 0.5, "trigger": "automaton"},
        "control": {"period_s": 0.05},
    }  # fmt: skip
    return {
        "scenario": {"resolved": resolved}, "runs": there, "reproduction": [row("reproduced")],
        "claims": [*claims, *(each for each in judged if ("SAFE-TRACE", each["run"]) not in given)],
        "overall": {"status": "as_expected", "why": "", "either": []}, **more,
    }  # fmt: skip


def row(status: str, name: str = "A1") -> Document:
    return {"id": name, "status": status, "run": "a", "robot": "ugv1", "measure": "stall_position"}


def answered(screen: summary.FirstScreen, question: str) -> list[Line]:
    return [line for answer in screen.answers if answer.question == question for line in answer.lines]


def lines(found: Document, question: str) -> list[Line]:
    return answered(summary.first_screen(found), question)


RUNS = st.none() | st.builds(
    run, st.sampled_from("aabcddd"), st.sampled_from([0.5, D, D, 8.0]), st.sampled_from([TARGET, TARGET, STUCK]),
    st.sampled_from([TRIGGER, TRIGGER, HIT]),
)  # fmt: skip
JUDGED = st.builds(
    claim, st.sampled_from(["SAFE-TRACE", "SAFE-HYP", "SAFE-HYP"]), st.sampled_from(["a", "b", "c", "d", "printed"]),
    st.sampled_from([*STATUSES, *PASSING]), as_expected=st.booleans(), exercised=st.sampled_from([0, 6, 6]),
)  # fmt: skip
ROWS = st.lists(
    st.builds(row, st.sampled_from(["reproduced", "reproduced", "calibrated", "not_reproduced"])), max_size=2
)


@settings(max_examples=400)
@given(
    st.dictionaries(st.sampled_from(["a", "b", "c", "d", "printed"]), RUNS, max_size=4),
    st.lists(JUDGED, max_size=4, unique_by=lambda each: (each["id"], each["run"])),
    st.sampled_from(["proved", "proved", "refuted"]), ROWS,
)  # fmt: skip
def test_a_mark_is_good_only_where_nothing_failed(
    runs: dict[str, Document | None], judged: list[Document], gate: str, rows: list[Document]
) -> None:
    """Against an oracle that knows nothing but collisions, distances, ends and statuses."""
    theorems = [claim("SAFE-INV", status="proved"), claim("SAFE-GATE", status=gate)]
    found = document(runs, *theorems, *(each for each in judged if each["run"] in runs), reproduction=rows)
    trace, hypotheses = (
        {each["run"]: each for each in found["claims"] if each["id"] == name} for name in ("SAFE-TRACE", "SAFE-HYP")
    )
    near = {name: each["metrics"]["min_distance_m"]["ugv1"]["rock"]["value"] for name, each in found["runs"].items()}
    hit = {name for name, each in found["runs"].items() if HIT in each["events"]}
    safe = {name for name in near if near[name] >= D and name not in hit and trace[name]["status"] in PASSING}
    unsafe = {name for name in near if near[name] < D or name in hit or trace[name]["status"] == "refuted"}
    home = {name for name in near if found["runs"][name]["metrics"]["final_position_m"]["ugv1"] == TARGET}
    main = {name for name in runs if name != "printed"} or {*runs}
    helped = {name for name in main if not runs[name] or runs[name]["method"] != "a"} or main
    differs = any(not each["as_expected"] and each["status"] not in UNDECIDED for each in found["claims"])

    screen = summary.first_screen(found)
    mark = screen.headline.mark
    good = bool(runs) and helped <= safe & home and not hit and not differs
    assert mark != "yes" or good
    assert mark == "yes" or not (good and main <= safe & home)
    assert mark != "no" or not main & safe & home
    marked = [(line.mark, line.text, {*line.text.partition(":")[0].split(", ")}) for line in answered(screen, "Safe?")]
    assert all(names <= safe for of, _, names in marked if of in ("yes", "none"))
    assert screen.rows or unsafe - ({"printed"} - hit) <= {
        name for of, _, names in marked for name in names if of == "no"
    }
    assert all(
        {*says.partition(":")[0].split(", ")} <= home for of, says in answered(screen, "Arrived?") if of == "yes"
    )
    assert all(
        (of == "yes") == ({each["status"] for each in rows} == {"reproduced"}) for of, _ in answered(screen, "Paper?")
    )
    for each in screen.rows:
        assert (each.safe.mark == "yes") == (each.run in safe and trace[each.run]["exercised"] > 0)
        assert (each.safe.mark == "no") == (each.run in unsafe)
        assert (each.arrived.mark == "yes") == (each.run in home)
    of_d = {name for name in runs if (runs[name] or {"method": "c"})["method"] == "d"}
    met = {name for name, each in hypotheses.items() if each["status"] in PASSING and each["exercised"]}
    printed = " ".join(summary.text(found).split())
    assert "Proved for (d)" not in printed or (of_d <= met and gate == "proved")
    assert ", proved" not in printed or (of_d & met and gate == "proved")
    assert all(line.text in printed for answer in screen.answers for line in answer.lines)


@pytest.mark.parametrize(
    ("runs", "claims", "mark", "says"),
    [
        ({"b": CRASH, "d": run("d")}, [], "partly",
         "Only method (d) is safe and brings everyone home. Under (b), ugv1 collides."),
        ({"b": CRASH}, [claim("SAFE-TRACE", "b", "refuted", expected="holds", as_expected=False)], "no",
         "Not safe. Under (b), ugv1 collides. 1 check is not as declared."),
        ({"b": CRASH, "d": run("d")}, [claim("SAFE-TRACE", "d", "error")], "no",
         "No method brings everyone home safely. Under (b), ugv1 collides."),
        ({"a": run("a"), "printed": run("a", 0.0, TARGET, HIT)}, [], "partly",
         "All arrive safely. In run printed, ugv1 collides."),
        ({"a": run("a"), "d": run("d"), "printed": run("a", 1.78)}, [], "yes",
         "With and without help, all arrive safely."),
        ({"d": run("d", end=STUCK)}, [], "no", "Safe, but not all arrive: ugv1 does not arrive."),
        ({"d": run("d", 1.99996)}, [], "no", "Not safe. Under (d), ugv1 comes within 1.99996 m of rock."),
        ({"d": run("d")}, [claim("SAFE-TRACE", "d", "refuted")], "no", "Not safe. Under (d), SAFE-TRACE is refuted."),
        ({"d": run("d")}, [claim("SAFE-TRACE", "d", "error")], "open", "Not decided: run d could not be judged."),
        ({"d": run("d"), "c": None}, [], "open", "Not decided: run c could not be judged."),
        ({}, [], "open", "Nothing was run."),
        ({"a": run("a", end=STUCK), "b": run("b", 0.495), "c": run("c", end=STUCK), "d": run("d")}, [], "partly",
         "Only method (d) is safe and brings everyone home. Under (b), ugv1 comes within 0.495 m of rock; "
         "under (a) and (c), ugv1 does not arrive."),
    ],
)  # fmt: skip
def test_the_headline(runs: dict[str, Document | None], claims: list[Document], mark: str, says: str) -> None:
    assert summary.headline(document(runs, *claims)) == (mark, says)


def test_who_did_not_arrive_and_where_it_is() -> None:
    found = document({"b": CRASH, "c": None, "d": run("d")})
    found["runs"]["d"]["metrics"]["final_position_m"]["uav"] = [0.0, 9.0, 2.5]
    assert lines(found, "Arrived?") == [
        ("no", "b: ugv1 collided, ended at (3.37, 5.10) m."),
        ("open", "c: not known, it was not run."),
        ("no", "d: uav ended short of its target, at (0.00, 9.00, 2.50) m."),
    ]


def test_what_nothing_tested_is_not_good() -> None:
    idle = [claim(name, "d", exercised=0) for name in ("SAFE-TRACE", "THR-TRIG", "ZENO-TRACE")]
    found = document({"d": run("d", 8.0)}, *idle)
    first = [lines(found, question)[0] for question in ("Safe?", "Zeno-free?", "Threshold?")]
    assert [mark for mark, _ in first] == ["none", "", "none"]
    assert "the UAV helps: it was never called" in summary.first_screen(found).beware


def test_refuted_triggers_and_gaps() -> None:
    bad = [claim("THR-TRIG", "d", "refuted"), claim("ZENO-TRACE", "d", "refuted", counterexample={"gap_s": 0.2})]
    found = document({"d": run("d", D, TARGET, TRIGGER)}, *bad, claim("SAFE-HYP", "d", "refuted"), *PROVED[:2])
    assert [lines(found, question)[-1][0] for question in ("Threshold?", "Zeno-free?", "Safe?")] == ["no"] * 3
    seen = claim("ZENO-TRACE", "d", exercised=3, evidence={"smallest_gap": {"gap_s": 0.61}})
    assert lines(document({"d": run("d")}, seen), "Zeno-free?") == [
        ("", "Seen: 3 gaps between triggers; the smallest is 0.610 s.")
    ]


def quality(run: str, status: str = "holds", margin: float = 0.9, **found: Any) -> Document:
    """THR-QUALITY of a run, with so many decisions of each kind."""
    counts = {kind: found.pop(kind, 0) for kind in ("served", "early", "false", "missed")}
    evidence = {"counts": counts, "latest": None, "earliest": None, "ddm": {}} | found
    return claim("THR-QUALITY", run, status, margin=margin, evidence=evidence)


AGAINST = "Against the task error without noise"
BEST = "the Bayes optimum 2.992 m for the assumed 6 m/s and 10 m/√s."
OFTEN_WRONG: Document = {
    "drift_m_s": 0.56, "noise_m_sqrt_s": 10.0, "error_rate": 5 / 7, "error_rate_of_18": 0.4916, "decision_time_s": 8.3,
    "decision_time_of_17_s": 0.09, "decision_time_without_noise_s": 5.35,
}  # fmt: skip


def test_the_trigger_follows_its_variable_and_that_is_not_the_task_error() -> None:
    """Both are said: none missed by its own variable, and how late, early, false and missed without the noise."""
    late, early = {"late_s": 5.07, "error_m": 5.84}, {"late_s": -0.2, "error_m": 2.5}
    runs = {name: run(name, D, TARGET, TRIGGER) for name in "abcd"}
    found = document(
        runs, *(claim("THR-TRIG", name) for name in runs),
        quality("a", "refuted", -3.9, served=2, false=8, missed=1, latest=late, ddm={"ugv1": OFTEN_WRONG}),
        quality("b", served=1, earliest=early), quality("d", served=1, earliest=early),
        claim("THR-QUALITY", "c", "error"),
    )  # fmt: skip
    assert lines(found, "Threshold?") == [
        ("yes", "Fired at 3 m, at 14.479 s. Follows its own variable exactly: none missed, none spurious."),
        ("open", "c: not compared with the task error without noise (THR-QUALITY)."),
        ("no", f"{AGAINST} (a): up to 5.07 s late (at 5.84 m), 8 of 10 false alarms, 1 missed."),
        ("yes", f"{AGAINST} (b, d): up to 0.20 s early (at 2.50 m), no false alarm, none missed."),
        ("", "Decisions about ugv1 in run a: 71 % wrong, 8.3 s in the mean. "
             "By (17)-(18), for its 0.56 m/s and 10 m/√s: 49 % wrong, 0.09 s."),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("rule", "kind", "extra", "drift", "told"),
    [
        ("fixed", "declared", 3e-7, 6.0, ("yes", f"3 m, set by hand (rule fixed), costs no more than {BEST}")),
        ("printed", "declared", 0.02, 6.0,
         ("partly", f"3 m, by (19) as printed (rule printed), costs 5 % more risk than {BEST}")),
        ("printed", "declared", 1.0, 6.0,
         ("partly", f"3 m, by (19) as printed (rule printed), costs 3.5 times the risk of {BEST}")),
        ("bayes", "optimal", 0.0, 6.0, ("yes", "3 m is the Bayes optimum for the assumed 6 m/s and 10 m/√s.")),
        ("bayes", "optimal", 0.0, 11.0, ("none", "3 m is the Bayes optimum for the assumed 11 m/s and 10 m/√s; no task "
                                                 "error here grows faster than 10 m/s.")),
    ],
)  # fmt: skip
def test_which_rule_gave_the_threshold_and_what_it_costs_for_the_assumed_numbers(
    rule: str, kind: str, extra: float, drift: float, told: tuple[str, str]
) -> None:
    assert lines(chosen(rule, kind, extra, {}, drift), "Threshold?")[-1] == told


@pytest.mark.parametrize(
    ("noise", "best", "extra", "mark", "told"),
    [
        (0.004, 0.00016, 2.68, "partly", "0.00016 m is best, and 3 m costs as much as a delay of 5.4 s."),
        (0.0, 0.0, 2.68, "partly", "the lower, the better, and 3 m costs as much as a delay of 5.4 s."),
        (10.0, 2.99, 1e-4, "yes", "too, no threshold is better."),
    ],
)
def test_what_the_threshold_costs_for_the_numbers_of_the_run(
    noise: float, best: float, extra: float, mark: str, told: str
) -> None:
    """The drift and the noise are both the run's."""
    row = {"drift_m_s": 0.56, "noise_m_sqrt_s": noise, "threshold_m": 3.0, "optimum_m": best, "extra_risk": extra}
    better = row | {"drift_m_s": 0.9, "extra_risk": 0.0}
    found = lines(chosen("fixed", "declared", 0.0, {"a ugv1": row, "b ugv1": better}), "Threshold?")
    assert found[-1][0] == mark
    assert found[-1][1].startswith(f"ugv1 had 0.56 m/s and {noise:g} m/√s in run a: for these, ")
    assert found[-1][1].endswith(told)


def chosen(rule: str, kind: str, extra: float, runs: Document, drift: float = 6.0) -> Document:
    """A report in which THR-CHOICE compares thresholds."""
    evidence = {
        "kind": kind, "rule": rule, "threshold_in_force_m": 3.0, "optimal_threshold_m": 2.992, "extra_risk": extra,
        "least_risk": 0.4, "runs": runs,
    }  # fmt: skip
    inputs = {"drift_m_s": drift, "noise_m_sqrt_s": 10.0, "c1_1_s": 0.5, "c2": 1.0}
    return document({"a": run("a", D, TARGET, TRIGGER)}, claim("THR-CHOICE", evidence=evidence, inputs=inputs))


@pytest.mark.parametrize(("dwell_s", "mark"), [(0.5, "yes"), (0.05, "yes"), (0.049, "partly"), (1e-6, "partly")])
def test_a_dwell_below_the_control_period_is_no_protection(dwell_s: float, mark: str) -> None:
    found = document({"d": run("d")}, *PROVED)
    found["scenario"]["resolved"]["decision"]["min_inter_event_s"] = dwell_s
    (first, *_) = lines(found, "Zeno-free?")
    assert first[0] == mark
    assert ("No practical protection: that is shorter than the control period, 0.05 s" in first[1]) == (mark != "yes")


def test_a_scenario_without_a_counterpart_has_a_table_of_methods() -> None:
    proposed, accepted, refused = event("proposal"), event("accept"), event("refuse")
    waits = {"refusals": {"ugv1": {"waits": 2, "no_plan": 1}}}
    runs = {
        "a": run("a", end=STUCK), "b": run("b", 0.495, TARGET, proposed), "d": run("d", D, TARGET, proposed, accepted),
        "c": run("c", D, STUCK, proposed, refused, refused, gatekeeper=waits),
        "d2": run("d", D, STUCK) | {"faults": [{}, {}]},
        "d3": run("d", D, TARGET, proposed, accepted) | {"faults": [{}]},
    }  # fmt: skip
    met = [claim("SAFE-HYP", name) for name in ("d", "d2", "d3")]
    screen = summary.first_screen(document(runs, *PROVED, *met, reproduction=[]))
    assert [(each.run, *each.safe, each.arrived.text, each.interventions) for each in screen.rows] == [
        ("a", "yes", "2.000 m, not proved", "0 of 1", "none"),
        ("b", "no", "0.495 m (ugv1 to rock)", "1 of 1", "1 obeyed"),
        ("d", "yes", "2.000 m, proved", "1 of 1", "1 accepted"),
        ("c", "yes", "2.000 m, not proved", "0 of 1", "2 refused: waiting looked cheaper"),
        ("d2", "yes", "2.000 m, proved", "0 of 1", "policy failed 2 times"),
        ("d3", "yes", "2.000 m, proved", "1 of 1", "1 accepted; policy failed 1 time"),
    ]
    assert screen.required == "1 to 2 m"
    assert [answer.question for answer in screen.answers] == ["Zeno-free?", "Threshold?"]


def test_the_pair_of_least_margin_counts_not_that_of_least_distance() -> None:
    near = {"ugv1": {"uav": {"value": 1.2, "t_s": 3.0, "safe_distance_m": 1.0}}, "uav": {}}
    found = document({"d": run("d", 2.5, min_robot_distance_m=near)})
    assert "1.200 m (ugv1 to uav), required 1 m" in lines(found, "Safe?")[0][1]


def test_what_is_not_as_declared_says_so() -> None:
    for status, mark in (("not_as_expected", "no"), ("inconclusive", "open")):
        overall = {"status": status, "why": "1 check differs.", "either": []}
        assert summary.as_declared(document({"d": run("d")}, overall=overall)) == (mark, "1 check differs.")
