"""Reports: report.json is the truth; HTML, JUnit and the figures render it."""

from __future__ import annotations


def entry() -> None:
    """Console script."""
    from airground_drake.interruption import end_on_signals, leave

    end_on_signals()  # before the imports, which take seconds
    from airground_drake.report.__main__ import main

    leave(main())
