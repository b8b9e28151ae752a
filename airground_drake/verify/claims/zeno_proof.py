"""ZENO-PROOF: two triggers are never closer than the minimum inter-event time (coq/Trigger.v)."""

from typing import Any

from airground_drake.base.exact import decimal
from airground_drake.scenario.schema import Scenario
from airground_drake.verify.model.levels import levels_of, trigger_of
from airground_drake.verify.model.theorem import Hypothesis, TheoremClaim

# The bound to refute if the scenario declares 0 s, s. Any number would do: the counterexample scales with it.
SHORTEST_S = 1e-3


class ZenoProof(TheoremClaim):
    id = "ZENO-PROOF"
    subject = "proof of gaps between triggers"
    summary = "Two triggers are at least the minimum inter-event time apart, whatever the noise."
    statement = (
        "Triggers i < j of a UGV are at least (j - i) times the minimum inter-event time (the dwell) apart, whatever "
        "the decision variable does. So there are at most floor(T/dwell) + 1 triggers in a time T, and no run is Zeno."
    )
    latex = (
        r"x : [0, \infty) \to \mathbb{R} \text{ arbitrary} \; \Rightarrow \; t_j - t_i \ge (j - i) \tau_{\min}",
        r"N(T) \le \lfloor T / \tau_{\min} \rfloor + 1",
    )
    method = (
        "Theorems in Coq about the automaton, by induction over any events at any times. This claim checks that the "
        "dwell in force is the minimum inter-event time, and above 0. Tests compare the transitions of the running "
        "`Trigger` with the theorem's. For a bare threshold, a run of the automaton is the counterexample."
    )
    equations = "(20)"
    assumptions = (
        "Time never runs backwards.",
        "x is any number at any time: no bound on the noise or its rate is used.",
        "Triggers are the times at which the automaton enters INTERVENING. The simulator locates crossings of x to "
        "1e-6 s, which delays triggers. This brings no two triggers closer than the dwell, because the automaton uses "
        "the time of the event itself.",
    )
    does_not_establish = (
        "That triggers come at the right time (THR-TRIG), or that the bare threshold is Zeno (ZENO-REFINE measures how"
        " its events multiply). The end of a dwell is rounded, by about 1e-15 s: ZENO-TRACE measures gaps to 1e-9 s."
    )

    theorems = ("Trigger.dwell_apart", "Trigger.at_most")
    margin_of = "dwell in force"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        return {
            **levels_of(scenario),
            "min_inter_event_s": float(scenario.decision.min_inter_event_s),
            "duration_s": float(scenario.duration_s),
        }

    def hypotheses(self, inputs: dict[str, Any]) -> list[Hypothesis]:
        dwell, zeta, release = (decimal(inputs[name]) for name in ("dwell_s", "zeta_m", "released_below_m"))
        bound = decimal(inputs["min_inter_event_s"])
        return [
            Hypothesis.of(
                "dwell less the bound", "the dwell is the minimum inter-event time at least", dwell - bound, "s"
            ),
            Hypothesis.of(self.margin_of, "the dwell in force is above 0", dwell, "s", strict=True),
            Hypothesis.of("threshold less release", "the release level is at most the threshold", zeta - release, "m"),
        ]

    def numbers(self, inputs: dict[str, Any]) -> dict[str, Any]:
        dwell = decimal(inputs["dwell_s"])
        most = int(decimal(inputs["duration_s"]) // dwell) + 1 if dwell > 0 else None
        return {"bound_s": inputs["min_inter_event_s"] or SHORTEST_S, "most_triggers": most}

    def counterexample(self, inputs: dict[str, Any], broken: Hypothesis) -> dict[str, Any] | None:
        """Two triggers closer than the bound, on a run of the automaton: up, down and up again."""
        trigger = trigger_of(inputs)
        bound = inputs["min_inter_event_s"] or SHORTEST_S
        gap = max(trigger.dwell, bound / 2.0)
        if not gap < bound:
            return None
        state, run = trigger.start(0.0, trigger.zeta), list[dict[str, Any]]()
        for t, x in ((0.0, trigger.zeta), (gap / 2.0, trigger.release - trigger.zeta), (gap, trigger.zeta)):
            before = state.triggers if run else 0
            state = trigger.step(state, t, x) if run else state
            run.append({"t_s": t, "x_m": x, "mode": state.mode.name, "trigger": state.triggers > before})
        times = [row["t_s"] for row in run if row["trigger"]]
        return {"run": run, "gap_s": times[1] - times[0], "bound_s": bound} if len(times) > 1 else None
