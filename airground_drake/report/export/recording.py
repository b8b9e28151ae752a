"""A run as an MCAP file, for Foxglove and other readers, or as CSV files, one per table of the trace."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from airground_drake.base import files
from airground_drake.base.arrays import Array
from airground_drake.base.errors import ExportError
from airground_drake.report.view.geometry import Mesh, prisms
from airground_drake.report.view.stage import (
    OBSTACLE_COLOR,
    SAFE_COLOR,
    STATE_COLORS,
    UAV_COLOR,
    UNSEEN_COLOR,
    Barrier,
    Robot,
    Stage,
    rgb,
    stage_of,
    states,
)
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.tables import TABLES
from airground_drake.sim.trace import Trace
from airground_drake.verify.runs.pairs import least_gap, pairs_of

if TYPE_CHECKING:
    from mcap.writer import Writer

FRAME = "world"
# Levels of `foxglove.Log` by kind of event: 4 is an error, 3 a warning; all other kinds are information, 2.
LEVELS = {"collision": 4, "refuse": 3}

_NUMBER, _TEXT = {"type": "number"}, {"type": "string"}


def _object(**properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties}


def _array(items: Mapping[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": items}


_WHOLE = {"type": "integer"}
_TIME = _object(sec=_WHOLE, nsec=_WHOLE)
_VECTOR = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_POSE = _object(position=_VECTOR, orientation=_object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER))
_COLOR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_CYLINDER = _object(pose=_POSE, size=_VECTOR, bottom_scale=_NUMBER, top_scale=_NUMBER, color=_COLOR)
_SPHERE = _object(pose=_POSE, size=_VECTOR, color=_COLOR)
_LINE = _object(
    type=_WHOLE, pose=_POSE, thickness=_NUMBER, scale_invariant={"type": "boolean"}, points=_array(_VECTOR),
    color=_COLOR, colors=_array(_COLOR), indices=_array(_WHOLE),
)  # fmt: skip
_TRIANGLES = _object(pose=_POSE, points=_array(_VECTOR), color=_COLOR, colors=_array(_COLOR), indices=_array(_WHOLE))
_ENTITY = _object(
    timestamp=_TIME, frame_id=_TEXT, id=_TEXT, lifetime=_TIME, frame_locked={"type": "boolean"},
    cylinders=_array(_CYLINDER), spheres=_array(_SPHERE), lines=_array(_LINE), triangles=_array(_TRIANGLES),
)  # fmt: skip
_SCENE = _object(deletions=_array(_object()), entities=_array(_ENTITY))
_LOG = _object(timestamp=_TIME, level=_WHOLE, message=_TEXT, name=_TEXT)
_SIGNALS = _object(
    position_m=_VECTOR, command_m_s=_VECTOR, decision_variable_m=_NUMBER, noise_m=_NUMBER, mode=_NUMBER,
    executing=_NUMBER,
)  # fmt: skip


class Message(NamedTuple):
    """A message on a topic."""

    t_s: float
    topic: str
    schema: str
    data: Mapping[str, Any]


# JSON Schemas by name; the first two are those of Foxglove, with the fields that are used here.
SCHEMAS = {"foxglove.SceneUpdate": _SCENE, "foxglove.Log": _LOG, "airground_drake.Signals": _SIGNALS}


def recorded(trace: Trace, scenario: Scenario) -> bytes:
    """The MCAP file of a run of a scenario: the topics `/scene`, `/events`, `/robots/NAME` and `/obstacles/NAME`."""
    # The last one is there for obstacles that move: the origin of the frame.
    try:
        from mcap.writer import Writer
    except ImportError as error:
        raise ExportError("MCAP files need the package mcap: pip install 'airground_drake[mcap]'") from error
    buffer = io.BytesIO()
    writer = Writer(buffer)
    writer.start(profile="", library="airground_drake")
    about = {"scenario": scenario.name, "run": trace.run, "method": str(trace.meta["method"])}
    writer.add_metadata("airground_drake", about)
    _write(writer, sorted(_messages(trace, scenario), key=lambda message: message.t_s))
    writer.finish()  # type: ignore[no-untyped-call]
    return buffer.getvalue()


def _write(writer: Writer, messages: list[Message]) -> None:
    schemas = {
        name: writer.register_schema(name, "jsonschema", json.dumps(schema).encode())
        for name, schema in SCHEMAS.items()
    }
    channels: dict[str, int] = {}
    for number, message in enumerate(messages):
        if message.topic not in channels:
            channels[message.topic] = writer.register_channel(message.topic, "json", schemas[message.schema])
        at = round(message.t_s * 1e9)
        writer.add_message(channels[message.topic], at, json.dumps(message.data).encode(), at, number)


def _messages(trace: Trace, scenario: Scenario) -> Iterator[Message]:
    standing = stage_of(trace, scenario)
    yield Message(0.0, "/scene", "foxglove.SceneUpdate", {"deletions": [], "entities": list(_standing(standing))})
    looks = {robot: states(trace, robot, trace.t) for robot in trace.ugvs}
    movers = [barrier for barrier in standing.barriers if len(barrier.way_m)]
    moved = [(barrier, trace.position(barrier.name) - barrier.way_m[0]) for barrier in movers]
    for k, t in enumerate(trace.t.tolist()):
        entities = [_barrier(standing, barrier, t, by[k].tolist()) for barrier, by in moved]
        for robot in standing.robots:
            color = STATE_COLORS[looks[robot.name][k]] if robot.name in looks else UAV_COLOR
            entities.append(_robot(robot, t, trace.body(robot.name)[k].tolist(), color))
            yield Message(t, f"/robots/{robot.name}", "airground_drake.Signals", _signals(trace, robot.name, k))
        for barrier, by in moved:
            place = {"position_m": _vector((barrier.way_m[0] + by[k]).tolist())}
            yield Message(t, f"/obstacles/{barrier.name}", "airground_drake.Signals", place)
        yield Message(t, "/scene", "foxglove.SceneUpdate", {"deletions": [], "entities": entities})
    for event in trace.events:
        t, kind, name = float(event["t_s"]), str(event["kind"]), str(event["robot"])
        log = {"timestamp": _time(t), "level": LEVELS.get(kind, 2), "message": f"{name}: {kind}", "name": name}
        yield Message(t, "/events", "foxglove.Log", log)


def _signals(trace: Trace, robot: str, k: int) -> dict[str, Any]:
    signals: dict[str, Any] = {
        "position_m": _vector(trace.body(robot)[k].tolist()),
        "command_m_s": _vector(trace.command(robot)[k].tolist()),
    }
    if robot in trace.ugvs:
        for name in ("decision_variable_m", "noise_m", "mode"):
            signals[name] = float(trace.column(f"{robot}.{name}")[k])
        signals["executing"] = float(trace.executing(robot)[k])
    return signals


def _standing(stage: Stage) -> Iterator[dict[str, Any]]:
    """All barriers where they are at the start, the arena's frames, and phantoms as cylinders."""
    low = stage.mark_m
    yield from (_barrier(stage, barrier, 0.0, [0.0] * 3) for barrier in stage.barriers)
    if stage.arena:
        colors = (OBSTACLE_COLOR, SAFE_COLOR)
        yield _entity("arena", 0.0, lines=[_loop(*outline) for outline in zip(stage.arena, colors, strict=True)])
    for k, phantom in enumerate(stage.phantoms_m.tolist()):
        yield _entity(f"phantom {k + 1}", 0.0, cylinders=[_cylinder(phantom, low, low, UNSEEN_COLOR, 0.5)])


def _barrier(stage: Stage, barrier: Barrier, t: float, moved: list[float]) -> dict[str, Any]:
    """A ball, post or wall inside its transparent safe zone, moved from where it starts."""
    name, color, low = f"obstacle {barrier.name}", barrier.color, stage.mark_m
    foot = (barrier.place_m + moved).tolist()
    tall = max(2.0 * low, min(barrier.top_m, float(stage.high_m[2])) - float(barrier.place_m[2]))
    if barrier.is_round:
        body = _cylinder(foot, float(barrier.radius_m[0]), tall, color)
        return _entity(name, t, cylinders=[body, _cylinder(foot, float(barrier.safe_m[0]), low, SAFE_COLOR, 0.2)])
    body = _triangles(prisms(barrier.body, tall), moved, color)
    return _entity(name, t, triangles=[body, _triangles(prisms(barrier.safe, low), moved, SAFE_COLOR, 0.2)])


def _robot(robot: Robot, t: float, position: list[float], color: str) -> dict[str, Any]:
    """A UGV as a low cylinder, the UAV as a ball."""
    r = robot.radius_m
    if robot.kind == "UGV":
        return _entity(f"robot {robot.name}", t, cylinders=[_cylinder(position, r, r, color)])
    ball = {"pose": _pose(position), "size": {"x": 2.0 * r, "y": 2.0 * r, "z": 2.0 * r}, "color": _rgba(color)}
    return _entity(f"robot {robot.name}", t, spheres=[ball])


def _entity(name: str, t: float, **shapes: list[dict[str, Any]]) -> dict[str, Any]:
    """A scene entity, shown until another of the same name replaces it."""
    stays = {"sec": 0, "nsec": 0}
    return {"timestamp": _time(t), "frame_id": FRAME, "id": name, "lifetime": stays, "frame_locked": False, **shapes}


def _cylinder(foot: list[float], radius: float, height: float, color: str, alpha: float = 1.0) -> dict[str, Any]:
    x, y, z = foot
    size = {"x": 2.0 * radius, "y": 2.0 * radius, "z": height}
    pose = _pose([x, y, z + height / 2.0])
    return {"pose": pose, "size": size, "bottom_scale": 1.0, "top_scale": 1.0, "color": _rgba(color, alpha)}


def _triangles(mesh: Mesh, place: list[float], color: str, alpha: float = 1.0) -> dict[str, Any]:
    points, indices = [_vector(vertex) for vertex in mesh.vertices.T.tolist()], mesh.faces.T.ravel().tolist()
    return {"pose": _pose(place), "points": points, "color": _rgba(color, alpha), "colors": [], "indices": indices}


def _loop(corners: Array, color: str) -> dict[str, Any]:
    """A closed line on the ground through corners (K, 2), m, two pixels wide."""
    points = [_vector([*corner, 0.0]) for corner in corners.tolist()]
    line = {"type": 1, "pose": _pose([0.0] * 3), "thickness": 2.0, "scale_invariant": True, "points": points}
    return line | {"color": _rgba(color), "colors": [], "indices": []}


def _pose(position: list[float]) -> dict[str, Any]:
    return {"position": _vector(position), "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}


def _vector(values: list[float]) -> dict[str, float]:
    return dict(zip("xyz", values, strict=True))


def _rgba(color: str, alpha: float = 1.0) -> dict[str, float]:
    return dict(zip("rgba", [*rgb(color), alpha], strict=True))


def _time(t_s: float) -> dict[str, int]:
    sec, nsec = divmod(round(t_s * 1e9), 10**9)
    return {"sec": sec, "nsec": nsec}


# Columns under the names that say what they are, by their names in a trace.
TOLD = {"distances_m": "distances_of_centres_m"}


def write(trace: Trace, folder: Path) -> Iterator[Path]:
    """Write the tables, the events and the smallest distances of a run, `RUN_TABLE.csv`."""
    # Distances are between surfaces, below 0 as an overlap. Numbers are written so that they read back equal.
    tables: dict[str, pd.DataFrame] = {name: getattr(trace, name) for name in TABLES}
    tables["events"] = pd.DataFrame(trace.events)
    least = [least_gap(trace, pair) for pair in pairs_of(trace)]
    tables["distances"] = pd.DataFrame([
        {"first": at.pair.first, "second": at.pair.second, "min_distance_m": at.gap_m,
         "safe_distance_m": at.pair.required_m, "t_s": at.t_s} for at in least
    ])  # fmt: skip
    for name, table in tables.items():
        path = folder / f"{trace.run}_{name}.csv"
        files.write_text(path, table.rename(columns=TOLD).map(_cell).to_csv(index=False))
        yield path


def _cell(value: Any) -> Any:
    """A list or an array as JSON text, anything else as it is."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    return json.dumps(value) if isinstance(value, list) else value
