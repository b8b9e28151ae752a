"""How fast the step-wise environment is: control periods per second, and resets.

    python benchmarks/environment.py
    python benchmarks/environment.py case_a lab --seconds 20
    pip install vmas && python benchmarks/environment.py --vmas

An agent proposes two random waypoints, or nothing in one request of four. A reset begins an episode on a model that
exists already; its time excludes the periods up to the first request. A new course needs a new model. `side by side`
are `ENVIRONMENTS` environments by our vector environment, and in brackets by Gymnasium's loop over single ones.
`--vmas` adds the scenario `navigation` of VMAS with as many agents, alone and as batches of `ENVIRONMENTS` and
`BATCH`. Times are of the CPU, of one process with one thread.
"""

import argparse
import os
import time
from importlib import import_module
from pathlib import Path

os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

import numpy as np
from gymnasium.vector import SyncVectorEnv, VectorEnv

from airground_drake.scenario.load import load
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.simulation import Recorder
from airground_drake.study.campaign.spec import load_spec
from airground_drake.study.environments.encoding import Encoding
from airground_drake.study.environments.gymnasium_env import InterventionEnv, InterventionVectorEnv
from airground_drake.study.environments.sources import Source

DEFAULT = ("case_a", "case_b", "warehouse", "crossing")
CAMPAIGN = Path(__file__).parents[1] / "examples" / "learned.yaml"
RESETS, ENVIRONMENTS, BATCH = 20, 16, 1024


def played(source: Source, number: int, rng: np.random.Generator) -> tuple[float, int, float]:
    """Duration of an episode, s, its number of requests, and its CPU time without that of the reset, s."""
    encoding, episode, count = Encoding(), source.episode(number), 0
    began = time.process_time()
    while requests := episode.requests():
        for robot, seen in requests.items():
            encoding.observed(seen)
            action = rng.uniform(-1.0, 1.0, encoding.actions)
            action[0] += 0.5
            episode.answer(robot, encoding.motion(action, seen))
            count += 1
    return episode.t, count, time.process_time() - began


def at_one_go(scenario: Scenario) -> float:
    """Control periods per second of CPU time of the scenario's last run."""
    recorder = Recorder(scenario, [*scenario.runs][-1])
    simulator = recorder.begin()
    began = time.process_time()
    recorder.advance(simulator, scenario.duration_s)
    return scenario.duration_s / scenario.control.period_s / (time.process_time() - began)


def times_ms(source: Source, numbers: range) -> list[float]:
    """CPU times of beginning episodes, ms."""
    found = []
    for number in numbers:
        began = time.process_time()
        source.episode(number)
        found.append(1e3 * (time.process_time() - began))
    return found


def side_by_side(envs: VectorEnv, period_s: float, seconds: float) -> float:
    """Control periods per second of CPU time of environments that are stepped together."""
    rng, before, simulated = np.random.default_rng(1), np.zeros(ENVIRONMENTS), 0.0
    envs.reset(seed=1)
    began = time.process_time()
    while time.process_time() - began < seconds:
        actions = rng.uniform(-1.0, 1.0, envs.action_space.shape).astype(np.float32)
        actions[:, 0] += 0.5
        now = envs.step(np.clip(actions, -1.0, 1.0))[4]["t_s"]
        simulated += float(np.maximum(now - before, 0.0).sum())
        before = now
    return simulated / period_s / (time.process_time() - began)


def of_vmas(agents: int, environments: int, seconds: float) -> float:
    """Steps per second of CPU time, over all environments, of a scenario of VMAS with random actions."""
    import_module("torch").set_num_threads(1)
    made = import_module("vmas").make_env("navigation", num_envs=environments, device="cpu", n_agents=agents, seed=1)
    made.reset()
    steps, began = 0, time.process_time()
    while time.process_time() - began < seconds:
        made.step([made.get_random_action(agent) for agent in made.agents])
        steps += environments
    return steps / (time.process_time() - began)


def main() -> None:
    """Print a line per scenario, and one about new courses."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenarios", nargs="*", default=DEFAULT, help=f"default: {' '.join(DEFAULT)}")
    parser.add_argument("--seconds", type=float, default=10.0, help="CPU time per scenario (default: 10)")
    parser.add_argument("--vmas", action="store_true", help="a scenario of VMAS beside each of ours")
    given = parser.parse_args()
    for name in given.scenarios:
        scenario = load(name)
        source, rng = Source(scenario), np.random.default_rng(1)
        played(source, 0, rng)  # loads and compiles
        done: list[tuple[float, int, float]] = []
        while sum(took for _, _, took in done) < given.seconds:
            done.append(played(source, len(done), rng))
        simulated, requests, took = (sum(column) for column in zip(*done, strict=True))
        resets = times_ms(source, range(RESETS))
        both = (InterventionVectorEnv(ENVIRONMENTS, scenario),
                SyncVectorEnv([lambda scenario=scenario: InterventionEnv(scenario)] * ENVIRONMENTS))  # fmt: skip
        together = [side_by_side(envs, scenario.control.period_s, given.seconds / 2.0) for envs in both]
        print(
            f"{name}: {len(scenario.ugvs)} UGVs, {simulated / scenario.control.period_s / took:.0f} periods of "
            f"{scenario.control.period_s:g} s per second (at one go: {at_one_go(scenario):.0f}, "
            f"side by side: {together[0]:.0f} [{together[1]:.0f}]), "
            f"{requests / len(done):.1f} requests per episode, "
            f"reset {np.median(resets):.1f} ms (worst {max(resets):.1f})"
        )
        if given.vmas:
            steps = [of_vmas(len(scenario.ugvs), n, given.seconds / 2.0) for n in (1, ENVIRONMENTS, BATCH)]
            print("    VMAS, steps per second: {:.0f} alone, {:.0f} and {:.0f} in batches".format(*steps))
    courses = Source(load_spec(CAMPAIGN))
    times_ms(courses, range(1))
    fresh, again = (times_ms(courses, range(1, 1 + RESETS)) for _ in range(2))
    print(f"new course: {np.median(fresh):.1f} ms (worst {max(fresh):.1f}); again: {np.median(again):.1f} ms")


if __name__ == "__main__":
    main()
