"""LIVE-WAIT: no UAV keeps a UGV from its own task for longer than a bound, whatever it sends.

The transitions are read off the running `Patience` (`relation.py`), an induction on them gives the bound, and running
gatekeepers are attacked (`attack.py`). Certificates: `obligations.json` and an SMT-LIB script for each obligation.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from airground_drake.components import make_patience
from airground_drake.gatekeeper.patience import Patience
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.claim import TIME_TOLERANCE_S, ModelClaim
from airground_drake.verify.engines.prover import LIMIT_S, discharge, finding, proved_again
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.patience.attack import attacks
from airground_drake.verify.model.patience.relation import obligations, symbolic


class LiveWait(ModelClaim):
    """LIVE-WAIT."""

    id = "LIVE-WAIT"
    summary = "No UAV can keep a UGV from its own task for ever."
    statement = (
        "Under method (d) no UAV keeps a UGV from its own task for longer than a bound, whatever it proposes, "
        "withdraws, says of its map or names as its cause: after so long the UGV is on its own until it has rested."
    )
    formula = (
        "between two rests of rest_s on its own: time executed <= tries (longest_s + h), h the period of the "
        "gatekeeper; without progress: given back by (last on time) + behind_s + h; exhausted: tries = 0 again by "
        "(last executed) + rest_s + h"
    )
    latex = (
        r"\text{time executed between two rests} \le N (\tau_{\text{longest}} + h)",
        r"\text{without progress: given back by } t_{\text{on time}} + \tau_{\text{behind}} + h",
        r"\text{exhausted: tries} = 0 \text{ again by } t_{\text{executed}} + \tau_{\text{rest}} + h",
    )
    method = (
        "The transitions are read off the running `Patience` by running its methods on symbols. That they keep the "
        "invariant (on its own c <= n (D + h), executing c <= (n - 1) (D + h) and u <= b + D) and that it implies the "
        "bound are polynomial implications with exact certificates, z3 and cvc5 besides. Running gatekeepers that "
        "believe every prediction are attacked: endless motions, greedy replacements, random withdrawals, brief "
        "proposals and silence for longer than a rest, a UGV that cannot move. So are ones that see no use in any "
        "proposal, by favours: for another UGV, which the bound covers; for none that there is, or for the UGV itself, "
        "which must be refused. They are called as their system calls them, and tries are counted once more from what "
        "they answer: a new proposal of use must be accepted while a try is left, so also after every rest, and "
        "refused else. The margin is the bound less the longest that an attack kept a UGV between two rests."
    )
    equations = "(20)"
    assumptions = (
        "The gatekeeper is sampled every period, and the controller executes what it accepts at its next sample.",
        "Numbers of tries are whole; rounding of times, 1e-15 s, is not counted.",
    )
    does_not_establish = (
        "That what is accepted is of use, or that the UGV gets anywhere on its own; that refused proposals cost "
        "nothing but messages. Safety is SAFE-GATE."
    )

    exercised_by = "obligations of the proof"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """The running patience's numbers, and the period of the gatekeeper, s."""
        patience = make_patience(scenario)
        return {
            "tries": int(patience.most),
            "rest_s": float(patience.rest),
            "longest_s": float(patience.longest),
            "lag_m": float(patience.lag),
            "behind_s": float(patience.behind),
            "period_s": float(scenario.gatekeeper.period_s),
        }

    def check(self, inputs: dict[str, Any]) -> Finding:
        """Read off, prove, attack."""
        return judge(Patience, inputs)

    def takes(self, inputs: dict[str, Any], finding: Finding) -> bool:
        """The obligations once more, by expansion."""
        return proved_again(finding, obligations(symbolic(Patience)))


def judge(kind: type[Patience], inputs: dict[str, Any]) -> Finding:
    """The finding for a kind of patience with these numbers."""
    names = ("tries", "rest_s", "longest_s", "lag_m", "behind_s")
    patience, h = kind(*(inputs[name] for name in names)), inputs["period_s"]
    bound = patience.most * (patience.longest + h)
    attacked = attacks(patience, h)
    worst = max(row["longest_between_rests_s"] for row in attacked)
    found = finding(discharge(obligations(symbolic(kind)), LIMIT_S), bound_s=bound, attacks=attacked)
    broken = [
        row for row in attacked
        if row["longest_between_rests_s"] > bound + TIME_TOLERANCE_S or row["unexpected"]
    ]  # fmt: skip
    if broken and found.status == "proved":
        return replace(found, status="error", counterexample=None)  # the relation is not the running code's
    return replace(
        found, margin=bound - worst if found.status == "proved" else None, unit="s",
        quantity="bound less the longest that an attack kept a UGV from its own task between two rests",
    )  # fmt: skip
