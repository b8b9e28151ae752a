"""SAFE-LEMMA, SAFE-INV and SAFE-GATE: why no sampled step of set-based avoidance leaves the safe set.

Symbols, in proofs and in their texts: a robot at x relative to what it avoids, at distance D = ||x||, with unit
vector n = x/D and velocity v, has the radial speed r = n.v; E = ||x + s v|| is the distance after s, 0 <= s <= h; d is
the safe distance, A the gain, h the control period, q the share of an inequality (1 obstacle, 1/2 robot of a pair), b
its bound. SAFE-LEMMA is E >= D + s r; everything else is about the numbers D, r, s.

Certificate files: `obligations.json` and `<obligation>.smt2` as `obligation.py` describes them, and from SAFE-LEMMA
`gram.json`, see `lemma.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from airground_drake.diagram import build_model
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.claim import Finding, ModelClaim
from airground_drake.verify.engines.prover import discharge, finding
from airground_drake.verify.model.avoidance.conformance import conformance, rounding
from airground_drake.verify.model.avoidance.constants import Inputs, constants, kinds, range_spare
from airground_drake.verify.model.avoidance.hostile_inputs import hostile_team, non_finite, postcondition
from airground_drake.verify.model.avoidance.lemma import gram_certificate, lemma
from airground_drake.verify.model.avoidance.mutants import BROKEN
from airground_drake.verify.model.avoidance.obligations import LIMIT_S, gate, rest, scaling, step, with_scenario


class SafeLemma(ModelClaim):
    """SAFE-LEMMA."""

    id = "SAFE-LEMMA"
    statement = (
        "On a straight line the distance from a point is at least its value at the start plus the time times its rate "
        "of change at the start: ||x + s v|| >= ||x|| + s (x.v)/||x|| for x other than 0 and s >= 0, in space and in "
        "the plane."
    )
    formula = "||x + s v|| >= ||x|| + s (x.v)/||x||, x != 0, s >= 0"
    method = (
        "Lagrange's identity ||x||^2 ||v||^2 - (x.v)^2 = sum over i < j of (x_i v_j - x_j v_i)^2, expanded exactly, "
        "and as a rational Gram matrix with exact LDL; the step from squares to norms by polynomial certificates for "
        "both signs of the right-hand side. z3 and cvc5 on the negations."
    )
    equations = "none of the paper's; it turns (7)-(8), (11) into statements about one number, the distance"
    assumptions = ("Real arithmetic; x is not 0 (a robot is not at the point that it avoids).",)
    does_not_establish = "Anything about velocities that change within the period, or about rounding (see SAFE-INV)."

    def inputs(self, scenario: Scenario) -> Inputs:
        """None: it is about no constants."""
        return {}

    def check(self, inputs: Inputs) -> Finding:
        """Discharge the obligations and build the Gram matrix."""
        gram = gram_certificate()
        found = finding(discharge(lemma(), LIMIT_S), gram_matrix="expands exactly, positive semidefinite by exact LDL")
        return replace(found, certificates=found.certificates | {"gram.json": gram})


class SafeInv(ModelClaim):
    """SAFE-INV."""

    id = "SAFE-INV"
    statement = (
        "One control period under the avoidance inequalities keeps the distance: if D >= d at a sample and the "
        "velocities held until the next meet their inequality, the distance is >= d all the time in between; if D <= d "
        "it never decreases, and the deficit shrinks by the factor 1 - A h per period at least. It holds for an "
        "obstacle, for two robots that take half the inequality each, for a UGV under a UAV (z of n dropped, v_z = 0), "
        "and for what is beyond the sensing range. With several obstacles and robots each pair has its own inequality "
        "and its own conclusion; all hold together where all inequalities do, and from a safe state v = 0 meets them "
        "all. Scaling a velocity towards 0 breaks no inequality that v = 0 meets."
    )
    formula = (
        "D >= d, n.v >= -q (D - d)/h (sum over the pair: q = 1) => ||x + s v|| >= d for all s in [0, h]; "
        "D <= d, n.v >= q A (d - D) => ||x + s v|| >= D and d - ||x + h v|| <= (1 - A h)(d - D); "
        "D > R, R >= d + c h => ||x + s v|| >= d"
    )
    method = (
        "In D, r = n.v and s through SAFE-LEMMA: polynomial certificates, symbolic in A, h, d and again with the "
        "scenario's numbers; z3 and cvc5 on the negations. The encoded relation is compared in exact arithmetic with "
        "what the running kernel computes, and the running composition is sampled with up to 12 points."
    )
    equations = "(7)-(8), (11) in the inequality form of the package (set-based avoidance)"
    assumptions = (
        "SAFE-LEMMA; integrator plant with zero-order hold, both robots of a pair sampled at the same instants.",
        "Obstacles stand still; robots are points and obey their speed limits (what is out of range counts on that).",
        "A UGV's velocity has no z component.",
        "Rounding: binary64, a period cut into at most 64 integration steps, coordinates <= start + speed * duration.",
    )
    does_not_establish = (
        "That the inequalities hold in a run (SAFE-HYP), nor under disturbance (SAFE-DIST). In floating point the "
        "distance is kept up to the margins in the evidence: what one step loses is restored while D < d by the lower "
        "branch, one deficit at a time; contradictory deficits of several points are not restored, and then losses may "
        "add up over the steps. Inside two safe distances at once there may be no velocity that meets both."
    )

    def inputs(self, scenario: Scenario) -> Inputs:
        """Gain, period, sensing range and the team."""
        return constants(scenario)

    def check(self, inputs: Inputs) -> Finding:
        """Discharge the obligations, compare with the kernels; margin: spare of the sensing range."""
        compared, sampled = conformance(inputs), postcondition(inputs, 500)
        found = finding(
            discharge([*step(), *rest(), *scaling(), *with_scenario(inputs)], LIMIT_S),
            conformance=compared, composition=sampled, rounding=rounding(inputs),
        )  # fmt: skip
        spare = {kind.name: float(range_spare(inputs, kind)) for kind in kinds(inputs)}
        kind = min(spare, key=lambda name: spare[name])
        where = {"quantity": "sensing range - d - c h", "pair": kind}
        found = replace(found, margin=spare[kind], unit="m", where=where)
        if found.status == "proved" and not compared["agrees"]:
            return replace(found, status="refuted", counterexample=compared["first_difference"] or compared)
        lost = sampled["worst_loss_over_rounding"] > 1.0
        if found.status == "proved" and (lost or not sampled["met"]):
            return replace(found, status="refuted", counterexample=sampled["first_missed"] or sampled)
        return found


class SafeGate(ModelClaim):
    """SAFE-GATE."""

    id = "SAFE-GATE"
    statement = (
        "Under method (d) no intervention, accepted or not, leaves the safe set: the avoidance layer is applied last, "
        "to whatever velocity comes from below, and from a safe state its output meets every inequality "
        "whatever its input was; SAFE-INV does the rest. Neither the optimiser nor its horizon, nor the UAV as an "
        "adviser, nor its intervention is trusted; as a robot the UAV must keep its own share of each inequality."
    )
    formula = "b_k <= 0 as computed, for all k => for every u: v = avoid(u) has n_k.v >= b_k for all k, as floats"
    method = (
        "v = 0 meets all inequalities from a safe state, and the last step of the layer shortens the velocity until "
        "none that v = 0 meets is broken; its loop ends only when a comparison of floats finds none, which is the "
        "postcondition itself (polynomial certificates show that one pass suffices but for rounding; every further one "
        "shortens v). The running layer is evaluated on hostile inputs from a deterministic sample of safe states, the "
        "running UGV controller with hostile interventions, accepted or not, and the running UAV controller; the order "
        "of priorities is read from the built "
        "diagram of method (d)."
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

    def inputs(self, scenario: Scenario) -> Inputs:
        """Those of SAFE-INV, and what the diagram of method (d) was built with."""
        controller = build_model(scenario, "d").diagram.GetSubsystemByName("ugv_controller")
        compositions = sorted({run.composition for run in scenario.runs.values() if run.method == "d"})
        built = {
            "intervention_on_top": bool(controller.intervention_on_top),
            "compositions": compositions or ["augmented"],
        }
        return constants(scenario) | {"method_d": built}

    def check(self, inputs: Inputs) -> Finding:
        """Discharge the obligations and attack the running code; margin: the worst slack of the sample, m/s."""
        built = inputs["method_d"]
        layers = [postcondition(inputs, 2400, composition) for composition in built["compositions"]]
        teams = [hostile_team(inputs, 150, each, built["intervention_on_top"]) for each in built["compositions"]]
        found = finding(
            discharge(gate(), LIMIT_S), layer=layers, controller=teams, method_d=built, non_finite=non_finite(inputs)
        )
        worst = min(layers, key=lambda layer: float(layer["worst_slack_m_s"]))
        found = replace(found, margin=worst["worst_slack_m_s"], unit="m/s", where={"composition": worst["composition"]})
        attacks = [(-team["worst_missed_by_m_s"], team) for team in teams if team["missed"]]
        attacks += [(layer["worst_slack_m_s"], layer) for layer in layers if not layer["met"]]
        if found.status == "proved" and attacks:
            slack, attack = min(attacks, key=lambda each: float(each[0]))
            return replace(found, status="refuted", margin=slack, counterexample=attack)
        return found


def _built(inputs: Inputs, **changed: Any) -> Finding:
    """SAFE-GATE for a diagram of method (d) that was built differently."""
    return SafeGate().check(inputs | {"method_d": inputs["method_d"] | changed})


MUTANTS: dict[str, Callable[[Inputs], Finding]] = {
    **BROKEN,
    "SAFE-GATE: intervention on top": lambda inputs: _built(inputs, intervention_on_top=True),
    "SAFE-GATE: recursion (5) as printed": lambda inputs: _built(inputs, compositions=["recursion_nearest"]),
}
"""Broken variants; each takes the inputs of SAFE-GATE and is refuted."""
