"""numba's `njit` for functions that are compiled once and kept, or anew in each process where nothing can be kept."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache as once
from typing import Any

import numba

NOTE = (
    "note: no folder for compiled functions can be written: each command compiles them anew, which may take a minute; "
    "NUMBA_CACHE_DIR can name a folder"
)


def njit(*, cache: bool) -> Callable[[Callable[..., Any]], Any]:
    """`numba.njit`; where numba finds no folder for its cache, it is said once, and nothing is kept."""

    def compiled(function: Callable[..., Any]) -> Any:
        try:
            return numba.njit(cache=cache)(function)
        except RuntimeError:  # "no locator available": numba looks for a folder when a function is decorated
            _say()
            return numba.njit(function)

    return compiled


@once
def _say() -> None:
    with suppress(OSError):
        print(NOTE, file=sys.stderr)
