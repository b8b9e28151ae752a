"""Claims about the model and about runs.

`verify(trace)` judges a run from its trace alone. `verify_model(scenario)` checks the hypotheses of theorems for the
constants of a scenario, or makes experiments of its own. Claims about a run share no code with the controllers, the
simulator or the optimiser whose work they judge.

`claim.py` says what a claim is, `registry.py` which there are. `runs/` has the claims about a trace and `model/` those
about the model, each in a file that has its identifier as a name. `engines/` computes for them and knows no claim.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from airground_drake.verify.cache import cache_folder
    from airground_drake.verify.claim import Claim, ModelClaim, TraceClaim, Verdict
    from airground_drake.verify.finding import Finding
    from airground_drake.verify.judge import verdicts_to_pandas, verify, verify_all, verify_model

    MODEL_CLAIMS: tuple[ModelClaim, ...]
    TRACE_CLAIMS: tuple[TraceClaim, ...]

__all__ = [
    "MODEL_CLAIMS",
    "TRACE_CLAIMS",
    "Claim",
    "Finding",
    "ModelClaim",
    "TraceClaim",
    "Verdict",
    "cache_folder",
    "verdicts_to_pandas",
    "verify",
    "verify_all",
    "verify_model",
]

_HOME = {
    "cache_folder": "cache",
    "verdicts_to_pandas": "judge",
    "verify": "judge",
    "verify_all": "judge",
    "verify_model": "judge",
    **dict.fromkeys(("Claim", "ModelClaim", "TraceClaim", "Verdict"), "claim"),
    "Finding": "finding",
}
_INSTANCES = {"MODEL_CLAIMS": "model_claims", "TRACE_CLAIMS": "run_claims"}


def __getattr__(name: str) -> Any:
    """Import on first use: a part of this package loads only what it needs."""
    if name in _INSTANCES:
        return tuple(getattr(import_module(f"{__name__}.registry"), _INSTANCES[name])())
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
