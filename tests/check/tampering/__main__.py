"""`PYTHONPATH=tests python -m check.tampering DIR [NAME COPY]`.

Tries all tamperings on copies of a report of case B and shows what each is refused for; with NAME and COPY it makes the
one tampered copy, in the folder COPY, and leaves it there.
"""

import sys
from pathlib import Path

from check.tampering import IGNORED, TAMPERINGS, attempt
from check.tampering.base import copy, mend


def main(arguments: list[str]) -> int:
    """0 if every tampering is refused by the rule that must refuse it."""
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
        found = [f"{entry['claim']}, {entry['rule']}" for entry in outcome.refused] or [outcome.error.strip()]
        expected = outcome.is_by(tampering)
        missed += not expected
        print(f"{name:<56} {'' if expected else 'NOT AS EXPECTED: '}{'; '.join(found)[:160] or 'NOTHING'}")
    for name, (_, why) in IGNORED.items():
        print(f"{name:<56} not noticed: {why}")
    print(f"{len(TAMPERINGS)} tamperings, {missed} not refused as expected; {len(IGNORED)} are not noticed")
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
