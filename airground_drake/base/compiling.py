"""numba's `njit` with a cache on disk, or without one if no cache folder is writable."""

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
_jit: Any = numba.njit  # its stubs lack options
_kind: Any = numba.types.unliteral


def njit(*, cache: bool, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """`numba.njit`; if numba finds no cache folder, a message says so once, and nothing is cached."""
    options["no_cfunc_wrapper"] = True  # nobody calls them from C

    def compiled(function: Callable[..., Any]) -> Any:
        try:
            dispatcher = _jit(cache=cache, **options)(function)
        except RuntimeError:  # "no locator available": numba looks for a folder when a function is decorated
            _say()
            dispatcher = _jit(**options)(function)
        if hasattr(dispatcher, "get_call_template"):  # unless NUMBA_DISABLE_JIT is set
            dispatcher.get_call_template = _without_constants(dispatcher.get_call_template)
        return dispatcher

    return compiled


def _without_constants(template: Callable[..., Any]) -> Callable[..., Any]:
    """numba's dispatch, except that it never compiles a function again for a constant argument."""
    return lambda args, named: template(tuple(map(_kind, args)), {name: _kind(of) for name, of in named.items()})


@once
def _say() -> None:
    with suppress(OSError):
        print(NOTE, file=sys.stderr)
