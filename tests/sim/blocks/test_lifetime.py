"""Diagrams of runs are freed; otherwise a campaign's workers would grow by megabytes a run."""

import gc
import weakref

import pytest
from pydrake.systems.framework import LeafSystem

from airground_drake.scenario.load import load
from airground_drake.sim.simulation import Recorder


@pytest.mark.parametrize("run", ["b", "c", "d"])
def test_a_recorder_is_freed_with_all_its_systems(run: str) -> None:
    recorder = Recorder(load("case_a", {"duration_s": 0.2}), run)
    recorder.simulate()
    systems = [*_within(recorder._root)]
    assert len(systems) > 15
    alive = [weakref.ref(system) for system in (recorder._root, *systems)]
    del recorder, systems
    gc.collect()
    assert [each().get_name() for each in alive if each() is not None] == []


def _within(diagram: LeafSystem) -> list[LeafSystem]:
    found = []
    for system in diagram.GetSystems():
        found += [system, *(_within(system) if hasattr(system, "GetSystems") else [])]
    return found
