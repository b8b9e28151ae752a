"""An immutable sequence with cheap append, for states that are copied at every change."""

from collections.abc import Iterator, Sequence
from itertools import islice
from threading import Lock
from typing import Any, Generic, Self, TypeVar, overload

Entry = TypeVar("Entry")
_ONE_AT_A_TIME = Lock()  # simulations may go on from one state in several threads


class Immutable:
    """A state that never changes: its copy is the object itself."""

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self


class History(Immutable, Sequence[Entry], Generic[Entry]):
    """An immutable sequence of past entries. `plus` returns a longer one, at the cost of the added entries."""

    # A history shares its list with the one that it was made from. A second continuation of the same history gets a
    # list of its own.

    def __init__(self, entries: Sequence[Entry] = ()) -> None:
        self._entries, self._count = [*entries], len(entries)

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[Entry]:
        return islice(self._entries, self._count)

    @overload
    def __getitem__(self, index: int) -> Entry: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Entry, ...]: ...
    def __getitem__(self, index: int | slice) -> Entry | tuple[Entry, ...]:
        if isinstance(index, slice):
            return tuple(self._entries[k] for k in range(*index.indices(self._count)))
        return self._entries[range(self._count)[index]]

    def plus(self, more: Sequence[Entry]) -> Self:
        if not more:
            return self
        after = type(self)()
        with _ONE_AT_A_TIME:
            newest = 0 < self._count == len(self._entries)  # an empty one may be the default of many
            after._entries = self._entries if newest else self._entries[: self._count]
            after._entries.extend(more)
        after._count = self._count + len(more)
        return after

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and tuple(self) == tuple(other)

    def __hash__(self) -> int:
        return hash(tuple(self))

    def __repr__(self) -> str:
        return f"History({[*self]!r})"
