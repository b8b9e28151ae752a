"""Solvers in processes of their own."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import partial
from typing import Any

import pytest
from verify.engines.cases import STEP

from airground_drake.side_by_side import side_by_side
from airground_drake.verify.engines import smt
from airground_drake.verify.engines.smt import solve


def test_a_solver_that_hangs_is_killed_and_the_next_script_still_runs() -> None:
    hard = "(set-logic QF_NRA)\n" + "".join(f"(declare-const x{i} Real)\n" for i in range(12))
    hard += "".join(f"(assert (= (+ (* x{i} x{i} x{i}) (* x{i + 1} x{i + 2})) {i + 1}.5))\n" for i in range(10))
    hard += "(assert (> (* x0 x1 x2 x3 x4 x5 x6 x7 x8 x9) 1000.0))\n(check-sat)\n"
    first, second = solve([hard, STEP.smt2()], "z3", limit_s=0.5)
    assert first.answer in ("timeout", "unknown", "sat")
    assert second.answer == "unsat"


@pytest.mark.parametrize("solver", ["z3", "cvc5"])
def test_a_script_that_cannot_be_read_decides_nothing(solver: Any) -> None:
    broken, good = solve(["(set-logic QF_NRA)\n(assert (> x 0.0))\n(check-sat)\n", STEP.smt2()], solver)
    assert broken.answer == "error"
    assert good.answer == "unsat"


def test_spacer_finds_an_invariant() -> None:
    rule = "(assert (forall ((x Int) (y Int)) (=> (and (inv x) (= y (+ x 1)) (< x 10)) (inv y))))\n"
    head = "(set-logic HORN)\n(declare-fun inv (Int) Bool)\n(assert (forall ((x Int)) (=> (= x 0) (inv x))))\n"
    bad = "(assert (forall ((x Int)) (=> (and (inv x) (> x {})) false)))\n(check-sat)\n"
    assert [r.answer for r in solve([head + rule + bad.format(10), head + rule + bad.format(9)])] == ["sat", "unsat"]


def test_the_solvers_processes_load_no_drake() -> None:
    code = (
        "import sys, airground_drake.verify.engines.smt; print(any(name.startswith('pydrake') for name in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"


def test_a_solvers_process_is_kept_and_replaced_when_it_has_ended() -> None:
    key = os.getpid(), "z3"
    script = STEP.smt2() + "; {}\n"
    assert solve([script.format(1)])[0].answer == "unsat"
    kept = smt._idle[key]
    assert solve([script.format(2)])[0].answer == "unsat"
    assert smt._idle[key] is kept
    kept.kill()
    kept.wait()
    assert solve([script.format(3)])[0].answer == "unsat"
    assert smt._idle[key] is not kept


def test_no_script_leaves_anything_to_the_next() -> None:
    declared = "(set-logic QF_NRA)\n(declare-const {} Real)\n(assert (> {} 1.0))\n(check-sat)\n"
    again = "(set-logic QF_NRA)\n(declare-const {} Real)\n(assert (< {} 1.0))\n(check-sat)\n"
    unknown = "(set-logic QF_NRA)\n(assert (> left 1.0))\n(check-sat)\n"
    for solver in ("z3", "cvc5"):
        found = solve([declared.format("left", "left"), again.format("left", "left"), unknown], solver)
        assert [each.answer for each in found] == ["sat", "sat", "error"]


def test_a_forked_process_asks_a_solver_of_its_own() -> None:
    script = STEP.smt2() + "; forked {}\n"
    assert solve([script.format(0)])[0].answer == "unsat"
    own = smt._idle[os.getpid(), "z3"]

    def ask(k: int) -> tuple[str, int]:
        answer = solve([script.format(k)])[0].answer
        return answer, smt._idle[os.getpid(), "z3"].pid

    found = side_by_side([partial(ask, 1), partial(ask, 2)], jobs=2)
    assert [answer for answer, _ in found] == ["unsat", "unsat"]
    assert own.pid not in {pid for _, pid in found}
    assert own.poll() is None
