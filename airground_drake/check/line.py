"""The result of one check."""

from dataclasses import dataclass
from typing import Any

AGREES, DISAGREES, OPEN = "agrees", "DISAGREES", "cannot be checked"
# Outcomes; the last two come from `airground check`: nothing to compare with, and a different run when simulated.
RECORDED, NOT_HERE = "as recorded", "not reproduced here"


@dataclass(frozen=True)
class CheckLine:
    """One check."""

    claim: str  # identifier of the claim, or report, files, trace, events
    run: str  # on which run; '' for the report and the model
    outcome: str  # see above
    text: str  # the result, or why it cannot be checked
    rule: str = ""  # the rule that is broken or cannot be applied; '' if all agrees
    about: str = ""  # the robot, pair, event, decision or file
    t_s: float | None = None  # when in the run; None where there is no time
    recorded: Any = None  # what the files say, if a rule is broken
    recomputed: Any = None  # what follows from them
    by: str = "checker"  # who checked: "checker", "made again", "simulated again" or "Coq"
