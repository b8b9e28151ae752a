"""The registered claims, made on use.

`airground_drake.base.registry` lists them in the order of the report: a new claim is one file and one line there. A
scenario adds its own under `claims`.
"""

from collections.abc import Collection, Mapping
from functools import cache
from typing import TypeVar, get_type_hints

from pydantic import TypeAdapter, ValidationError

from airground_drake.base.errors import PluginError, UnknownNameError, short
from airground_drake.base.registry import MODEL_CLAIMS, RUN_CLAIMS, Registry
from airground_drake.verify.claim import Claim, ModelClaim, TraceClaim

C = TypeVar("C", bound=Claim)


def model_claims(ids: Collection[str] | None = None, added: Mapping[str, str] | None = None) -> list[ModelClaim]:
    """The claims about the model, or those with these identifiers."""
    # ids: default: all.
    # added: claims of a scenario, `module:Class` by identifier. Those about runs are left out.
    return _made(MODEL_CLAIMS, ModelClaim, ids, added or {})


def run_claims(ids: Collection[str] | None = None, added: Mapping[str, str] | None = None) -> list[TraceClaim]:
    """The claims that are decided from one trace; otherwise as `model_claims`."""
    return _made(RUN_CLAIMS, TraceClaim, ids, added or {})


def _made(registry: Registry, kind: type[C], ids: Collection[str] | None, added: Mapping[str, str]) -> list[C]:
    places = {name: name for name in registry}
    asked = {name: place for name, place in added.items() if ids is None or name in ids}
    places |= {name: place for name, place in asked.items() if issubclass(registry.load(place, of=Claim), kind)}
    for name in ids or ():
        if name not in places:
            raise UnknownNameError("claim", name, places)
    chosen = {name: place for name, place in places.items() if ids is None or name in ids}
    return [_instance(registry, registry.load(place, of=kind), name, place) for name, place in chosen.items()]


@cache
def _instance(registry: Registry, kind: type[C], name: str, place: str) -> C:
    claim = registry.make(place, of=kind)
    if why := _unsaid(claim):
        raise PluginError(f"claim {name!r}: {place} {why}")
    if claim.id != name:
        raise PluginError(f"claim {name!r}: {place} has the identifier {claim.id!r}")
    return claim


def _unsaid(claim: Claim) -> str:
    """The attribute of `Claim` that a class lacks or has with a wrong type, in words; '' if it is complete."""
    says = get_type_hints(Claim)
    if missing := [name for name in says if not hasattr(claim, name)]:
        return f"has no {missing[0]!r}; wanted: {', '.join(says)}"
    for name, kind in says.items():
        try:
            TypeAdapter(kind).validate_python(getattr(claim, name))
        except ValidationError as error:
            return f"has {name!r} {short(repr(getattr(claim, name)))}: {error.errors()[0]['msg']}"
    return "" if claim.formula or claim.latex else "has neither 'formula' nor 'latex'"
