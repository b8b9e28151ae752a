"""Sum-up rounding (28)-(29) of a recorded decision, a part of GATE-PLAN."""

from collections.abc import Iterator

import numpy as np

from airground_drake.base.errors import TraceError
from airground_drake.verify.runs.gate_record import DecisionRecord, Deviation

TIE = 1e-9  # accumulated deficits closer to 1/2 than this are a tie: either mode may follow
ROUNDED_ROUTES = ("relaxed", "nonlinear")  # routes that solve (27) and round by (28)-(29)


def is_rounded(row: DecisionRecord) -> bool:
    """Whether a relaxed plan or a rounded one was recorded; each needs the other."""
    rounded = row.data["relaxed"] is not None or row.data["rounded"] is not None
    if not rounded and row.given["route"] in ROUNDED_ROUTES and row.given["status"] == "optimal":
        raise TraceError(f"{row.label} claims to be complete, but has no relaxation")
    return rounded


def integrated_error_s(row: DecisionRecord) -> float:
    """Largest integrated difference of the relaxed and the rounded plan, s."""
    return float(row.dt * np.abs(np.cumsum(row["relaxed"] - row["rounded"])).max())


def compare_rounding(row: DecisionRecord) -> Iterator[Deviation]:
    """Compare the rounded plan with the rule (28)-(29), and the recorded numbers with the plans."""
    # Each stage is judged by the deficit that the recorded stages before it leave, so that one wrong stage does not
    # blur the next. The integrated error is judged against its own bound as well, so that the verdict does not rest on
    # the theorem that follows from the rule.
    relaxed = row["relaxed"]
    rounded = row["rounded"]
    given = row.given
    yield Deviation(row, "relaxed omega is outside [0, 1]", np.maximum(0.0, np.abs(relaxed - 0.5) - 0.5), 0.0)
    yield Deviation(row, "rounded omega is not binary", np.minimum(np.abs(rounded), np.abs(rounded - 1.0)), 0.0)
    deficit = np.cumsum(relaxed) - np.concatenate([[0.0], np.cumsum(rounded)[:-1]])
    against = np.where(rounded == 1.0, 0.5 - deficit, deficit - 0.5)  # positive: the other mode lacks more
    yield Deviation(row, "rounded against the rule", np.maximum(0.0, against), TIE, stage=int(np.argmax(against)))
    error = integrated_error_s(row)
    beyond = max(0.0, error - row.dt / 2.0)
    yield Deviation(row, "integrated rounding error beyond half a stage, s", beyond, TIE * row.dt, error_s=error)
    yield Deviation(row, "recorded rounding error, s", given["rounding_deviation_s"] - error, TIE, recomputed_s=error)
    yield Deviation(row, "recorded relaxed first stage", given["relaxed_first_stage"] - relaxed[0], TIE)
    first = "accept" if rounded[0] == 1.0 else "refuse"
    yield Deviation(row, "recorded rounded first stage", float(given["rounded_first_stage"] != first), 0.0)
