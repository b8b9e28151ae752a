"""The tables of a trace other than `states` and `samples`: their columns."""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
import pandas as pd

SCHEMA = "airground_drake.trace/10"

DECISION_COLUMNS = {
    "t_s": "float64",
    "robot": "str",
    "policy": "str",
    "number": "int64",
    "answer": "int64",
    "issued_s": "float64",
    "decision": "str",
    "reason": "str",
    "status": "str",
    "route": "str",
    "plan_first_stage": "str",
    "relaxed_first_stage": "float64",
    "rounded_first_stage": "str",
    "objective": "float64",
    "route_bound": "float64",
    "gap": "float64",
    "objective_accept": "float64",
    "objective_refuse": "float64",
    "accept_throughout": "float64",
    "refuse_throughout": "float64",
    "rounding_deviation_s": "float64",
    "predicted_clearance_m": "float64",
    "refuse_outcome_m2_s": "float64",
    "accept_outcome_m2_s": "float64",
    "refuse_stalls": "float64",
    "accept_stalls": "float64",
    "refuse_left_m": "float64",
    "accept_left_m": "float64",
    "tries": "float64",
}
DECISION_LISTS = ("sensed", "known", "new", "told")
"""Columns of `Trace.decisions`, one row per robot and gatekeeper call; -1 where a number does not apply. `number` is
that of `Trace.proposals`, `answer` that of the answer in `Trace.messages` that told the UAV of the decision, -1 where
it changed nothing. Columns up to
`predicted_clearance_m` belong to decisions by problem (26), the others to decisions by outcomes: the outcome of either
choice by `ugv.outcome` (cost, 1 if the UGV comes to rest short of its goal, way left), and the number of tries
since the UGV last rested.

Three columns are about the first stage: `plan_first_stage` of the plan returned, the cheapest by (25) that the route
evaluated; `relaxed_first_stage` and `rounded_first_stage` of the relaxation, before and after sum-up rounding. They may
differ. `decision` is the answer: by the rule `first_stage` it is `rounded_first_stage`, if the route rounds.

The lists say what a prediction rested on; they are empty where nothing was predicted. Obstacles are indices in the
order of the scenario:
- sensed: obstacles within sensing range.
- known: obstacles sensed so far and not seen to be gone (method (d)).
- new: obstacles sensed for the first time that are not on the proposal's map (method (d)).
- told: rows of the proposal's map that were believed (method (d)).
Of other UGVs a prediction knows where they are, how fast they go, and what the same joint plan asks of them."""

PROBLEM_SCALARS = ("dt_s", "error_weight_1_m2_s", "slack_weight_1_m2_s", "terminal_weight_s")
PROBLEM_ARRAYS = (
    "initial_m", "accept_m_s", "refuse_m_s", "reference_m", "centres_m", "distances_m",
    "plan", "positions_m", "relaxed", "rounded", "normals",
)  # fmt: skip
"""Columns of `Trace.problems` (empty under method (d)): the data of (26) for each row of `decisions`, and the result of
the route. Arrays are flattened in C order: initial (3), accept, refuse and reference (N x 3), centres and normals
(N x m x 3), distances (m), plan, relaxed and rounded omega (N), positions of the plan (N x 3). An array that the route
does not give is empty. The normals are those of the half-planes of `route_bound`."""

PROPOSAL_COLUMNS = (
    "number", "robot", "policy", "issued_s", "times_s", "positions_m", "selection", "mapped", "cause", "party",
    "sender",
)  # fmt: skip
"""Columns of `Trace.proposals`, one row per proposal sent; arrays are flattened in C order:
- number: identifies the proposal, whichever UAV sent it; increases in the order of sending of each UAV, from 0.
- robot, policy, issued_s: its UGV, its policy, the time of sending.
- times_s (M), positions_m (M x 3): vertices of the requested motion.
- selection (m x 3): J_int of (12)-(14), the directions that the motion concerns.
- mapped: outlines of the obstacles on the UAV's map, without padding, one after the other: see
  `model.geometry.outline`.
- cause: the UGV whose trigger led to it: this UGV, or another UGV for which it makes way.
- party: indices in `ugvs` of all UGVs in the same joint plan; empty if the proposal stands alone.
- sender: the UAV."""


MESSAGE_COLUMNS = {
    "kind": "str",
    "number": "int64",
    "attempt": "int64",
    "copy": "int64",
    "sender": "str",
    "receiver": "str",
    "about": "int64",
    "sent_s": "float64",
    "received_s": "float64",
    "read_s": "float64",
}
"""Columns of `Trace.messages`, one row per delivery, by time of sending:
- kind: proposal, withdrawal or answer. A proposal that is replaced is withdrawn.
- number: counts the messages of its kind; for a proposal it is that of `Trace.proposals`.
- attempt: 0, or how often the message was sent before: who waits for an answer repeats.
- copy: 0, or 1 for a message that the channel doubled.
- sender, receiver: names of robots.
- about: number of the proposal.
- sent_s, received_s, read_s: times, s; NaN for a message that was lost, that did not arrive before the end, or that was
  never read. A UGV reads a proposal when its gatekeeper decides on it for the first time, and answers when its answer
  changes or it senses an obstacle that the UAV does not know. Under method (b) it reads it when it begins to execute
  it, and does not answer. With a channel UGVs answer every message that they read, withdrawals too: such an answer
  belongs to no decision."""

PLAN_COLUMNS = {"t_s": "float64", "uav": "str", "ugv": "str", "policy": "str", "outcome": "str", "reason": "str"}
"""Columns of `Trace.plans`, one row per policy that was asked for a plan for a UGV: the outcome is proposed, passed
over (another plan ranked higher), nothing or failed; the reason says why it left a UGV without a way, and may be empty.
A further column, `sent`, lists the numbers of the plan's proposals."""

SEEN_COLUMNS = {
    "t_s": "float64", "by": "str", "of": "str", "x_m": "float64", "y_m": "float64", "z_m": "float64",
    "measured_s": "float64",
}  # fmt: skip
"""Columns of `Trace.seen`: where a robot saw a body at a control sample, if not at its true place of that instant, and
when it measured that. For simulated robots the table is empty: see `samples` for what they publish of positions."""

TABLES = ("states", "samples", "seen", "messages", "proposals", "plans", "decisions", "problems")
"""Attributes of `Trace` that are tables, each saved as a Parquet file of its name."""


TEXT: Any = pd.Series(dtype="str").dtype


def typed(rows: Sequence[Mapping[str, Any]], kinds: Mapping[str, str], *lists: str) -> pd.DataFrame:
    """A table of rows with columns of some kinds, and columns whose cells are lists."""
    # Each column is made with its type: Series, or `astype` for all of them, take three times as long.
    if not rows:
        return _empty(*kinds.items(), *((name, "object") for name in lists)).copy()
    return _columns(rows, {**kinds, **dict.fromkeys(lists, "object")})


@cache
def _empty(*kinds: tuple[str, str]) -> pd.DataFrame:
    return _columns([], dict(kinds))


def _columns(rows: Sequence[Mapping[str, Any]], kinds: Mapping[str, str]) -> pd.DataFrame:
    columns: dict[str, Any] = {}
    for name, kind in kinds.items():
        cells = [row[name] for row in rows]
        if kind == "object":
            columns[name] = np.empty(len(cells), dtype=object)
            columns[name][:] = cells
        else:
            columns[name] = pd.array(cells, dtype=TEXT) if kind == "str" else np.array(cells, kind)
    return pd.DataFrame(columns)


def listed(rows: Sequence[tuple[Any, ...]], columns: tuple[str, ...]) -> pd.DataFrame:
    """A table of rows with columns of any type."""
    return pd.DataFrame(rows, columns=list(columns)) if rows else _none(columns).copy()


@cache
def _none(columns: tuple[str, ...]) -> pd.DataFrame:
    return pd.DataFrame(columns=list(columns))
