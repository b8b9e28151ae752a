"""The relation read off the running trigger."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from verify.judging import Judged
from verify.model.trigger.cases import KINDS, ZENO

from airground_drake.decision.trigger import Trigger
from airground_drake.verify.model.trigger import relation
from airground_drake.verify.model.trigger.zeno_proof import ZenoProof


@pytest.mark.parametrize("name", KINDS)
def test_conformance_notices_another_trigger(name: str) -> None:
    transitions = relation.read_off(lambda _: KINDS[name](3.0, 2.0, 0.3))
    found = relation.conformance(Trigger(3.0, 2.0, 0.3), transitions, 30.0)
    assert found["disagreements"] > 0
    assert found["first"] is not None


def test_conformance_meets_every_transition_and_the_rounding(judged: Judged) -> None:
    found = judged(ZenoProof(), ZENO).evidence["conformance"]
    assert found["states"] >= 2000
    assert found["disagreements"] == 0
    assert found["within_rounding"] > 0  # 0.3 is no binary fraction: it matters, and the bound on it covers it
    transitions = relation.read_off(lambda _: Trigger(3.0, 2.0, 0.3))
    events = {each.name for each in transitions if each.source is not None and not each.name.endswith("waits")}
    assert events - set(found["transitions"]) == {"intervening_refractory_untriggered"}  # only at s < 0


@given(st.floats(0.0, 30.0), st.floats(1e-3, 10.0))
@example(0.1, 0.2)
def test_rounding_bounds_the_end_of_the_dwell(triggered_at: float, dwell: float) -> None:
    trigger = Trigger(3.0, 2.0, dwell)
    end = trigger.dwell_end(trigger.rise(trigger.start(0.0, 0.0), triggered_at))
    exact = Fraction(triggered_at) + Fraction(repr(dwell))
    assert abs(Fraction(end) - exact) <= Fraction(relation.dwell_rounding(trigger, 30.0))


def test_symbols_explore_every_outcome() -> None:
    transitions = relation.read_off(lambda path: Trigger(*map(path.symbol, ("zeta", "release", "dwell"))))
    assert {(str(f), strict) for f, strict in transitions[0].guards} >= {("zeta", True), ("zeta - release", False)}
    assert len([each for each in transitions if each.source is None]) == 2
    assert {each.name for each in transitions if each.triggers and not each.name.endswith("untriggered")} == {
        "start_intervening",
        "supervising_intervening",
        "refractory_intervening",
    }
