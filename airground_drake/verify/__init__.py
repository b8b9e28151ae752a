"""Claims about the model and about runs.

Enters: a Trace, or a Scenario.
Leaves: findings.
May import: `base`, `model`, `scenario`, `sim`.

`judge(trace)` judges a run from its trace alone. `judge_model(scenario)` checks the hypotheses of theorems for the
constants of a scenario, or runs experiments. Claims about a run share no code with the controllers, the simulator and
the optimiser that they judge. They take a body's motion and its cost in distance from its plant (`model/plants`), and
measure both in the run; `check` has separate formulas.

`claim.py` defines a claim, and `base/registry.py` lists them. `pair_kinds.py` lists the pairs that must keep apart.
`claims/` has the claims, each in the file of its name. `runs/` has code shared by claims about a trace, `model/` code
shared by claims about the model. `engines/` computes for them and imports no claim. `proofs/` and `coq/` have the
theorems.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from airground_drake.verify.cache import cache_folder
    from airground_drake.verify.claim import Claim, ModelClaim, TraceClaim, Verdict
    from airground_drake.verify.finding import Finding
    from airground_drake.verify.judging import judge, judge_all, judge_model, verdicts_to_pandas

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
    "judge",
    "judge_all",
    "judge_model",
    "verdicts_to_pandas",
]

_HOME = {
    "cache": ("cache_folder",),
    "judging": ("judge", "judge_all", "judge_model", "verdicts_to_pandas"),
    "claim": ("Claim", "ModelClaim", "TraceClaim", "Verdict"),
    "finding": ("Finding",),
}
_INSTANCES = {"MODEL_CLAIMS": "model_claims", "TRACE_CLAIMS": "run_claims"}


def __getattr__(name: str) -> Any:
    """Import on first use: a part of this package loads only what it needs."""
    if name in _INSTANCES:
        return tuple(getattr(import_module(f"{__name__}.registry"), _INSTANCES[name])())
    for module, names in _HOME.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
