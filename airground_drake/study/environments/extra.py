"""The packages of the extra `gym`."""

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def needed() -> Iterator[None]:
    """In the body, a package that is missing is named with the extra that brings it."""
    try:
        yield
    except ModuleNotFoundError as error:
        hint = f"environments need the package {error.name}: pip install 'airground_drake[gym]'"
        raise ModuleNotFoundError(hint, name=error.name) from None
