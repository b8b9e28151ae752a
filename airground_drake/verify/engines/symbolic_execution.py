"""Linear forms that pass for floats: a function of them is run once for each way its comparisons can come out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from fractions import Fraction
from typing import Any, TypeVar

from airground_drake.verify.engines.obligation import rational

Result = TypeVar("Result")


class Linear:
    """A linear form in symbols, exact; `path` decides how a comparison of two forms comes out."""

    def __init__(self, path: Branch, parts: dict[str, Fraction]) -> None:
        """`parts`: coefficient by symbol, the constant under ''."""
        self.path = path
        self.parts = {name: value for name, value in parts.items() if value}

    def __add__(self, other: Linear | float) -> Linear:
        theirs = other.parts if isinstance(other, Linear) else {"": Fraction(rational(other))}
        names = dict.fromkeys((*self.parts, *theirs))
        return Linear(self.path, {name: self.parts.get(name, Fraction()) + theirs.get(name, 0) for name in names})

    __radd__ = __add__

    def __neg__(self) -> Linear:
        return Linear(self.path, {name: -value for name, value in self.parts.items()})

    def __sub__(self, other: Linear | float) -> Linear:
        return self + -other

    def __ge__(self, other: Linear | float) -> bool:
        return self.path.decide(self - other)

    def __le__(self, other: Linear | float) -> bool:
        return self.path.decide(-self + other)

    def __gt__(self, other: Linear | float) -> bool:
        return not self <= other

    def __lt__(self, other: Linear | float) -> bool:
        return not self >= other

    def __bool__(self) -> bool:
        if not set(self.parts) <= {*self.path.counts, ""}:
            raise TypeError(
                f"whether {self} is 0 cannot be asked: only counts, which are not negative, have truth values"
            )
        return self > 0

    def __eq__(self, other: object) -> bool:
        raise TypeError(f"{self} can be compared by order only")

    __hash__ = object.__hash__

    def __str__(self) -> str:
        text = ""
        order = [name for name in self.path.order if name in self.parts]
        for name in (*order, *(name for name in self.parts if name and name not in order), ""):
            if value := self.parts.get(name):
                size = name if name and abs(value) == 1 else "*".join(filter(None, (str(abs(value)), name)))
                text += f" {'-' if value < 0 else '+'} {size}" if text else f"{'-' if value < 0 else ''}{size}"
        return text or "0"

    def smt(self, sort: str = "Real") -> str:
        """As an SMT-LIB term of this sort."""

        def number(value: Fraction) -> str:
            size = str(abs(value)) if sort == "Int" else f"(/ {abs(value.numerator)}.0 {value.denominator}.0)"
            return size if value >= 0 else f"(- {size})"

        terms = [
            number(value) if not name else name if value == 1 else f"(* {number(value)} {name})"
            for name, value in self.parts.items()
        ]
        return terms[0] if len(terms) == 1 else f"(+ {' '.join(terms)})" if terms else number(Fraction())

    def at(self, point: dict[str, Fraction]) -> Fraction:
        """Value at a point, exact."""
        return sum((value * (point[name] if name else 1) for name, value in self.parts.items()), Fraction())


class Branch:
    """One way through a function of symbols: the outcomes of its comparisons, `guards` that make them so.

    Attributes:
        outcomes: of the comparisons so far.
        guards: forms that are >= 0, or > 0 if marked so, on this branch.
        order: of symbols in print; others follow.
        counts: symbols that are never negative, so that they have truth values.
    """

    def __init__(self, outcomes: Sequence[bool] = (), order: Sequence[str] = (), counts: Sequence[str] = ()) -> None:
        """Comparisons beyond `outcomes` come out true."""
        self.outcomes = list(outcomes)
        self.guards: list[tuple[Linear, bool]] = []
        self.order = order
        self.counts = counts

    def decide(self, form: Linear) -> bool:
        """Whether form >= 0 on this path; its guard is (form, strict?)."""
        if not set(form.parts) - {""}:
            return form.at({}) >= 0
        place = len(self.guards)
        if place == len(self.outcomes):
            self.outcomes.append(True)
        outcome = self.outcomes[place]
        self.guards.append((form, False) if outcome else (-form, True))
        return outcome

    def symbol(self, name: str) -> Any:
        """A symbol, to be passed where a float is expected."""
        return Linear(self, {name: Fraction(1)})


def branches(
    function: Callable[[Branch], Result], order: Sequence[str] = (), counts: Sequence[str] = ()
) -> list[tuple[Branch, Result]]:
    """All ways through a function; those that end in a ValueError (refused parameters) lead nowhere."""
    found: list[tuple[Branch, Result]] = []
    todo: list[list[bool]] = [[]]
    while todo:
        given = todo.pop()
        branch = Branch(given, order, counts)
        with suppress(ValueError):
            found.append((branch, function(branch)))
        todo += [[*branch.outcomes[:i], False] for i in range(len(given), len(branch.outcomes))]
    return found
