"""The strength of the decision noise is the scenario's."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.common import RandomGenerator
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput

from airground_drake.scenarios.schema import Decision
from airground_drake.systems.components import make_noise

PERIODS, COUNT = 400, 100


@pytest.mark.parametrize("period_s", [0.05, 0.2])
def test_the_variance_of_the_increments_is_that_of_the_scenario(period_s: float) -> None:
    """Without a leak they are independent, with variance s^2 h; 40,000 of them give it within 3 %."""
    given = Decision(noise_m_sqrt_s=0.3, noise_period_s=period_s, leak_1_s=0.0)
    builder = DiagramBuilder()
    source, noise = (builder.AddSystem(system) for system in make_noise(COUNT, given))
    builder.Connect(source.get_output_port(), noise.get_input_port())
    log = LogVectorOutput(noise.get_output_port(), builder, period_s)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    diagram.SetRandomContext(context, RandomGenerator(5))
    Simulator(diagram, context).AdvanceTo(PERIODS * period_s)
    increments = np.diff(log.FindLog(context).data(), axis=1)
    assert np.var(increments) == pytest.approx(given.noise_m_sqrt_s**2 * period_s, rel=0.03)
