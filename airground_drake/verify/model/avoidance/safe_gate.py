"""SAFE-GATE: under method (d) no intervention, accepted or not, leaves the safe set.

Symbols and certificates are those of `safe_inv.py`; the obligations are `gate()` of `obligations.py`, the attacks on
the running layer and controllers are in `hostile_inputs.py`.
"""

from __future__ import annotations

from dataclasses import replace

from airground_drake.diagram import build_model
from airground_drake.scenarios.load import from_data
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.engines.prover import discharge, finding, proved_again
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.avoidance.constants import Inputs, built_from, compositions_of, constants
from airground_drake.verify.model.avoidance.hostile_inputs import hostile_team, non_finite, postcondition
from airground_drake.verify.model.avoidance.obligations import LIMIT_S, gate
from airground_drake.verify.model.avoidance.wiring import compare, difference

QUANTITY = "least slack n.v - b of an avoidance inequality over all hostile inputs to the layer"


class SafeGate(ModelClaim):
    """SAFE-GATE."""

    id = "SAFE-GATE"
    summary = "Under method (d) nothing that the UAV asks for can bring a robot closer than the safe distance."
    statement = (
        "Under method (d) no intervention, accepted or not, leaves the safe set: the avoidance layer is applied last, "
        "to whatever velocity comes from below, and from a safe state its output meets every inequality "
        "whatever its input was; SAFE-INV does the rest. Neither the optimiser nor its horizon, nor the UAV as an "
        "adviser, nor its intervention is trusted; as a robot the UAV must keep its own share of each inequality."
    )
    formula = "b_k <= 0 as computed, for all k => for every u: v = avoid(u) has n_k.v >= b_k for all k, as floats"
    latex = (
        r"b_k \le 0 \text{ for all } k \; \Rightarrow \; n_k^\top \operatorname{avoid}(u) \ge b_k \text{ for "
        r"all } k \text{ and every } u",
    )
    method = (
        "v = 0 meets all inequalities from a safe state, and the last step of the layer shortens the velocity until "
        "none that v = 0 meets is broken; its loop ends only when a comparison of floats finds none, which is the "
        "postcondition itself (polynomial certificates show that one pass suffices but for rounding; every further one "
        "shortens v). The running layer is evaluated on hostile inputs from a deterministic sample of safe states, the "
        "running UGV controller with hostile interventions, accepted or not, and the running UAV controller; the order "
        "of priorities is read from the built diagram of method (d). The controllers of that diagram are driven "
        "through their ports, too, by hostile presets, proposals and answers: their commands must meet every "
        "inequality of the scenario, and execute a proposal only where that very proposal was accepted."
    )
    equations = "(20) against the priorities of method (d); (5), (7)-(8), (14)"
    assumptions = (
        "SAFE-INV and its assumptions; the state is safe at the start.",
        "b_k <= 0 as computed is D_k >= d_k up to rounding: the sampled states are moved outward by some 1e-15 m.",
        "The UAV flies by its own avoidance layer: it takes half of each inequality, straight above a UGV all of it.",
    )
    does_not_establish = (
        "That an intervention is useful, or that the robots get anywhere. Nothing is said of methods (b) and (c), "
        "which put interventions on top. The sample supports the reading of the code; the proof is about its equations."
    )

    exercised_by = "obligations of the proof"

    def inputs(self, scenario: Scenario) -> Inputs:
        """Those of SAFE-INV, and what the diagram of method (d) was built with."""
        given = built_from(scenario)
        ugvs = build_model(from_data(given, "the scenario"), "d").diagram.GetSubsystemByName("ugvs")
        controller = ugvs.GetSubsystemByName("ugv_controller")
        built = {
            "intervention_on_top": bool(controller.law.intervention_on_top),
            "compositions": compositions_of(scenario),
        }
        return constants(scenario) | {"method_d": built, "scenario": given}

    def check(self, inputs: Inputs) -> Finding:
        """Discharge the obligations and attack the running code; margin: the worst slack of the sample, m/s."""
        built = inputs["method_d"]
        layers = [postcondition(inputs, 2400, composition) for composition in built["compositions"]]
        teams = [hostile_team(inputs, 150, each, built["intervention_on_top"]) for each in built["compositions"]]
        wired = [compare(inputs, each) for each in built["compositions"]]
        found = finding(
            discharge(gate(), LIMIT_S), layer=layers, controller=teams, wiring=wired, method_d=built,
            non_finite=non_finite(inputs),
        )  # fmt: skip
        worst = min(layers, key=lambda layer: float(layer["worst_slack_m_s"]))
        where = {"composition": worst["composition"]}
        found = replace(found, margin=worst["worst_slack_m_s"], unit="m/s", quantity=QUANTITY, where=where)
        attacks = [(-team["worst_missed_by_m_s"], team) for team in teams if team["missed"]]
        attacks += [(layer["worst_slack_m_s"], layer) for layer in layers if not layer["met"]]
        if found.status == "proved" and attacks:
            slack, attack = min(attacks, key=lambda each: float(each[0]))
            differs = next((each["first_difference"] for each in wired if not each["agrees"]), None)
            shown = attack if differs is None else attack | {"wiring": differs}
            return replace(found, status="refuted", margin=slack, counterexample=shown)
        return difference(found, wired)

    def takes(self, inputs: Inputs, finding: Finding) -> bool:
        """The obligations once more, by expansion."""
        return proved_again(finding, gate())
