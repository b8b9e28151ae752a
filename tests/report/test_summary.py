"""The first screen of a report, in words: what happened decides its marks, and nothing is said that was not seen."""

from __future__ import annotations

from typing import Any

import pytest

from airground_drake.report import outcomes, summary

Document = dict[str, Any]
TARGET, STUCK = [0.0, 9.0, 0.0], [3.369, 5.102, 0.0]
D = 2.0


def claim(name: str, run: str = "", status: str = "holds", **more: Any) -> Document:
    known = {"id": name, "run": run, "status": status, "expected": status, "as_expected": True, "exercised": 6}
    return {**known, "evidence": {}, "counterexample": None, **more}


def run(
    method: str, least_m: float = D, end: list[float] = TARGET, events: tuple[Document, ...] = (), **more: Any
) -> Document:
    """A run in which ugv1 comes so near to a rock, and ends somewhere."""
    arrivals = ({"t_s": 23.6, "robot": "ugv1", "kind": "arrival"},) if end == TARGET else ()
    return {
        "method": method,
        "zeta_m": 3.0,
        "events": [*events, *arrivals],
        "metrics": {
            "min_distance_m": {"ugv1": {"rock": {"value": least_m, "t_s": 11.35, "safe_distance_m": D}}, "uav": {}},
            "min_robot_distance_m": {
                name: {other: {"value": 3.0, "t_s": 0.0, "safe_distance_m": 1.0}}
                for name, other in (("ugv1", "uav"), ("uav", "ugv1"))
            },
            "final_position_m": {"ugv1": end, "uav": [0.0, 9.0, 2.0]},
            "gatekeeper": None,
        },
        **more,
    }


def trigger(t_s: float = 14.479) -> Document:
    return {"t_s": t_s, "robot": "ugv1", "kind": "trigger"}


HIT = {"t_s": 11.35, "robot": "ugv1", "kind": "collision"}
PROVED = [claim("SAFE-INV", status="proved"), claim("SAFE-GATE", status="proved"), claim("ZENO-PROOF", status="proved")]


def document(runs: dict[str, Document], *claims: Document, missing: tuple[str, ...] = (), **more: Any) -> Document:
    """A report of these runs, in which every pair was judged as the distances say."""
    names = [*runs, *missing]
    judged = [
        claim(
            "SAFE-TRACE",
            name,
            "holds" if each["metrics"]["min_distance_m"]["ugv1"]["rock"]["value"] >= D else "refuted",
        )
        for name, each in runs.items()
    ]
    given = {(each["id"], each["run"]) for each in claims}
    every = [*claims, *(each for each in judged if (each["id"], each["run"]) not in given)]
    return {
        "scenario": {
            "resolved": {
                "runs": {
                    name: {"method": runs[name]["method"] if name in runs else "c", "composition": "augmented"}
                    for name in names
                },
                "ugvs": {"ugv1": {"target_m": TARGET}},
                "uav": {"name": "uav", "target_m": [0.0, 9.0, 2.0]},
                "arrival_tolerance_m": 0.1,
                "decision": {"min_inter_event_s": 0.5, "trigger": "automaton"},
            }
        },
        "runs": runs,
        "claims": every,
        "reproduction": [],
        "overall": {"status": "as_expected", "why": "", "either": []},
        **more,
    }  # fmt: skip


def lines(found: Document, question: str) -> list[summary.Line]:
    return next((answer.lines for answer in summary.answers(found) if answer.question == question), [])


def row(status: str, name: str = "A1", **more: Any) -> Document:
    return {"id": name, "status": status, "run": "a", "robot": "ugv1", "measure": "stall_position", **more}


def test_case_a_in_short() -> None:
    """Stuck without help, safe with it, as in the paper."""
    stands = {"conditions": [{"robot": "ugv1", "condition": "stands", "margin_m": 1e-3}]}
    found = document(
        {"a": run("a", end=STUCK, events=(trigger(),)), "d": run("d", events=(trigger(),))},
        *PROVED, claim("SAFE-HYP", "d"), claim("LIVE-GOAL", "a", evidence=stands),
        claim("THR-TRIG", "a"), claim("THR-TRIG", "d"), claim("ZENO-TRACE", "d", exercised=0),
        reproduction=[row("calibrated"), row("reproduced", "A2"), row("not_reproduced", "A8")],
    )  # fmt: skip
    assert summary.headline(found) == ("yes", "With help, all arrive safely. Without it, ugv1 is stuck.")
    assert lines(found, "Safe?") == [
        ("yes", "a, d: minimum distance 2.000 m (ugv1 to rock), required 2 m."),
        ("", "Proved for (d), whatever the UAV asks for."),
    ]
    assert lines(found, "Arrived?") == [
        ("yes", "d: all, by 23.6 s."),
        ("none", "a: ugv1 stuck at (3.37, 5.10) m, as in the paper."),
    ]
    assert lines(found, "Zeno-free?") == [
        ("yes", "Proved: triggers are at least 0.5 s apart."),
        ("", "These runs cannot show it: no UGV triggers twice. Scenario dwell does."),
    ]
    assert lines(found, "Threshold?") == [("yes", "Fired at 3 m, at 14.479 s; none missed, none spurious.")]
    assert lines(found, "Paper?") == [
        ("partly", "2 of 3 results match: 1 without tuning, 1 after calibration; not reproduced: A8.")
    ]
    assert "method (a) is also safe elsewhere: that was only seen in these runs" in summary.do_not_conclude(found)
    assert summary.legend(found) == "✓ yes, ≈ in part, \N{EN DASH} neither good nor bad"
    printed = " ".join(summary.text(found).split())
    assert all(each.text in printed for answer in summary.answers(found) for each in answer.lines)


@pytest.mark.parametrize("declared", ["refuted", "holds"])
def test_a_crash_is_never_green_whatever_was_declared(declared: str) -> None:
    """As declared or not is another statement."""
    crash = claim("SAFE-TRACE", "b", "refuted", expected=declared, as_expected=declared == "refuted")
    overall = {"status": "as_expected", "why": "", "either": []}
    if declared == "holds":
        overall |= {"status": "not_as_expected", "why": "1 of 2 checks differs."}
    found = document(
        {"b": run("b", 0.0, STUCK, (HIT,)), "d": run("d")}, crash, *PROVED, claim("SAFE-HYP", "d"),
        reproduction=[row("reproduced")], overall=overall,
    )  # fmt: skip
    mark, says = summary.headline(found)
    told = "Only method (d) is safe and brings everyone home. Under (b), ugv1 collides."
    assert (mark, says) == ("partly", told + " 1 check is not as declared." * (declared == "holds"))
    first = lines(found, "Safe?")[0]
    assert first.mark == "no"
    assert first.text.startswith("b: ugv1 collides, 0.000 m from rock at 11.35 s, required 2 m")
    assert ("(expected)" in first.text) == (declared == "refuted")
    assert lines(found, "Arrived?")[1] == ("no", "b: ugv1 collided, ended at (3.37, 5.10) m.")
    assert summary.as_declared(found).mark == ("yes" if declared == "refuted" else "no")


def test_only_a_crash() -> None:
    found = document({"b": run("b", 0.0, TARGET, (HIT,))})
    assert summary.headline(found) == ("no", "Not safe. Under (b), ugv1 collides.")


def test_a_crash_in_a_compared_recursion_is_not_green_either() -> None:
    runs = {"a": run("a"), "printed": run("a", 0.0, TARGET, (HIT,))}
    found = document(runs, reproduction=[row("reproduced")])
    found["scenario"]["resolved"]["runs"]["printed"]["composition"] = "recursion_listed"
    assert summary.headline(found) == ("partly", "All arrive safely. In run printed, ugv1 collides.")
    found["runs"]["printed"] = run("a", 1.78)
    assert summary.headline(found) == ("yes", "All arrive safely.")
    assert lines(found, "Safe?")[-1].text.startswith(
        "1 run with recursion (5) as printed: all arrive, but ugv1 comes within 1.780 m of rock"
    )


def test_a_robot_that_does_not_arrive() -> None:
    found = document({"d": run("d", end=STUCK)})
    assert summary.headline(found) == ("no", "Safe, but not all arrive: ugv1 does not arrive.")
    assert lines(found, "Arrived?") == [("no", "d: ugv1 ended short of its target, at (3.37, 5.10) m.")]


def test_the_uav_has_three_coordinates_and_counts_where_all_ugvs_are_home() -> None:
    found = document({"d": run("d")})
    found["runs"]["d"]["metrics"]["final_position_m"]["uav"] = [0.0, 9.0, 2.5]
    assert lines(found, "Arrived?") == [("no", "d: uav ended short of its target, at (0.00, 9.00, 2.50) m.")]


def test_a_claim_that_is_refuted_although_the_distances_are_kept() -> None:
    found = document({"d": run("d")}, claim("SAFE-TRACE", "d", "refuted"))
    assert summary.headline(found).mark == "no"
    assert lines(found, "Safe?")[0] == ("no", "d: SAFE-TRACE is refuted (expected).")


@pytest.mark.parametrize("status", ["inconclusive", "error", "not_run"])
def test_what_could_not_be_judged_is_not_safe(status: str) -> None:
    found = document({"d": run("d")}, claim("SAFE-TRACE", "d", status), claim("THR-TRIG", "d", status))
    assert summary.headline(found) == ("open", "Not decided: run d could not be judged.")
    assert lines(found, "Safe?")[0] == ("open", f"d: not known, SAFE-TRACE: {status.replace('_', ' ')}.")
    assert lines(found, "Safe?")[1] == ("open", "Not proved for (d).")
    assert "what could not be judged is fine" in summary.do_not_conclude(found)


def test_a_run_that_is_missing() -> None:
    found = document({"d": run("d")}, missing=("c",), reproduction=[row("reproduced")])
    assert summary.headline(found) == ("open", "Not decided: run c could not be judged.")
    assert ("open", "c: not known, it was not run.") in lines(found, "Safe?")
    assert ("open", "c: not known, it was not run.") in lines(found, "Arrived?")
    assert summary.headline(document({}))[0] == "open"
    assert "✓" not in summary.text(document({})).partition("Marks")[0]


def test_nothing_triggered_and_nothing_came_near() -> None:
    idle = claim("SAFE-TRACE", "d", exercised=0)
    found = document(
        {"d": run("d", 8.0)}, idle, claim("THR-TRIG", "d", exercised=0), claim("ZENO-TRACE", "d", exercised=0)
    )
    (safe, _) = lines(found, "Safe?")
    assert safe.mark == "none"
    assert "not tested" in safe.text
    assert lines(found, "Threshold?") == [("none", "Not tested here: nothing reached the 3 m.")]
    assert lines(found, "Zeno-free?") == [("", "These runs cannot show it: nothing triggered. Scenario dwell does.")]
    assert "the UAV helps: it was never called" in summary.do_not_conclude(found)


def test_the_proof_is_claimed_only_where_its_conditions_were_met() -> None:
    found = document({"d": run("d")}, *PROVED, claim("SAFE-HYP", "d", "refuted"))
    assert lines(found, "Safe?")[1].mark == "no"
    found = document({"d": run("d")}, *PROVED, claim("SAFE-HYP", "d", exercised=0))
    assert "Proved" not in summary.text(found).replace("Proved: triggers", "")


def test_refuted_triggers_and_gaps() -> None:
    found = document(
        {"d": run("d", events=(trigger(1.0), trigger(1.2)))},
        claim("THR-TRIG", "d", "refuted"), claim("ZENO-TRACE", "d", "refuted", counterexample={"gap_s": 0.2}),
    )  # fmt: skip
    assert lines(found, "Threshold?")[0].mark == "no"
    assert lines(found, "Zeno-free?") == [("no", "d: two triggers 0.2 s apart.")]
    seen = claim("ZENO-TRACE", "d", exercised=3, evidence={"smallest_gap": {"gap_s": 0.61}})
    assert lines(document({"d": run("d")}, seen), "Zeno-free?")[0].text == (
        "Seen: 3 gaps between triggers; the smallest is 0.610 s."
    )


@pytest.mark.parametrize(
    ("extra", "real", "marks", "told"),
    [
        (3e-7, 0.28, ["yes", "partly"], "3 m calls the UAV late"),
        (0.02, 4.0, ["partly", "partly"], "3 m calls the UAV early"),
        (0.02, None, ["partly"], "the risk is 5 % higher"),
    ],
)
def test_a_threshold_is_good_or_bad_for_the_assumed_drift_and_for_that_of_the_run(
    extra: float, real: float | None, marks: list[str], told: str
) -> None:
    evidence = {
        "kind": "declared", "threshold_in_force_m": 3.0, "optimal_threshold_m": 2.992, "extra_risk": extra,
        "least_risk": 0.4, "runs": {"a ugv1": {"optimum_for_this_drift_m": real, "drift_m_s": 0.56}},
    }  # fmt: skip
    found = document(
        {"a": run("a", events=(trigger(),))}, claim("THR-CHOICE", evidence=evidence, inputs={"drift_m_s": 6.05})
    )
    assert [line.mark for line in lines(found, "Threshold?")] == marks
    assert told in lines(found, "Threshold?")[-1].text


def test_a_scenario_without_a_counterpart_has_a_table_of_methods() -> None:
    accepted = {"t_s": 8.0, "robot": "ugv1", "kind": "accept"}
    proposed = {"t_s": 8.0, "robot": "ugv1", "kind": "proposal"}
    refused = {"t_s": 8.0, "robot": "ugv1", "kind": "refuse"}
    waits = {"refusals": {"ugv1": {"waits": 2}}}
    found = document(
        {
            "a": run("a", end=STUCK),
            "b": run("b", 0.495, TARGET, (proposed,)),
            "c": run("c", end=STUCK, events=(proposed, refused, refused)),
            "d": run("d", events=(proposed, accepted)),
        },
        *PROVED, claim("SAFE-HYP", "d"),
    )  # fmt: skip
    found["runs"]["c"]["metrics"]["gatekeeper"] = waits
    assert summary.headline(found) == (
        "partly",
        "Only method (d) is safe and brings everyone home. Under (b), ugv1 comes within 0.495 m of rock; under (a) and "
        "(c), ugv1 does not arrive.",
    )
    assert [(each.run, *each.safe, each.arrived.text, each.interventions) for each in summary.methods(found)] == [
        ("a", "yes", "2.000 m, not proved", "0 of 1", "none"),
        ("b", "no", "0.495 m (ugv1 to rock)", "1 of 1", "1 obeyed"),
        ("c", "yes", "2.000 m, not proved", "0 of 1", "2 refused: waiting looked cheaper"),
        ("d", "yes", "2.000 m, proved", "1 of 1", "1 accepted"),
    ]
    assert summary.required_m(found) == "1 to 2 m"
    assert not lines(found, "Safe?")
    assert not lines(found, "Paper?")
    assert not summary.methods(found | {"reproduction": [row("reproduced")]})


def test_the_pair_of_least_margin_counts_not_that_of_least_distance() -> None:
    found = document({"d": run("d", 2.5)})
    near = {"uav": {"value": 1.2, "t_s": 3.0, "safe_distance_m": 1.0}}
    found["runs"]["d"]["metrics"]["min_robot_distance_m"] = {"ugv1": near, "uav": {}}
    assert "1.200 m (ugv1 to uav), required 1 m" in lines(found, "Safe?")[0].text


def test_a_distance_that_falls_short_by_little_does_not_look_kept() -> None:
    assert outcomes.distance(1.99996, 2.0) == "1.99996 m"
    assert outcomes.distance(2.0, 2.0) == "2.000 m"
    assert outcomes.distance(0.49497, 1.0) == "0.495 m"
    assert summary.headline(document({"d": run("d", 1.99996)})).mark == "no"


def test_as_declared_counts_what_failed_deliberately_and_what_was_not_tested() -> None:
    found = document({"b": run("b", 0.5)}, claim("ZENO-TRACE", "b", exercised=0))
    assert summary.as_declared(found) == ("yes", "2 checks as declared: 1 deliberate failure, 1 not tested.")
    found["overall"] = {"status": "inconclusive", "why": "1 check could not be decided.", "either": []}
    assert summary.as_declared(found) == ("open", "1 check could not be decided.")
