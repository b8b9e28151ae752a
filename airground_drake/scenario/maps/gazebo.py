"""The obstacles of a Gazebo world: upright cylinders, balls and boxes of its models."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple
from xml.etree import ElementTree
from xml.parsers import expat

from airground_drake.base.errors import Fault, ScenarioError, short

LINE = "line"  # attribute in which each element has its line in the file
MOST_ELEMENTS = 1_000_000
TILTED = 1e-6  # roll or pitch above which something does not stand upright, rad
SHAPES = ("box", "cylinder", "sphere")
EMPTY = "empty"  # the geometry of nothing
# Elements that are no obstacles, by their parent element. Other elements are read, or named as left out.
NO_BODIES = {
    "sdf": {"light"},
    "world": {
        "atmosphere", "audio", "frame", "gravity", "gui", "joint", "light", "magnetic_field", "physics", "plugin",
        "road", "scene", "spherical_coordinates", "wind",
    },
    "state": {"iterations", "joint", "light", "real_time", "sim_time", "wall_time"},
    "model": {
        "allow_auto_disable", "enable_wind", "frame", "gripper", "joint", "plugin", "pose", "self_collide", "static",
    },
}  # fmt: skip


class Pose(NamedTuple):
    """Position, m, and heading, rad, of something upright."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    heading: float = 0.0

    def __matmul__(self, inner: Pose) -> Pose:
        """The pose, in the outer frame, of what has the pose `inner` in this one."""
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        x, y = self.x + cos * inner.x - sin * inner.y, self.y + sin * inner.x + cos * inner.y
        return Pose(x, y, self.z + inner.z, self.heading + inner.heading)


class Solid(NamedTuple):
    """Something in the way of robots."""

    name: str  # of its model
    pose: Pose  # of its middle
    size: tuple[float, ...]  # length and width of a box, m; the radius alone, m, for cylinders and balls
    bottom: float  # height of its lower edge over the ground, m
    top: float  # height of its upper edge over the ground, m


class Gazebo(NamedTuple):
    """The solids of a world, and the names of all other bodies in it, which were left out, each with the reason."""

    solids: list[Solid]
    left_out: list[str]


def world(text: str, source: str) -> Gazebo:
    """The obstacles in a world file that may be hostile."""
    # A model is where `<state>` says, if it is in there; else where the model says. Left out are models that a plug-in
    # moves, models within models, included models, actors, populations, shapes other than `SHAPES`, and what does not
    # stand out of the ground.
    root = _parsed(text, source)
    world = root.find("world") if root.tag == "sdf" else root if root.tag == "world" else None
    if world is None:
        raise ScenarioError(f"{source}:{root.get(LINE)}", root.tag, Fault("no world"), "wanted: <sdf> with a <world>")
    left_out = list[str]()
    if root is not world:
        root.remove(world)
        left_out += _others(root)
    left_out += _others(world, "model", "state")
    left_out += [f"{element} in <state>" for state in world.iterfind("state") for element in _others(state, "model")]
    states = {state.get("name"): state for state in world.iterfind("state/model")}
    solids = list[Solid]()
    for model in world.iterfind("model"):
        name = model.get("name") or "model"
        if model.find("plugin") is not None and _text(model, "static") not in ("1", "true"):
            left_out.append(f"{name}, which a plug-in moves")
            continue
        state = states.get(model.get("name"))
        scale = None if state is None else state.find("scale")
        reader = _Reader(source, name, (1.0, 1.0, 1.0) if scale is None else _numbers(scale, 3, source))
        pose = reader.pose(model if state is None or state.find("pose") is None else state)
        solids += reader.model(model, pose)
        left_out += reader.left_out
    return Gazebo(solids, [*dict.fromkeys(left_out)])


class _Reader:
    """Reads the shapes of one model."""

    def __init__(self, source: str, name: str, scale: tuple[float, ...]) -> None:
        self.source, self.name, self.scale = source, name, scale
        self.left_out: list[str] = []

    def model(self, model: ElementTree.Element, pose: Pose) -> Iterator[Solid]:
        """The solids of a model at a pose, if they stand out of the ground."""
        for link in model.iterfind("link"):
            for collision in link.iterfind("collision"):
                for solid in self.solids(collision, pose @ self.pose(link) @ self.pose(collision)):
                    if solid.top > 0.0:
                        yield solid
                    else:
                        self.left_out.append(f"{self.name}, whose top is not above the ground")
        within = [f"{element} within {self.name}" for element in _others(model, "link")]
        if not within and model.find("link/collision/geometry/*") is None:
            within = [f"{self.name}, which has no <collision>"]
        self.left_out += within

    def pose(self, of: ElementTree.Element) -> Pose:
        given = of.find("pose")
        if given is None or not (given.text or "").strip():
            return Pose()
        if frame := given.get("relative_to") or given.get("frame"):
            raise self._wrong(given, frame, "wanted: a pose in the frame of the element around it")
        x, y, z, *angles = _numbers(given, 6, self.source)
        in_degrees = given.get("degrees") in ("true", "1")
        roll, pitch, yaw = map(math.radians, angles) if in_degrees else angles
        if max(abs(math.remainder(angle, math.tau)) for angle in (roll, pitch)) > TILTED:
            raise self._wrong(given, f"{roll:g} {pitch:g}", "roll and pitch must be 0: shapes stand upright")
        return Pose(x, y, z, yaw)

    def solids(self, collision: ElementTree.Element, pose: Pose) -> Iterator[Solid]:
        """The solid of a `<collision>`, if it is in the way of robots."""
        for shape in collision.iterfind("geometry/*"):
            if shape.tag == EMPTY or (shape.tag == "plane" and self._is_level(shape)):
                continue
            if shape.tag not in SHAPES:
                self.left_out.append(f"a {shape.tag} of {self.name}")
            elif shape.tag == "box":
                length, width, height = self._sizes(shape, "size", 3, self.scale)
                yield Solid(self.name, pose, (length, width), pose.z - 0.5 * height, pose.z + 0.5 * height)
            else:
                across, along, up = self.scale
                if across != along or (shape.tag == "sphere" and across != up):
                    raise self._wrong(shape, " ".join(map(str, self.scale)), "round shapes keep their proportions")
                (radius,) = self._sizes(shape, "radius", 1, (across,))
                (height,) = self._sizes(shape, "length", 1, (up,)) if shape.tag == "cylinder" else (2.0 * radius,)
                yield Solid(self.name, pose, (radius,), pose.z - 0.5 * height, pose.z + 0.5 * height)

    def _is_level(self, plane: ElementTree.Element) -> bool:
        normal = plane.find("normal")
        x, y, z = (0.0, 0.0, 1.0) if normal is None else _numbers(normal, 3, self.source)
        return math.hypot(x, y) <= TILTED * abs(z)

    def _sizes(self, shape: ElementTree.Element, key: str, count: int, scale: tuple[float, ...]) -> tuple[float, ...]:
        """Sizes above 0, m."""
        given = shape.find(key)
        if given is None:
            raise self._wrong(shape, Fault("missing"), f"wanted: <{key}>")
        sizes = tuple(size * factor for size, factor in zip(_numbers(given, count, self.source), scale, strict=True))
        if min(sizes) <= 0.0:
            raise self._wrong(given, given.text, "wanted: numbers above 0, in m")
        return sizes

    def _wrong(self, at: ElementTree.Element, value: object, allowed: str) -> ScenarioError:
        return ScenarioError(f"{self.source}:{at.get(LINE)}", f"{self.name}: <{at.tag}>", value, allowed)


def _others(of: ElementTree.Element, *read: str) -> Iterator[str]:
    """The names of the bodies in an element, but for those with a tag that is read."""
    for body in of:
        if body.tag in (*read, *NO_BODIES[of.tag]):
            continue
        name = body.get("name") or _text(body, "name")
        if body.tag == "include":
            yield f"<include> of {_text(body, 'uri')}" + (f" as {name}" if name else "")
        else:
            yield name if body.tag == "model" and name else f"<{body.tag}> {name}".strip()


def _numbers(of: ElementTree.Element, count: int, source: str) -> tuple[float, ...]:
    try:
        numbers = tuple(map(float, (of.text or "").split()))
    except ValueError:
        numbers = ()
    if len(numbers) != count or not all(abs(number) < 1e9 for number in numbers):
        noun = "number" if count == 1 else "numbers"
        allowed = f"wanted: {count} {noun} below 1e9 in size"
        raise ScenarioError(f"{source}:{of.get(LINE)}", f"<{of.tag}>", short((of.text or "").strip()), allowed)
    return numbers


def _text(of: ElementTree.Element, key: str) -> str:
    return (of.findtext(key) or "").strip()


def _parsed(text: str, source: str) -> ElementTree.Element:
    """The elements of an XML text; each has its line as an attribute. A DTD, which may hold bombs, is refused."""
    builder = ElementTree.TreeBuilder()
    parser = expat.ParserCreate()
    count = 0

    def refuse(fault: str, allowed: str) -> ScenarioError:
        return ScenarioError(f"{source}:{parser.CurrentLineNumber}", "", Fault(fault), allowed)

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > MOST_ELEMENTS:
            raise refuse("too many elements", f"at most {MOST_ELEMENTS} are allowed")
        builder.start(tag, {**attributes, LINE: str(parser.CurrentLineNumber)})

    def doctype(*_: object) -> None:
        raise refuse("a DTD is given", "wanted: the SDF of a Gazebo world, which needs none")

    parser.StartElementHandler, parser.EndElementHandler = start, builder.end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = builder.data, doctype
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise refuse(f"not XML: {expat.errors.messages[error.code]}", "wanted: the SDF of a Gazebo world") from None
    return builder.close()
