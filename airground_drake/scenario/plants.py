"""The plants of a scenario's robots: their keys, one class per kind, and from them the plants of the model."""

# No `from __future__ import annotations` here: pydantic needs the types themselves, not their names.
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, Protocol, Union

from pydantic import BeforeValidator, Discriminator, Field, Tag, TypeAdapter, ValidationInfo

from airground_drake.base.registry import AS_TOLD, PLANTS
from airground_drake.base.values import RECORDED, refused
from airground_drake.model.plants.budget import Bounds
from airground_drake.model.plants.first_order import FirstOrder
from airground_drake.model.plants.own import OwnKeys
from airground_drake.model.plants.plant import Keys, Plant
from airground_drake.scenario.hints import plugin_path
from airground_drake.scenario.kinds import OneOrList

# The classes of keys, by kind; `OWN` stands for the user's plants.
OWN = "a plant of your own"
KEYS: dict[str, type[Keys]] = {name: PLANTS.load(name, of=Keys) for name in PLANTS.own} | {OWN: OwnKeys}
NO_THEOREM = "no theorem covers another combination"


def tag_of(given: Any) -> str:
    """The name in `KEYS` of the class that a plant's keys belong to; without a mapping, that of the default plant."""
    kind = given.get("kind", AS_TOLD) if isinstance(given, dict) else getattr(given, "kind", AS_TOLD)
    return kind if kind in PLANTS.own else OWN


def _known(given: Any, info: ValidationInfo) -> Any:
    """Refuse a kind that does not name a plant, whatever the other keys are."""
    kind = given.get("kind", AS_TOLD) if isinstance(given, dict) else AS_TOLD
    if isinstance(kind, str) and info.context != RECORDED and not PLANTS.accepts(kind):
        raise refused(kind, f"one of {', '.join(PLANTS.allowed)}{plugin_path(kind)}", "kind")
    return given


if TYPE_CHECKING:
    AnyKeys = Keys
else:
    _tagged = (Annotated[kind, Tag(name)] for name, kind in KEYS.items())
    AnyKeys = Annotated[Union[tuple(_tagged)], Discriminator(tag_of), BeforeValidator(_known)]  # noqa: UP007

Plants = Annotated[list[AnyKeys], Field(strict=True, max_length=2), OneOrList()]


class _Robot(Protocol):
    """A robot of a scenario."""

    plant: list[Keys]


def plant_of(robot: _Robot, period_s: float) -> Plant:
    """How a robot moves under its commands, with a control period, s."""
    plant: Plant | None = None
    for keys in reversed(robot.plant):
        plant = keys.made(period_s, plant)
    return plant or FirstOrder()


def bounds_of(robot: Any, period_s: float, seen: dict[str, Any]) -> Bounds:
    """How far a robot of a scenario may be from where the law steers it, and what is `seen` of it."""
    return plant_of(robot, period_s).bounds(robot.max_speed_m_s)._replace(**seen)


def made(given: list[dict[str, Any]], period_s: float) -> Plant:
    """The plant that the value of `plant` in a resolved scenario says, with a control period, s."""
    return plant_of(SimpleNamespace(plant=_LIST.validate_python(given, context=RECORDED)), period_s)


_LIST = TypeAdapter(list[AnyKeys])


def refusal(given: list[Keys]) -> str:
    """Why plants cannot be combined; '' if they can."""
    if len(given) < 2 or given[0].precedes(given[1]):
        return ""
    why = next((keys.alone for keys in given if keys.alone), NO_THEOREM)
    return f"one plant, or a delay and then a lag: {why}"
