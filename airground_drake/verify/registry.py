"""Which claims there are, in the order of the report. A new claim is one file and one line here.

Modules are imported on use.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import cache
from importlib import import_module
from typing import Any

from airground_drake.errors import AirgroundError
from airground_drake.verify.claim import ModelClaim, Mutant, TraceClaim

_RUNS, _MODEL = "airground_drake.verify.runs", "airground_drake.verify.model"

MODEL_CLAIMS: dict[str, str] = {
    "SAFE-LEMMA": f"{_MODEL}.avoidance.safe_lemma:SafeLemma",
    "SAFE-INV": f"{_MODEL}.avoidance.safe_inv:SafeInv",
    "SAFE-GATE": f"{_MODEL}.avoidance.safe_gate:SafeGate",
    "SAFE-DIST": f"{_MODEL}.avoidance.safe_dist:SafeDist",
    "ZENO-PROOF": f"{_MODEL}.trigger.zeno_proof:ZenoProof",
    "ZENO-REFINE": f"{_MODEL}.trigger.zeno_refine:ZenoRefine",
    "THR-ROOT": f"{_MODEL}.threshold.thr_root:ThrRoot",
    "THR-OPT": f"{_MODEL}.threshold.thr_opt:ThrOpt",
    "THR-DDM": f"{_MODEL}.threshold.thr_ddm:ThrDdm",
}
"""Claims about the model: identifier to module:class."""

RUN_CLAIMS: dict[str, str] = {
    "SAFE-TRACE": f"{_RUNS}.safe_trace:SafeTrace",
    "SAFE-HYP": f"{_RUNS}.safe_hyp:SafeHyp",
    "ZENO-TRACE": f"{_RUNS}.zeno_trace:ZenoTrace",
    "THR-TRIG": f"{_RUNS}.thr_trig:ThrTrig",
    "GATE-OPT": f"{_RUNS}.gate_opt:GateOpt",
    "GATE-SUR": f"{_RUNS}.gate_sur:GateSur",
    "GATE-FEAS": f"{_RUNS}.gate_feas:GateFeas",
    "GATE-TIME": f"{_RUNS}.gate_time:GateTime",
    "LIVE-GOAL": f"{_RUNS}.live_goal:LiveGoal",
    "COMM": f"{_RUNS}.comm:Comm",
}
"""Claims that are decided from one trace: identifier to module:class."""


MUTANTS: tuple[str, ...] = (f"{_MODEL}.avoidance.mutants", f"{_MODEL}.trigger.mutants", f"{_MODEL}.threshold.mutants")
"""Modules with a table MUTANTS of broken variants, each of which names the claim that must refute it."""


class UnknownClaimError(AirgroundError):
    """An identifier that is no claim's, or not of this kind."""


def model_claims(ids: Collection[str] | None = None) -> list[ModelClaim]:
    """The claims about the model, or those with these identifiers.

    Raises:
        UnknownClaimError: if an identifier is not among MODEL_CLAIMS.
    """
    return _made(MODEL_CLAIMS, ids, "about the model")


def run_claims(ids: Collection[str] | None = None) -> list[TraceClaim]:
    """The claims that are decided from one trace, or those with these identifiers.

    Raises:
        UnknownClaimError: if an identifier is not among RUN_CLAIMS.
    """
    return _made(RUN_CLAIMS, ids, "about a run")


def mutants() -> list[Mutant]:
    """All broken variants."""
    return [mutant for module in MUTANTS for mutant in import_module(module).MUTANTS]


def _made(table: Mapping[str, str], ids: Collection[str] | None, about: str) -> list[Any]:
    if unknown := sorted(set(ids or ()) - set(table)):
        raise UnknownClaimError(f"unknown claim {', '.join(unknown)}; claims {about} are {', '.join(table)}")
    return [_instance(entry) for name, entry in table.items() if ids is None or name in ids]


@cache
def _instance(entry: str) -> Any:
    module, _, name = entry.partition(":")
    return getattr(import_module(module), name)()
