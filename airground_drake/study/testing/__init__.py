"""For your own tests: claims as assertions, traces that a session simulates once, and random scenarios.

    from airground_drake.study.testing import assert_holds

    def test_my_team_keeps_its_distances(airground_trace):
        assert_holds(airground_trace("team.yaml", "d"), "SAFE-TRACE", "LIVE-GOAL", exercised=True)

`plugin.py` is a pytest plugin that is installed with the package; its fixture is `airground_trace`. `strategies.py` has
scenarios for Hypothesis. These two need pytest and hypothesis.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from airground_drake.study.testing.assertions import ClaimError, NotExercisedWarning, assert_holds, assert_proved

__all__ = ["ClaimError", "NotExercisedWarning", "assert_holds", "assert_proved"]


def __getattr__(name: str) -> Any:
    """Import on first use: every session of pytest loads the plugin, and with it this package."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.assertions"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
