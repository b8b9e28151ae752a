"""SAFE-GATE: under method (d) no intervention, accepted or not, leaves the safe set (coq/Gate.v, Safety.v)."""

from fractions import Fraction
from typing import Any

from airground_drake.base.registry import METHODS
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify.claims.safe_inv import SafeInv
from airground_drake.verify.model.theorem import Hypothesis
from airground_drake.verify.runs.proposals import below_avoidance


class SafeGate(SafeInv):
    id = "SAFE-GATE"
    subject = "proof of distances"
    summary = "Under method (d) no request of the UAV makes a robot move closer than the safe distance."
    statement = (
        "Under method (d) no intervention, accepted or not, leads out of the safe set. The avoidance layer is applied "
        "last. From a safe state every command meets all inequalities if it is scaled back far enough; then SAFE-INV "
        "applies. The proof does not depend on the optimiser, its horizon or the UAV's proposals. The UAV, as a robot,"
        " must keep its own share of each inequality. All messages between UAVs and UGVs may be lost. This is about "
        "robots and static obstacles. Beside an obstacle that may move, no request of the UAV makes a robot come "
        "too near by its own motion, because v = 0 also meets the passive inequality."
    )
    latex = (
        r"b_k \le 0, \; 0 \le c \le \frac{b_k}{n_k^\top u} \text{ wherever } n_k^\top u < b_k \; \Rightarrow \; "
        r"n_k^\top (c u) \ge b_k \text{ for all } k",
    )
    method = (
        "A theorem in Coq: the last step of the layer scales a command back towards 0, and a factor c as in the "
        "formula exists wherever standing still is allowed. This claim checks the hypotheses of SAFE-INV again, and "
        "that method (d) has avoidance above the intervention. Tests apply hostile inputs to the running layer and to "
        "the controllers of a built diagram."
    )
    equations = "(20) against the priorities of method (d); (5), (7)-(8), (14)"
    assumptions = (
        "SAFE-INV and its assumptions; the state is safe at the start.",
        "The run's composition is 'augmented', the default; the paper's recursion does not scale the command back.",
        "The UAV has its own avoidance layer: it takes half of each inequality, or all of it straight above a UGV.",
    )
    does_not_establish = (
        "That an intervention is useful, that robots make progress, or that a moving obstacle stays away. It does not "
        "apply to methods (b) and (c), which put interventions above avoidance. SAFE-HYP checks for each run that the "
        "built controllers have these priorities and limits."
    )

    about_the_law = True
    theorems = ("Gate.scaled_back", "Gate.no_faster", "Safety.standing", "Safety.safe_always", "Passive.own_doing")

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        return {**super().inputs(scenario), "intervention_on_top": METHODS["d"].intervention_on_top}

    def hypotheses(self, inputs: dict[str, Any]) -> list[Hypothesis]:
        on_top = Fraction(inputs["intervention_on_top"])
        order = Hypothesis.of("order of priorities", "method (d) has avoidance above the intervention", -on_top)
        return [*super().hypotheses(inputs), order]

    def seen_in(self, trace: Trace) -> tuple[int, int]:
        return below_avoidance(trace)
