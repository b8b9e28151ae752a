"""`PYTHONPATH=tests python -m check.tampering DIR [NAME COPY]`.

Tries all tamperings on copies of a report of case B and shows what each is refused for. With NAME and COPY it makes the
one tampered copy, in the folder COPY, and leaves it there.
"""

import sys
from pathlib import Path

from check.tampering import TAMPERINGS, attempt
from check.tampering.base import copy, mend


def main(arguments: list[str]) -> int:
    """0 if every tampering is refused."""
    report = Path(arguments[0])
    if len(arguments) == 3:
        chosen, folder = TAMPERINGS[arguments[1]], copy(report, Path(arguments[2]))
        chosen.edit(folder)
        if chosen.mended:
            mend(folder)
        return 0
    missed = 0
    for name, tampering in TAMPERINGS.items():
        outcome = attempt(report, tampering.edit, mended=tampering.mended)
        found = [f"{line['claim']} ({line['by']}): {line['text']}" for line in outcome.refused] or [outcome.error]
        missed += not outcome.is_of(tampering)
        print(f"{name:<56} {'' if outcome.is_of(tampering) else 'NOT REFUSED: '}{'; '.join(found)[:160]}")
    print(f"{len(TAMPERINGS)} tamperings, {missed} not refused")
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
