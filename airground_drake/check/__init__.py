"""A small, separately written check of a report: `python -m airground_drake.check DIR`.

It reads report.json and trace/, and establishes again what matters most by formulas of its own: distances, the
hypotheses of the invariance theorem, triggers, events, and the verdict over all claims. It uses the standard library,
numpy, pandas and pyarrow, and nothing else of this package. `airground check DIR` runs it first, then has every claim
judged again by the claims' own code from the same files.

    files, limits         strict reading; sizes and times beyond which a report is refused
    rules, scenario       how a broken rule is told; what a scenario declares
    run                   a trace that belongs to its run and obeys its law of motion
    safety                SAFE-TRACE: distances in continuous time; SAFE-HYP: the avoidance inequalities, exactly
    positions             positions that come from elsewhere: `airground judge`
    triggers              ZENO-TRACE, THR-TRIG, THR-QUALITY
    events                triggers, messages, answers, arrivals, collisions
    verdicts              expectations, and the verdict over all claims
    report, command       all checks, one line each; the command line
"""

from .command import main

__all__ = ["main"]
