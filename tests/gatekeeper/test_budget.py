"""Limits of a solution."""

from __future__ import annotations

import math
from typing import Any

import pytest

from airground_drake.gatekeeper.budget import Budget


@pytest.mark.parametrize(
    "wrong", [{"iterations": 0}, {"search_iterations": 0}, {"search_s": 0.0}, {"deadline_s": math.nan}]
)
def test_budgets_that_mean_nothing(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="budget"):
        Budget(**wrong)
