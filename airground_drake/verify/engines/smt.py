"""SMT solvers in processes of their own, which can be killed: z3 and cvc5 on SMT-LIB 2 scripts.

    python -m airground_drake.verify.engines.smt z3 < scripts

says that it is ready, reads a script a line, as a JSON text, and prints a line of JSON for each. `solve` keeps such a
process for the next scripts and enforces the time limit from outside, because solvers do not always keep theirs.
Nothing of one script is left for the next: each has a context of its own.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib import import_module
from select import select
from typing import Any, Literal

from airground_drake.interruption import end_with_parent

Solver = Literal["z3", "cvc5", "cvc5_proof"]
Answer = Literal["sat", "unsat", "unknown", "timeout", "error"]


@dataclass(frozen=True)
class Result:
    """What a solver said of a script.

    Attributes:
        answer: 'unknown', 'timeout' and 'error' decide nothing.
        model: for 'sat' (z3 only), values by name: rationals as 'p/q'; an irrational one ends in '?'.
        detail: why nothing was decided.
        proof: for 'unsat' (cvc5_proof only), cvc5's proof in its calculus CPC.
    """

    answer: Answer
    model: dict[str, str] = field(default_factory=dict)
    detail: str = ""
    proof: str = ""


_DECIDED: dict[tuple[Solver, str], Result] = {}
"""What a solver has said of a script: all that its answer depends on is in the script."""


def solve(scripts: Sequence[str], solver: Solver = "z3", limit_s: float = 20.0) -> list[Result]:
    """Run a solver on each script; one that it has decided in this process is not asked again.

    Args:
        scripts: SMT-LIB 2 texts, each with one `(check-sat)`; logic HORN asks z3's Spacer.
        solver: which one.
        limit_s: wall-clock time for each script, s; the process is killed when it is over.

    Returns:
        One result per script, in order; never raises for what a solver does.
    """
    found: dict[str, Result] = {}
    for script in dict.fromkeys(scripts):
        if (solver, script) not in _DECIDED:
            found[script] = _ask(solver, script, limit_s)
    _DECIDED.update({(solver, script): each for script, each in found.items() if each.answer in ("sat", "unsat")})
    return [found.get(script) or _DECIDED[solver, script] for script in scripts]


START_S = 60.0
"""A process that has not loaded its solver by then, s, is asked all the same."""
_Process = subprocess.Popen[bytes]
_idle: dict[tuple[int, Solver], _Process] = {}
"""A solver's process that waits for a script, by the process that has started it: forked ones have their own."""


def _ask(solver: Solver, script: str, limit_s: float) -> Result:
    """What a solver says of a script; a process that has not answered in time, or has ended, is done with."""
    key = os.getpid(), solver
    process = _idle.pop(key, None)
    if process is None or process.poll() is not None:
        process = _started(solver)
        _line(process, b"", START_S)  # when it has loaded the solver
    line = _line(process, json.dumps(script).encode() + b"\n", limit_s)
    if line is not None and line.endswith(b"\n"):
        if _idle.setdefault(key, process) is not process:  # another thread's
            _end(process)
        return Result(**json.loads(line))
    if line is None:
        _end(process)
        return Result("timeout", detail=f"{solver}: no answer in {limit_s:g} s")
    last = (_end(process).decode(errors="replace").strip().splitlines() or ["no message"])[-1]
    return Result("error", detail=f"{solver} ended: {last}")


def _started(solver: Solver) -> _Process:
    pipe = subprocess.PIPE
    command = [sys.executable, "-P", "-m", "airground_drake.verify.engines.smt", solver]
    return subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, bufsize=0)


def _line(process: _Process, script: bytes, limit_s: float) -> bytes | None:
    """The next line that a process says, to a script if one is sent.

    What there was of it if the process has ended; None if time is over.
    """
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        rest = memoryview(script)
        while rest:
            rest = rest[process.stdin.write(rest) :]
    except BrokenPipeError:
        return b""
    line = b""
    end = time.monotonic() + limit_s
    while not line.endswith(b"\n"):
        if not select([process.stdout], [], [], max(0.0, end - time.monotonic()))[0]:
            return None
        if not (part := process.stdout.read(1 << 16)):
            return line
        line += part
    return line


def _end(process: _Process) -> bytes:
    """Kill a process; its last words."""
    process.kill()
    return process.communicate()[1]


def _z3(script: str) -> dict[str, Any]:
    import z3

    logic = next((line[11:-1] for line in script.splitlines() if line.startswith("(set-logic ")), "")
    context = z3.Context()
    solver = z3.SolverFor(logic, context) if logic else z3.Solver(ctx=context)
    solver.from_string(script)
    answer = str(solver.check())
    if answer == "unknown":
        return {"answer": answer, "detail": f"z3: {solver.reason_unknown()}"}
    if answer != "sat" or logic == "HORN":
        return {"answer": answer}
    model = solver.model()
    return {"answer": answer, "model": {d.name(): _value(model[d]) for d in model.decls() if d.arity() == 0}}


def _value(value: Any) -> str:
    """A rational as 'p/q', anything else as z3 prints it."""
    import z3

    if z3.is_rational_value(value):
        return str(value.as_fraction())
    return str(value.approx(20).as_fraction()) + "?" if z3.is_algebraic_value(value) else str(value)


PROOF_OPTIONS = {
    "produce-proofs": "true",
    "proof-granularity": "dsl-rewrite",
    "nl-cov": "false",
    "nl-ext": "full",
    "nl-ext-tplanes": "true",
    "rlimit-per": "200000",
}
"""Of cvc5 where a proof is wanted: rewriting in steps, no coverings (they have no rule), and a limit by a count, so
that it does not depend on the machine what is proved."""


def _cvc5(script: str) -> dict[str, Any]:
    return _by_cvc5(script, {})


def _cvc5_proof(script: str) -> dict[str, Any]:
    return _by_cvc5(script, PROOF_OPTIONS)


def _by_cvc5(script: str, options: dict[str, str]) -> dict[str, Any]:
    import cvc5

    solver = cvc5.Solver(cvc5.TermManager())
    for name, value in options.items():
        solver.setOption(name, value)
    parser = cvc5.InputParser(solver)
    parser.setStringInput(cvc5.InputLanguage.SMT_LIB_2_6, script, "script")
    manager = parser.getSymbolManager()
    said = ""
    while not (command := parser.nextCommand()).isNull():
        said += str(command.invoke(solver, manager))
    answer = said.strip().splitlines()[-1] if said.strip() else ""
    if answer == "unsat" and options:
        proof = "".join(_text(solver.proofToString(part, cvc5.ProofFormat.CPC)) for part in solver.getProof())
        return {"answer": answer, "proof": proof}
    if answer in ("sat", "unsat"):
        return {"answer": answer}
    return {"answer": "unknown", "detail": f"cvc5: {said.strip()[:200]}"}


def _text(value: str | bytes) -> str:
    return value if isinstance(value, str) else value.decode()


def main() -> None:
    """Answer the scripts on stdin, for as long as somebody may ask."""
    end_with_parent()
    decide = {"z3": _z3, "cvc5": _cvc5, "cvc5_proof": _cvc5_proof}[sys.argv[1]]
    import_module("z3" if decide is _z3 else "cvc5")
    print("ready", flush=True)
    for line in sys.stdin:
        try:
            answer = decide(json.loads(line))
        except Exception as error:  # the solvers raise many kinds
            answer = {"answer": "error", "detail": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
