"""Mutants of what judges: claims about runs, engines and proofs (`verify`), the independent checker (`check`).

On honest runs a claim or a rule that demands less says the same. It is caught by a run that must be refuted and on
which the other side still refutes it, by tampered reports, or by the tests' broken traces; where there is no such run,
none is made.
"""

from __future__ import annotations

from mutation.mutant import Mutant

RUNS = "tests/verify/runs"
BOTH = ("case_b d", "soft_gate c", "crowd b")
"""Honest runs, of which the last two refute SAFE-TRACE and SAFE-HYP."""

CLAIMS = (
    Mutant(
        "GATE-OPT allows 50 %",
        "verify/runs/gate_opt.py",
        "largest_gap = 0.05",
        "largest_gap = 0.5",
        runs=(),
        tests=(f"{RUNS}/test_gate_opt.py",),
    ),
    Mutant(
        "SAFE-TRACE allows 5 cm",
        "verify/runs/safe_trace.py",
        ">= -DISTANCE_TOLERANCE_M",
        ">= -0.05",
        runs=BOTH,
        tests=(f"{RUNS}/test_safe_trace.py",),
    ),
    Mutant(
        "SAFE-TRACE forgets the UAV",
        "verify/runs/pairs.py",
        "combinations(trace.robots, 2)",
        "combinations(trace.ugvs, 2)",
        runs=BOTH,
        tests=(f"{RUNS}/test_safe_trace.py",),
    ),
    Mutant(
        "claims forget radii",
        "verify/runs/pairs.py",
        "{name: body.radius_m for name",
        "{name: 0.0 * body.radius_m for name",
        runs=("bodies d",),
    ),
    Mutant(
        "SAFE-TRACE looks at the ends of segments only",
        "verify/engines/geometry.py",
        "fraction = np.clip(np.divide(along",
        "fraction = np.round(np.divide(along",
        runs=BOTH,
        tests=(f"{RUNS}/test_safe_trace.py", "tests/verify/engines/test_geometry.py"),
    ),
    Mutant(
        "ZENO-TRACE allows half the dwell",
        "verify/runs/zeno_trace.py",
        "held = gap >= bound - TIME_TOLERANCE_S",
        "held = gap >= 0.5 * bound",
        runs=BOTH,
        tests=(f"{RUNS}/test_zeno_trace.py", f"{RUNS}/test_tolerances.py"),
    ),
    Mutant(
        "THR-TRIG allows 0.1 s",
        "verify/runs/thr_trig.py",
        "EVENT_TOLERANCE_S = 1e-5",
        "EVENT_TOLERANCE_S = 0.1",
        runs=BOTH,
        tests=(f"{RUNS}/test_thr_trig.py", f"{RUNS}/test_tolerances.py"),
    ),
    Mutant(
        "THR-TRIG ignores the mode",
        "verify/runs/thr_trig.py",
        "wrong = (mode != sides[0]) & (mode != sides[1])",
        "wrong = (mode != sides[0]) & (mode != sides[1]) & False",
        runs=BOTH,
        tests=(f"{RUNS}/test_thr_trig.py",),
    ),
    Mutant(
        "THR-TRIG overlooks dips",
        "verify/engines/geometry.py",
        "knots = np.union1d(t, _minima(t, parts))",
        "knots = np.union1d(t, t)",
        runs=("crowd d",),
        tests=(f"{RUNS}/test_thr_trig.py", "tests/verify/engines/test_geometry.py"),
    ),
    Mutant(
        "SAFE-HYP gives every robot the whole share",
        "verify/engines/shortfalls.py",
        "max(part * bound - ",
        "max(bound - ",
        runs=BOTH,
        tests=("tests/verify/engines/test_shortfalls.py",),
    ),
    Mutant(
        "SAFE-HYP does not judge the hold",
        "verify/runs/safe_hyp.py",
        "t, 0.0 - off, DISTANCE_TOLERANCE_M, about)",
        "t, 0.0 * off, DISTANCE_TOLERANCE_M, about)",
        runs=BOTH,
        tests=(f"{RUNS}/test_safe_hyp.py",),
    ),
    Mutant(
        "EXEC allows 0.1 m/s",
        "verify/runs/exec.py",
        "COMMAND_TOLERANCE_M_S = 1e-6",
        "COMMAND_TOLERANCE_M_S = 0.1",
        runs=BOTH,
        tests=(f"{RUNS}/test_exec.py",),
    ),
    Mutant(
        "EXEC believes the signal",
        "verify/runs/exec.py",
        "| (one.executing != one.said)",
        "| (one.executing != one.executing)",
        runs=BOTH,
        tests=(f"{RUNS}/test_exec.py",),
    ),
    Mutant(
        "EXEC counts refusals as acceptance",
        "verify/runs/proposals.py",
        "if own is None or not own.accepted:",
        "if own is None:",
        tests=(f"{RUNS}/test_exec.py",),
    ),
    Mutant(
        "GATE-MODEL allows 0.1 m/s",
        "verify/runs/gate_model.py",
        "VELOCITY_TOLERANCE_M_S = 1e-6",
        "VELOCITY_TOLERANCE_M_S = 0.1",
        runs=BOTH,
        tests=(f"{RUNS}/test_gate_model.py",),
    ),
    Mutant(
        "half a run is enough",
        "verify/claim.py",
        "            if finding.status in PASSING:\n",
        "            if False:\n",
        runs=(),
        tests=("tests/verify/test_claim.py",),
    ),
    Mutant(
        "rows need not follow their commands",
        "verify/claim.py",
        "MOTION_TOLERANCE_M = 1e-9",
        "MOTION_TOLERANCE_M = 1e9",
        runs=(),
        tests=("tests/verify/test_claim.py",),
    ),
)

CHECKER = (
    Mutant(
        "checker: no radii",
        "check/scenario.py",
        '(float(one["radius_m"]) + float(other["radius_m"]))',
        '0.0 * (float(one["radius_m"]) + float(other["radius_m"]))',
        runs=("bodies d",),
    ),
    Mutant(
        "checker: events within 0.1 s",
        "check/triggers.py",
        "EVENT_S = 1e-5",
        "EVENT_S = 0.1",
        runs=BOTH,
        tamperings=("THR-TRIG", "ZENO-TRACE"),
    ),
    Mutant(
        "checker: dips are overlooked",
        "check/triggers.py",
        "inside = (u > 0.0) & (u < 1.0)",
        "inside = (u > 2.0) & (u < 1.0)",
        runs=("crowd d",),
        tamperings=("THR-TRIG",),
        tests=("tests/check/test_triggers.py",),
    ),
    Mutant(
        "checker: digests are not compared",
        "check/run.py",
        'same("SHA-256 of a table", meta["files"][file], sha256(content), about=file)',
        "pass",
        runs=(),
        tamperings=("trace",),
    ),
    Mutant(
        "checker: commands need not lead anywhere",
        "check/run.py",
        'close("law of motion", run.position_m[robot][1:], led, within=SMALL,',
        'close("law of motion", run.position_m[robot][1:], led, within=1e9,',
        runs=(),
        tamperings=("trace",),
    ),
)
