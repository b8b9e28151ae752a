"""Step-wise environments: API checkers, whole episodes again, and the same run as an ordinary policy makes."""

import copy
import importlib
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np
import pandas as pd
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import SyncVectorEnv
from pettingzoo.test import parallel_api_test, parallel_seed_test

from airground_drake.base.errors import ScenarioError, UnknownNameError
from airground_drake.base.registry import POLICIES
from airground_drake.model.geometry import outline
from airground_drake.model.geometry.motion import Motion
from airground_drake.scenario.load import load, validated
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.batch.run import LeftToDrakeError
from airground_drake.sim.simulation import simulate
from airground_drake.sim.tables import TABLES
from airground_drake.sim.trace import Trace
from airground_drake.study.campaign.spec import Spec, load_spec
from airground_drake.study.environments import episode
from airground_drake.study.environments.encoding import Encoding, free_ways
from airground_drake.study.environments.episode import Episode, Stage, with_agent
from airground_drake.study.environments.gymnasium_env import ID, InterventionEnv, InterventionVectorEnv
from airground_drake.study.environments.pettingzoo_env import TeamEnv
from airground_drake.study.environments.sources import Source
from airground_drake.uav.planner import Planner
from airground_drake.uav.policy import Observation, Policy
from airground_drake.verify import judge

CAMPAIGN = """
scenario: minimal
runs: [d]
seed: 3
set: {duration_s: 8.0, control.period_s: 0.05}
course: {ugvs: [1, 3], obstacles: [6, 9], length_m: 10.0, width_m: 10.0}
draw: {seed: {integer: [0, 1000]}, decision.noise_m_sqrt_s: {uniform: [0.0, 0.05]}}
"""


@pytest.fixture(scope="module")
def courses(tmp_path_factory: pytest.TempPathFactory) -> Spec:
    path = tmp_path_factory.mktemp("campaign") / "courses.yaml"
    path.write_text(CAMPAIGN)
    return load_spec(path)


@pytest.fixture(params=["case_b", "courses"])
def given(request: pytest.FixtureRequest, courses: Spec) -> Scenario | Spec:
    return courses if request.param == "courses" else load(request.param, {"duration_s": 14.0})


def same(one: Trace, other: Trace, but: Sequence[str] = ()) -> bool:
    pairs = [(getattr(one, name), getattr(other, name)) for name in TABLES]
    assert all(len(table) for name, (table, _) in zip(TABLES, pairs, strict=True) if name in ("states", "samples"))
    return all(a.drop(columns=but, errors="ignore").equals(b.drop(columns=but, errors="ignore")) for a, b in pairs)


def test_gymnasium_accepts_it(given: Scenario | Spec) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", category=DeprecationWarning)
        check_env(gymnasium.make(ID, given=given).unwrapped)


def test_pettingzoo_accepts_it(given: Scenario | Spec) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", category=DeprecationWarning)
        if isinstance(given, Spec):
            warnings.filterwarnings("ignore", "No agents present but not all possible_agents")
        parallel_api_test(TeamEnv(given), num_cycles=20)
        parallel_seed_test(lambda: TeamEnv(given))


def alone(given: Scenario | Spec, seed: int) -> tuple[list[Any], list[Trace]]:
    """Two episodes with random actions: all that comes back, and the traces."""
    env, seen, traces = InterventionEnv(given), [], []
    env.action_space.seed(seed)
    for k in range(2):
        observation, info = env.reset(seed=seed if k == 0 else None)
        seen += [observation.tobytes(), info]
        over = False
        while not over:
            observation, reward, over, cut, info = env.step(env.action_space.sample())
            seen += [observation.tobytes(), reward, over, cut, info]
        traces.append(env.trace())
    return seen, traces


def together(given: Scenario | Spec, seed: int) -> tuple[list[Any], list[Trace]]:
    env, seen, traces = TeamEnv(given), [], []
    for number, agent in enumerate(env.possible_agents):
        env.action_space(agent).seed(seed + number)
    for k in range(2):
        observations, infos = env.reset(seed=seed if k == 0 else None)
        while env.agents:
            seen += [{name: each.tobytes() for name, each in observations.items()}, infos]
            actions = {agent: env.action_space(agent).sample() for agent in env.agents}
            observations, *rest, infos = env.step(actions)
            seen += rest
        traces.append(env.trace())
    return seen, traces


@pytest.mark.parametrize("play", [alone, together])
def test_whole_episodes_are_the_same_again(given: Scenario | Spec, play: Callable[..., Any]) -> None:
    (seen, traces), (again, others) = play(given, 5), play(given, 5)
    assert seen == again
    assert len(seen) > 8
    assert all(map(same, traces, others))
    assert not same(traces[0], traces[1])
    assert play(given, 6)[0] != seen


class Aside(Policy):
    counted = True

    def propose(self, seen: Observation) -> Motion | None:
        return Encoding().motion(aside(seen), seen)


def aside(seen: Observation) -> list[float]:
    return [-1.0 if seen.refusals % 3 == 1 else 1.0, 0.1, 0.3, 0.4, 0.3 - 0.1 * seen.refusals]


@pytest.mark.parametrize(
    ("name", "duration_s"), [("case_a", 20.0), pytest.param("warehouse", 15.0, marks=pytest.mark.slow)]
)
def test_it_is_the_run_of_an_ordinary_policy(name: str, duration_s: float) -> None:
    """All tables are equal to the last bit, so proposals are checked, sent and judged alike."""
    scenario = load(name, {"duration_s": duration_s})  # an episode ends when all have arrived
    episode = Episode(Stage(with_agent(scenario, "d"), "d"), seed=3)
    asked = 0
    while requests := episode.requests():
        robot, seen = next(iter(requests.items()))
        episode.answer(robot, Encoding().motion(aside(seen), seen))
        asked += 1
    trace = episode.trace()
    with POLICIES.adding("aside", Aside):
        policies = [{"name": "aside"}]
        own = simulate(validated(with_agent(scenario, "d"), {"intervention.policies": policies}), "d", seed=3)
    assert asked > 1
    assert len(trace.plans) == asked
    assert same(trace, own, but=["policy"])
    assert all(verdict.status != "refuted" for verdict in judge(trace) if verdict.claim.id.startswith("SAFE"))


def test_what_an_agent_proposes_is_checked_like_any_proposal() -> None:
    """Nonsense is a fault of the policy, which the trace names; the run goes on."""
    episode = Episode(Stage(with_agent(load("case_a"), "d"), "d"))
    wrong = iter([{"nobody": Motion(np.zeros(1), np.zeros((1, 3)))}, 17, Motion(np.zeros(1), np.full((1, 3), 1e300))])
    while requests := episode.requests():
        for robot in requests:
            episode.answer(robot, next(wrong, None))  # type: ignore[arg-type]
    trace = episode.trace()
    assert [fault["what"].partition(":")[0] for fault in trace.meta["faults"]] == [
        "ValueError", "TypeError", "ValueError",
    ]  # fmt: skip
    assert len(trace.proposals) == 0


def test_policies_are_asked_once_at_each_instant_and_again_with_an_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, plan = list[float](), Planner.plan
    monkeypatch.setattr(Planner, "plan", lambda self, before, now: asked.append(now.t) or plan(self, before, now))
    env = InterventionEnv(load("minimal"))
    env.reset(options={"number": 1})
    over = False
    while not over:
        _, _, over, _, _ = env.step(np.array([1.0, 0.0, 0.4, 0.5, 0.4], dtype=np.float32))
    assert 3 < len(set(asked)) <= len(asked) <= len(set(asked)) + 3


@pytest.mark.parametrize("number", [-5, 1.5, "3"])
def test_the_number_of_an_episode_is_a_whole_one(number: Any) -> None:
    with pytest.raises(ValueError, match=rf"number of the episode: {number!r}; allowed: a whole number from 0"):
        InterventionEnv(load("minimal")).reset(options={"number": number})


def test_the_return_is_the_time_away_and_a_run_ends_when_all_are_there() -> None:
    env = InterventionEnv(load("minimal"))
    _, info = env.reset(options={"number": 1})
    begun, rewards, over = info["t_s"], [], False
    while not over:
        _, reward, over, _, info = env.step(np.array([1.0, 0.0, 0.4, 0.5, 0.4], dtype=np.float32))
        rewards.append(reward)
    trace = env.trace()
    instants = (trace.t > begun) & (np.abs(trace.t / 0.05 - np.round(trace.t / 0.05)) < 1e-6)
    away = np.linalg.norm(trace.position("ugv1")[instants] - [10.0, 0.0, 0.0], axis=1) > 0.1
    assert -sum(rewards) == pytest.approx(0.05 * away.sum(), abs=1e-6)
    assert info["t_s"] == trace.scenario.duration_s == trace.t[-1] < 20.0
    assert {v.claim.id: v.status for v in judge(trace)}["LIVE-GOAL"] == "holds"
    _, info = env.reset(options={"number": 1})
    lost = 0.0
    over = False
    while not over:
        _, reward, over, _, _ = env.step(np.full(5, -1.0, dtype=np.float32))
        lost -= reward
    left = float(np.linalg.norm(env.trace().position("ugv1")[-1] - [10.0, 0.0, 0.0]))
    assert left > 1.0
    assert lost == pytest.approx(20.0 - begun + left, abs=1e-6)  # its preset has 1 m/s


def test_requests_come_one_by_one_or_together() -> None:
    """A UGV's observation tells what was proposed to another at the same instant, except to agents of a team."""
    stage = Stage(with_agent(load("crossing"), "d"), "d")
    episode = Episode(stage)
    while len(requests := episode.requests()) < 2:
        episode.answer(next(iter(requests)), None)
    (first, seen), (second, _) = list(requests.items())[:2]
    t = episode.t
    motion = Motion(np.array([seen.start, seen.start + 1.0]), np.array([seen.position, seen.target]))
    episode.answer(first, motion)
    told = next(mate for mate in episode.requests()[second].team if mate.name == first)
    assert episode.t == t
    assert told.proposal is not None
    np.testing.assert_array_equal(told.proposal.motion.positions, motion.positions)
    with pytest.raises(ValueError, match=f"no proposal for {first} is asked for now; asked for: {second}"):
        episode.answer(first, None)


def test_courses_are_those_of_the_campaign(courses: Spec) -> None:
    env = TeamEnv(courses, numbers=range(4, 8))
    assert env.possible_agents == ["ugv1", "ugv2", "ugv3"]
    teams = set()
    for number in (4, 5, 6, 7, 4):
        _, infos = env.reset(options={"number": number})
        assert set(infos) == set(env.agents) == set(courses.draw(number).ugvs)
        teams.add(len(env.agents))
        start = env.trace().position("ugv1")[0] if infos["ugv1"]["t_s"] else None
        assert start is None or start.tolist() == courses.draw(number).ugvs["ugv1"].start_m
    assert len(teams) > 1
    rng, source = np.random.default_rng(1), Source(courses, numbers=range(4, 8))
    assert {source.drawn(rng) for _ in range(30)} == {4, 5, 6, 7}


def test_free_ways_are_those_of_a_fine_search() -> None:
    """Against steps of 1 mm; also beside an obstacle that is touched, and among walls."""
    rng = np.random.default_rng(2)
    turns = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    headings = np.column_stack([np.cos(turns), np.sin(turns)])
    blocked = 0
    for _ in range(20):
        balls = outline.balls(np.column_stack([rng.uniform(-6.0, 6.0, (4, 2)), np.zeros(4)]))
        wall = outline.prism(rng.uniform(-6.0, 6.0, (2, 2)))
        rows = outline.joined(balls, wall[None])
        at = np.zeros(3)
        away = np.array([float(np.hypot(*ball[outline.MIDDLE : outline.EXTENT])) for ball in balls] + [9.0])
        keep = np.minimum(rng.uniform(0.3, 1.0, 5), away)
        ways = free_ways(rows, keep, at, headings, 5.0)
        for heading, way in zip(headings, ways, strict=True):
            places = np.arange(0.0, 5.0, 1e-3)[:, None] * heading
            apart = np.hypot(*(places[:, None] - balls[:, outline.MIDDLE : outline.EXTENT]).transpose(2, 0, 1))
            apart = np.column_stack([apart, segment(places, wall)])
            closing = apart[1] < apart[0]
            bad = np.flatnonzero(((apart < keep) & closing).any(axis=1))
            first = 1e-3 * bad[0] if len(bad) else 5.0
            assert first - way < 0.3 or way == 0.0
            assert way <= first + 2e-3
            blocked += way < 5.0
    assert 40 < blocked < 220
    assert free_ways(outline.balls(np.zeros((0, 3))), np.zeros(0), np.zeros(3), headings, 5.0).tolist() == [5.0] * 12


def segment(places: np.ndarray, wall: np.ndarray) -> np.ndarray:
    a, b = outline.corners_of(wall)
    share = np.clip((places - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return np.hypot(*(places - a - share[:, None] * (b - a)).T)


def test_mistakes_are_named() -> None:
    with pytest.raises(UnknownNameError, match="allowed: b, c, c_literal, d"):
        InterventionEnv(load("case_a"), run="a")
    with pytest.raises(ScenarioError, match="wanted: a run of method b, c or d"):
        InterventionEnv(load("minimal", {"runs": {"a": {"method": "a"}}}))
    env = InterventionEnv(load("minimal"))
    with pytest.raises(RuntimeError, match="call reset first"):
        env.step(env.action_space.sample())
    env.reset(seed=1)
    with pytest.raises(ValueError, match="wanted: 5 finite numbers"):
        env.step(np.full(5, np.nan, dtype=np.float32))
    assert isinstance(env.trace().to_pandas(), pd.DataFrame)


@pytest.mark.parametrize("kind", [InterventionEnv, TeamEnv])
def test_mistakes_in_an_episode_are_named(kind: type[InterventionEnv] | type[TeamEnv]) -> None:
    """Both kinds: options that do not exist, steps after the end."""
    env = kind(load("minimal", {"duration_s": 0.5}))
    with pytest.raises(ValueError, match="unknown options of reset: 'nmber'; allowed: 'number'"):
        env.reset(options={"nmber": 3})
    env.reset(options={"number": 1})
    action: Any = {"ugv1": np.zeros(5)} if isinstance(env, TeamEnv) else np.zeros(5)
    assert env.step(action)[2] in (True, {"ugv1": True})
    with pytest.raises(RuntimeError, match="the episode is over: call reset"):
        env.step(action)
    env.reset(options={"number": 1})
    env.step(action)


@pytest.mark.parametrize("kind", [InterventionEnv, TeamEnv])
def test_an_environment_goes_on_as_its_copy_does(kind: type[InterventionEnv] | type[TeamEnv]) -> None:
    env = kind(load("case_b", {"duration_s": 16.0}))
    env.reset(options={"number": 4})
    rng = np.random.default_rng(1)
    actions = [rng.uniform(-1.0, 1.0, 5) for _ in range(6)]

    def go_on(own: Any, chosen: Sequence[Any]) -> list[Any]:
        steps = []
        for action in chosen:
            step = own.step(dict.fromkeys(own.agents, action) if isinstance(own, TeamEnv) else action)
            steps.append(step[:3])
            if step[2] in (True, dict.fromkeys(step[2], True) if isinstance(step[2], dict) else True):
                break
        return steps

    go_on(env, actions[:1])
    copied, other = copy.deepcopy(env), copy.deepcopy(env)
    go_on(other, actions[::-1])
    theirs, ours = go_on(copied, actions[1:]), go_on(env, actions[1:])
    assert str(theirs) == str(ours)
    assert same(copied.trace(), env.trace())


def test_an_episode_that_drake_makes_is_not_copied(monkeypatch: pytest.MonkeyPatch) -> None:
    def left(*_: object) -> None:
        raise LeftToDrakeError

    monkeypatch.setattr(episode, "Batch", left)
    env = InterventionEnv(load("minimal", {"duration_s": 2.0}))
    env.reset(options={"number": 1})
    with pytest.raises(TypeError, match="its model is a Drake diagram; make a second environment"):
        copy.deepcopy(env)


def test_environments_side_by_side_are_those_of_gymnasium(given: Scenario | Spec) -> None:
    """Also after their episodes are over: the same arrays as by its own loop over single environments."""
    ours = InterventionVectorEnv(3, given, numbers=range(1, 6))
    theirs = SyncVectorEnv([lambda: InterventionEnv(given, numbers=range(1, 6))] * 3)
    rng = np.random.default_rng(2)
    assert ours.metadata["autoreset_mode"] is theirs.metadata["autoreset_mode"]
    for mine, gymnasiums in zip(ours.reset(seed=7), theirs.reset(seed=7), strict=True):
        assert str(mine) == str(gymnasiums)
    ended = 0
    for _ in range(12):
        actions = rng.uniform(-1.0, 1.0, ours.action_space.shape).astype(np.float32)
        steps = ours.step(actions), theirs.step(actions)
        ended += steps[0][2].sum()
        assert str(steps[0]) == str(steps[1])
        for mine, gymnasiums in zip(steps[0][:4], steps[1][:4], strict=True):
            assert (mine.dtype, mine.tolist()) == (gymnasiums.dtype, gymnasiums.tolist())
    assert ended > 1


def test_an_action_that_is_missing_is_named() -> None:
    env = TeamEnv(load("minimal"))
    _, infos = env.reset(options={"number": 1})
    assert infos["ugv1"]["asked"]
    with pytest.raises(ValueError, match="no action for ugv1; asked for now: ugv1"):
        env.step({})


def test_the_registered_environment_needs_no_arguments() -> None:
    observation, _ = gymnasium.make(ID).reset(seed=1)
    assert observation[0] == 1.0
    several = gymnasium.make_vec(ID, num_envs=2)
    assert isinstance(several, InterventionVectorEnv)
    assert (several.reset(seed=1)[0][0] == observation).all()
    with pytest.raises(ValueError, match="num_envs is 0; allowed: a whole number from 1"):
        InterventionVectorEnv(0)
    with pytest.raises(ValueError, match="1 actions; wanted: 2"):
        several.step(np.zeros((1, 5), dtype=np.float32))


def test_a_package_that_is_missing_is_named_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    for package in ("gymnasium", "pettingzoo"):
        name = f"airground_drake.study.environments.{package}_env"
        with monkeypatch.context() as patch:
            patch.setitem(sys.modules, package, None)
            patch.delitem(sys.modules, name)
            with pytest.raises(
                ImportError, match=f"need the package {package}: pip install 'airground_drake\\[gym\\]'"
            ):
                importlib.import_module(name)
