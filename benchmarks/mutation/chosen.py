"""The mutants that matter: faults that once were real, or that would break a claim; every room of the core has some.

In chosen.txt each has a name, the place and the tests that notice it, and the edit: lines that go, and what comes.
"""

from collections.abc import Iterator
from pathlib import Path

from mutation.mutant import Mutant

TESTS: dict[str, tuple[str, ...]] = {
    "WIRING": (
        "tests/oracles/test_runs.py::test_a_run_among_walls_has_no_fault",
        "tests/oracles/test_runs.py::test_the_uavs_avoidance_and_contradicting_inequalities",
        "tests/sim/test_simulation.py::test_claims_do_not_depend_on_the_periods",
    ),
    "CROWD": ("tests/check/test_honest_runs.py::test_a_crowd",),
    "BODY": ("tests/sim/test_events.py", "tests/test_bodies.py"),
    "TRIGGER": (
        "tests/hypotheses/test_transitions.py",
        "tests/hypotheses/test_isolation.py",
        "tests/model/trigger",
        "tests/sim/blocks/test_decision.py",
    ),
    "ATTACKS": ("tests/hypotheses/test_patience_attacks.py",),
    "PLANNER": ("tests/uav",),
    "ROUTES": ("tests/ugv/test_relaxation.py", "tests/ugv/routes/test_contract.py"),
    "ASSOCIATED": ("tests/study/logs/test_association.py",),
    "FORMS": ("tests/study/logs/test_forms.py",),
}
"""Names in the place of tests that are often meant."""


def read(text: str) -> Iterator[Mutant]:
    """The mutants of a text like chosen.txt; what begins with # is about those that follow."""
    for part in text.split("\n\n"):
        name, place, *edit = part.splitlines() if not part.startswith("#") else ("", "")
        if not name:
            continue
        where, _, named = place.partition(": ")
        path, _, function = where.partition(" ")
        old, new = ("\n".join(line[1:] for line in edit if line[0] == sign) for sign in "-+")
        tests = tuple(test for each in named.split(", ") for test in TESTS.get(each, (each,)))
        yield Mutant(name, path, function, old, new, tests)


CHOSEN = (*read((Path(__file__).parent / "chosen.txt").read_text(encoding="utf-8")),)
