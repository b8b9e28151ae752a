"""From a solution to an answer: margin, dwell."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from builders.problems import STALL_POSITION, case_a_proposal, random_problem
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.gatekeeper.answer import Decision, Rules, in_words, settle
from airground_drake.gatekeeper.problem import predicted_problem
from airground_drake.gatekeeper.routes.relaxed import RelaxedRoute
from airground_drake.gatekeeper.solution import Solution
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.messages import ACCEPT, REFUSE, SILENT
from airground_drake.intervention.policy import Proposal

RULES = Rules(switching_margin=0.1, min_dwell=0.2)


def solution(accept: float, refuse: float, status: Any = "optimal") -> Solution:
    return Solution(accept < refuse, status, objective=min(accept, refuse))


def answer(accept: float, refuse: float, standing: float, stood: float) -> tuple[bool, str]:
    """`settle` where keeping an answer throughout costs what the best plan costs that starts with it."""
    return settle(solution(accept, refuse), (accept, refuse), standing, stood, RULES)


def test_a_new_proposal_is_judged_by_the_plan_alone() -> None:
    assert answer(10.0, 10.5, SILENT, 0.0) == (True, "cheaper")
    assert answer(10.5, 10.0, SILENT, 0.0) == (False, "not_cheaper")
    assert answer(10.0 - 1e-9, 10.0, SILENT, 0.0) == (False, "no_difference")


def test_a_plan_that_accepts_later_is_named_as_such_with_its_cost() -> None:
    """Accepting throughout costs less than refusing throughout, and still the proposal is refused."""
    _, _, proposal, _ = case_a_proposal()
    later = Solution(False, "optimal", objective=350.0)
    throughout = 350.3, 468.8
    assert settle(later, throughout, SILENT, 0.0, RULES) == (False, "waits")
    never = replace(later, objective=throughout[1] * (1.0 - 1e-9))
    assert settle(never, throughout, SILENT, 0.0, RULES) == (False, "not_cheaper")
    words = in_words(Decision(0.0, 0, proposal, False, "waits", random_problem(0), later, throughout))
    assert words == (
        "the best plan refuses now and accepts later: cost 350, 350.3 to accept throughout, 468.8 to refuse"
    )


def test_a_standing_answer_is_reversed_only_for_a_clear_gain() -> None:
    assert answer(10.5, 10.0, ACCEPT, 1.0) == (True, "kept")
    assert answer(10.0, 10.5, REFUSE, 1.0) == (False, "kept")
    assert answer(20.0, 10.0, ACCEPT, 1.0) == (False, "reversed")
    assert answer(10.0, 20.0, REFUSE, 1.0) == (True, "reversed")


def test_no_reversal_before_the_dwell_is_over() -> None:
    assert answer(20.0, 10.0, ACCEPT, 0.15) == (True, "dwell")
    assert answer(10.0, 20.0, REFUSE, 0.15) == (False, "dwell")
    assert answer(20.0, 10.0, ACCEPT, 0.2) == (False, "reversed")


@given(st.sampled_from([SILENT, ACCEPT, REFUSE]), st.floats(0.0, 1.0))
def test_without_a_plan_everything_is_refused_at_once(standing: float, stood: float) -> None:
    without = solution(1.0, 2.0, "refused_not_finite")
    assert settle(without, (1.0, 2.0), standing, stood, RULES) == (False, "no_plan")


@given(
    st.floats(0.1, 100.0),
    st.floats(0.1, 100.0),
    st.tuples(st.floats(0.1, 100.0), st.floats(0.1, 100.0)),
    st.floats(0.0, 0.5),
    st.sampled_from([ACCEPT, REFUSE]),
)
def test_opposite_answers_never_want_each_other(
    accept: float, refuse: float, kept: tuple[float, float], margin: float, standing: float
) -> None:
    """Reversed once, the same costs do not reverse it back."""
    rules = Rules(switching_margin=margin)
    accepted, _ = settle(solution(accept, refuse), kept, standing, 1.0, rules)
    assert settle(solution(accept, refuse), kept, ACCEPT if accepted else REFUSE, 1.0, rules)[1] == "kept"


def test_a_proposal_into_an_obstacle_is_refused() -> None:
    scene, law, _, horizon = case_a_proposal()
    motion = Motion.at_speed(np.array([STALL_POSITION, [4.0, 7.0, 0.0]]), 2.0, start=scene.t)
    problem = predicted_problem(
        scene, replace(law, intervention_on_top=True), Proposal("bad", scene.t, motion), horizon
    )
    throughout = tuple(problem.evaluate(np.full(problem.stages, answer)).objective for answer in (1.0, 0.0))
    assert not settle(RelaxedRoute().solve(problem), throughout, SILENT, 0.0, Rules())[0]
