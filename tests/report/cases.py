"""Case A in small, as far as a report looks at it, and verdicts on it."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from builders.paths import Corners, along

from airground_drake.base.statuses import Status
from airground_drake.report import document
from airground_drake.report.audit import of_runs
from airground_drake.scenario.schema import Choice, Decision, Obstacle, Preset, Reproduction, Run, Scenario, Uav, Ugv
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TraceClaim, Verdict
from airground_drake.verify.finding import Finding

STALL = (3.369, 5.102)
APPROACH: Corners = [(0, 3.3, 0.5), (4, 4.2, 3), (7, 4.2, 4.6), (9, *STALL)]
STALLING: Corners = [*APPROACH, (30, *STALL)]
GOING_ROUND: Corners = [*APPROACH, (14.5, *STALL), (16, 6.5, 4), (18, 6.5, 9), (23, 3.3, 13), (30, 3.3, 13)]
SQUEEZING: Corners = [*APPROACH, (11, 2.83, 5.65), (13, 2.0, 7), (23, 3.3, 13), (30, 3.3, 13)]
BESIDE: Corners = [(0, -2.6, 0.5), (23, -2.6, 13), (30, -1.0, 13)]
FLIGHT: Corners = [(0, 0, 1, 2), (23, 0, 13, 2), (30, 0, 13, 2)]


def event(t: float, kind: str, robot: str = "ugv1") -> dict[str, Any]:
    return {"t_s": t, "robot": robot, "kind": kind, "position_m": [*STALL, 0.0]}


def make_scenario(ugv1: str = "ugv1", **more: Any) -> Scenario:
    """Case A in small, as far as a report looks at it."""
    return Scenario(
        name="case_a",
        title="Case A",
        description="A small case.",
        duration_s=30.0,
        ugvs={
            ugv1: Ugv([3.3, 0.5, 0.0], [3.3, 13.0, 0.0], Preset([[3.3, 0.0, 0.0], [3.3, 13.0, 0.0]], 0.5606)),
            "ugv2": Ugv([-2.6, 0.5, 0.0], [-2.6, 13.0, 0.0], Preset([[-2.6, 0.0, 0.0], [-2.6, 13.0, 0.0]], 0.5606)),
        },
        uav=Uav(start_m=[0.0, 1.0, 2.0], target_m=[0.0, 13.0, 2.0]),
        obstacles={
            "obstacle_1": Obstacle([1.7, 4.0, 0.0]),
            "obstacle_2": Obstacle([4.0, 7.0, 0.0]),
            "obstacle_0": Obstacle([-20.0, 5.0, 0.0], known_to_uav=False),
        },
        decision=Decision(release_m=1.5),
        runs={
            "a": Run("a", stalls_m={ugv1: [3.37, 5.1, 0.0]}),
            "c": Run("c"),
            "a_printed": Run("a", "recursion_listed", expected={"SAFE-TRACE": "refuted"}),
        },
        reproduction=[
            Reproduction("A1", "stalls at", "stall_position", "a", ugv1, [3.3, 5.1], "m", 0.1, why="as it is"),
            Reproduction("A5", "triggered at", "trigger_time", "c", ugv1, [14.45], "s", 0.1, True, "speed set"),
            Reproduction("A7", "succeeds", "intervention_succeeds", "c", ugv1, [1.0], "yes/no", why="all of it"),
        ],
        choices=[Choice(f"ugvs.{ugv1}.preset.speed_m_s", "calibrated", "1 m/s", reason="the trigger time")],
        **more,
    )


def make_trace(
    scenario: Scenario, run: str = "a", corners: Corners = STALLING, events: Sequence[dict[str, Any]] = (), **more: Any
) -> Trace:
    """The first UGV along corners, the second beside it, both accepting an intervention between 14.5 s and 17 s."""
    decisions = [
        {"t_s": 14.5, "accept_throughout": 80.0, "refuse_throughout": 100.0, "gap": 0.01},
        {"t_s": 15.0},
    ]
    known = {"robot": next(iter(scenario.ugvs)), "policy": "detour", "decision": "accept"}
    return along(
        asdict(scenario),
        run,
        [corners, BESIDE, FLIGHT],
        events,
        intervention_s=(14.5, 17.0),
        decisions=[known | each for each in decisions] if run == "c" else (),
        timings={"wall_s": 0.5, "decision_times_s": [0.001, 0.002]},
        **more,
    )


class Kept(TraceClaim):
    id = "SAFE-TRACE"
    subject = "distances"
    statement = "Every robot keeps its distance"
    formula = "D >= d"
    method = "geometry"
    equations = "(7)"
    assumptions = ("straight lines",)
    does_not_establish = "anything else"
    exercised_by = "pairs"

    def check(self, trace: Trace) -> Finding:
        raise NotImplementedError


def verdict(run: str, status: Status = "holds", expected: str = "holds", **finding: Any) -> Verdict:
    return Verdict.of(Kept(), run, Finding(status, **finding), expected)


ASKED = [event(14.6, "proposal"), event(14.6, "proposal", "ugv2")]
SUCCESS = [event(14.5, "trigger"), *ASKED, event(14.65, "accept"), event(17, "release")]


def make_traces(scenario: Scenario) -> dict[str, Trace]:
    ugv1 = next(iter(scenario.ugvs))
    success = [each if each["robot"] == "ugv2" else {**each, "robot": ugv1} for each in SUCCESS]
    return {
        "a": make_trace(scenario, "a", STALLING, [event(14.5, "trigger", ugv1)]),
        "c": make_trace(scenario, "c", GOING_ROUND, success),
        "a_printed": make_trace(scenario, "a_printed", SQUEEZING),
    }


FINE = [verdict("a"), verdict("c", margin=float("nan")), verdict("a_printed", "refuted", "refuted", margin=-0.2)]


def built(scenario: Scenario, traces: dict[str, Trace], verdicts: list[Verdict]) -> dict[str, Any]:
    about = {"package": "0.1.0", "seed": 1, "started": "now"}
    return document.build(scenario, traces, verdicts, about, audit=of_runs(scenario, traces))
