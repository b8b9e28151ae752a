"""A controller of the user's own for the UGVs: fed by name, checked, and judged by its steps."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydrake.systems.framework import LeafSystem
from pydrake.systems.primitives import ConstantVectorSource
from sim.blocks.both_programs import found

from airground_drake.base.errors import PluginError, ScenarioError, SimulationError
from airground_drake.model.bodies.world import World
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.scenario import plugins
from airground_drake.scenario.load import load, resolved
from airground_drake.sim.blocks import UgvController
from airground_drake.sim.diagram import build_diagram, make_monitor
from airground_drake.sim.simulation import simulate
from airground_drake.verify import judge, judge_model

SETTINGS = {"duration_s": 5.0}


class Straight(LeafSystem):
    """Straight ahead at the reference's velocity, whatever is in the way; tests change a part of it."""

    sizes = (3, 1, 3)  # of the outputs, for each UGV or in all

    def __init__(self, world: World, law: UgvLaw, **given: float) -> None:
        super().__init__()
        self.count, self.given = len(world.names("ugv")), given
        command, executing, gains = self.sizes
        self.reference = self.DeclareVectorInputPort("reference", 6 * self.count)
        self.DeclareStateOutputPort("command", self.DeclareDiscreteState(command * self.count))
        self.DeclareStateOutputPort("executing", self.DeclareDiscreteState([-1.0] * executing * self.count))
        self.DeclareVectorOutputPort("gains", gains, lambda context, output: output.SetFromVector([1.0] * gains))
        self.sample(law.avoidance.period)

    def sample(self, period_s: float) -> None:
        self.DeclarePeriodicDiscreteUpdateEvent(period_s, 0.0, self.update)

    def update(self, context: Any, discrete: Any) -> None:
        discrete.set_value(0, self.reference.Eval(context)[3 * self.count :])


class TwoOfThree(Straight):
    sizes = (2, 1, 3)


class Twice(Straight):
    def sample(self, period_s: float) -> None:
        super().sample(2.0 * period_s)


class Unsampled(Straight):
    def sample(self, period_s: float) -> None:
        pass


class Filtered(Straight):
    def sample(self, period_s: float) -> None:
        super().sample(period_s)
        self.DeclareContinuousState(1)

    def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
        derivatives.SetFromVector([0.0])


class Unfed(Straight):
    def sample(self, period_s: float) -> None:
        super().sample(period_s)
        self.DeclareVectorInputPort("lidar", 1)


class Narrow(Straight):
    def sample(self, period_s: float) -> None:
        super().sample(period_s)
        self.DeclareVectorInputPort("bodies", 3 * self.count)


class AtOnce(LeafSystem):
    def __init__(self, world: World, law: UgvLaw) -> None:
        super().__init__()
        n = len(world.names("ugv"))
        self.DeclareVectorInputPort("bodies", 3 * len(world.moving))
        for name, size in (("command", 3 * n), ("executing", n), ("gains", 3)):
            self.DeclareVectorOutputPort(name, size, lambda context, output: None)
        self.DeclareDiscreteState(1)
        self.DeclarePeriodicDiscreteUpdateEvent(law.avoidance.period, 0.0, lambda context, discrete: None)


class Raises(Straight):
    def update(self, context: Any, discrete: Any) -> None:
        if context.get_time() > 0.5:
            raise ZeroDivisionError("no gain")


class Nowhere(Straight):
    def update(self, context: Any, discrete: Any) -> None:
        discrete.set_value(0, np.full(3 * self.count, np.nan))


class Half(Straight):
    def update(self, context: Any, discrete: Any) -> None:
        discrete.set_value(1, np.full(self.count, 0.5))


class Made(Straight):
    def update(self, context: Any, discrete: Any) -> None:
        discrete.set_value(1, np.full(self.count, 5.0 * (context.get_time() > 1.0)) - 1.0)


class NoMap(Straight):
    def __init__(self, world: World, law: UgvLaw) -> None:
        raise FileNotFoundError("no map")


def test_the_packages_own_as_a_users_makes_the_same_run_but_no_claim_is_made_about_a_law() -> None:
    scenario = load("minimal", SETTINGS)
    usual, own = simulate(scenario, "d"), simulate(scenario, "d", ugv_controller=UgvController, engine="batch")
    for table in ("states", "samples", "decisions", "proposals", "messages"):
        assert getattr(own, table).equals(getattr(usual, table)), table
    kind = "airground_drake.sim.blocks.controllers:UgvController"
    assert own.meta["controllers"]["ugv_controller"] == {"class": kind, "sampling_s": [0.025, 0.0]}
    assert own.scenario.ugv_controller is not None
    verdicts = {verdict.claim.id: verdict for verdict in judge(own)}
    assert {verdicts[claim].status for claim in ("SAFE-TRACE", "SAFE-HYP")} == {"holds"}
    for claim in ("GATE-PLAN", "LIVE-HYP"):
        assert (verdicts[claim].status, verdicts[claim].as_expected) == ("not_run", True)
        assert kind in verdicts[claim].evidence["reason"]
    assert "not by what it was built with" in verdicts["SAFE-HYP"].evidence["own_controller"]
    about = {verdict.claim.id: verdict for verdict in judge_model(own.scenario, claims=["SAFE-GATE", "SAFE-INV"])}
    assert about["SAFE-GATE"].status == "not_run"
    assert about["SAFE-INV"].status == "proved"
    assert set(found(usual, "GATE-PLAN", "LIVE-HYP").values()) == {"holds"}


def test_steps_that_miss_the_inequalities_are_found() -> None:
    trace = simulate(load("swap"), "a", ugv_controller=Straight)
    assert found(trace, "SAFE-TRACE", "SAFE-HYP") == {"SAFE-TRACE": "refuted", "SAFE-HYP": "refuted"}


def test_a_class_that_the_scenario_does_not_name_does_not_pass_for_a_controller() -> None:
    usual = simulate(load("minimal", SETTINGS), "d")
    own = usual.meta["controllers"] | {"ugv_controller": {"class": "m:C", "sampling_s": [0.025, 0.0]}}
    forged = replace(usual, meta=usual.meta | {"controllers": own})
    assert found(forged, "SAFE-HYP", "LIVE-HYP") == {"SAFE-HYP": "error", "LIVE-HYP": "holds"}


@pytest.mark.parametrize(
    ("make", "error", "said"),
    [
        (TwoOfThree, PluginError, r"output ports of sizes .*'command': 2.*must include \{'command': 3, 'executing': 1"),
        (Twice, PluginError, r"updated every 0.05 s from 0 s; allowed: .* every 0.025 s from t = 0"),
        (Unsampled, PluginError, "no discrete update of a single period"),
        (Filtered, PluginError, "has continuous or abstract state; allowed: discrete state"),
        (Unfed, PluginError, r"has an input port 'lidar'; allowed: answers, bodies, .*, reference"),
        (AtOnce, PluginError, "output port command that depends on its inputs at once"),
        (Narrow, PluginError, r"port bodies of System ugv_controller \(size 3\) to .* \(size 6\)$"),
        (
            f"{__name__}:NoMap",
            PluginError,
            r"^controller '\S*NoMap': test_\w+\.py:\d+ FileNotFoundError: no map$",
        ),
        (lambda world: 3, PluginError, r"': got an unexpected keyword argument 'law'; allowed: world \(needed\)$"),
        (lambda world, law: 3, PluginError, "is made by a function that returns 3; allowed: a Drake System"),
        (lambda world, law: ConstantVectorSource([0.0]), PluginError, "output ports of sizes {'y0': 1}"),
        (3, PluginError, "ugv_controller is 3; allowed: a subclass of Drake's System, or a function"),
        (int, PluginError, "ugv_controller is <class 'int'>; allowed"),
        (Raises, SimulationError, r"t = 0\.\d+ s: test_own_controller\.py:\d+ ZeroDivisionError: .*Raises of the UGVs"),
        (Nowhere, SimulationError, r"Nowhere' has \[nan, nan, nan\] at command; allowed: finite numbers"),
        (Half, SimulationError, r"Half' has \[0\.5\] at executing; allowed: numbers of proposals, -1 for none"),
        (Made, PluginError, r"Made' says that ugv1 executes 4 at t = 1\.025 s; allowed: .* that have arrived"),
    ],
)
def test_a_controller_that_fails_says_which_and_why(make: Any, error: type[Exception], said: str) -> None:
    by_name = {"ugv_controller": {"kind": make}} if isinstance(make, str) else {}
    with pytest.raises(error, match=said):
        simulate(load("minimal", SETTINGS | by_name), "d", ugv_controller=None if by_name else make)


def test_unicycles_need_the_share_of_each_command() -> None:
    with pytest.raises(PluginError, match=r"must include .*'command_share': "):
        build_diagram(load("case_a_unicycle"), "d", ugv_controller=Straight)


def test_a_class_in_a_scenario_needs_leave_and_takes_numbers(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(f"from {__name__} import Straight\nclass Mine(Straight):\n    pass\n")
    given = {"ugv_controller": {"kind": "mine.py:Mine", "parameters": {"eye": 2.0}}}
    scenario, source = load("minimal", {**SETTINGS, **given}), str(tmp_path / "mine.yaml")
    Path(source).write_text("")
    with pytest.raises(ScenarioError, match=r"ugv_controller\.kind: 'mine\.py:Mine'.*--allow-plugins"):
        plugins.refuse(scenario, source)
    with plugins.admitted(scenario, source, allow=True):
        trace = simulate(scenario, "a")
        assert [*plugins.digests(scenario)] == ["mine.py:Mine"]
    assert trace.meta["controllers"]["ugv_controller"]["class"] == "mine.py:Mine"
    build_diagram(plugins.without(scenario))  # imports nothing
    with pytest.raises(PluginError, match=r"mine\.py:Mine' has no law that is known here"):
        make_monitor(scenario)


def test_without_the_key_a_scenario_is_written_and_digested_as_before() -> None:
    scenario = load("minimal")
    assert "ugv_controller" not in resolved(scenario)
    other = load("minimal", {"ugv_controller": {"kind": "m:C"}})
    assert resolved(other)["ugv_controller"] == {"kind": "m:C", "parameters": {}}
    assert other.digest != scenario.digest
