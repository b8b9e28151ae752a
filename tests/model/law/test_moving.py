"""Beside obstacles that move: what the robot does itself, what it keeps, and that it retreats."""

from dataclasses import replace

import numpy as np
from builders.worlds import world
from hypothesis import example, given
from hypothesis import strategies as st
from properties import examples

from airground_drake.base.arrays import Array
from airground_drake.model.bodies.world import Body, World
from airground_drake.model.geometry import convex, outline
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.plants.scripted import Scripted

H, GAP, SPEED, LIMIT = 0.05, 0.3, 1.2, 1.5
SHAPES = {
    "person": outline.balls(np.zeros(3), 0.25, GAP),
    "forklift": outline.stacked([outline.prism([[-0.4, -1.0], [0.4, -1.0], [0.4, 1.0], [-0.4, 1.0]], gap=GAP)]),
    "board": outline.stacked([outline.prism([[-0.7, 0.0], [0.7, 0.0]], radius=0.05, gap=GAP)]),
}


def beside(shape: Array, speed: float, count: int = 2, walls: Array | None = None, error_m: float = 0.0) -> World:
    team, rows = world(count, ugv_m=0.2, max_speed=LIMIT), shape.copy()
    rows[:, outline.SPEED] = speed
    script = Scripted(Motion(np.zeros(1), np.zeros((1, 3))))
    fixed = () if walls is None else (Body("walls", "obstacle", np.zeros(3), walls),)
    robots = [replace(body, error_m=error_m) for body in team.bodies]
    return replace(team, bodies=(*robots, Body("mover", "obstacle", np.zeros(3), rows, script, speed), *fixed))


def apart(shape: Array, place: Array, origin: Array) -> float:
    """Gap less the distance to keep of a point, by many points of the motion's corners: see tests of `convex`."""
    return float((convex.distances(shape, place - origin, True) - outline.keep(shape, 0.0)).min())


@examples(80, fuzz=2000)
@example("forklift", 43, "hostile", 0.1)  # cornered, it must not slide towards where the obstacle may be
@example("board", 132, "hostile", 0.1)
@given(
    st.sampled_from(sorted(SHAPES)),
    st.integers(0, 2**31),
    st.sampled_from(["at random", "towards", "hostile"]),
    st.sampled_from([0.0, 0.02, 0.1]),
)
def test_no_robot_brings_itself_too_near_and_what_was_far_enough_is_kept(
    shape: str, seed: int, how: str, error_m: float
) -> None:
    """Whatever is asked of the robots, wherever they believe to be, and whatever the obstacle does within its speed."""
    rng, rows = np.random.default_rng(seed), SHAPES[shape]
    wall = outline.stacked([outline.prism(rng.uniform(-3.0, 3.0, (2, 2)).tolist(), gap=GAP)])
    team = beside(rows, SPEED, 2, wall, error_m)
    near, avoidance = team.around(team.select("ugv")), Avoidance(3.0, H, 4.0, stands=error_m > 0.0)
    y = rng.uniform(-1.0, 1.0, 2)
    places = np.array([[-1.0, y[0], 0.0], [1.0, y[1], 0.0], [0.0, 0.0, 9.0], [0.0, 0.0, 0.0]])
    for _ in range(40):
        origin, before = places[3].copy(), places[:2].copy()
        offset = origin - before
        lower = 9.0 * (rng.normal(size=(2, 3)) if how == "at random" else offset) * [1.0, 1.0, 0.0]
        seen, aside = places.copy(), rng.choice([-1.0, 1.0], (2, 1)) * offset[:, [1, 0, 2]] * [1.0, -1.0, 0.0]
        seen[:2] += error_m * aside / np.maximum(np.linalg.norm(offset, axis=1, keepdims=True), 1e-9)
        velocity = avoidance.command(lower, seen, near)
        turn = rng.uniform(-np.pi, np.pi)
        drift = SPEED * np.array([np.cos(turn), np.sin(turn), 0.0])
        if how == "hostile":
            drift = SPEED * -offset[0] / max(float(np.linalg.norm(offset[0])), 1e-9)
        for own, step in zip(before, velocity, strict=True):
            had = apart(rows, own, origin)
            for s in np.linspace(0.0, 1.0, 6):
                there = own + s * H * step
                assert apart(rows, there, origin) >= min(had, SPEED * H) - 1e-9
                if had >= SPEED * H:
                    assert apart(rows, there, origin + s * H * drift) >= -1e-9
        places[:2] += H * velocity
        places[3] = origin + H * drift


def test_a_robot_retreats_within_its_speed_limit_and_slides_along_a_wall() -> None:
    """A person walks at a robot that stands, in the open and before a wall."""
    rows, avoidance = SHAPES["person"], Avoidance(3.0, H, 4.0)
    wall = outline.stacked([outline.prism([[-9.0, 1.0], [9.0, 1.0]], gap=GAP)])
    for walls, way in ((None, [0.0, 1.0, 0.0]), (wall, [0.3, 1.0, 0.0])):
        team = beside(rows, SPEED, 1, walls)
        near, drift = team.around(team.select("ugv")), SPEED * np.array(way) / np.linalg.norm(way)
        places = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 9.0], [0.0 if walls is None else -0.2, -2.0, 0.0]])
        least, fastest = np.inf, 0.0
        for _ in range(60):
            velocity = avoidance.command(np.zeros((1, 3)), places, near)
            fastest = max(fastest, float(np.linalg.norm(velocity[0])))
            places[0] += H * velocity[0]
            places[2] += H * drift
            least = min(least, apart(rows, places[0], places[2]))
            assert walls is None or apart(wall, places[0], np.zeros(3)) >= -1e-9
        assert (SPEED - 1e-9 if walls is None else 0.5) <= fastest <= LIMIT + 1e-9
        assert least >= -1e-9 if walls is None else least > -GAP  # it could not go on before the wall


def test_an_obstacle_that_promises_to_stand_is_no_reason_to_retreat() -> None:
    for speed, moves in ((0.0, False), (SPEED, True)):
        team = beside(SHAPES["person"], speed, 1)
        places = np.array([[0.56, 0.0, 0.0], [0.0, 0.0, 9.0], [0.0, 0.0, 0.0]])
        velocity = Avoidance(3.0, H, 4.0).command(np.zeros((1, 3)), places, team.around(slice(0, 1)))
        assert bool(velocity[0, 0] > 0.5) is moves


def test_a_uav_near_what_may_move_stands_with_errors() -> None:
    """In space the directions that surely lead away are no half-planes."""
    places, wish = np.array([[9.0, 9.0, 0.0], [0.4, 0.0, 0.3], [0.0, 0.0, 0.0]]), np.array([[-0.3, 1.0, 0.0]])
    for error_m, moves in ((0.0, True), (0.05, False)):
        team = beside(SHAPES["person"], SPEED, 1, error_m=error_m)
        law = Avoidance(3.0, H, 4.0, stands=error_m > 0.0)
        assert law.command(wish, places, team.around(team.select("uav"))).any() == moves
