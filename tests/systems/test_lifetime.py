"""Diagrams of runs are freed; without that a campaign's workers would grow by megabytes a run."""

import gc
import weakref

import pytest
from pydrake.systems.framework import LeafSystem

from airground_drake.run.simulation import Recorder
from airground_drake.scenarios.load import load
from airground_drake.systems.lifetime import weakly


@pytest.mark.parametrize("run", ["b", "c", "d"])
def test_a_recorder_is_freed_with_all_its_systems(run: str) -> None:
    """Whatever stands for the trigger, the gatekeeper, the planner and the diagrams around them."""
    recorder = Recorder(load("case_a", {"duration_s": 0.2})[0], run)
    recorder.simulate()
    systems = [*_within(recorder._root)]
    assert len(systems) > 15
    alive = [weakref.ref(system) for system in (recorder._root, *systems)]
    del recorder, systems
    gc.collect()
    assert [each().get_name() for each in alive if each() is not None] == []


def test_what_is_declared_weakly_does_not_keep_its_object() -> None:
    """And is called with what it is given."""

    class Adder:
        def sum(self, one: int, two: int) -> int:
            return one + two

    adder = Adder()
    call, kept = weakly(adder.sum), weakref.ref(adder)
    assert call(1, 2) == 3
    del adder
    assert kept() is None


def _within(diagram: LeafSystem) -> list[LeafSystem]:
    found = []
    for system in diagram.GetSystems():
        found += [system, *(_within(system) if hasattr(system, "GetSystems") else [])]
    return found
