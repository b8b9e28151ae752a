"""Observations and motions as plain JSON, so that they can go to another process and back without a pickle.

An array is its shape and its bytes (binary64, in base64), so that every number arrives as it was, to the bit.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from airground_drake.arrays import Array
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.policy import Observation, Proposal, Teammate

_KINDS: dict[str, type] = {kind.__name__: kind for kind in (Observation, Teammate, Proposal, Motion)}


def packed(value: Any) -> Any:
    """What the UAV knows as JSON: an `Observation`, or a part of one."""
    if isinstance(value, np.ndarray):
        return {"shape": value.shape, "binary64": _text(value)}
    if isinstance(value, tuple):
        return [packed(each) for each in value]
    if is_dataclass(value):
        given = [each.name for each in fields(value) if each.init]
        return {type(value).__name__: {name: packed(getattr(value, name)) for name in given}}
    return value


def unpacked(data: Any) -> Any:
    """What `packed` was given, made anew; its arrays are views of immutable bytes."""
    if isinstance(data, list):
        return tuple(unpacked(each) for each in data)
    if not isinstance(data, dict):
        return data
    if "binary64" in data:
        return _numbers(data["binary64"]).reshape(data["shape"])
    ((kind, values),) = data.items()
    return _KINDS[kind](**{name: unpacked(each) for name, each in values.items()})


def packed_motions(motions: Mapping[str, Motion]) -> list[list[str]]:
    """A proposal as JSON: name, times and positions of each motion."""
    return [[name, _text(motion.times), _text(motion.positions)] for name, motion in motions.items()]


def unpacked_motions(data: object) -> dict[str, Motion]:
    """The motions by name that `packed_motions` was given, from a source that is not trusted.

    Raises:
        ValueError: if the data are anything else.
    """
    found: dict[str, Motion] = {}
    for each in data if isinstance(data, list) else [data]:
        if not (isinstance(each, list) and len(each) == 3 and all(isinstance(part, str) for part in each)):
            raise ValueError("no motion")
        name, times, positions = each
        found[name] = Motion(_numbers(times), _numbers(positions).reshape(-1, 3))
    return found


def _text(values: Array) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=np.float64).tobytes()).decode("ascii")


def _numbers(text: str) -> Array:
    return np.frombuffer(base64.b64decode(text, validate=True), dtype=np.float64)
