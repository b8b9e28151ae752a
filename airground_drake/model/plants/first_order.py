"""First order: it follows commands exactly."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from airground_drake.model.plants.plant import Keys, Plant


@dataclass(slots=True, kw_only=True)
class FirstOrderKeys(Keys):
    """It follows commands exactly."""

    kind: Literal["first_order"] = "first_order"
    """The default."""

    def made(self, period_s: float, after: Plant | None) -> "FirstOrder":
        return FirstOrder()


@dataclass(frozen=True)
class FirstOrder(Plant):
    """p_dot = v: it follows commands exactly."""

    unproved: ClassVar[str] = ""
