"""Names: declared once, imported when used, from the package, from entry points, or as `module:Class`."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import EntryPoint
from typing import Any

import pytest

from airground_drake import registry
from airground_drake.base.errors import PluginError, UnknownNameError
from airground_drake.intervention.policy import Policy
from airground_drake.registry import METHODS, MODEL_CLAIMS, POLICIES, ROUTES, RUN_CLAIMS, SAMPLERS, UAV_TASKS, Registry

ALL = (POLICIES, ROUTES, UAV_TASKS, SAMPLERS, RUN_CLAIMS, MODEL_CLAIMS)


@pytest.mark.parametrize("names", ALL, ids=lambda names: names.group)
def test_every_name_stands_for_a_class(names: Registry) -> None:
    for name in names.own:
        assert isinstance(names.load(name, of=object), type)


@pytest.mark.parametrize("names", ALL, ids=lambda names: names.group)
def test_what_a_name_stands_for_is_said_without_importing_it(names: Registry) -> None:
    for name in names.own:
        found = names.load(name, of=object)
        assert names.says(name) == (getattr(found, "summary", "") or (found.__doc__ or "").partition("\n")[0])


def test_what_cannot_be_found_says_nothing() -> None:
    lost = Registry("policy", "policies", {"a": "no_such.module:It", "b": "math:pi", "c": "json.decoder:NoSuchClass"})
    assert [lost.says(name) for name in lost.own] == ["", "", ""]


def test_a_policy_that_is_added_for_the_time_being() -> None:
    class Mine(Policy):
        def propose(self, seen: Any) -> None:
            return None

    with POLICIES.adding("mine", Mine):
        assert POLICIES.load("mine", of=Policy) is Mine
        assert "mine" in POLICIES
    assert "mine" not in POLICIES


@pytest.mark.parametrize(
    ("name", "error", "said"),
    [
        ("detuor", UnknownNameError, "unknown policy 'detuor'; allowed: detour, coordinate"),
        ("no_such_module:Thing", PluginError, "cannot be imported"),
        ("math:no_such_thing", PluginError, "cannot be imported"),
        ("math:pi", PluginError, "is not a subclass of airground_drake.intervention.policy.Policy"),
        ("..:x", UnknownNameError, "unknown policy"),
        ("", UnknownNameError, "unknown policy"),
    ],
)
def test_what_stands_for_nothing_is_named(name: str, error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said.replace("(", r"\(")):
        POLICIES.load(name, of=Policy)


@pytest.mark.parametrize(
    ("name", "parameters", "said"),
    [
        ("detour", {}, "missing a required argument: 'speed_m_s'; allowed: speed_m_s (needed), clearance_m, follow_s"),
        ("coordinate", {"max_sped": 3.0}, "got an unexpected keyword argument 'max_sped'; allowed: speed_m_s, clear"),
        ("detour", {"speed_m_s": -1.0}, "ValueError: detour needs speed_m_s > 0"),
    ],
)
def test_parameters_that_do_not_fit_are_told_with_those_that_do(
    name: str, parameters: dict[str, float], said: str
) -> None:
    with pytest.raises(PluginError) as caught:
        POLICIES.make(name, of=Policy, **parameters)
    assert said in str(caught.value)
    assert "TypeError" not in str(caught.value)


def test_entry_points_of_other_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    point = EntryPoint("orbit", "airground_drake.intervention.detour:Detour", POLICIES.group)
    monkeypatch.setattr(registry, "entry_points", lambda group: [point] if group == POLICIES.group else [])
    registry._entry_points.cache_clear()
    try:
        assert POLICIES.accepts("orbit")
        assert "orbit" in tuple(POLICIES)
        assert POLICIES.load("orbit", of=Policy).__name__ == "Detour"
        assert not ROUTES.accepts("orbit")
    finally:
        registry._entry_points.cache_clear()


def test_methods_say_what_the_paper_has() -> None:
    assert list(METHODS) == ["a", "b", "c", "d"]
    assert [m.id for m in METHODS.values() if m.gated] == ["c", "d"]
    assert [m.id for m in METHODS.values() if not m.intervention_on_top] == ["d"]


def test_looking_names_up_imports_nothing() -> None:
    program = "import sys, airground_drake.registry as r; assert 'detour' in r.POLICIES; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.split()
    assert not {"pydrake", "numpy", "numba", "pandas"} & set(loaded)
