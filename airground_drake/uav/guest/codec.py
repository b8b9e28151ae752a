"""Messages to and from a policy's process: JSON, which cannot carry code, as a pickle can.

An array is sent as its shape and its bytes (binary64, in base64), so that every number arrives unchanged.
"""

import base64
import json
from dataclasses import fields
from typing import Any

import numpy as np

from airground_drake.model.geometry.motion import Motion
from airground_drake.uav.policy import MovingObstacle, Observation, Proposal, Teammate

# Classes whose objects a message may contain.
KINDS: tuple[type, ...] = (Observation, Teammate, Proposal, MovingObstacle, Motion)
LONGEST = 4 * 2**20  # largest answer of a policy, bytes: some 90,000 vertices


def encoded(message: object) -> bytes:
    """A message of plain JSON, arrays and objects of `KINDS` as bytes."""
    return json.dumps(message, default=_as_json, separators=(",", ":")).encode("ascii")


def _as_json(value: Any) -> dict[str, Any]:
    if isinstance(value, np.ndarray):
        numbers = np.ascontiguousarray(value, dtype=np.float64).tobytes()
        return {"@": "array", "shape": value.shape, "base64": base64.b64encode(numbers).decode("ascii")}
    return {"@": type(value).__name__} | {part.name: getattr(value, part.name) for part in fields(value) if part.init}


def decoded(data: bytes, kinds: tuple[type, ...]) -> Any:
    """The decoded message, with read-only arrays."""
    # kinds: classes whose objects may be made. The data cannot name any other code.
    named = {kind.__name__: kind for kind in kinds}

    def made(values: dict[str, Any]) -> Any:
        kind = values.pop("@", None)
        if kind == "array":
            numbers = base64.b64decode(values["base64"], validate=True)
            return np.frombuffer(numbers, dtype=np.float64).reshape(values["shape"])
        if kind is None:
            return values
        return named[kind](**{name: tuple(v) if isinstance(v, list) else v for name, v in values.items()})

    return json.loads(data, object_hook=made)
