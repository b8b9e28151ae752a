"""The search over joint steps finds a plan wherever its graph has one, and else proves that it has none."""

from collections import deque
from itertools import combinations, pairwise, product

import numpy as np
import pytest
from builders.teams import Array, motions, random_team, task
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.model.geometry.outline import balls
from airground_drake.uav.coordination import lacam, network
from airground_drake.uav.coordination.coarse import CoarseGraph, coarsened
from airground_drake.uav.coordination.first_plan import FIRST, first_plan
from airground_drake.uav.coordination.joint import Effort, plan
from airground_drake.uav.coordination.pibt import Team, conflicts
from airground_drake.uav.coordination.roadmap import RobotTask, Space, build_roadmap
from airground_drake.uav.coordination.single import Mover, OtherRobot

V = 2.4
APART = 0.8
CELLS = np.array([(1.2 * x, 1.2 * y) for x in range(4) for y in range(3)])


def line(a: tuple[float, float], b: tuple[float, float], step: float = 0.5) -> list[tuple[float, float]]:
    count = max(1, round(np.hypot(b[0] - a[0], b[1] - a[1]) / step))
    return [(a[0] + (b[0] - a[0]) * k / count, a[1] + (b[1] - a[1]) * k / count) for k in range(count + 1)]


def corridor(length: float, *, closed: bool) -> Space:
    discs = [*line((0, 0.7), (length, 0.7)), *line((0, -0.7), (length, -0.7)), *line((0, -0.7), (0, 0.7))]
    discs += line((length, -0.7), (length, 0.7)) if closed else []
    rows = balls([[*centre, 0.0] for centre in discs])
    return Space(rows, np.full(len(rows), 0.5), 0.1, APART, 0.2)


def dead_end(count: int) -> tuple[Space, list[RobotTask]]:
    xs = [1.0 + 1.2 * k for k in range(count)]
    return corridor(1.2 * count + 2.4, closed=False), [task((x, 0), (y, 0)) for x, y in zip(xs, xs[::-1], strict=True)]


def movers(room: Space, tasks: list[RobotTask], speed: float = V) -> list[Mover]:
    spaces = [room.of(one.body) for one in tasks]
    roadmap = build_roadmap(spaces, tasks)
    least = min(each.apart for each in spaces)
    return [
        Mover.on(roadmap if own.apart == least else roadmap.within(own, nodes), own, one, speed, nodes)
        for own, one, nodes in zip(spaces, tasks, roadmap.robots, strict=True)
    ]


def graph_of(places: Array, joined: set[tuple[int, int]]) -> CoarseGraph:
    """Straight edges between places, in both directions; the first edge of a node is to stay."""
    first, heads, rows, begins = [0], [], [], [0]
    for node in range(len(places)):
        near = sorted({b if a == node else a for a, b in joined if node in (a, b)})
        for head in [node, *near]:
            heads.append(head)
            rows.append([[0.0, *places[node]]] + ([[1.0, *places[head]]] if head != node else []))
            begins.append(begins[-1] + len(rows[-1]))
        first.append(len(heads))
    ends = [(np.array(row[0][1:]), np.array(row[-1][1:])) for row in rows]
    lengths = np.array([np.hypot(*(b - a)) for a, b in ends])
    circles = np.array([[*(0.5 * (a + b)), 0.5 * np.hypot(*(b - a))] for a, b in ends])
    return CoarseGraph(
        places, np.array(first), np.array(heads), lengths, np.array(begins), np.concatenate(rows), circles
    )


def team_of(graph: CoarseGraph, targets: list[int], *, swaps: bool) -> Team:
    """Point-like robots of one size; ways to the targets by relaxation over all edges."""
    n, e, places = len(targets), len(graph.heads), graph.places
    tails = np.repeat(np.arange(len(places)), np.diff(graph.first))
    to_go = np.full((1, n, len(places)), np.inf)
    for i, target in enumerate(targets):
        to_go[0, i, target] = 0.0
        for _ in places:
            for a, b, length in zip(tails, graph.heads, graph.lengths, strict=True):
                to_go[0, i, a] = min(to_go[0, i, a], length + to_go[0, i, b])
    return Team(
        np.array(targets), np.ones((n, e), bool), np.zeros(n, np.int64), np.zeros((1, 1, e), bool),
        np.full((n, n), APART), to_go, swaps, 0.05,
    )  # fmt: skip


def apart_at(one: Array, other: Array) -> float:
    """Least distance of two polylines that are travelled in the same step, by many samples of each straight piece."""
    shares = np.unique(np.concatenate([np.linspace(0.0, 1.0, 401), one[:, 0], other[:, 0]]))
    p, q = (np.column_stack([np.interp(shares, each[:, 0], axis) for axis in each[:, 1:].T]) for each in (one, other))
    return float(np.hypot(*(p - q).T).min())


def edge_rows(graph: CoarseGraph, edge: int) -> Array:
    return graph.rows[graph.begins[edge] : graph.begins[edge + 1]]


def reachable(graph: CoarseGraph, starts: tuple[int, ...], targets: tuple[int, ...]) -> bool:
    """Whether joint moves lead to the targets: breadth first over all configurations, so that none is left out."""
    together: dict[tuple[int, int], bool] = {}

    def allowed(one: int, other: int) -> bool:
        if (one, other) not in together:
            a, b = edge_rows(graph, one), edge_rows(graph, other)
            together[one, other] = apart_at(a, b) >= min(APART, np.hypot(*(a[0, 1:] - b[0, 1:]))) - 1e-7
        return together[one, other]

    seen, queue = {starts}, deque([starts])
    while queue:
        at = queue.popleft()
        if at == targets:
            return True
        for moves in product(*(range(graph.first[node], graph.first[node + 1]) for node in at)):
            there = tuple(int(graph.heads[edge]) for edge in moves)
            if there not in seen and all(allowed(a, b) for a, b in combinations(moves, 2)):
                seen.add(there)
                queue.append(there)
    return False


@given(seed=st.integers(0, 10**6), count=st.integers(2, 3), swaps=st.booleans())
@examples(25, fuzz=500)
def test_a_plan_is_found_exactly_where_all_joint_moves_contain_one(seed: int, count: int, swaps: bool) -> None:
    rng = np.random.default_rng(seed)
    places = CELLS[rng.permutation(len(CELLS))[: rng.integers(count + 1, 8)]]
    near = {(a, b) for a, b in combinations(range(len(places)), 2) if np.hypot(*(places[a] - places[b])) < 1.3}
    graph = graph_of(places, {pair for pair in near if rng.random() < 0.85})
    starts, targets = (rng.permutation(len(places))[:count].tolist() for _ in range(2))
    found = lacam.search(graph, team_of(graph, targets, swaps=swaps), np.array(starts), 2_000_000)
    assert found.status == ("found" if reachable(graph, tuple(starts), tuple(targets)) else "exhausted")
    at = starts
    for moves in found.moves.tolist():
        tails = [int(np.searchsorted(graph.first, edge, side="right")) - 1 for edge in moves]
        assert tails == at
        for one, other in combinations([edge_rows(graph, edge) for edge in moves], 2):
            assert apart_at(one, other) >= min(APART, np.hypot(*(one[0, 1:] - other[0, 1:]))) - 1e-7
        at = [int(graph.heads[edge]) for edge in moves]
    assert found.status != "found" or at == targets


@given(points=st.lists(st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)), min_size=4, max_size=4))
@examples(60, fuzz=2000)
def test_conflicts_are_those_of_exact_distances(points: list[tuple[float, float]]) -> None:
    graph = graph_of(np.array(points), {(0, 1), (2, 3)})
    edges = [e for e in (1, 5) if len(edge_rows(graph, e)) > 1]
    for one, other in combinations([*edges, 0, 4], 2):
        a, b = edge_rows(graph, one), edge_rows(graph, other)
        least = min(APART, float(np.hypot(*(a[0, 1:] - b[0, 1:]))))
        if abs(apart_at(a, b) - least) > 0.02:
            assert conflicts(graph, one, other, APART, False) == (apart_at(a, b) < least)


@pytest.mark.parametrize("count", [3, 4])
def test_robots_turn_round_in_a_dead_end(count: int) -> None:
    """One order of prioritised planning cannot: the first to come back needs all others to have left."""
    room, tasks = dead_end(count)
    found, again = (plan(room, tasks, [V] * count) for _ in range(2))
    assert found.outcome == "complete"
    assert found.candidates > 0
    ways = motions(found, tasks)
    for one, other in combinations(ways, 2):
        t = np.unique(np.concatenate([one[:, 0], other[:, 0], np.linspace(0.0, 40.0, 4001)]))
        p, q = (np.column_stack([np.interp(t, w[:, 0], axis) for axis in w[:, 1:].T]) for w in (one, other))
        assert np.hypot(*(p - q).T).min() >= APART - 1e-9
    assert [way.tolist() for way in motions(again, tasks)] == [way.tolist() for way in ways]


@pytest.mark.parametrize("rings", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_a_jam_dissolves_with_little_effort(rings: int) -> None:
    steps = [(a, b) for a, b in product(range(-rings, rings + 1), repeat=2) if abs(a + b) <= rings and (a, b) != (0, 0)]
    places = [(APART * (a + 0.5 * b), APART * np.sqrt(0.75) * b) for a, b in steps]
    rows = balls([[0.0, 0.0, 0.0]])
    room = Space(rows, np.array([0.75]), 0.01, APART, 0.2)
    team = movers(room, [task(place, (-4.0 * place[0], -4.0 * place[1])) for place in places])
    assert first_plan(team, [], 50 * FIRST * len(team)).outcome == "found"


def test_robots_that_cannot_change_places_exhaust_every_roadmap() -> None:
    room, tasks = corridor(6.0, closed=True), [task((1, 0), (4, 0)), task((4, 0), (1, 0))]
    found = plan(room, tasks, [V, V])
    assert (found.outcome, found.separated) == ("exhausted", ())
    assert found.ways.count(None) > 0
    quick = plan(room, tasks, [V, V], effort=Effort(candidates=50))
    assert (quick.outcome, quick.candidates <= 100) == ("effort spent", True)


def test_who_is_walled_in_is_named_and_does_not_keep_the_others_from_a_plan() -> None:
    room, tasks = dead_end(3)
    cage = [(20.0 + np.cos(a), np.sin(a)) for a in np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)]
    rows = np.concatenate([room.rows, balls([[*centre, 0.0] for centre in cage])])
    walled = Space(rows, np.full(len(rows), 0.5), 0.1, APART, 0.2)
    found = plan(walled, [*tasks, task((20.0, 0.0), (25.0, 0.0))], [V] * 4)
    assert (found.outcome, found.separated) == ("no plan exists", (3,))
    assert [way is None for way in found.ways] == [False, False, False, True]


def test_a_failing_team_costs_a_bounded_effort() -> None:
    """Eight in a closed corridor for nine: far too many joint moves to try them all."""
    xs = [0.9 + 0.9 * k for k in range(8)]
    room = corridor(9.0, closed=True)
    tasks = [task((x, 0), (y, 0)) for x, y in zip(xs, xs[::-1], strict=True)]
    found = first_plan(movers(room, tasks), [], 20_000)
    assert found.outcome == "effort spent"
    assert found.candidates <= 20_000 + lacam.FOR_STEP + lacam.FOR_ROBOT * 8


@given(seed=st.integers(0, 10**6), bodies=st.sampled_from([(0.0,), (0.0, 0.5)]), crossing=st.booleans())
@examples(8, fuzz=300)
def test_first_plans_keep_every_distance(seed: int, bodies: tuple[float, ...], crossing: bool) -> None:
    """Among robots of two sizes and at two speeds, and beside a robot with a known motion that crosses."""
    room, tasks = random_team(seed, 4, 3, 12.0)
    tasks = [RobotTask(one.start, one.preset, bodies[k % len(bodies)]) for k, one in enumerate(tasks)]
    others = [OtherRobot(np.array([[0.0, -9.0, 6.0], [14.0, 24.0, 6.0]]))] if crossing else []
    own = movers(room, tasks, 1.0)
    if any(np.isinf(mover.to_go[mover.own.start]) or not mover.own.usable[-1] for mover in own):
        return
    found = first_plan(own, others, 50_000)
    ways = [way.motion for way in found.ways]
    t = np.linspace(0.0, max([float(way[-1, 0]) for way in ways] or [0.0]), 4000)
    at = [np.column_stack([np.interp(t, way[:, 0], axis) for axis in way[:, 1:].T]) for way in ways]
    for (i, p), (j, q) in combinations(enumerate(at), 2):
        apart = np.hypot(*(p - q).T)
        least = min(room.apart + tasks[i].body + tasks[j].body, apart[0], apart[-1])
        assert apart.min() >= least - 1e-9
    for i, p in enumerate(at):
        for other in others:
            q = np.column_stack([np.interp(t, other.motion[:, 0], axis) for axis in other.motion[:, 1:].T])
            apart = np.hypot(*(p - q).T)
            assert apart.min() >= min(room.apart + tasks[i].body, apart[0]) - 1e-9
        for row, keep in zip(room.rows, room.keep, strict=True):
            apart = np.hypot(*(p - row[9:11]).T)
            assert apart.min() >= min(keep + tasks[i].body, apart[0]) - 1e-9
        legs = np.diff(ways[i], axis=0)
        assert (np.hypot(legs[:, 1], legs[:, 2]) <= legs[:, 0] * (1.0 + 1e-9) + 1e-9).all()


@given(seed=st.integers(0, 10**6))
@examples(8, fuzz=300)
def test_a_coarse_roadmap_connects_what_the_roadmap_connects(seed: int) -> None:
    room, tasks = random_team(seed, 3, 5, 12.0)
    own = movers(room, tasks)
    coarse = coarsened(own, 1.45 * room.apart)
    graph = coarse.graph
    for i, mover in enumerate(own):
        reached, queue = {int(coarse.starts[i])}, [int(coarse.starts[i])]
        while queue:
            node = queue.pop()
            for edge in range(graph.first[node], graph.first[node + 1]):
                if coarse.usable[i, edge] and (head := int(graph.heads[edge])) not in reached:
                    reached.add(head)
                    queue.append(head)
        assert (coarse.targets[i] in reached) == np.isfinite(mover.to_go[mover.own.start])
        assert not np.isin(
            coarse.starts, graph.heads[graph.heads != np.repeat(np.arange(len(graph.places)), np.diff(graph.first))]
        ).any()


def test_what_does_not_conflict_does_not_wait() -> None:
    """Two robots far from each other go on at their own paces, though the steps made one wait for the other."""
    places = np.array([(0.0, 0.0), (1.2, 0.0), (2.4, 0.0), (0.0, 9.0), (1.2, 9.0), (2.4, 9.0)])
    graph = graph_of(places, {(0, 1), (1, 2), (3, 4), (4, 5)})
    team = team_of(graph, [2, 5], swaps=False)
    edge = {(a, int(graph.heads[e])): e for a in range(6) for e in range(graph.first[a], graph.first[a + 1])}
    moves = np.array([[edge[0, 1], edge[3, 3]], [edge[1, 2], edge[3, 4]], [edge[2, 2], edge[4, 5]]])
    one, other = network.motions(graph, team, moves, [1.0, 2.0])
    assert one[-1].tolist() == pytest.approx([2.4, 2.4, 0.0])
    assert other[-1].tolist() == pytest.approx([1.2, 2.4, 9.0])
    assert all(a < b for a, b in pairwise(one[:, 0].tolist()))
