"""A small, separately written check of a report: `python -m airground_drake.check DIR`.

Enters: the files of a report.
Leaves: whether they agree with what the report says.
May import: no other room.

It reads report.json and, of each run, meta.json, states.parquet and samples.parquet, and judges distances, hypotheses,
triggers, dwell, arrivals and collisions again by formulas of its own. It uses the standard library, numpy, pandas and
pyarrow, and nothing else of this package. `airground check DIR` runs it first, then makes the report again from its
traces.

    files, limits         strict reading; sizes and times beyond which a report is refused
    rules, scenario       how a broken rule is told; what a scenario declares
    shapes                convex parts of obstacles, and distances from them
    run                   a trace that belongs to its run and obeys its law of motion
    safety                SAFE-TRACE: distances in continuous time; SAFE-HYP: the avoidance inequalities, exactly
    triggers              ZENO-TRACE, THR-TRIG, THR-QUALITY
    events                arrivals and collisions
    report, line, command all checks, one line each; the command line
"""

from .command import main

__all__ = ["main"]
