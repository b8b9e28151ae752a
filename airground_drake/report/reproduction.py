"""The paper's reported results against ours: measures, and the reproduction table.

A measure is a pure function of a trace and a robot. It returns its components in the order of the scenario's
`paper` values, 1 or 0 for a yes/no quantity, and an empty list if the run has no such value. A row without a value is
never reproduced.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import TraceError
from airground_drake.report.metrics import closest_obstacle, events_of, gap_m
from airground_drake.report.sentences import YES_NO
from airground_drake.scenario.schema import Reproduction, Scenario
from airground_drake.sim.collisions import first_collisions
from airground_drake.sim.trace import Trace

Measure = Callable[[Trace, str], list[float]]

STILL_M = 1e-3  # a robot stands still if it moved less than this during the last STILL_S of a run
STILL_S = 1.0
# A trigger counts as at the threshold if the decision variable is at most this much below: event isolation.
TRIGGER_TOLERANCE_M = 1e-5
SHIFTED_M = 0.1  # a path that leaves its straight line by this is shifted


def _stall_position(trace: Trace, robot: str) -> list[float]:
    """Final [x, y] in m of a robot that stands still short of its target, and did not collide."""
    hit = robot in first_collisions(trace.events)
    if hit or trace.t[-1] - trace.t[0] < STILL_S or _arrived(trace, robot):
        return []
    first = max(int(np.searchsorted(trace.t, trace.t[-1] - STILL_S, side="right")) - 1, 0)
    last_second = trace.position(robot)[first:]
    if np.linalg.norm(last_second - last_second[-1], axis=1).max() >= STILL_M:
        return []
    return _planar(last_second[-1])


def _distances_while_stalled(trace: Trace, robot: str) -> list[float]:
    """Final distances in m of a stalled robot to its two nearest obstacles, in the order of their names."""
    if not _stall_position(trace, robot):
        return []
    distance = {name: float(gap_m(trace, robot, name)[-1]) for name in trace.scenario.barriers}
    return [distance[name] for name in sorted(sorted(distance, key=distance.__getitem__)[:2])]


def _grows_past_threshold(trace: Trace, robot: str) -> list[float]:
    """1 if the decision variable ends above the threshold and grew from its crossing to the reference's end."""
    # A run in which the robot's intervention was released does not count: there it came back by itself.
    x, zeta = _decision_variable(trace, robot)
    above = np.flatnonzero(x >= zeta)
    if not above.size or _times(trace, robot, "release"):
        return [0.0]
    moving = np.flatnonzero((np.diff(trace.reference(robot), axis=0) != 0.0).any(axis=1))
    reference_end = trace.sample_rows[moving[-1] + 1] if moving.size else len(x) - 1
    return [float(x[-1] > zeta and x[reference_end] > x[above[0]])]


def _grows_until_acceptance(trace: Trace, robot: str) -> list[float]:
    """1 if the decision variable grew from first trigger to first acceptance, and later fell below the threshold."""
    # Empty without an acceptance.
    triggers, accepted = (_times(trace, robot, kind)[:1] for kind in ("trigger", "accept"))
    if not triggers or not accepted:
        return []
    x, zeta = _decision_variable(trace, robot)
    before, at = np.interp([*triggers, *accepted], trace.t, x)
    return [float(at > before and x[trace.t > accepted[0]].min(initial=np.inf) < zeta)]


def _path_shifts(trace: Trace, robot: str) -> list[float]:
    """1 if the robot's path leaves a straight line by SHIFTED_M while interventions are executed; empty without any."""
    executed = np.flatnonzero(np.any([trace.executing(ugv) >= 0 for ugv in trace.ugvs], axis=0))
    if not executed.size:
        return []
    path = trace.position(robot)[max(executed[0] - 1, 0) : executed[-1] + 1, :2]
    along = (path[-1] - path[0]) / max(float(np.linalg.norm(path[-1] - path[0])), 1e-12)
    away = path - path[0]
    return [float(np.linalg.norm(away - np.outer(away @ along, along), axis=1).max() >= SHIFTED_M)]


def _recovery_duration(trace: Trace, robot: str) -> list[float]:
    """Time from the first trigger until the decision variable first falls below the threshold, s."""
    # The row of the trigger may be slightly below the threshold (accuracy of event isolation), so a fall starts from a
    # row at or above it. Rows are interpolated linearly.
    triggers = _times(trace, robot, "trigger")
    if not triggers:
        return []
    t, (x, zeta) = trace.t, _decision_variable(trace, robot)
    start = int(np.searchsorted(t, triggers[0]))
    falls = np.flatnonzero((x[start:-1] >= zeta) & (x[start + 1 :] < zeta)) + start
    if not falls.size:
        return []
    k = falls[0]
    return [float(t[k] + (t[k + 1] - t[k]) * (x[k] - zeta) / (x[k] - x[k + 1]) - triggers[0])]


def _shortcomings(trace: Trace, robot: str) -> list[str]:
    """What an intervention lacks to succeed as in the paper."""
    triggers, accepted, refused = (_times(trace, robot, kind) for kind in ("trigger", "accept", "refuse"))
    x, zeta = _decision_variable(trace, robot)
    early = [t for t in triggers if np.interp(t, trace.t, x) < zeta - TRIGGER_TOLERANCE_M]
    lacks = [] if triggers else ["it never triggers"]
    lacks += [f"it triggers below the threshold at {_listed(early)}"] if early else []
    lacks += [] if accepted else ["the gatekeeper never accepts"]
    lacks += [f"the gatekeeper refuses at {_listed(refused)}"] if refused else []
    return lacks if _arrived(trace, robot) else [*lacks, "it does not arrive"]


def _taken_back(trace: Trace, robot: str) -> list[str]:
    """What became of an acceptance that did not last."""
    accepted = _times(trace, robot, "accept")[:1]
    refused = [t for t in _times(trace, robot, "refuse") if accepted and t > accepted[0]]
    lacks = [f"accepted at {_listed(accepted)}, refused at {_listed(refused)}"] if refused else []
    return lacks if _arrived(trace, robot) else [*lacks, "it does not arrive"]


def _minimum_distance(trace: Trace, robot: str) -> list[float]:
    """Smallest distance to any obstacle over continuous time, m."""
    nearest = closest_obstacle(trace, robot)
    return [] if nearest is None else [nearest.value]


def _execution_time(trace: Trace, robot: str) -> list[float]:
    """Time at which an intervention is first executed, s."""
    rows = np.flatnonzero(trace.executing(robot) >= 0)
    return [float(trace.t[max(rows[0] - 1, 0)])] if len(rows) else []


def _collision_position(trace: Trace, robot: str) -> list[float]:
    """Position [x, y] in m of the robot's first collision."""
    hits = events_of(trace, robot, "collision")
    return _planar(hits[0]["position_m"]) if hits else []


# The measures by name.
MEASURES: dict[str, Measure] = {
    "stall_position": _stall_position,
    "distances_while_stalled": _distances_while_stalled,
    "grows_past_threshold": _grows_past_threshold,
    "grows_until_acceptance": _grows_until_acceptance,
    "path_shifts": _path_shifts,
    "recovery_duration": _recovery_duration,
    "minimum_distance": _minimum_distance,
    "execution_time": _execution_time,
    # 1 if the robot ends, or is before its first collision, within the arrival tolerance of its target.
    "arrives": lambda trace, robot: [float(_arrived(trace, robot))],
    # Time of the first trigger, s.
    "trigger_time": lambda trace, robot: _times(trace, robot, "trigger")[:1],
    # 1 if the robot arrives, triggered only at the threshold, and the gatekeeper accepted and never refused.
    "intervention_succeeds": lambda trace, robot: [float(not _shortcomings(trace, robot))],
    # 1 if the gatekeeper never refused after its first acceptance and the robot arrives; empty without acceptance.
    "acceptance_lasts": lambda trace, robot: [
        float(not _taken_back(trace, robot)) for _ in _times(trace, robot, "accept")[:1]
    ],
    # Time at which the UAV sent the proposal that the gatekeeper first accepted, or first refused, s.
    "accepted_proposal_time": lambda trace, robot: _sent(trace, robot, "accept"),
    "refused_proposal_time": lambda trace, robot: _sent(trace, robot, "refuse"),
    # Position [x, y] in m at the end of the run.
    "final_position": lambda trace, robot: _planar(trace.position(robot)[-1]),
    "collision_position": _collision_position,
}

# By measure, what the reason of a row tells of the run at hand.
DETAILS: dict[str, Callable[[Trace, str], list[str]]] = {
    "intervention_succeeds": _shortcomings,
    "acceptance_lasts": _taken_back,
    "accepted_proposal_time": lambda trace, robot: [
        f"accepted at {t:.2f} s" for t in _times(trace, robot, "accept")[:1]
    ],
    "refused_proposal_time": lambda trace, robot: [f"refused at {t:.2f} s" for t in _times(trace, robot, "refuse")[:1]],
}


def rows(scenario: Scenario, traces: Mapping[str, Trace]) -> list[dict[str, Any]]:
    return [_row(row, traces) for row in scenario.reproduction]


def _row(row: Reproduction, traces: Mapping[str, Trace]) -> dict[str, Any]:
    ours, reason = _evaluate(row, traces)
    details = DETAILS[row.measure](traces[row.run], row.robot) if ours and row.measure in DETAILS else []
    tolerance = 0.0 if row.unit == YES_NO else row.tolerance
    difference = max(abs(a - b) for a, b in zip(ours, row.paper, strict=True)) if ours else None
    within = difference is not None and difference <= tolerance * (1.0 + 1e-9) + 1e-12
    if difference is not None and row.unit == YES_NO:
        reason = "" if within else "the answer differs"
    elif difference is not None:
        too_much = f"differs by {difference:.4g} {row.unit}, {tolerance:.4g} {row.unit} are allowed"
        reason = _off_the_digits(ours, row.paper, row.unit) if within else too_much
    return {
        **{name: getattr(row, name) for name in ("id", "quantity", "measure", "run", "robot", "unit")},
        "paper": _scalar(row.paper),
        "ours": _scalar(ours),
        "difference": difference,
        "tolerance": tolerance,
        "status": _status(row, within),
        "why": "; ".join(filter(None, (reason, *details, "" if within else row.ambiguous, row.why))),
    }


def _status(row: Reproduction, within: bool) -> str:
    if within and row.by_construction:
        return "by_construction"
    if within:
        return "calibrated" if row.calibrated else "reproduced"
    return "ambiguous" if row.ambiguous else "not_reproduced"


def _off_the_digits(ours: list[float], paper: list[float], unit: str) -> str:
    """A note for a value that passes by the tolerance, but does not round to the digits that the paper prints."""
    off = [
        f"ours rounds to {round(mine, decimals):g} {unit}, the paper prints {printed:g} {unit}"
        for mine, printed in zip(ours, paper, strict=True)
        for decimals in [len(repr(float(printed)).partition(".")[2])]
        if round(mine, decimals) != printed
    ]
    return f"within the tolerance only: {', '.join(off)}" if off else ""


def _evaluate(row: Reproduction, traces: Mapping[str, Trace]) -> tuple[list[float], str]:
    """Our value, or an empty list and the reason why there is no value to compare."""
    if row.measure not in MEASURES:
        return [], f"there is no measure {row.measure!r}; there are {', '.join(sorted(MEASURES))}"
    if row.run not in traces:
        return [], f"run {row.run!r} has no trace"
    try:
        ours = MEASURES[row.measure](traces[row.run], row.robot)
    except TraceError as error:
        return [], f"could not be measured: {error}"
    if not ours:
        return [], f"no value: run {row.run} shows nothing of the kind for {row.robot}"
    if len(ours) != len(row.paper):
        return [], f"{len(ours)} components measured, the paper's value has {len(row.paper)}"
    if not np.isfinite(ours).all():
        return [], "the measured value is not finite"
    return ours, ""


def _scalar(values: list[float]) -> float | list[float] | None:
    return (values[0] if len(values) == 1 else list(values)) if values else None


def _decision_variable(trace: Trace, ugv: str) -> tuple[Array, float]:
    return trace.column(f"{ugv}.decision_variable_m"), float(trace.meta["zeta_m"])


def _times(trace: Trace, robot: str, kind: str) -> list[float]:
    return [float(event["t_s"]) for event in events_of(trace, robot, kind)]


def _sent(trace: Trace, robot: str, answer: str) -> list[float]:
    """When the proposal with the first answer of a kind was sent, s."""
    answered = _times(trace, robot, answer)[:1]
    return [t for t in _times(trace, robot, "proposal") if answered and t <= answered[0]][-1:]


def _listed(times_s: list[float]) -> str:
    return f"{', '.join(f'{t:.2f}' for t in times_s)} s"


def _planar(position: Any) -> list[float]:
    return [float(position[0]), float(position[1])]


def _arrived(trace: Trace, robot: str) -> bool:
    end = trace.position(robot)[trace.counting_rows(robot) - 1]
    target = trace.scenario.robots[robot].target_m
    return bool(np.linalg.norm(end - np.asarray(target)) <= trace.scenario.arrival_tolerance_m)
