"""`python -m airground_drake.check DIR`."""

import os
import signal
import sys
import traceback
from types import FrameType
from typing import NoReturn

from .command import main


def _end(number: int, frame: FrameType | None) -> NoReturn:
    """Print one line, and exit with the signal's code."""
    os.write(2, f"error: interrupted ({signal.Signals(number).name})\n".encode())
    os._exit(128 + number)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, _end)
    signal.signal(signal.SIGTERM, _end)
    try:
        sys.exit(main())
    except Exception:  # neither a verdict nor a report that cannot be used
        traceback.print_exc()
        sys.exit(4)
