"""GATE-SUR: how every gatekeeper decision of a run was rounded."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from airground_drake.errors import TraceError
from airground_drake.trace import Trace
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.gate_record import Off, ProblemClaim, Row, conclude

TIE = 1e-9
"""Accumulated deficits of sum-up rounding closer to 1/2 than this are a tie: either mode may follow."""

ROUNDED_ROUTES = ("relaxed", "nonlinear")
"""Routes that solve (27) and round by (28)-(29)."""


class GateSur(ProblemClaim):
    """GATE-SUR."""

    id = "GATE-SUR"
    summary = "Fractional plans were rounded to yes or no by the paper's rule, and stayed close to them."
    statement = "Every relaxed plan was rounded by sum-up rounding, with an integrated error of at most half a stage."
    formula = (
        "rounded_k = 1 if D_k >= 1 - D_k else 0, D_k = sum_{r <= k} relaxed_r - sum_{r < k} rounded_r; "
        "max_k |dt sum_{r <= k} (relaxed_r - rounded_r)| <= dt / 2"
    )
    latex = (
        r"D_k = \sum_{r \le k} \tilde\omega_r - \sum_{r < k} \omega_r, \quad \omega_k = \begin{cases} 1 & D_k "
        r"\ge 1 - D_k \\ 0 & \text{otherwise} \end{cases}",
        r"\max_k \left| \Delta t \sum_{r \le k} (\tilde\omega_r - \omega_r) \right| \le \frac{\Delta t}{2}",
    )
    method = (
        "Running sums of the recorded relaxed and rounded plans. Each stage is judged by the deficits that the "
        "recorded rounding before it leaves, so that one wrong stage does not blur the next; deficits within 1e-9 of "
        "1/2 are a tie, where either mode may follow (exact ties should accept). Each error is judged against its own "
        "bound as well, so that the verdict does not rest on the theorem that follows from the rule."
    )
    equations = "(28)-(29)"
    assumptions = ("The relaxed plan recorded is the one that was rounded.",)
    does_not_establish = (
        "That the relaxed plan is optimal (GATE-OPT), or that the rounded one was taken: the cheapest plan known was. "
        "A small integrated error bounds positions, not costs."
    )

    exercised_by = "relaxed plans that were rounded"

    def applies(self, trace: Trace) -> bool:
        """Only some routes round; a trace without a scenario is for `judge` to reject."""
        gate = trace.meta.get("scenario", {}).get("gatekeeper", {})
        return super().applies(trace) and gate.get("route", ROUNDED_ROUTES[0]) in ROUNDED_ROUTES

    def judge_rows(self, trace: Trace, rows: list[Row]) -> Finding:
        """Round again, and sum up; the margin is what is left of dt/2."""
        without = [row for row in rows if row.data["relaxed"] is None]
        if cut := [row for row in without if row.given["status"] == "optimal"]:
            raise TraceError(f"{cut[0].label} claims to be complete, but has no relaxation")
        rounded = [row for row in rows if row.data["relaxed"] is not None]
        skipped = {"decisions": len(rows), "without_relaxation": [row.label for row in without]}
        if not rounded:
            return Finding("not_run", evidence={"reason": "no decision has a relaxation", **skipped})
        worst = min(rounded, key=lambda row: row.dt / 2.0 - _deviation(row))
        error, bound = _deviation(worst), worst.dt / 2.0
        finding = Finding(
            "holds",
            margin=max(0.0, bound - error),
            unit="s",
            quantity="half a stage less the integrated rounding error",
            where={name: worst.given[name] for name in ("robot", "t_s")},
            evidence={**skipped, "largest_error_s": error, "bound_s": bound},
            exercised=len(rounded),
        )
        return conclude(finding, (one for row in rounded for one in compare_rounding(row)))


def _deviation(row: Row) -> float:
    """Largest integrated difference of the relaxed and the rounded plan, s."""
    return float(row.dt * np.abs(np.cumsum(row["relaxed"] - row["rounded"])).max())


def compare_rounding(row: Row) -> Iterator[Off]:
    """(28)-(29) and what was recorded about it."""
    relaxed = row["relaxed"]
    rounded = row["rounded"]
    given = row.given
    yield Off(row, "relaxed omega is outside [0, 1]", np.maximum(0.0, np.abs(relaxed - 0.5) - 0.5), 0.0)
    yield Off(row, "rounded omega is not binary", np.minimum(np.abs(rounded), np.abs(rounded - 1.0)), 0.0)
    deficit = np.cumsum(relaxed) - np.concatenate([[0.0], np.cumsum(rounded)[:-1]])
    against = np.where(rounded == 1.0, 0.5 - deficit, deficit - 0.5)  # positive: the other mode lacks more
    yield Off(row, "rounded against the rule", np.maximum(0.0, against), TIE, stage=int(np.argmax(against)))
    deviation = _deviation(row)
    yield Off(row, "integrated rounding error, s", deviation, (0.5 + TIE) * row.dt)
    yield Off(row, "recorded rounding error, s", given["rounding_deviation_s"] - deviation, TIE, recomputed_s=deviation)
    yield Off(row, "recorded relaxed first stage", given["relaxed_first_stage"] - relaxed[0], TIE)
