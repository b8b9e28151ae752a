"""What is said of one check."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

AGREES, DISAGREES, OPEN = "agrees", "DISAGREES", "cannot be checked"
RECORDED, NOT_HERE = "as recorded", "not reproduced here"
"""Outcomes; the last two are those of `airground check`: nothing to compare with, and another run when simulated."""


@dataclass(frozen=True)
class CheckLine:
    """One check.

    Attributes:
        claim: identifier of the claim, or what else was checked: report, files, trace, events.
        run: on which run; '' for the report and the model.
        outcome: see above.
        text: what was found, or why nothing was.
        rule: the rule that is broken or cannot be applied; '' if all agrees.
        about: the robot, pair, event, decision or file.
        t_s: when in the run; None where there is no time.
        recorded: what the files say, if a rule is broken.
        recomputed: what follows from them.
        by: who checked: "checker", "made again", "simulated again" or "Coq".
    """

    claim: str
    run: str
    outcome: str
    text: str
    rule: str = ""
    about: str = ""
    t_s: float | None = None
    recorded: Any = None
    recomputed: Any = None
    by: str = "checker"
