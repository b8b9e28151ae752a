"""Names: declared once, imported when used, from the package, from entry points, or as `module:Class`."""

import subprocess
import sys
from importlib.metadata import EntryPoint
from typing import Any

import pytest

from airground_drake.base import registry
from airground_drake.base.errors import PluginError, UnknownNameError
from airground_drake.base.registry import MODEL_CLAIMS, POLICIES, ROUTES, RUN_CLAIMS, SAMPLERS, UAV_TASKS, Registry
from airground_drake.uav.policy import Policy


@pytest.mark.parametrize(
    "names", [POLICIES, ROUTES, UAV_TASKS, SAMPLERS, RUN_CLAIMS, MODEL_CLAIMS], ids=lambda names: names.group
)
def test_every_name_stands_for_a_class_and_what_it_is_can_be_said_without_an_import(names: Registry) -> None:
    for name in names.own:
        found = names.load(name, of=object)
        assert isinstance(found, type)
        assert names.says(name) == (getattr(found, "summary", "") or (found.__doc__ or "").partition("\n")[0])


def test_a_lost_class_says_nothing() -> None:
    lost = Registry("policy", "policies", {"a": "no_such.module:It", "b": "math:pi", "c": "json.decoder:NoSuchClass"})
    assert [lost.says(name) for name in lost.own] == ["", "", ""]


@pytest.mark.parametrize(
    ("name", "parameters", "error", "said"),
    [
        ("detuor", {}, UnknownNameError, "unknown policy 'detuor'; allowed: detour, coordinate"),
        ("..:x", {}, UnknownNameError, "unknown policy"),
        ("", {}, UnknownNameError, "unknown policy"),
        ("no_such_module:Thing", {}, PluginError, "cannot be imported"),
        ("math:no_such_thing", {}, PluginError, "cannot be imported"),
        ("math:pi", {}, PluginError, "is not a subclass of airground_drake.uav.policy.Policy"),
        ("detour", {}, PluginError, "missing a required argument: 'speed_m_s'; allowed: speed_m_s (needed), clearance"),
        ("detour", {"speed_m_s": -1.0}, PluginError, "ValueError: detour needs speed_m_s > 0"),
        ("detour", {"speed_m_s": 1.0, "follow_s": 601.0}, PluginError, "follow_s from 0 to 600"),
        ("coordinate", {"max_sped": 3.0}, PluginError, "an unexpected keyword argument 'max_sped'; allowed: speed_m_s"),
    ],
)
def test_a_name_or_parameters_that_do_not_fit_are_told_with_those_that_do(
    name: str, parameters: dict[str, float], error: type[Exception], said: str
) -> None:
    with pytest.raises(error) as caught:
        POLICIES.make(name, of=Policy, **parameters)
    assert said in str(caught.value)
    assert "TypeError" not in str(caught.value)


def test_classes_of_entry_points_and_classes_that_are_added_in_a_block() -> None:
    point = EntryPoint("orbit", "airground_drake.uav.detour:Detour", POLICIES.group)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(registry, "entry_points", lambda group: [point] if group == POLICIES.group else [])
        registry._entry_points.cache_clear()
        assert "orbit" in tuple(POLICIES)
        assert POLICIES.load("orbit", of=Policy).__name__ == "Detour"
        assert (POLICIES.accepts("orbit"), ROUTES.accepts("orbit")) == (True, False)
    registry._entry_points.cache_clear()

    class Mine(Policy):
        def propose(self, seen: Any) -> None:
            return None

    with POLICIES.adding("mine", Mine):
        assert POLICIES.load("mine", of=Policy) is Mine
    assert "mine" not in POLICIES


def test_looking_names_up_imports_nothing() -> None:
    program = "import sys, airground_drake.base.registry as r; assert 'detour' in r.POLICIES; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.split()
    assert not {"pydrake", "numpy", "numba", "pandas"} & set(loaded)
