"""ZENO-PROOF: two triggers are never closer than the minimum inter-event time, whatever the decision variable does.

The transition relation is not written down a second time: `read_off` (`relation.py`) runs the methods of the running
`Trigger` on symbols, once for every way in which their comparisons can come out. The induction on it is in
`induction.py`, broken triggers are in `mutants.py`. An observer that sees nothing but entries into INTERVENING is
added to it: k triggers so far, the last of them at l; what the automaton itself remembers, n triggers and the last at
a, is not trusted. t is the time of the last event or wait, s >= t now, x any number. The invariant:

    n = k; SUPERVISING: k = 0 or t >= l + dwell; INTERVENING and REFRACTORY: k >= 1 and a = l

Certificates: `relation.json` (transitions with the scenario's numbers: guards `form` >= 0 or > 0, values after it;
source 'START' has no state before), `obligations.json` (for all zeta > 0, release <= zeta, dwell >= 0: of every
transition that it keeps n = k and a = l, `*_memory`, and the rest of the invariant, `*_phase`, and at every trigger
that s - l >= dwell, `*_claim`; "k = 0 or" is a factor k there, k >= 0 because it counts), `zeno_horn.smt2`
(the numbers again, for Spacer: satisfiable if some invariant P exists), `inv_initiation.smt2`, `inv_consecution.smt2`
and `inv_safety.smt2` (the invariant above, for any solver: each must be unsatisfiable).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from airground_drake.components import make_trigger, threshold
from airground_drake.decision.trigger import Trigger
from airground_drake.scenarios.schema import Scenario
from airground_drake.statuses import Status
from airground_drake.verify.claim import TIME_TOLERANCE_S, ModelClaim
from airground_drake.verify.engines.obligation import Obligation, rational
from airground_drake.verify.engines.prover import LIMIT_S, discharge, finding, proved_again
from airground_drake.verify.engines.smt import solve
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.trigger.induction import counterexample, horn, invariant, obligations, remarks
from airground_drake.verify.model.trigger.relation import Transition, conformance, dwell_rounding, read_off

SHORTEST_S = 1e-3
"""Bound that is tried where the scenario has none (0 s), s: any number would do, the counterexample scales with it."""


class ZenoProof(ModelClaim):
    """ZENO-PROOF."""

    id = "ZENO-PROOF"
    summary = "Triggers never pile up: two are at least the minimum inter-event time apart, whatever the noise."
    statement = (
        "Two triggers of a UGV are never closer than the minimum inter-event time, whatever the decision variable "
        "does, so that no run is Zeno."
    )
    formula = (
        "for every x: [0, inf) -> R, consecutive triggers satisfy t_(k+1) - t_k >= min_inter_event_s - e, where e, "
        "about 1e-15 s, is the rounding error of triggered_at + dwell"
    )
    latex = (
        r"x : [0, \infty) \to \mathbb{R} \text{ arbitrary} \; \Rightarrow \; t_{k+1} - t_k \ge \tau_{\min} - "
        r"e, \quad e \approx 10^{-15} \text{ s}",
    )
    method = (
        "The transition relation is read off the running `Trigger` by running its methods on symbols. Its invariant "
        "is proved for symbolic parameters, transition by transition, by polynomial implications with exact "
        "certificates, z3 and cvc5 besides; with the scenario's numbers Spacer finds an invariant of its own "
        "(constrained Horn clauses), and z3 and cvc5 check ours. The relation is compared with the running "
        "`EventTrigger` on random states. The margin is what rounding leaves of ZENO-TRACE's tolerance, 1e-9 s. A "
        "refuted claim comes with a run of the automaton, replayed on the running code."
    )
    equations = "(20)"
    assumptions = (
        "Time never runs backwards, and the trigger's methods are called only under the guards of `EventTrigger`.",
        "x is any number at any time: no bound on the noise or its rate is used.",
        "Triggers are the times at which the automaton enters INTERVENING. The simulator's event isolation, 1e-6 s, "
        "delays them against the crossings of x; it brings no two of them closer than the dwell, because guards and "
        "triggered_at use the time of the event itself.",
    )
    does_not_establish = (
        "That a trigger comes when it should (THR-TRIG), or that the bare threshold is Zeno (ZENO-REFINE shows how its "
        "events multiply; here it is refuted by a run with two triggers closer than the bound). With a rate bound "
        "|dx/dt| <= R (not Wiener noise) 2 (zeta - release)/R would bound the inter-event time as well: `rate_bound`."
    )

    exercised_by = "obligations of the proof"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """The running trigger's levels, m, and dwell, s; the bound claimed, s; the time within which to be exact, s."""
        trigger = make_trigger(scenario, threshold(scenario))
        return {
            "zeta_m": float(trigger.zeta),
            "released_below_m": float(trigger.release),
            "dwell_s": float(trigger.dwell),
            "min_inter_event_s": float(scenario.decision.min_inter_event_s),
            "duration_s": float(scenario.duration_s),
        }

    def check(self, inputs: dict[str, Any]) -> Finding:
        """Prove it for these constants, or find a run that breaks it."""
        return prove(_trigger(inputs), inputs)

    def takes(self, inputs: dict[str, Any], finding: Finding) -> bool:
        """The obligations once more, by expansion; relation, invariant and clauses as this code writes them."""
        trigger, bound = _trigger(inputs), _bound(inputs)
        written = scripts(read_off(lambda _: trigger), trigger, bound).items() <= finding.certificates.items()
        return written and proved_again(finding, to_prove(trigger, bound))


def prove(trigger: Trigger, inputs: dict[str, Any]) -> Finding:
    """The finding for a trigger, the scenario's or a mutant of it."""
    bound, duration = _bound(inputs), inputs["duration_s"]
    numeric = read_off(lambda _: trigger)
    saved = scripts(numeric, trigger, bound)
    files = {name: text for name, text in saved.items() if name.endswith(".smt2")}
    answers = solve(list(files.values()), "z3", LIMIT_S)
    spacer = answers[0]  # on the clauses; the others on our invariant
    z3 = answers[1:]
    evidence: dict[str, Any] = {
        "bound_s": bound,
        "spacer": {"sat": "an invariant exists", "unsat": "violated"}.get(spacer.answer, spacer.answer),
        "conformance": conformance(trigger, numeric, duration),
        "rounding_s": dwell_rounding(trigger, duration),
    }
    if spacer.answer == "unsat":
        broken = counterexample(numeric, trigger, bound)
        status: Status = "refuted" if broken else "error"
        margin = broken["gap_s"] - bound if broken else None
        return Finding(status, margin, "s", {}, broken, evidence, saved, "a gap between triggers less the bound")
    cvc5 = solve(list(files.values())[1:], "cvc5", LIMIT_S)
    found = finding(discharge(to_prove(trigger, bound)))
    ours = {name: [a.answer, b.answer] for name, a, b in zip(list(files)[1:], z3, cvc5, strict=True)}
    status = found.status
    if any("sat" in pair for pair in ours.values()) or evidence["conformance"]["disagreements"]:
        status = "error"  # the invariant or the relation is not the running code's
    elif status == "proved" and (spacer.answer != "sat" or any(pair != ["unsat", "unsat"] for pair in ours.values())):
        status = "inconclusive"
    return replace(
        found, status=status, margin=TIME_TOLERANCE_S - evidence["rounding_s"], unit="s", where={"bound_s": bound},
        quantity="what rounding leaves of the 1e-9 s by which a gap between triggers may fall short of the bound",
        evidence={**evidence, "invariant": ours, **found.evidence}, certificates={**saved, **found.certificates},
    )  # fmt: skip


def scripts(numeric: Sequence[Transition], trigger: Trigger, bound: float) -> dict[str, str]:
    """The certificates with the scenario's numbers."""
    described = json.dumps({"bound_s": rational(bound), "transitions": [each.to_json() for each in numeric]}, indent=1)
    clauses = {"zeno_horn.smt2": horn(numeric, trigger, bound), **invariant(numeric, trigger, bound)}
    return {"relation.json": described + "\n", **clauses}


def to_prove(trigger: Trigger, bound: float) -> list[Obligation]:
    """The obligations for all parameters, and what follows with the scenario's numbers."""
    general = read_off(lambda path: type(trigger)(*map(path.symbol, ("zeta", "release", "dwell"))))
    return [*obligations(general), *remarks(trigger, bound)]


def _trigger(inputs: dict[str, Any]) -> Trigger:
    return Trigger(inputs["zeta_m"], inputs["released_below_m"], inputs["dwell_s"])


def _bound(inputs: dict[str, Any]) -> float:
    return float(inputs["min_inter_event_s"] or SHORTEST_S)
