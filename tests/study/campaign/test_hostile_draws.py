"""Draws of the hostile campaign in which two exact roll-outs of one outcome once went different ways."""

from pathlib import Path

import pytest
from oracles import faults_of

from airground_drake.sim.simulation import simulate
from airground_drake.study.campaign.spec import load_spec
from airground_drake.verify import judge

pytestmark = pytest.mark.slow

HOSTILE = Path(__file__).parents[3] / "benchmarks" / "campaigns" / "hostile.yaml"


@pytest.mark.parametrize("index", [1093, 1957, 2397, 3774])
def test_roll_outs_agree(index: int) -> None:
    """A UGV is squeezed between robots predicted in nearly one direction, or in nearly opposite ones."""
    trace = simulate(load_spec(HOSTILE).draw(index), "d")
    assert not faults_of(trace)
    for verdict in judge(trace, claims=["LIVE-HYP", "SAFE-TRACE"]):
        assert verdict.status == "holds", verdict
