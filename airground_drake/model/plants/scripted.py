"""A motion that is given: that of an obstacle."""

from dataclasses import dataclass

from airground_drake.model.geometry.motion import Motion
from airground_drake.model.plants.plant import Plant


@dataclass(frozen=True, eq=False)
class Scripted(Plant):
    """Nobody commands it."""

    script: Motion  # its motion, straight between vertices at control samples
    announced: bool = False  # whether the robots' predictions use it
