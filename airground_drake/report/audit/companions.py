"""Findings that rest on runs of other scenarios than the report's own. They are simulated here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydrake.solvers import ClarabelSolver, MathematicalProgram

from airground_drake.base.arrays import Array
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.report.audit.item import Item, item
from airground_drake.report.audit.literal import literal_rule
from airground_drake.report.figures.timelines import nearest_distance
from airground_drake.report.metrics import closest_obstacle
from airground_drake.report.reproduction import MEASURES
from airground_drake.report.view.canvas import thin
from airground_drake.scenario.load import load
from airground_drake.scenario.schema import Scenario
from airground_drake.scenario.world import make_world
from airground_drake.sim.components import make_outlook, make_patience, make_presets
from airground_drake.sim.simulation import Recorder, simulate
from airground_drake.sim.trace import Trace
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.outcome import Outcome
from airground_drake.ugv.outcome_gatekeeper import OutcomeGatekeepers
from airground_drake.ugv.rollout import View

# Relaxation (27), with half-planes, and rounding (28)-(29), whatever the default of a scenario.
PAPERS_ROUTE = "gatekeeper.route=relaxed"
WAY_POINTS = 120  # points of a line that a finding keeps for its figure
EVERYTHING = "d, all accepted"
LIGHT = "c, error weight 1"


class Believing(OutcomeGatekeepers):
    """Gatekeepers that consider every proposal useful."""

    def foresee(self, seen: View, law: UgvLaw, proposal: Proposal) -> tuple[Outcome, Outcome]:
        """Refusing stalls, accepting does not."""
        steps = np.arange(0.0, 2.0, law.avoidance.period)
        follows = proposal.motion.sample(seen.t + steps)
        return Outcome(follows, True, 1.0, 1.0), Outcome(follows, False, 0.0, 0.0)

    @classmethod
    def of(cls, scenario: Scenario, law: UgvLaw) -> Believing:
        return cls(make_world(scenario), law, make_presets(scenario), make_outlook(scenario), make_patience(scenario))


def companion_findings() -> list[Item]:
    """Items 7, 10, 11 and 23 to 25."""
    direct, gated = (_run("case_b", run, "duration_s=13.0", PAPERS_ROUTE) for run in ("b", "c"))
    return [
        _sign(), _soft_gate(), _no_dynamics(gated), _method_b(direct, gated), _proper_tasks(direct), literal_rule(),
    ]  # fmt: skip


def _run(name: str, run: str, *changes: str) -> Trace:
    return simulate(load(name, ("reproduction=[]", *changes)), run)


def _sign() -> Item:
    """Item 7: UGV2's preset x with the printed and with the opposite sign."""
    evidence = {}
    for sign, x in (("printed", 1.3), ("ours", -1.3)):
        change = f"ugvs.ugv2.preset.waypoints_m=[[{x}, 0.0, 0.0], [{x}, 13.0, 0.0], [-1.0, 13.0, 0.0]]"
        trace = _run("case_a", "a", change)
        way = trace.position("ugv2")
        evidence[sign] = {
            "preset_x_m": x,
            "ends_at_m": way[-1].tolist(),
            "way_m": way[thin(way[:, :2], WAY_POINTS), :2].round(3).tolist(),
            "stalls_at_m": MEASURES["stall_position"](trace, "ugv2"),
            "arrives": bool(MEASURES["arrives"](trace, "ugv2")[0]),
            "command": f"case_a with --set {change}, run a",
        }
    return item(
        7, "Table 1",
        "The paper prints x = 1.3 m for UGV2's preset trajectory and says that UGV2 arrives on its own. "
        "With x = 1.3 m it stalls; with x = -1.3 m it arrives.",
        {"x_m": 1.3, "arrives": evidence["printed"]["arrives"]}, {"x_m": -1.3, "arrives": evidence["ours"]["arrives"]},
        bool(evidence["printed"]["stalls_at_m"]) and bool(evidence["ours"]["arrives"]), evidence, unit="m",
    )  # fmt: skip


def _soft_gate() -> Item:
    """Item 10: (c) accepts an intervention although it predicts a distance below d; (d) makes it harmless."""
    scenario = load("soft_gate")
    d, gate = scenario.safe_distance.obstacle_m, scenario.gatekeeper
    traces = {name: _run("soft_gate", name, PAPERS_ROUTE) for name in ("c", "d")} | {
        EVERYTHING: Recorder(scenario, "d", make_gatekeepers=Believing.of).simulate()
    }
    light = _run("soft_gate", "c", PAPERS_ROUTE, "gatekeeper.error_weight_1_m2_s=1")
    evidence: dict[str, Any] = {}
    for name, trace in (*traces.items(), (LIGHT, light)):
        nearest = closest_obstacle(trace, "ugv1")
        accepted = trace.decisions.loc[trace.decisions["decision"] == "accept", "predicted_clearance_m"]
        evidence[name] = {
            "accepted": len(accepted),
            "least_predicted_clearance_of_accepted_m": (
                float(accepted.min()) if len(accepted) and name in ("c", LIGHT) else None
            ),
            "min_distance_m": nearest.value if nearest else None,
            "t_s": nearest.t_s if nearest else None,
        }
    paper, ours = evidence["c"], evidence[EVERYTHING]
    predicted = paper["least_predicted_clearance_of_accepted_m"]
    shown = predicted is not None and predicted < 0.0 and paper["min_distance_m"] < d
    return item(
        10, "(26d)-(26e)",
        "The soft constraint is no safety guarantee: a large enough gain in task error outweighs its "
        "violation, and the gatekeeper accepts although it predicts the violation. Under (d) every distance stays at "
        "least d, even if each of these proposals is accepted and executed. The failure needs an error weight of "
        f"{gate.error_weight_1_m2_s:g} and a slack weight of {gate.slack_weight_1_m2_s:g}; with an error weight of "
        f"1 {'nothing is accepted' if not evidence[LIGHT]['accepted'] else 'it happens, too'}. The paper gives neither "
        "the weights nor a bound on them.",
        {"min_distance_m": paper["min_distance_m"], "predicted_clearance_m": predicted},
        {"min_distance_m": ours["min_distance_m"]},
        shown and ours["accepted"] > 0 and ours["min_distance_m"] >= d - 1e-9,
        {
            **evidence, "safe_distance_m": d, "command": f"airground report soft_gate --set {PAPERS_ROUTE}",
            "error_weight_1_m2_s": gate.error_weight_1_m2_s, "slack_weight_1_m2_s": gate.slack_weight_1_m2_s,
            "distance_to_the_nearest_obstacle": _gaps(traces),
        },
        unit="m",
    )  # fmt: skip


def _gaps(traces: Mapping[str, Trace]) -> dict[str, list[float]]:
    """Distances of UGV1 to its nearest obstacle over common times, the closest approaches among them."""
    gaps = {name: nearest_distance(trace, "ugv1") for name, trace in traces.items()}
    first = next(iter(traces.values()))
    closest = [float(trace.t[gaps[name].argmin()]) for name, trace in traces.items()]
    t_s = np.unique([*np.linspace(first.t[0], first.t[-1], WAY_POINTS), *closest])
    lines = {f"{name}_m": np.interp(t_s, trace.t, gaps[name]).round(4).tolist() for name, trace in traces.items()}
    return {"t_s": t_s.round(6).tolist(), **lines}


def _no_dynamics(trace: Trace) -> Item:
    """Item 11: (26) and (27) as printed have no kinematics: their optimum does not depend on the decision."""
    first, decision = trace.problems.iloc[0], trace.decisions.iloc[0]
    reference = np.asarray(first["reference_m"]).reshape(-1, 3)
    start, dt = np.asarray(first["initial_m"]), float(first["dt_s"])
    states = {"printed": _printed_optimum(reference)}
    for name in ("accept", "refuse"):
        states[name] = start + dt * np.cumsum(np.reshape(first[f"{name}_m_s"], reference.shape), axis=0)
    cost = {
        name: float(float(first["error_weight_1_m2_s"]) * dt * np.sum((at - reference) ** 2))
        for name, at in states.items()
    }
    costs = {name: {"printed": cost["printed"], "with_23": cost[name]} for name in ("accept", "refuse")}
    printed, ours = (abs(costs["accept"][kind] - costs["refuse"][kind]) for kind in ("printed", "with_23"))
    with_slack = float(abs(decision["accept_throughout"] - decision["refuse_throughout"]))
    errors = {f"{name}_m": np.linalg.norm(at - reference, axis=1).round(6).tolist() for name, at in states.items()}
    return item(
        11, "(26), (27)",
        "Neither (26) nor (27) lists the kinematics (23) among its constraints. As printed the states are "
        "free. If only task errors count, they follow the reference exactly, and accepting costs as much as refusing. "
        f"With (23) the task errors of the two differ by {ours:.3f}. With the price of the slack, the costs (25) "
        f"differ by {with_slack:.0f}.",
        {"cost_accept_minus_refuse": printed},
        {"cost_accept_minus_refuse": ours, "cost_with_slack_accept_minus_refuse": with_slack},
        printed < 1e-6 < ours,
        {
            "problem": "the first decision of case_b, run c; task errors only, but for with_slack",
            "t_s": float(decision["t_s"]), "cost": costs,
            "task_error": {"t_s": (dt * np.arange(1, len(reference) + 1)).round(6).tolist(), **errors},
        },
    )  # fmt: skip


def _printed_optimum(reference: Array) -> Array:
    """States (N, 3), m, of least task error in (27) as printed, which constrains only the initial one."""
    program = MathematicalProgram()
    states = program.NewContinuousVariables(*reference.shape, "rho")
    program.AddQuadraticErrorCost(np.eye(states.size), reference.ravel(), states.ravel())
    result = ClarabelSolver().Solve(program)
    return np.asarray(result.GetSolution(states)) if result.is_success() else np.full(reference.shape, np.nan)


def _method_b(direct: Trace, gated: Trace) -> Item:
    """Item 23: method (b) with a gatekeeper, as in section 5.1, is method (c)."""
    answer, traces = gated.decisions.iloc[0], {"without": direct, "with": gated}
    nearest = {name: closest_obstacle(trace, "ugv1") for name, trace in traces.items()}
    least = {name: round(closest.value, 9) if closest else None for name, closest in nearest.items()}
    triggers = {name: MEASURES["trigger_time"](trace, "ugv1") for name, trace in traces.items()}
    return item(
        23, "section 5, Figures 6 and 10",
        "Method (b) is not the same in both cases. Section 5 introduces it with an effective intervention. "
        "In 5.1 the UGV accepts that 'after the MPC intervention task decision maker'. In 5.2 it executes a wrong one, "
        "and only method (c) has the decision maker. In our case B the UGV refuses with a gatekeeper and collides "
        "without one, after the same trigger, so (b) cannot have one there. Here (b) never has a gatekeeper.",
        "5.1: (b) with the MPC; 5.2: (b) without",
        {"distance_without_m": least["without"], "first_answer_with": str(answer["decision"])},
        not len(direct.decisions) and answer["decision"] == "refuse"
        and triggers["without"] == triggers["with"] and least["without"] is not None and least["without"] < 0.05,
        {
            "min_distance_m": least, "triggers_s": triggers, "answered_s": float(answer["t_s"]),
            "runs": "case_b, b (without) and c (with), 13 s", "sections 5.1 and 5.2": "by reading",
        },
    )  # fmt: skip


def _proper_tasks(direct: Trace) -> Item:
    """Item 24: the paper calls interventions proper and bidirectional, but no equation says so."""
    ends = np.asarray(direct.proposals.iloc[0]["positions_m"]).reshape(-1, 3)[-1]
    scenario = load("case_b")
    obstacle = np.asarray(scenario.obstacles["sudden"].position_m)
    away, d = float(np.linalg.norm(ends - obstacle)), scenario.safe_distance.obstacle_m
    return item(
        24, "sections 1, 3.2, 5.2 and 6",
        "Section 6 says 'it is assumed that UAVs can give proper intervention tasks'. Assumption 1 only "
        "says that the UAV can give interventions, and the paper does not define 'proper'. Section 4 and case B are "
        "about an intervention that is not proper; in our case B it ends at the obstacle. Section 1 claims "
        "'bidirectional interventions'. No equation contains them: in (14), (20) and (23) the UAV intervenes on a UGV, "
        "and only the UGVs' positions go back to the UAV, in (9) and (15).",
        "interventions are proper and bidirectional",
        {"wrong_intervention_to_obstacle_m": away, "safe_distance_m": d},
        away < d, {"ends_at_m": ends.tolist(), "obstacle_m": obstacle.tolist(), "rest": "by reading"},
    )  # fmt: skip
