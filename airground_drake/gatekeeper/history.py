"""What has been decided so far, kept by states of which each has a little more than the one before."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Generic, TypeVar, overload

T = TypeVar("T")


class History(Sequence[T], Generic[T]):
    """An immutable sequence; a longer one is made at the cost of what is added, as the two share their items."""

    def __init__(self, items: Iterable[T] = ()) -> None:
        """Of these items."""
        self._items = list(items)
        self._count = len(self._items)

    def extended(self, more: Iterable[T]) -> History[T]:
        """This history and what follows."""
        longer: History[T] = History()
        own = len(self._items) == self._count  # else another one has grown out of this already
        longer._items = self._items if own else self._items[: self._count]
        longer._items.extend(more)
        longer._count = len(longer._items)
        return longer

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, index: int) -> T: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[T]: ...
    def __getitem__(self, index: int | slice) -> T | Sequence[T]:
        """As of a tuple of the items."""
        if isinstance(index, slice):
            return tuple(self._items[: self._count][index])
        return self._items[range(self._count)[index]]
