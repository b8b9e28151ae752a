"""The parameters that the controllers of a run must have, such as distances and shares.

They are read from the scenario and compared with the parameters read back from the controllers in the diagram. The code
that builds the controllers is not used, so that a wrong distance there is a difference here.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array, Indices
from airground_drake.sim.trace import Trace
from airground_drake.verify.engines.outlines import CORNERS, COUNT, EXTENT, MIDDLE, unpacked
from airground_drake.verify.runs.control_law import ON_TOP, PLANE
from airground_drake.verify.runs.old_positions import unsure_s
from airground_drake.verify.runs.pairs import carried, declared_pairs, pairs_beside, parts_of

NO_INTERVENTION = "a"  # method without interventions
# Parameters that are outlines: of what is at rest, and of what moves, about its origin.
OUTLINES = ("outlines", "moving_outlines")
SAME_M = 1e-12  # distances that differ by no more are equal, m: two ways to add up a budget round differently


def demanded(trace: Trace) -> dict[str, dict[str, Any]]:
    """The parameters of both controllers by the scenario, as `systems.controllers.read_back` names them; flat."""
    # Outlines are without the circles round their corners.
    #
    # Every robot avoids all convex parts of the barriers at rest, then all other robots in team order, then the parts
    # of the barriers that move.
    scenario = trace.scenario
    robots = trace.robots
    parts = parts_of(trace)
    control = scenario.control
    barriers = scenario.barriers
    everybody = np.arange(len(robots))
    still, moving = _numbers(trace)
    m = len(still)
    number = {name: k for k, name in enumerate([*barriers, *robots])}
    safe, share = np.zeros((2, len(robots), len(number)))
    late_s = unsure_s(scenario)
    for pair in declared_pairs(trace):
        first, second = number[pair.first], number[pair.second]
        for i, j in ((first, second), (second, first)):
            if i >= len(barriers):  # a barrier does not avoid others
                i -= len(barriers)
                safe[i, j], share[i, j] = pair.law_m, -pair.error_m if pair.error_m and pair.speed_m_s else pair.share
                if pair.asynchronous:
                    share[i, j] = -late_s * scenario.ugvs[robots[j - len(barriers)]].max_speed_m_s
    outlines = [*outlines_of(trace)]
    at_rest, that_move = (np.concatenate([np.empty(0), *(outlines[k] for k in some)]) for some in (still, moving))
    column = np.concatenate([parts.owner[still], len(barriers) + everybody, parts.owner[moving]])
    safe, share = safe[:, column], share[:, column]
    bodies = np.unique(parts.owner[moving], return_inverse=True)[1]
    carrier = np.concatenate([everybody, len(robots) + bodies])
    with_uav = np.array([scenario.kind_of(name) == "uav" for name in robots])
    wanted = {}
    uavs = everybody[with_uav]
    controllers = {"ugv_controller": everybody[~with_uav]}
    for i in uavs.tolist():
        controllers["uav_controller" if len(uavs) == 1 else f"uav_controller_{robots[i]}"] = uavs[uavs == i]
    for name, team in controllers.items():
        beside = np.array([np.delete(np.arange(len(column)), m + i) for i in team])
        wanted[name] = {
            "members": team,
            "outlines": at_rest,
            "others": carrier[beside[:, m:] - m].ravel(),
            "safe_m": np.take_along_axis(safe[team], beside, axis=1).ravel(),
            "share": np.take_along_axis(share[team], beside, axis=1).ravel(),
            "mobility": np.concatenate([np.ones(3) if with_uav[i] else PLANE for i in team]),
            "max_speed_m_s": np.array([scenario.robots[robots[i]].max_speed_m_s for i in team]),
            "sampling_s": np.array([control.period_s, 0.0]),
            "gain_1_s": control.avoidance_gain_1_s,
            "period_s": control.period_s,
            "sensing_range_m": control.sensing_range_m,
        }
        if scenario.stands:
            wanted[name]["stands"] = True
        if len(moving):
            wanted[name]["moving_outlines"] = that_move
    if own := scenario.ugv_controller:  # it is judged by its steps, whatever its parameters
        sampling_s = wanted["ugv_controller"]["sampling_s"]
        return wanted | {"ugv_controller": {"class": own.kind, "sampling_s": sampling_s}}
    of_run = scenario.runs[trace.run]
    wanted["ugv_controller"]["composition"] = of_run.composition
    if of_run.method != NO_INTERVENTION:
        wanted["ugv_controller"]["intervention_on_top"] = of_run.method in ON_TOP
    return wanted


def _numbers(trace: Trace) -> tuple[Indices, Indices]:
    """Numbers of the parts of barriers at rest, and of those that move."""
    still, *moving = (numbers for numbers, _ in carried(trace))
    return still, np.concatenate([np.empty(0, dtype=np.intp), *moving])


def outlines_of(trace: Trace) -> Iterator[Array]:
    """The numbers of the outline of each convex part of the barriers, but for the circle round its corners."""
    parts, pairs = parts_of(trace), pairs_beside(trace, trace.robots[0])
    for k, number in enumerate(parts.owner.tolist()):
        barrier = trace.scenario.barriers[parts.names[number]]
        core = parts.cores.take(k)
        corners = list(dict.fromkeys(map(tuple, core.corners.tolist())))
        heights = [float(core.base), float(core.top), float(len(corners))]
        gap = pairs[parts.names[number]].required_m
        speed = barrier.expected_speed_m_s
        yield np.array([gap, barrier.radius_m, speed, *heights, *(x for corner in corners for x in corner)])


def _without_circles(numbers: Sequence[float]) -> Array:
    """The numbers of outlines without the circles round their corners; NaN if a circle is too small."""
    try:
        rows = unpacked(numbers)
    except ValueError:
        return np.array(numbers)
    kept = [np.empty(0)]
    for row in rows:
        corners = row[CORNERS : CORNERS + 2 * int(row[COUNT])]
        held = np.hypot(*(corners.reshape(-1, 2) - row[MIDDLE:EXTENT]).T).max() <= row[EXTENT]
        kept.append(np.where(held, np.append(row[:MIDDLE], corners), np.nan))
    return np.concatenate(kept)


def differences(trace: Trace) -> Iterator[dict[str, Any]]:
    """Parameters of the controllers that differ from the scenario, each with the first difference."""
    built = trace.meta["controllers"]
    for controller, wanted in demanded(trace).items():
        for parameter, due in wanted.items():
            given = built.get(controller, {}).get(parameter)
            about = {"controller": controller, "parameter": parameter}
            if not isinstance(due, np.ndarray):
                if given != due:
                    yield {**about, "built": given, "scenario": due}
                continue
            if parameter in ("safe_m", "share"):
                value, times = np.array(given, dtype=np.float64).reshape(-1, 2).T
                given = np.repeat(value, times.astype(np.intp))
            given = _without_circles(given or []) if parameter in OUTLINES else np.asarray(given, dtype=np.float64)
            if given.shape != due.shape:
                yield {**about, "built": f"{given.size} numbers", "scenario": f"{due.size} numbers"}
            elif (other := np.abs(given - due) > (SAME_M if parameter == "safe_m" else 0.0)).any():
                k = int(np.argmax(other))
                place = _place(trace, wanted, parameter, k)
                yield {**about, **place, "built": float(given[k]), "scenario": float(due[k])}


def _place(trace: Trace, wanted: dict[str, Any], parameter: str, k: int) -> dict[str, Any]:
    """The robot and the other body of the k-th number of a parameter."""
    members, parts = wanted["members"], parts_of(trace)
    length = len(wanted[parameter]) // len(members)
    if parameter in ("safe_m", "share"):
        robot, column = divmod(k, length)
        others = wanted["others"].reshape(len(members), -1)[robot]
        still, _ = _numbers(trace)
        m = len(still)
        moving = [name for name, barrier in trace.scenario.barriers.items() if barrier.moves]
        beside = parts.names[parts.owner[still[column]]] if column < m else [*trace.robots, *moving][others[column - m]]
        return {"robot": trace.robots[members[robot]], "other": beside}
    if parameter in ("mobility", "max_speed_m_s"):
        return {"robot": trace.robots[members[k // length]]}
    return {"index": k}
