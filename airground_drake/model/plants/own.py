"""A user's own Drake System: only its declared drift and cover are known here."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from airground_drake.base.registry import PLANTS, PLUGIN_PATTERN
from airground_drake.base.values import Name, NotNegative, Real, ValueRule, Words
from airground_drake.model.plants.budget import Bounds
from airground_drake.model.plants.plant import PLACE, Keys, Plant, Premise, Recorded, Setting


@dataclass(slots=True, kw_only=True)
class OwnKeys(Keys):
    """The user's own Drake System, with declared drift and cover. Each run measures both."""

    kind: Annotated[Words, ValueRule(str, lambda: {"anyOf": [{"enum": PLANTS.others}, {"pattern": PLUGIN_PATTERN}]})]
    """Its class: `module:Class` or `file.py:Class`."""
    drift_m_s: NotNegative = 0.0
    """Largest distance by which its steered point misses a command in a period, divided by the period."""
    cover_m: NotNegative = 0.0
    """How far the body is at most from the steered point's straight line in a control period."""
    parameters: dict[Name, Real] = field(default_factory=dict)
    """Numbers for its class, by name."""
    is_own: ClassVar[bool] = True
    alone: ClassVar[str] = "a plant of your own does everything itself"

    def made(self, period_s: float, after: Plant | None) -> "Own":
        return Own(self.kind, self.drift_m_s, self.cover_m, self.parameters)

    def problems(self, setting: Setting) -> Iterator[tuple[str, object, str]]:
        if self.drift_m_s and not setting.gain_1_s:
            yield "drift_m_s", self.drift_m_s, "0: without control.avoidance_gain_1_s nothing makes up for a drift"


@dataclass(frozen=True)
class Own(Plant):
    """A Drake System of the user's."""

    # `sim.blocks.plant` makes it and looks at its ports.
    # In each period its steered point ends within `drift_m_s` times the control period of the commanded point,
    # and its body stays within `cover_m` of the straight line between the places of that point at the period's ends. A
    # run measures both. Predictions assume that commands are followed exactly.

    name: str  # of its class, `module:Class` or `file.py:Class`
    drift_m_s: float  # declared
    cover_m: float  # declared
    parameters: Mapping[str, float] = field(default_factory=dict)  # of its class

    signals: ClassVar[tuple[str, ...]] = PLACE
    measured: ClassVar[tuple[str, ...]] = ("drift_m_s", "cover_m")
    theorems: ClassVar[tuple[str, ...]] = ("Mixed.drifting", "Mixed.entry_keeps")
    unproved: ClassVar[str] = "its drift and cover are declared: the distance budget says what is proved of it"

    def bounds(self, speed_m_s: float) -> Bounds:
        return Bounds(cover_m=self.cover_m, drift_m_s=self.drift_m_s, speed_m_s=speed_m_s)

    def premises(self, run: Recorded) -> Iterator[Premise]:
        drift, cover = run.measured.T
        yield Premise("declared drift", "m/s", run.sampled_s, self.drift_m_s - drift)
        yield Premise("declared cover", "m", run.sampled_s, self.cover_m - cover)
