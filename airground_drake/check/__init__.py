"""An independent check of a report: `python -m airground_drake.check DIR`.

Every verdict in DIR/report.json is established again from DIR/trace/ and the scenario, by formulas that are
written here from the statements of the claims. Only the standard library, numpy,
pandas and pyarrow are used: no Drake, no solver, nothing else of this package. docs/checker.md says what each rule
establishes.

    files, limits              strict reading; sizes and times beyond which nothing is looked at
    rules, scenario            what a broken rule says; what a scenario declares
    run, nearness              a trace that is of its run and obeys its law of motion; what comes near at all in it
    events, metrics            what follows from a trace
    safety                     SAFE-TRACE, SAFE-HYP
    law, proposals, execution  EXEC: the control law, what was accepted when, commands
    triggers                   ZENO-TRACE, THR-TRIG
    outcome                    LIVE-GOAL, COMM
    decisions                  a recorded decision, its problem (26), predictions (23) and costs (25)
    feasibility                GATE-FEAS
    rollouts, foresight        GATE-MODEL under method (d): what comes of accepting and refusing
    prediction                 GATE-MODEL: mode velocities
    progress                   LIVE-PROG
    optimality                 GATE-OPT
    theorems                   hypotheses of SAFE-LEMMA, SAFE-INV, SAFE-GATE, SAFE-DIST, ZENO-PROOF, LIVE-WAIT, THR-ISO,
                               THR-ROOT and THR-OPT
    statistics                 THR-DDM, ZENO-REFINE
    inputs                     the constants that a claim about the model must be about
    evidence                   what of a claim's entry is established, and what is taken as recorded
    claims, verdict            what decides each claim, and what is expected of it; a recorded verdict against that
    overall, report            the verdict over all of them, and the files; all checks, a line each
    command                    the command line
"""

from .command import main

__all__ = ["main"]
