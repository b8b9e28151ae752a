"""Which claims there are, in the order of the report. A new claim is one file and one line here.

Modules are imported on use.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any

from airground_drake.verify.claim import ModelClaim, TraceClaim

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


def _made(entry: str) -> Any:
    module, _, name = entry.partition(":")
    return getattr(import_module(module), name)()


@cache
def model_claims() -> tuple[ModelClaim, ...]:
    """The claims about the model."""
    return tuple(_made(entry) for entry in MODEL_CLAIMS.values())


@cache
def run_claims() -> tuple[TraceClaim, ...]:
    """The claims that are decided from one trace."""
    return tuple(_made(entry) for entry in RUN_CLAIMS.values())
