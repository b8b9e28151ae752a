"""What Drake costs: the same run as a diagram, as a loop of numpy, and by SciPy: `python benchmarks/bare.py`.

Case A without interventions and noise, method (a): the same control law and the same trigger three times, in turn, so
that their ratios mean something where the seconds do not. The loop is everything that the mathematics needs: positions
move on straight lines between control samples. SciPy integrates every control period with the velocities held and
finds the trigger as a zero of x - zeta. Printed: least CPU time, s, over some repetitions, the largest distance between
positions at control samples, m, and when the trigger fires. Then, of the run (d), where its time goes.
"""

from __future__ import annotations

import argparse
import cProfile
import os
import pstats
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.integrate import solve_ivp

from airground_drake.base.arrays import Array
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.registry import method_of
from airground_drake.run.simulation import Recorder
from airground_drake.scenarios.load import load
from airground_drake.scenarios.schema import Scenario
from airground_drake.scenarios.world import make_world
from airground_drake.systems import UavController, UgvController, components

Way = tuple[Array, float]
"""Positions of all robots at the control samples, (K + 1, n + 1, 3), m, and the first time that x reaches zeta, s."""


class Law:
    """The two control laws of a scenario, and its task errors."""

    def __init__(self, scenario: Scenario) -> None:
        """Without any diagram."""
        control, world = scenario.control, make_world(scenario)
        avoidance: Avoidance = components.make_avoidance(scenario)
        law = components.make_law(scenario, method_of("a"))
        self.ugvs = UgvController(world, law).velocity
        self.uav = UavController(
            world, avoidance, gain=control.formation_gain_1_s, altitude=scenario.uav.altitude_m
        ).velocity
        self.presets, self.period = components.make_presets(scenario), control.period_s
        self.starts, self.zeta = world.starts, components.threshold(scenario)
        self.samples = round(scenario.duration_s / control.period_s)

    def command(self, t: float, positions: Array, before: Array) -> Array:
        """Velocities of all robots, (n + 1, 3), m/s; `before`: those of the UGVs at the sample before."""
        reference, rate = (np.array(each) for each in zip(*(preset.at(t) for preset in self.presets), strict=True))
        ugvs = self.ugvs(t, positions, reference, rate, [None] * len(self.presets))
        return np.vstack([ugvs, self.uav(positions, before)])

    def x(self, t: float, positions: Array) -> float:
        """The largest decision variable, m."""
        away = [preset.at(t)[0] - place for preset, place in zip(self.presets, positions, strict=False)]
        return float(np.linalg.norm(away, axis=1).max())


def by_numpy(scenario: Scenario) -> Way:
    """A loop over the control samples; the trigger at the first sample at which it is due."""
    law = Law(scenario)
    positions, command = [law.starts], np.zeros_like(law.starts)
    fired = np.inf
    for k in range(law.samples):
        t = k * law.period
        command = law.command(t, positions[-1], command[:-1])
        positions.append(positions[-1] + law.period * command)
        fired = min(fired, t + law.period if law.x(t + law.period, positions[-1]) >= law.zeta else np.inf)
    return np.array(positions), fired


def by_scipy(scenario: Scenario) -> Way:
    """`scipy.integrate.solve_ivp` for every control period, the trigger as its event."""
    law = Law(scenario)
    positions, command = [law.starts], np.zeros_like(law.starts)
    fired = np.inf

    def level(t: float, y: Array) -> float:
        return law.x(t, y.reshape(-1, 3)) - law.zeta

    for k in range(law.samples):
        t = k * law.period
        command = law.command(t, positions[-1], command[:-1])
        held = command.ravel()
        found = solve_ivp(lambda t, y, v=held: v, (t, t + law.period), positions[-1].ravel(), events=level)
        positions.append(found.y[:, -1].reshape(-1, 3))
        fired = min([fired, *found.t_events[0]])
    return np.array(positions), fired


def by_drake(recorder: Recorder) -> Way:
    """The diagram, with its logs, noise and trigger, and the trace made of them."""
    trace = recorder.simulate()
    period = trace.scenario.control.period_s
    rows = np.searchsorted(trace.t, period * np.arange(round(trace.t[-1] / period) + 1) - 1e-6)
    fired = [event["t_s"] for event in trace.events if event["kind"] == "trigger"]
    return np.stack([trace.position(robot)[rows] for robot in trace.robots], axis=1), min(fired, default=np.inf)


def compared(scenario: Scenario, repetitions: int) -> pd.DataFrame:
    """A row for each way, the first one being what the others are compared with."""
    recorder = Recorder(scenario, "a")
    ways: dict[str, Callable[[], Way]] = {
        "Drake": lambda: by_drake(recorder),
        "numpy": lambda: by_numpy(scenario),
        "solve_ivp": lambda: by_scipy(scenario),
    }
    found = {name: way() for name, way in ways.items()}
    seconds: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(repetitions):
        for name, way in ways.items():
            started = time.process_time()
            way()
            seconds[name].append(time.process_time() - started)
    least = {name: min(taken) for name, taken in seconds.items()}
    reference = found["Drake"][0]
    rows = [
        {
            "way": name, "cpu_s": least[name], "ratio": least[name] / least["numpy"],
            "times_real_time": scenario.duration_s / least[name],
            "distance_m": float(np.linalg.norm(found[name][0] - reference, axis=2).max()),
            "trigger_s": found[name][1],
        }
        for name in ways
    ]  # fmt: skip
    return pd.DataFrame(rows)


def profiled(repetitions: int) -> pd.DataFrame:
    """Shares of the time of the run (d) of case A by part of the program, by cProfile, which makes Python dearer."""
    recorder = Recorder(load("case_a")[0], "d")
    recorder.simulate()
    profile = cProfile.Profile(time.process_time)
    profile.enable()
    for _ in range(repetitions):
        recorder.simulate()
    profile.disable()
    own, calls = Counter[str](), Counter[str]()
    statistics: Any = pstats.Stats(profile)
    for (file, _, name), (_, count, taken, _, _) in statistics.stats.items():
        part = _part(file, name)
        own[part] += taken
        calls[part] += count
    whole, per = sum(own.values()), repetitions * len(recorder.simulate().signals)
    shares = [(part, 100.0 * taken / whole, calls[part] / per) for part, taken in own.most_common(8)]
    return pd.DataFrame(shares, columns=["part", "share_percent", "calls_per_row"])


def _part(file: str, name: str) -> str:
    """The folder of the package, the library, or what is built in."""
    ours = file.rpartition(f"{os.sep}airground_drake{os.sep}")[2]
    if "pydrake" in name or "pydrake" in file:
        return "Drake: its own work and the way into Python"
    if ours != file:
        return Path(ours).parts[0]
    return "numpy, pandas, numba" if "site-packages" in file else "Python itself"


def main() -> None:
    """Measure, print, and write JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repetitions", type=int, default=10)
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    quiet = {"decision.noise_m_sqrt_s": 0.0, "runs": {"a": {"method": "a"}}, "reproduction": []}
    tables = {
        "ways": compared(load("case_a", quiet)[0], options.repetitions),
        "profile": profiled(options.repetitions),
    }
    for table in tables.values():
        print(table.to_string(index=False, float_format="%.4g") + "\n")
    if options.json:
        from airground_drake.base.files import write_json

        write_json(options.json, {name: table.to_dict("records") for name, table in tables.items()})


if __name__ == "__main__":
    main()
