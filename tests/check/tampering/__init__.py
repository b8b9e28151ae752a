"""Ways to tamper with a report, for `airground_drake.check` to notice.

`PYTHONPATH=tests python -m check.tampering DIR` tries them all on copies of a report of case B.
"""

from check.tampering import bombs, concerted, decisions, events, files, outcomes, report, signals
from check.tampering.base import TAMPERINGS, Outcome, Tampering, attempt

__all__ = ["TAMPERINGS", "Outcome", "Tampering", "attempt"]
__all__ += ["bombs", "concerted", "decisions", "events", "files", "outcomes", "report", "signals"]
