"""The proposals of a run, and which of them a UGV had accepted at a control sample, by the messages."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from .files import Json
from .rules import SMALL, Array, holds
from .run import INTERVENING, Run


@dataclass(frozen=True, eq=False)
class Proposal:
    """A row of the table of proposals.

    Attributes:
        ugv: to whom.
        policy: by which.
        issued_s: when.
        times_s: vertices of the motion, (M,).
        positions_m: the same, (M, 3).
        jacobian: J_int, (m, 3).
        mapped_m: obstacles that the UAV says it knows, (k, 3).
        mapped_radius_m: their radii, (k,).
        cause: UGV whose trigger it is sent for.
    """

    ugv: str
    policy: str
    issued_s: float
    times_s: Array
    positions_m: Array
    jacobian: Array
    mapped_m: Array
    mapped_radius_m: Array
    cause: str

    @cached_property
    def projector(self) -> Array:
        """J_int^+ J_int, (3, 3): by the right singular vectors of J_int."""
        _, sizes, directions = np.linalg.svd(self.jacobian)
        kept = directions[: len(sizes)][sizes > 1e-12 * max(1e-300, float(sizes.max()))]
        return np.asarray(kept.T @ kept)

    def place_m(self, t_s: Array) -> Array:
        """Where the UGV is to be at times (K,): (K, 3); at rest before the first vertex and after the last."""
        return np.stack([np.interp(t_s, self.times_s, axis) for axis in self.positions_m.T], axis=-1)

    def rate_m_s(self, t_s: float, side: float) -> Array:
        """Velocity of that place shortly before (`side` -1) or after (+1) a time, (3,)."""
        leg = int(np.searchsorted(self.times_s, t_s + side * SMALL))
        if leg == 0 or leg == len(self.times_s):
            return np.zeros(3)
        ends = slice(leg - 1, leg + 1)
        return np.asarray(np.diff(self.positions_m[ends], axis=0)[0] / np.diff(self.times_s[ends])[0])


@lru_cache(maxsize=8)
def proposals_of(run: Run) -> list[Proposal]:
    """All proposals by time.

    Raises:
        Disagreement: if one has numbers that are not finite, or is no motion of a UGV.
    """
    found = [_proposal(run, row) for row in run.proposals.to_dict("records")]
    return sorted(found, key=lambda proposal: proposal.issued_s)


def _proposal(run: Run, row: dict[Any, Any]) -> Proposal:
    names = ("times_s", "positions_m", "selection", "mapped_m", "mapped_radius_m")
    times, places, jacobian, mapped, radii = (np.asarray(row[name], dtype=np.float64).ravel() for name in names)
    at: Json = {"about": f"proposal to {row['robot']}", "t_s": float(row["issued_s"])}
    numbers = np.concatenate([times, places, jacobian, mapped, radii, [row["issued_s"]]])
    holds("numbers of a proposal are finite", np.isfinite(numbers), numbers, "a number", **at)
    holds("a proposal is to a UGV", row["robot"] in run.ugvs, row["robot"], "a UGV of the run", **at)
    holds("a proposal is for a UGV's trigger", row["cause"] in run.ugvs, row["cause"], "a UGV of the run", **at)
    shaped = len(times) > 0 and len(places) == 3 * len(times) and len(jacobian) > 0 and len(jacobian) % 3 == 0
    shaped = shaped and len(mapped) == 3 * len(radii)
    sizes = [len(times), len(places), len(jacobian), len(mapped), len(radii)]
    holds("a proposal is a motion", shaped, sizes, "M times, 3 M coordinates, 3 m of J, 3 k and k of the map", **at)
    holds("times of a motion increase", (np.diff(times) > 0.0).all(), times, "later than the one before", **at)
    _is_for_whom_it_says(run, row, at)
    return Proposal(
        str(row["robot"]), str(row["policy"]), at["t_s"], times, places.reshape(-1, 3), jacobian.reshape(-1, 3),
        mapped.reshape(-1, 3), radii, str(row["cause"]),
    )  # fmt: skip


def _is_for_whom_it_says(run: Run, row: dict[Any, Any], at: Json) -> None:
    """A proposal is for the trigger of its UGV while that is intervened on, else for that of another one that is.

    Modes of a row hold since the row before; the next row's counts as well, for what begins at that instant.
    """
    ugv, cause = str(row["robot"]), str(row["cause"])
    sent = int(np.searchsorted(run.t_s, at["t_s"] - SMALL))
    on = {name: run.column(f"{name}.mode")[sent : sent + 2] == INTERVENING for name in (ugv, cause)}
    right = on[cause].any() and (cause == ugv or not on[ugv].all())
    holds("a proposal is for a trigger", right, cause, "a UGV that is intervened on, its own first", **at)


@lru_cache(maxsize=32)
def accepted_at(run: Run, ugv: str) -> list[Proposal | None]:
    """What a UGV had accepted at each control sample, (S,), or None.

    The proposal in force at the last planning instant counts if the decision of the gatekeeper's last sample accepts
    it; under method (b) always.
    """
    mine = [proposal for proposal in proposals_of(run) if proposal.ugv == ugv]
    answers = answers_of(run, ugv)
    plan_s, gate_s = (run.scenario[part]["period_s"] for part in ("intervention", "gatekeeper"))
    ends_s = [taken_back_s(run, proposal, mine, answers) for proposal in mine]
    found: list[Proposal | None] = []
    for t in run.sample_s:
        planned, decided = plan_s * np.floor(t / plan_s + 1e-6), gate_s * np.floor(t / gate_s + 1e-6)
        in_force = [p for p, end in zip(mine, ends_s, strict=True) if p.issued_s <= planned + SMALL < end]
        last = in_force[-1] if in_force else None
        if last is not None and run.method != "b":
            given = [yes for when, issued, yes in answers if abs(when - decided) <= SMALL and issued == last.issued_s]
            last = last if given == [True] else None
        found.append(last)
    return found


def answers_of(run: Run, ugv: str) -> list[tuple[float, float, bool]]:
    """Time of each decision of a UGV, time of issue of the proposal that it is on, whether it accepts."""
    rows = run.decisions[run.decisions["robot"] == ugv].to_dict("records")
    return sorted((float(row["t_s"]), float(row["issued_s"]), row["decision"] == "accept") for row in rows)


def taken_back_s(run: Run, proposal: Proposal, mine: list[Proposal], answers: list[tuple[float, float, bool]]) -> float:
    """A little later than the planning instant at which a proposal is taken back, infinite if it never is.

    That is the first at which another is sent, neither the UGV nor the one that it is to make way for is intervened
    on, the motion is over, or the last answer was a refusal.
    """
    plan_s = run.scenario["intervention"]["period_s"]
    modes = np.stack([run.column(f"{ugv}.mode") for ugv in {proposal.ugv, proposal.cause}])
    wanted = (modes == INTERVENING).any(axis=0)
    k = round(proposal.issued_s / plan_s)
    while (k := k + 1) * plan_s <= run.t_s[-1] + SMALL:
        now = k * plan_s
        row = min(int(np.searchsorted(run.t_s, now - SMALL)), len(run.t_s) - 1)
        before = [yes for when, issued, yes in answers if issued == proposal.issued_s and when < now - SMALL]
        replaced = any(proposal.issued_s < other.issued_s <= now + SMALL for other in mine)
        over = run.t_s[row] >= proposal.times_s[-1]
        if replaced or over or not wanted[row] or (before and not before[-1]):
            return now + SMALL
    return np.inf
