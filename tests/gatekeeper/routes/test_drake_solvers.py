"""Other solvers for the program with binaries: refused where they are not, and the way to them through Drake."""

from __future__ import annotations

from typing import Any

import pytest
from builders.problems import INSTANCES, random_problem
from gatekeeper.contract import check_contract
from pydrake.solvers import ClarabelSolver, MixedIntegerBranchAndBound, SolutionResult

from airground_drake.base.errors import ScenarioError
from airground_drake.gatekeeper import drake_solvers
from airground_drake.gatekeeper.binary_program import BinaryProgram
from airground_drake.gatekeeper.daqp_solver import minimise
from airground_drake.gatekeeper.drake_solvers import SOLVERS, DrakeSearch, lacking
from airground_drake.gatekeeper.relaxation import normals_along
from airground_drake.gatekeeper.routes.mixed_integer import MixedIntegerRoute
from airground_drake.gatekeeper.solution import ConstantPlans
from airground_drake.report.__main__ import main as report
from airground_drake.run.simulation import simulate
from airground_drake.scenarios.load import load

NAMES = ("random 24x2", "rolled out 1", "a point at the robot", "identical modes", "random 1x1")


class BranchAndBound:
    """Drake's own branch and bound with Clarabel, in the shape of a solver of Drake; it stops at a gap of 1 %."""

    there, licensed = True, True

    def available(self) -> bool:
        return self.there

    def enabled(self) -> bool:
        return self.licensed

    def solver_id(self) -> Any:
        return ClarabelSolver.id()

    @staticmethod
    def AcquireLicense() -> object:
        return object()

    def Solve(self, program: Any, guess: None, options: Any) -> Any:
        del guess, options
        self.search = MixedIntegerBranchAndBound(program, ClarabelSolver.id())
        self.ended = self.search.Solve()
        return self

    def is_success(self) -> bool:
        return self.ended == SolutionResult.kSolutionFound

    def GetSolution(self, variables: Any) -> Any:
        return self.search.GetSolution(variables)


@pytest.fixture
def gurobi(monkeypatch: pytest.MonkeyPatch) -> type[BranchAndBound]:
    """What goes by this name is Drake's own branch and bound."""
    stand_in = type("StandIn", (BranchAndBound,), {})
    monkeypatch.setitem(drake_solvers.SOLVERS, "gurobi", stand_in)
    return stand_in


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.usefixtures("gurobi")
def test_a_solver_of_drake_takes_the_program_as_it_is(seed: int) -> None:
    problem, binary = random_problem(seed, 12, 1 + seed % 3), BinaryProgram(12, 12)
    normals = normals_along(problem, ConstantPlans.of(problem).better.positions)
    binary.update(problem, normals)
    cost = []
    for found in (minimise(binary), DrakeSearch("gurobi").minimise(binary)):
        assert found.omega is not None
        assert set(found.omega) <= {0.0, 1.0}
        cost.append(problem.evaluate_half_planes(problem.positions(binary.plan(found.omega)), normals))
    assert cost[0] * (1.0 - 1e-9) <= cost[1] <= 1.011 * cost[0] + 0.011


@pytest.mark.usefixtures("gurobi")
def test_its_optimum_is_that_of_the_route() -> None:
    found, ours = (check_contract(MixedIntegerRoute(solver=name), random_problem(0, 12)) for name in ("gurobi", "daqp"))
    assert (found.status, found.objective) == ("optimal", ours.objective)
    assert found.route_bound == pytest.approx(ours.route_bound, rel=1e-9)


def test_a_solver_that_fails_leaves_the_incumbent(
    gurobi: type[BranchAndBound], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gurobi, "is_success", lambda _: False)
    problem = INSTANCES["rolled out 1"]
    solution = check_contract(MixedIntegerRoute(blocks=6, solver="gurobi"), problem)
    assert solution.status == "solver_failed"


@pytest.mark.parametrize(
    ("there", "licensed", "why"), [(False, False, "this build of Drake does not have it"), (True, False, "no licence")]
)
def test_a_solver_that_is_not_here_is_refused(
    *, there: bool, licensed: bool, why: str, gurobi: type[BranchAndBound], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gurobi, "there", there)
    monkeypatch.setattr(gurobi, "licensed", licensed)
    scenario = load("case_b", {"gatekeeper.solver": "gurobi"})[0]  # the file itself is good, and so are its reports
    with pytest.raises(ScenarioError, match=f"case_b: gatekeeper.solver: 'gurobi' is not allowed; .*{why}") as caught:
        simulate(scenario, "c")
    assert "allowed here: daqp" in str(caught.value)
    with pytest.raises(ValueError, match=why):
        MixedIntegerRoute(solver="gurobi")


@pytest.mark.parametrize("name", SOLVERS)
def test_a_report_says_so_in_one_line(name: str, tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    if not lacking(name):
        pytest.skip(f"{name} can be used here")
    settings = [f"gatekeeper.solver={name}", "runs={c: {method: c}}", "reproduction=[]", "duration_s=1"]
    assert report(["case_b", "-q", "-o", str(tmp_path / "r"), *(w for s in settings for w in ("--set", s))]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"gatekeeper.solver: '{name}' is not allowed; {lacking(name)}; allowed here: daqp" in line


@pytest.mark.parametrize("name", SOLVERS)
@pytest.mark.parametrize("instance", NAMES)
def test_where_it_is_it_finds_the_optimum(name: str, instance: str) -> None:
    if why := lacking(name):
        pytest.skip(f"{name}: {why}")
    found, ours = (check_contract(MixedIntegerRoute(solver=each), INSTANCES[instance]) for each in (name, "daqp"))
    assert found.status == "optimal"
    assert found.objective == pytest.approx(ours.objective, rel=1e-6)
