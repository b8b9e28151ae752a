"""SMT solvers in processes of their own, which can be killed: z3 and cvc5 on SMT-LIB 2 scripts.

    python -m airground_drake.verify.engines.smt z3 < scripts.json

reads a JSON list of scripts and prints a line of JSON for each as it is decided. `solve` runs that and enforces
the time limit from outside, because solvers do not always keep theirs.
"""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field
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
    results: list[Result] = []
    open_ones = [script for script in dict.fromkeys(scripts) if (solver, script) not in _DECIDED]
    while len(results) < len(open_ones):
        results += _attempt(open_ones[len(results) :], solver, limit_s)
    found = dict(zip(open_ones, results, strict=True))
    _DECIDED.update({(solver, script): each for script, each in found.items() if each.answer in ("sat", "unsat")})
    return [found.get(script) or _DECIDED[solver, script] for script in scripts]


def _attempt(scripts: Sequence[str], solver: Solver, limit_s: float) -> list[Result]:
    """Results up to the first script that has to be killed, at least one."""
    command = [sys.executable, "-m", "airground_drake.verify.engines.smt", solver]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        lines: queue.Queue[str] = queue.Queue()
        reader = threading.Thread(target=_forward, args=(process.stdout, lines), daemon=True)
        reader.start()
        try:
            process.stdin.write(json.dumps(list(scripts)))
            process.stdin.close()
        except BrokenPipeError:
            pass
        results: list[Result] = []
        try:
            while len(results) < len(scripts):
                line = lines.get(timeout=limit_s)
                if not line:
                    last = (process.stderr.read().strip().splitlines() or ["no message"])[-1]
                    results.append(Result("error", detail=f"{solver} ended: {last}"))
                    break
                results.append(Result(**json.loads(line)))
        except queue.Empty:
            results.append(Result("timeout", detail=f"{solver}: no answer in {limit_s:g} s"))
        finally:
            process.kill()
    return results


def _forward(stream: Any, lines: queue.Queue[str]) -> None:
    """Lines of a stream into a queue, then '' for its end."""
    for line in stream:
        lines.put(line)
    lines.put("")


def _z3(script: str) -> dict[str, Any]:
    import z3

    logic = next((line[11:-1] for line in script.splitlines() if line.startswith("(set-logic ")), "")
    solver = z3.SolverFor(logic) if logic else z3.Solver()
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
    """Answer the scripts on stdin one by one, for as long as somebody waits for the answers."""
    end_with_parent()
    decide = {"z3": _z3, "cvc5": _cvc5, "cvc5_proof": _cvc5_proof}[sys.argv[1]]
    for script in json.load(sys.stdin):
        try:
            answer = decide(script)
        except Exception as error:  # the solvers raise many kinds
            answer = {"answer": "error", "detail": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
