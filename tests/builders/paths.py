"""Traces along given corners, with any events."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from airground_drake.sim.trace import Trace
from builders.layout import laid_out, reference_at

Corners = Sequence[tuple[float, ...]]
"""(t, x, y) or (t, x, y, z): where a robot is when, s and m; straight lines in between."""


def along(
    scenario: dict[str, Any],
    run: str,
    corners: Sequence[Corners],
    events: Sequence[dict[str, Any]] = (),
    *,
    step_s: float = 0.1,
    x: Mapping[float, float] | None = None,
    intervention_s: tuple[float, float] = (np.inf, np.inf),
    decisions: Sequence[dict[str, Any]] = (),
    timings: dict[str, Any] | None = None,
) -> Trace:
    """Robots along corners, UAV last, with true decision variables; `x`: that of the first UGV by time instead."""
    end = corners[0][-1][0]
    t = np.linspace(0.0, end, round(end / step_s) + 1)
    position = np.zeros((len(t), len(corners), 3))
    for i, of_robot in enumerate(corners):
        times, *axes = zip(*of_robot, strict=True)
        for k, values in enumerate(axes):
            position[:, i, k] = np.interp(t, times, values)
    velocity = np.gradient(position, t, axis=0) if len(t) > 1 else np.zeros_like(position)
    presets = [ugv["preset"] for ugv in scenario["ugvs"].values()]
    reference = np.array([[reference_at(preset, time) for preset in presets] for time in t])
    variable = np.linalg.norm(reference - position[:, :-1], axis=2)
    if x is not None:
        variable[:, 0] = np.interp(t, list(x), list(x.values()))
    intervening = np.repeat(((t > intervention_s[0]) & (t < intervention_s[1]))[:, None].astype(float), len(presets), 1)
    held = {"decision_variable_m": variable, "mode": intervening, "executing": intervening - 1.0}
    return laid_out(scenario, run, t, position, velocity, held, events, decisions, timings)
