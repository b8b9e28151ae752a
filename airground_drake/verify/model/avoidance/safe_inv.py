"""SAFE-INV: why no sampled step of set-based avoidance leaves the safe set.

The way through the proof: `lemma.py` (SAFE-LEMMA) turns motion in space into statements about one number, the
distance; `obligations.py` has those statements, each with its certificate; `constants.py` the numbers of the running
scenario that they are repeated with, `scenario_pairs.py` who must keep which distance from whom; `conformance.py`
compares the relation that they encode with the compiled kernels, `wiring.py` the controllers of the built diagram with
the scenario; `hostile_inputs.py` drives the running layer from safe states by hostile velocities; `mutants.py` has the
broken variants that must be refuted. SAFE-GATE (`safe_gate.py`) and SAFE-DIST (`safe_dist.py`) build on it.

Symbols, in proofs and in their texts: a robot at x relative to what it avoids, at distance D = ||x||, with unit
vector n = x/D and velocity v, has the radial speed r = n.v; E = ||x + s v|| is the distance after s, 0 <= s <= h; d is
the safe distance, A the gain, h the control period, q the share of an inequality (1 obstacle, 1/2 robot of a pair), b
its bound. SAFE-LEMMA is E >= D + s r; everything else is about the numbers D, r, s.

Certificate files: `obligations.json` and `<obligation>.smt2` as `engines/obligation.py` describes them.
"""

from __future__ import annotations

from dataclasses import replace

from airground_drake.scenarios.rounding import TOLERANCE_M
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.engines.obligation import Obligation
from airground_drake.verify.engines.prover import discharge, finding, proved_again
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.avoidance.conformance import conformance, rounding_leaves, rounding_margins
from airground_drake.verify.model.avoidance.constants import Inputs, built_from, constants, kinds, range_spare
from airground_drake.verify.model.avoidance.hostile_inputs import postcondition
from airground_drake.verify.model.avoidance.obligations import LIMIT_S, rest, scaling, step, with_scenario
from airground_drake.verify.model.avoidance.wiring import compare, difference

QUANTITY = "what rounding leaves of the 1e-9 m by which a distance may fall short of d"


class SafeInv(ModelClaim):
    """SAFE-INV."""

    id = "SAFE-INV"
    summary = "A robot that obeys the avoidance inequalities and starts at a safe distance keeps it."
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
    latex = (
        r"D \ge d, \; n^\top v \ge -q (D - d) / h \; \Rightarrow \; \lVert x + s v \rVert \ge d \quad "
        r"\text{for all } s \in [0, h]",
        r"D \le d, \; n^\top v \ge q A (d - D) \; \Rightarrow \; \lVert x + s v \rVert \ge D, \; d - \lVert x "
        r"+ h v \rVert \le (1 - A h) (d - D)",
        r"D > R, \; R \ge d + c h \; \Rightarrow \; \lVert x + s v \rVert \ge d",
        r"q = 1 \text{ in sum over the pair}",
    )
    method = (
        "In D, r = n.v and s through SAFE-LEMMA: polynomial certificates, symbolic in A, h, d and again with the "
        "scenario's numbers; z3 and cvc5 on the negations. The encoded relation is compared in exact arithmetic with "
        "what the running kernel computes, and the running composition is sampled with up to 12 points. Pairs, "
        "distances, shares and limits are the scenario's; the controllers of the built diagram are compared with "
        "them: beside everything that they must avoid, driven to it through their ports, every command must meet every "
        "inequality of the scenario, and be the closest velocity that they allow where one binds."
    )
    equations = "(7)-(8), (11) in the inequality form of the package (set-based avoidance)"
    assumptions = (
        "SAFE-LEMMA; integrator plant with zero-order hold, both robots of a pair sampled at the same instants.",
        "Obstacles stand still; robots obey their speed limits (what is out of range counts on that). Distances are of "
        "centres; what is not a point is a ball, and both radii are part of d.",
        "A UGV's velocity has no z component.",
        "Rounding: binary64, a period cut into at most 64 integration steps, coordinates <= start + speed * duration.",
    )
    does_not_establish = (
        "That the inequalities hold in a run (SAFE-HYP), nor under disturbance (SAFE-DIST). In floating point the "
        "distance is kept up to the margins in the evidence, below the tolerance of SAFE-TRACE: what one step loses is "
        "restored while D < d by the lower branch, one deficit at a time; contradictory deficits of several points are "
        "not restored, and then losses may add up over the steps. Inside two safe distances at once there may be no "
        "velocity that meets both. The diagram is compared in a sample of states, not in all."
    )

    exercised_by = "obligations of the proof"

    def inputs(self, scenario: Scenario) -> Inputs:
        """Gain, period, sensing range and the team; and what the diagram is built from."""
        return constants(scenario) | {"scenario": built_from(scenario)}

    def check(self, inputs: Inputs) -> Finding:
        """Discharge the obligations, compare with the running code; margin: what rounding leaves of 1e-9 m."""
        compared, sampled, wired = conformance(inputs), postcondition(inputs, 500), compare(inputs)
        spare = {kind.name: float(range_spare(inputs, kind)) for kind in kinds(inputs)}
        lost = rounding_margins(inputs)
        found = finding(
            discharge(obligations(inputs), LIMIT_S),
            conformance=compared, composition=sampled, wiring=wired, rounding=lost, sensing_range_spare_m=spare,
        )  # fmt: skip
        kind, left = rounding_leaves(lost)
        found = replace(found, margin=left, unit="m", quantity=QUANTITY, where={"pair": kind})
        if (short := min(spare, key=lambda name: spare[name])) and spare[short] < 0.0:
            found = replace(found, margin=spare[short], quantity="sensing range - d - c h", where={"pair": short})
        if found.status == "proved" and not compared["agrees"]:
            return _refuted(found, compared["first_difference"] or compared)
        beyond = sampled["worst_loss_over_rounding"] > 1.0
        if found.status == "proved" and (beyond or not sampled["met"]):
            return _refuted(found, sampled["first_missed"] or sampled)
        found = difference(found, [wired])
        if found.status == "proved" and (reason := _open(inputs, lost, left)):
            return replace(found, status="inconclusive", evidence={**found.evidence, "reason": reason})
        return found

    def takes(self, inputs: Inputs, finding: Finding) -> bool:
        """The obligations once more, by expansion."""
        return proved_again(finding, obligations(inputs))


def obligations(inputs: Inputs) -> list[Obligation]:
    """What is to be proved."""
    return [*step(), *rest(), *scaling(), *with_scenario(inputs)]


def _refuted(found: Finding, counterexample: Inputs) -> Finding:
    """By the running code: what rounding leaves says nothing then."""
    return replace(found, status="refuted", margin=None, where={}, counterexample=counterexample)


def _open(inputs: Inputs, lost: Inputs, left: float | None) -> str:
    """What keeps a proof in real arithmetic from holding for floating point; '' if nothing does."""
    if left is None:
        steps = inputs["duration_s"] / inputs["period_s"]
        most = max(float(each["margin_of_a_step_m"]) for each in lost.values()) * steps
        return (
            "A = 0: a deficit shrinks by the factor 1 - A h = 1 per period, that is not at all; nothing restores what "
            f"rounding takes, which may add up to {most:.3g} m within the run"
        )
    if left < 0.0:
        return (
            f"rounding may take {TOLERANCE_M - left:.3g} m from a safe distance; SAFE-TRACE tolerates {TOLERANCE_M:g} m"
        )
    return ""
