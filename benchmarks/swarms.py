"""Do the claims hold when many UGVs negotiate at once? `python benchmarks/swarms.py --runs 200`.

Draws swarms of 6 to 40 UGVs, small ones more often, that exchange places on a circle, on a grid, or through the door of
a walled course, and simulates method (d) with periods and patience drawn, too. One run in four has the policies of the
package, with few UGVs, because joint plans take long; the others have `Whims`. A run that goes wrong, by a claim that
is refuted or could not be decided, is printed with its number; `--only` repeats one run, and with `--write` its
scenario becomes a file. Whether the UGVs arrive is no matter here: they are given too little time.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import maps
import numpy as np
import yaml
from maps import Array, Course
from numpy.typing import NDArray

from airground_drake.geometry.motion import Motion
from airground_drake.intervention.policy import Observation, Policy, Teammate
from airground_drake.registry import POLICIES
from airground_drake.run.simulation import simulate
from airground_drake.scenarios.load import from_data
from airground_drake.verify import verify

CLAIMS = ("SAFE-TRACE", "SAFE-HYP", "EXEC", "THR-TRIG", "GATE-FEAS", "COMM")
SLOW_CLAIMS, SELDOM, FEW = ("GATE-MODEL", "LIVE-PROG"), 3, 15
"""Claims that roll out decisions again are judged on one run of so many, of so many UGVs at most."""
WHIMS = "whims"
KINDS = ("circle", "grid", "maze")
SAFE_M, SPACE_M = 0.8, 1.1
"""Safe distance of every pair, and distance between neighbours at the start, m."""
MOST_COORDINATED = 9
"""UGVs for which joint plans are made."""
PACKAGE: tuple[list[dict[str, Any]], ...] = (
    [{"name": "coordinate"}],
    [{"name": "coordinate"}, {"name": "detour", "parameters": {"speed_m_s": 2.0}}],
    [{"name": "detour", "parameters": {"speed_m_s": 2.0}}, {"name": "coordinate"}],
)


class Whims(Policy):
    """Joint plans for any UGVs, with or without the one that it was asked about; some lead back to the presets."""

    counted = True

    def __init__(self, *, seed: float) -> None:
        """Begin its random numbers anew."""
        self._random = np.random.default_rng(int(seed))

    def propose(self, seen: Observation) -> dict[str, Motion]:
        """Motions for the UGV and up to three others, or for others only, or for nobody."""
        free = [mate for mate in seen.team if mate.proposal is None or mate.proposal.issued != seen.t]
        chosen = self._random.permutation(len(free))[: self._random.integers(0, 4)]
        mates = {free[k].name: free[k] for k in chosen}
        if self._random.random() < 0.6:
            mates |= {mate.name: mate for mate in free if mate.name == seen.robot}
        return {name: self._motion(mate, seen.start) for name, mate in mates.items()}

    def _motion(self, mate: Teammate, start: float) -> Motion:
        lasts = float(self._random.choice([0.1, 0.5, 2.0, 5.0]))
        aside = mate.position + self._random.normal(size=3) * [1.0, 1.0, 0.0]
        end = mate.preset.at(start + lasts)[0] if self._random.random() < 0.7 else aside
        times = start + lasts * np.array([0.0, 0.5, 1.0])
        return Motion(times, np.stack([mate.position, 0.5 * (aside + end), end]))


def course(kind: str, n: int, rng: np.random.Generator) -> Course:
    """Starts and targets of n UGVs, and obstacles that none of them is too near to."""
    if kind == "circle":
        angle = np.arange(n) * 2.0 * np.pi / n
        starts = SPACE_M * n / (2.0 * np.pi) * np.column_stack([np.cos(angle), np.sin(angle)])
        return Course(0, 1.0, False, starts, -starts, np.empty((0, 2)))
    rows = int(np.ceil(np.sqrt(n)))
    lattice = SPACE_M * np.array([(k // rows, k % rows) for k in range(n)], dtype=float)
    if kind == "grid":
        return Course(0, 1.0, False, lattice, lattice[_others(n, rng)], np.empty((0, 2)))
    half = n // 2  # two groups of as many, on either side of a wall with a door, in a walled room
    depth, width = SPACE_M * (half // rows), SPACE_M * (rows - 1)
    left = lattice[:half] - [depth + 2.0, 0.0]
    right = lattice[:half] + np.array([2.0, 0.0])
    starts = np.concatenate([left, right])
    targets = np.concatenate([right[rng.permutation(half)], left[rng.permutation(half)]])
    room = SPACE_M + 0.1
    low, high = [-depth - 2.0 - room, -room], [depth + SPACE_M + 2.0 + room, width + room]
    door = rng.uniform(0.0, width)
    inner = _wall([0.0, low[1]], [0.0, high[1]])
    inner = inner[np.abs(inner[:, 1] - door) > SAFE_M + 0.2]
    outer = [_wall(low, [high[0], low[1]]), _wall([high[0], low[1]], high), _wall(high, [low[0], high[1]])]
    return Course(0, 1.0, True, starts, targets, np.concatenate([inner, *outer, _wall([low[0], high[1]], low)]))


def _others(n: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """For each of n places another one, all different."""
    order = rng.permutation(n)
    return order[(np.argsort(order) + 1) % n]


def _wall(start: list[float], end: list[float]) -> Array:
    """Centres of discs from one place to another, (k, 2), m, too close to pass between."""
    count = int(np.ceil(np.hypot(end[0] - start[0], end[1] - start[1]) / SPACE_M))
    return np.array(start) + np.arange(count)[:, None] / count * (np.array(end) - start)


def scenario_of(number: int) -> dict[str, Any]:
    """The scenario of a run, as in a file."""
    rng = np.random.default_rng([20270301, number])
    kind, n = KINDS[number % len(KINDS)], round(6.0 * (40.0 / 6.0) ** rng.random())
    policies: list[dict[str, Any]] = [{"name": WHIMS, "parameters": {"seed": float(number)}}]
    if number % 4 == 0:
        n, policies = min(n, MOST_COORDINATED), PACKAGE[rng.integers(len(PACKAGE))]

    class Swarm(Course):
        duration_s = float(round(rng.uniform(4.0, 9.0)))

    drawn = course(kind, n, rng)
    data = maps.scenario_of(Swarm(**vars(drawn)), policies)
    data |= {"name": f"swarm_{number}", "title": f"{n} UGVs: {kind}", "seed": number, "runs": {"d": {"method": "d"}}}
    data["safe_distance"] = {"obstacle_m": SAFE_M, "ugv_m": SAFE_M, "air_ground_m": 1.0}
    data["decision"] |= {"threshold": {"rule": "fixed", "zeta_m": 1.0}, "release_m": 0.6}
    data["intervention"] |= {
        "period_s": float(rng.choice([0.05, 0.1])),
        "ranking": str(rng.choice(["listed", "predicted"])),
        "retry_s": float(rng.choice([0.5, 1.0])),
    }
    data["gatekeeper"] = {
        "period_s": float(rng.choice([0.05, 0.1])),
        "longest_s": float(rng.choice([2.0, 10.0])),
        "tries": int(rng.integers(1, 6)),
    }
    return data


def main(argv: list[str] | None = None) -> int:
    """Print the runs that go wrong, then what was counted; 1 if there is one."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--runs", type=int, default=200, help="number of runs")
    parser.add_argument("--first", type=int, default=0, help="number of the first one")
    parser.add_argument("--only", type=int, help="repeat this one")
    parser.add_argument("--write", type=Path, help="write the scenarios of runs that go wrong into this folder")
    given = parser.parse_args(argv)
    numbers = range(given.first, given.first + given.runs) if given.only is None else [given.only]
    with POLICIES.adding(WHIMS, Whims):
        return judged(numbers, given.write)


def judged(numbers: Iterable[int], folder: Path | None) -> int:
    """Simulate and judge runs; 1 if one of them goes wrong."""
    spent: Counter[str] = Counter({"runs": 0, "wrong": 0})
    for number in numbers:
        data, started = scenario_of(number), time.process_time()
        slow = number % SELDOM == 0 and len(data["ugvs"]) <= FEW
        claims = (*CLAIMS, *SLOW_CLAIMS) if slow else CLAIMS
        trace = simulate(from_data(data, data["name"]), "d")
        verdicts = [(verdict.claim.id, verdict.finding) for verdict in verify(trace, claims)]
        wrong = [(name, found) for name, found in verdicts if found.status != "holds"]
        spent.update({"proposals": len(trace.proposals), "decisions": len(trace.decisions), "UGVs": len(trace.ugvs)})
        spent.update({"runs with proposals": int(len(trace.proposals) > 0), "faults": len(trace.meta["faults"])})
        spent.update({"acceptances": sum(event["kind"] == "accept" for event in trace.events)})
        took = time.process_time() - started
        print(f"{number}: {data['title']}, {len(trace.proposals)} proposals, {took:.1f} s", flush=True)
        for name, found in wrong:
            reason = found.counterexample or found.evidence.get("error") or found.evidence.get("reason")
            print(f"  {name} {found.status}: {reason}", flush=True)
        if wrong and folder:
            folder.mkdir(parents=True, exist_ok=True)
            (folder / f"{data['name']}.yaml").write_text(yaml.safe_dump(data, sort_keys=False), encoding="utf-8")
        spent.update({"runs": 1, "wrong": int(bool(wrong))})
    print(", ".join(f"{what} {count}" for what, count in spent.items()))
    return int(spent["wrong"] > 0)


if __name__ == "__main__":
    sys.exit(main())
