"""Kinds of bodies."""

from typing import Literal, get_args

Kind = Literal["ugv", "uav", "obstacle"]
KINDS: tuple[Kind, ...] = get_args(Kind)
ROBOTS: tuple[Kind, ...] = ("ugv", "uav")  # kinds of bodies that are commanded
