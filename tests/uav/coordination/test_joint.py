"""Joint plans keep every distance exactly, at all times, and are found where there is one."""

import math
from collections import Counter
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from builders.shapes import fields, from_core, wall
from builders.teams import Array, motions, random_team, space, task
from hypothesis import given
from hypothesis import strategies as st
from planner import alcove
from properties import examples

from airground_drake.model.geometry import outline
from airground_drake.uav.coordination import intervals, neighbourhoods
from airground_drake.uav.coordination.joint import Effort, Plan, plan
from airground_drake.uav.coordination.roadmap import RobotTask, Space, build_roadmap
from airground_drake.uav.coordination.single import Mover, OtherRobot, _wished, find, sum_of_times
from airground_drake.uav.coordination.timed import free_pieces

CORRIDOR = [(x, y) for x in np.arange(-6.0, 6.1, 1.5) for y in (-2.3, 2.3)]


def sampled(motion: Array, t: Array) -> Array:
    return np.column_stack([np.interp(t, motion[:, 0], axis) for axis in motion[:, 1:].T])


def distances(one: Array, other: Array) -> Array:
    """Least distance on each piece on which both go straight, by a formula of its own: minimum of a parabola."""
    t = np.union1d(one[:, 0], other[:, 0])
    offset = sampled(one, t) - sampled(other, t)
    step = np.diff(offset, axis=0)
    a, b = np.square(step).sum(axis=1), (offset[:-1] * step).sum(axis=1)
    s = np.clip(-b / np.where(a > 0.0, a, 1.0), 0.0, 1.0)
    inner = np.square(offset[:-1]).sum(axis=1) + 2.0 * s * b + s * s * a
    return np.sqrt(np.append(inner, np.square(offset[-1]).sum()))


def assert_keeps_distances(
    room: Space, tasks: list[RobotTask], found: Plan, speed: float, fixed: list[OtherRobot]
) -> None:
    ways = motions(found, tasks)
    for way, one in zip(ways, tasks, strict=True):
        assert way[0].tolist() == [0.0, *one.start]
        assert (np.diff(way[:, 0]) > 0.0).all()
        legs = np.diff(way, axis=0)
        assert (np.hypot(legs[:, 1], legs[:, 2]) <= speed * legs[:, 0] * (1.0 + 1e-9) + 1e-9).all()
        for row, keep in zip(room.rows, room.keep.tolist(), strict=True):
            core = outline.corners_of(row)
            least = min(keep + one.body, float(from_core(one.start[None], one.start[None], core)[0]))
            assert from_core(way[:-1, 1:], way[1:, 1:], core).min(initial=np.inf) >= least - 2e-9
    bodies = [OtherRobot(way, one.body) for way, one in zip(ways, tasks, strict=True)]
    moved = [body for body, way in zip(bodies, found.ways, strict=True) if way is not None]  # others may be run into
    for one, other in [*combinations(bodies, 2), *((body, each) for body in moved for each in fixed)]:
        ends = [float(np.hypot(*(one.motion[k, 1:] - other.motion[k, 1:]))) for k in (0, -1)]
        least = min(room.apart + one.radius + other.radius, *ends)
        assert distances(one.motion, other.motion).min() >= least - 2e-9


@given(
    seed=st.integers(0, 10**6), count=st.integers(1, 5), obstacles=st.integers(0, 6), extent=st.floats(9.0, 20.0),
    bodies=st.sampled_from([(0.0,), (0.0, 0.7), (0.3, 0.1, 1.0)]),
)  # fmt: skip
@examples(20, fuzz=1000)
def test_every_distance_is_kept_at_all_times(
    seed: int, count: int, obstacles: int, extent: float, bodies: tuple[float, ...]
) -> None:
    room, tasks = random_team(seed, min(count, 1 + int(extent / 4.0)), min(obstacles, int(extent / 3.0)), extent)
    tasks = [replace(one, body=bodies[k % len(bodies)]) for k, one in enumerate(tasks)]
    room = replace(room, keep=room.keep + np.arange(len(room.keep)) % 2 * bodies[-1])
    fixed = [OtherRobot(np.array([[0.0, -30.0, extent / 2.0], [30.0, 2.0 * extent, extent / 2.0]]), bodies[-1])]
    found = plan(room, tasks, [1.0] * len(tasks), fixed, effort=Effort(candidates=100_000))
    assert_keeps_distances(room, tasks, found, 1.0, fixed)
    for way, one in zip(found.ways, tasks, strict=True):
        assert way is None or way.motion[-1, 1:].tolist() == one.preset[-1, 1:].tolist()


@given(seed=st.integers(0, 10**6), count=st.integers(1, 3), field=fields(6), body=st.sampled_from([0.0, 0.2]))
@examples(15, fuzz=1000)
def test_every_distance_is_kept_among_walls(seed: int, count: int, field: tuple[Array, Array], body: float) -> None:
    """Robots begin and end anywhere, too near to walls and polygons now and then."""
    rng, (rows, keep) = np.random.default_rng(seed), field
    places = rng.permutation(np.array([(x, y) for x in (0.3, 2.6, 5.2, 7.4, 9.7) for y in (0.4, 3.1, 6.6, 9.3)]))
    tasks = [replace(task(places[2 * k], places[2 * k + 1]), body=body) for k in range(count)]
    room = Space(rows, keep, 0.1, 0.5, 0.1)
    found = plan(room, tasks, [1.0] * count, effort=Effort(candidates=100_000))
    assert_keeps_distances(room, tasks, found, 1.0, [])


def test_walls_do_not_make_the_lattice_larger_than_ways_need() -> None:
    """Arena walls of 40 m, and a wall through the middle: the way past it leads far, and so does the lattice then."""
    corners = [(-20.0, -20.0), (20.0, -20.0), (20.0, 20.0), (-20.0, 20.0)]
    arena = [wall(a, b) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    one = task((-15.0, -15.0), (-12.0, -15.0))
    sizes = []
    for more in ([], [wall((-13.5, -19.0), (-13.5, 10.0))]):
        room = Space(outline.stacked([*arena, *more]), np.full(4 + len(more), 0.5), 0.1, 0.5, 0.1)
        nodes = build_roadmap([room.of(0.0)], [one]).nodes
        sizes.append(np.ptp(nodes, axis=0))
        found = plan(room, [one], [1.0])
        assert found.complete
        assert_keeps_distances(room, [one], found, 1.0, [])
    assert (sizes[0] < 12.0).all()
    assert 5.0 < sizes[1][0] < 12.0


@pytest.mark.parametrize(
    ("obstacles", "ways"),
    [
        pytest.param(CORRIDOR, [((-10.0, 0.0), (10.0, 0.0)), ((10.0, 0.0), (-10.0, 0.0))], marks=pytest.mark.slow),
        ([], [((-1.0, 0.0), (5.0, 0.0)), ((1.0, 0.0), (-5.0, 0.0))]),
        ([(4.0 * math.cos(a), 4.0 * math.sin(a)) for a in np.linspace(-1.7, 1.7, 9)], [((2.0, 0.0), (9.0, 0.0))]),
        ([(1.995, 0.6), (-1.995, 0.6)], [((0.0, 0.6 - math.sqrt(4.0 - 1.995**2)), (0.0, 8.0))]),
        ([], [((6 * math.cos(a), 6 * math.sin(a)), (-6 * math.cos(a), -6 * math.sin(a))) for a in np.arange(6.0)]),
    ],
    ids=["swap", "nose to nose", "pocket", "stalled in a gap", "crossing"],
)
def test_deadlocks_are_resolved(
    obstacles: list[tuple[float, float]], ways: list[tuple[tuple[float, float], tuple[float, float]]]
) -> None:
    room, tasks = space(obstacles), [task(*way) for way in ways]
    found = plan(room, tasks, [1.0] * len(tasks))
    assert found.complete
    assert_keeps_distances(room, tasks, found, 1.0, [])


def test_a_dense_team_is_planned_for_in_another_order() -> None:
    """Four in a yard, where the order by length fails; without joint steps, only another order gives all a way."""
    corners = [(-0.7, -0.7), (2.9, -0.7), (2.9, 2.9), (-0.7, 2.9)]
    walls = [wall(a, b) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    room = Space(outline.stacked(walls), np.full(4, 0.5), 0.1, 0.8, 0.2)
    starts, targets = [(0.5, 0.9), (1.7, 1.9), (2.0, 0.9), (0.2, 2.1)], [(0.6, 0.8), (2.0, 0.3), (1.9, 2.1), (1.2, 0.0)]
    tasks = [task(*way) for way in zip(starts, targets, strict=True)]
    found = plan(room, tasks, [2.4] * 4, effort=Effort(candidates=0))
    assert found.outcome == "complete"
    assert_keeps_distances(room, tasks, found, 2.4, [])


def test_joint_steps_are_taken_where_the_plan_of_an_order_takes_long() -> None:
    room, tasks, speeds = alcove()
    one_by_one, both = plan(room, tasks, speeds, effort=Effort(candidates=0)), plan(room, tasks, speeds)
    assert one_by_one.complete
    assert both.complete
    assert sum_of_times(both.ways) < 0.85 * sum_of_times(one_by_one.ways)


def test_who_finds_no_way_stays_and_is_gone_round() -> None:
    cage = [(-8.0 + 2.5 * math.cos(a), 2.5 * math.sin(a)) for a in np.linspace(0.0, 2.0 * math.pi, 9)[:-1]]
    tasks = [task((-8.0, 0.0), (8.0, 0.0)), task((4.0, 0.0), (-2.0, 0.0))]
    room = space(cage)
    found = plan(room, tasks, [1.0, 1.0])
    assert found.ways[0] is None
    assert found.ways[1] is not None
    assert_keeps_distances(room, tasks, found, 1.0, [])


def test_what_a_robot_that_stands_blocks_is_computed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    computed: Counter[tuple[bytes, bytes]] = Counter()

    def counted(motion: Array, grid: intervals.Grid, radii: Array) -> tuple[intervals.Indices, Array]:
        computed[motion.tobytes(), radii.tobytes()] += len(motion) == 1
        return blocked_times(motion, grid, radii)

    blocked_times = intervals.blocked_times
    monkeypatch.setattr(intervals, "blocked_times", counted)
    cage = [(-4.0 + 2.5 * math.cos(a), 2.5 * math.sin(a)) for a in np.linspace(0.0, 2.0 * math.pi, 9)[:-1]]
    tasks = [task((-4.0, 0.0), (4.0, 0.0)), task((4.0, 0.0), (2.0, 0.0)), task((2.0, 2.2), (4.0, 2.2))]
    parked = [OtherRobot(np.array([[0.0, 0.4 * k, 5.0]])) for k in range(20)]
    found = plan(space(cage), tasks, [1.0] * 3, parked)
    assert [way is None for way in found.ways] == [True, False, False]
    assert max(computed.values()) == 1


@given(seed=st.integers(0, 10**6), count=st.integers(1, 4), limits=st.lists(st.floats(-3.0, 3.0), max_size=3))
@examples(20)
def test_a_way_is_found_if_the_robot_can_be_back_in_time(seed: int, count: int, limits: list[float]) -> None:
    """Whatever was asked before; found again among the same others, it is the same way, with the same effort."""
    room, tasks = random_team(seed, count + 1, 2, 14.0)
    roadmap = build_roadmap([room] * len(tasks), tasks)
    movers = [Mover.on(roadmap, room, one, 1.0, own) for one, own in zip(tasks, roadmap.robots, strict=True)]
    others = [OtherRobot(way.motion) for mover in movers[1:] if (way := find(mover, [], 5.0, 10**6)[0])]
    fresh = Mover.on(roadmap, room, tasks[0], 1.0, roadmap.robots[0])
    best, spent = find(fresh, others, 5.0, 10**6)
    earliest = math.inf if best is None else best.joined
    for limit in [*limits, -1e-6, 1e-6]:
        way, effort = find(movers[0], others, 5.0, 10**6, latest=earliest + limit)
        assert way is not None or best is None or limit <= 0.0
        assert way is None or way.joined == earliest
        assert effort <= spent
    again, effort = find(movers[0], others[::-1], 5.0, 10**6)
    assert effort == spent
    assert (again is None) == (best is None)
    if best is not None and again is not None:
        assert np.array_equal(again.motion, best.motion)
    if spent > 0:
        assert find(movers[0], others, 5.0, spent - 1)[1] <= spent - 1


def test_nodes_beyond_the_lattice_are_blocked_too() -> None:
    """Where ways are long, the nodes round a start reach beyond the lattice; and a robot comes from farther out."""
    roadmap = build_roadmap([space()], [task((0.0, 0.0), (2000.0, 2000.0))])
    nodes = roadmap.nodes
    for place in 2.0 * nodes[nodes.argmin(axis=0)]:  # as far beyond the lowest nodes as these are from the start
        blocked, _ = intervals.blocked_times(np.array([[0.0, *place]]), roadmap.grid, np.full(len(nodes), 10.0))
        assert len(blocked) > 0
        assert blocked.tolist() == np.flatnonzero(np.hypot(*(nodes - place).T) < 10.0).tolist()


def test_a_robot_that_leaves_is_not_taken_for_one_that_stays() -> None:
    """It stands on the target of another one."""
    one = task((-4.0, 0.0), (4.0, 0.0))
    roadmap = build_roadmap([space()], [one])
    mover, stands = Mover.on(roadmap, space(), one, 1.0, roadmap.robots[0]), OtherRobot(np.array([[0.0, 4.0, 0.5]]))
    leaves = stands._replace(until=5.0)
    ways = [find(mover, [], 5.0, 10**6, [leaves])[0], find(mover, [stands], 5.0, 10**6)[0]]
    assert [way is None for way in ways] == [False, True]


@given(seed=st.integers(0, 10**6), count=st.integers(2, 5))
@examples(20)
def test_searches_that_end_without_a_gain_change_no_plan(seed: int, count: int) -> None:
    room, tasks = random_team(seed, count, 3, 12.0)
    searched = neighbourhoods.find
    found = plan(room, tasks, [1.0] * count)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(neighbourhoods, "find", lambda *given, latest: searched(*given))
        exhaustive = plan(room, tasks, [1.0] * count)
    assert found.expansions <= exhaustive.expansions
    for one, other in zip(motions(found, tasks), motions(exhaustive, tasks), strict=True):
        assert np.array_equal(one, other)


def test_the_preset_is_joined_where_it_is_free_again() -> None:
    """A preset through a disc, at half of the robot's speed."""
    preset = np.array([[0.0, 0.0, 0.0], [20.0, 10.0, 0.0]])
    stuck = RobotTask(np.array([-1.0, 0.0]), preset)
    (way,) = plan(space([(3.0, 0.3)]), [stuck], [1.0], follow=5.0).ways
    assert way is not None
    assert 10.0 < way.joined < 12.0  # 5 m along the preset the disc is over
    after = np.linspace(way.joined, 20.0, 9)
    assert np.abs(sampled(way.motion, after) - sampled(preset, after)).max() < 1e-9


def test_an_effort_bounds_what_is_spent_and_the_plan_is_the_same_each_time() -> None:
    room, tasks = random_team(3, 5, 4, 14.0)
    one, two = (plan(room, tasks, [1.0] * 5, effort=Effort(expansions=50, candidates=500)) for _ in range(2))
    assert one.candidates <= 500 + 3 * 400
    assert one.expansions <= 50 + 2 * 50  # to find a plan, and to improve it
    assert_keeps_distances(room, tasks, one, 1.0, [])
    assert [way.motion.tolist() for way in one.ways if way] == [way.motion.tolist() for way in two.ways if way]


def test_a_small_robot_goes_where_a_large_one_cannot() -> None:
    """A wall with a gap of 4.6 m between centres, and nothing else to get through by."""
    wall = [(0.0, y) for y in (2.3, 4.0, 5.7, -2.3, -4.0, -5.7)]
    tasks = [task((-4.0, 0.0), (4.0, 0.0)), replace(task((-4.0, 4.0), (4.0, 4.0)), body=0.5)]
    found = plan(space(wall), tasks, [1.0, 1.0])
    assert found.complete
    assert_keeps_distances(space(wall), tasks, found, 1.0, [])
    small, large = motions(found, tasks)
    assert np.abs(small[:, 2]).max() < 1.0
    assert np.abs(large[:, 2]).max() > 8.0


def test_a_ball_above_the_ground_is_as_wide_as_it_is_there() -> None:
    room = replace(space([(0.0, 0.0)]), height=2.1)
    assert len(room.of(0.0).rows) == 0
    assert room.of(0.5).keep == pytest.approx(np.sqrt(2.5**2 - 2.1**2))


@pytest.mark.parametrize(("radius", "beside", "free"), [(0.0, 0.5, True), (1.0, 0.5, False), (1.0, 1.1, True)])
def test_a_body_in_the_way_of_a_preset(radius: float, beside: float, free: bool) -> None:
    """It stands beside the middle piece, farther away than two points must be by `beside`, m."""
    room = space()
    preset = np.array([[0.0, -9.0, 0.0], [4.0, -5.0, 0.0], [14.0, 5.0, 0.0], [18.0, 9.0, 0.0]])
    other = OtherRobot(np.array([[0.0, 0.0, room.apart + room.spacing + beside]]), radius)
    assert free_pieces(preset, other.motion, _wished(room, other)).tolist() == [True, free, True]
