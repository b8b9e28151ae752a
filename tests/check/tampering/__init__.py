"""Ways to tamper with a report, for `airground_drake.check` to notice.

`PYTHONPATH=tests python -m check.tampering DIR` tries them all on copies of a report of case B.
"""

from check.tampering import bombs, counts, decisions, events, execution, files, outcomes, report, signals, theorems
from check.tampering.base import IGNORED, NO_REPORT, TAMPERINGS, Outcome, Tampering, attempt

__all__ = [
    "IGNORED",
    "NO_REPORT",
    "TAMPERINGS",
    "Outcome",
    "Tampering",
    "attempt",
    "bombs",
    "counts",
    "decisions",
    "events",
    "execution",
    "files",
    "outcomes",
    "report",
    "signals",
    "theorems",
]
