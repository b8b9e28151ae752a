"""What LIVE-WAIT rests on: the methods of the running `Patience` run on symbols, and the obligations that follow.

Symbols: M tries at most, R rest, D longest try, W time behind, h period of the gatekeeper's samples; of the UGV's turn
n tries, b since when, u until when; t the last sample, s the one after it, s <= t + h; e the end of the motion; o when
the UGV was last on time; c the time for which tries that are over were executed since the last rest. The invariant:

    on its own: c <= n (D + h), n <= M;   executing: c <= (n - 1) (D + h), n <= M, u <= b + D, t <= b + D
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from airground_drake.gatekeeper.patience import Patience, Turn
from airground_drake.verify.engines.obligation import Obligation, Term
from airground_drake.verify.engines.rewriting import terms
from airground_drake.verify.engines.symbolic_execution import Branch, branches

SYMBOLS = ("n", "M", "b", "c", "s", "t", "u", "e", "o", "D", "R", "W", "L", "h")
SAMPLE = {"sample": "t + h - s"}
Make = Callable[[Branch], Patience]


def symbolic(kind: type[Patience] = Patience) -> Make:
    """A patience of a kind with symbols for its parameters."""
    return lambda path: kind(*map(path.symbol, ("M", "R", "D", "L", "W")))


def obligations(make: Make) -> list[Obligation]:
    """That every transition of a patience keeps the invariant, and that the invariant is the claim."""
    return [*_accept(make), *_goes_on(make), *_stops(make), *_rests(make), *_claim()]


def _turn(path: Branch, *, executing: bool) -> Turn:
    return Turn(executing, *map(path.symbol, "nbu"))


def _own(path: Branch) -> list[tuple[str, bool]]:
    """Guards of a path but for those that the parameters must meet."""
    found = [(str(form), strict) for form, strict in path.guards]
    return [(text, strict) for text, strict in found if text not in ("M - 1", "R", "D", "L", "W")]


def _obligation(
    name: str, says: str, goal: str, given: dict[str, str], guards: list[tuple[str, bool]], proof: tuple[Term, ...]
) -> Obligation:
    hypotheses, strict = dict(given), {"longest": "D", "period": "h"}
    for i, (text, is_strict) in enumerate(guards):
        (strict if is_strict else hypotheses)[f"guard_{i}"] = text
    known = {*hypotheses, *strict}
    certificate = proof if all(set(term.factors) <= known for term in proof) else ()
    return Obligation(name, says, SYMBOLS, goal, hypotheses, strict, certificate=certificate)


def _accept(make: Make) -> Iterator[Obligation]:
    """Accepting: a try more, but no more than all; it begins now and is over in time."""
    free: list[tuple[str, bool]] = []
    for path, used_up in branches(lambda path: make(path).exhausted(_turn(path, executing=False)), SYMBOLS):
        if not used_up:
            free = _own(path)
    whole = [f"{text} - 1" if strict else text for text, strict in free]  # counts are whole numbers
    tries_left = {f"free_{i}": text for i, text in enumerate(whole)}
    accepts = branches(
        lambda path: make(path).accept(_turn(path, executing=False), path.symbol("t"), path.symbol("e")), SYMBOLS
    )
    for i, (path, after) in enumerate(accepts):
        guards, name = _own(path), f"accept_{i}"
        yield _obligation(f"{name}_count", "a UGV that is not exhausted accepts, and has used no more than all tries",
                          f"M - ({after.tries})", tries_left, guards, terms("free_0"))  # fmt: skip
        yield _obligation(f"{name}_spent", "what was executed before fits into the tries before",
                          f"(({after.tries}) - 1)*(D + h) - c", {"spent": "n*(D + h) - c"}, guards,
                          terms("spent"))  # fmt: skip
        yield _obligation(f"{name}_now", "the try begins now", f"-(({after.since}) - t)**2", {}, guards, ())
        proof = terms("guard_0") if "e" in str(after.until) else ()
        yield _obligation(f"{name}_until", "it is over after the longest time at the latest",
                          f"({after.since}) + D - ({after.until})", {}, guards, proof)  # fmt: skip


def _goes_on(make: Make) -> Iterator[Obligation]:
    """Executing goes on only within the longest time, and only so long after the UGV was last on time."""
    for path, over in branches(lambda path: make(path).over(_turn(path, executing=True), path.symbol("t")), SYMBOLS):
        if not over:
            yield _obligation("goes_on_in_time", "what goes on at a sample has not lasted the longest time",
                              "b + D - t", {"until": "b + D - u"}, _own(path), terms("until", "guard_0"))  # fmt: skip
    for path, late in branches(lambda path: make(path).late(path.symbol("o"), path.symbol("t")), SYMBOLS):
        if not late:
            yield _obligation("given_back", "no progress: it is given back at the sample after that time at the latest",
                              "o + W + h - s", SAMPLE, _own(path), terms("guard_0", "sample"))  # fmt: skip


def _stops(make: Make) -> Iterator[Obligation]:
    """The end of a try: what was executed fits into the tries, and the UGV is on its own from now on."""
    given = {"spent": "(n - 1)*(D + h) - c", "kept": "b + D - t", **SAMPLE}
    stops = branches(lambda path: make(path).stop(_turn(path, executing=True), path.symbol("s")), SYMBOLS)
    for i, (path, after) in enumerate(stops):
        guards, goal = _own(path), f"({after.tries})*(D + h) - c - s + b"
        says = "what was executed fits into the tries"
        yield _obligation(f"stop_{i}_spent", says, goal, given, guards, terms("spent", "kept", "sample"))
        says = "the UGV is on its own from now on"
        yield _obligation(f"stop_{i}_now", says, f"-(({after.since}) - s)**2", {}, guards, ())


def _rests(make: Make) -> Iterator[Obligation]:
    """Tries count anew after a rest only, and after a rest they do."""
    for executing in (False, True):
        who = "executing" if executing else "own"

        def rested(path: Branch, executing: bool = executing) -> Turn:
            return make(path).rested(_turn(path, executing=executing), path.symbol("t"))

        for i, (path, after) in enumerate(branches(rested, SYMBOLS)):
            guards, name = _own(path), f"rest_{who}_{i}"
            if str(after.tries) == "n":
                if not executing:
                    says = "a UGV that has not rested yet has by the next sample, or a period after the rest"
                    proof = terms("guard_0", "sample")
                    yield _obligation(f"{name}_comes", says, "b + R + h - s", SAMPLE, guards, proof)
                continue
            says, goal = "tries count anew only when the UGV has rested on its own", "-1" if executing else "t - b - R"
            yield _obligation(f"{name}_is_one", says, goal, {}, guards, terms("guard_0"))
            yield _obligation(f"{name}_free", "and then all of them are left", f"-({after.tries})**2", {}, guards, ())


def _claim() -> Iterator[Obligation]:
    """The invariant bounds the time executed between two rests."""
    count = {"count": "M - n"}
    yield _obligation("wait_own", "on its own: executed for no more than M (D + h) since the last rest",
                      "M*(D + h) - c", {"spent": "n*(D + h) - c", **count}, [],
                      terms("spent", "count longest", "count period"))  # fmt: skip
    yield _obligation("wait_executing", "executing, up to the next sample: no more either",
                      "M*(D + h) - c - s + b",
                      {"spent": "(n - 1)*(D + h) - c", "kept": "b + D - t", **SAMPLE, **count}, [],
                      terms("spent", "kept", "sample", "count longest", "count period"))  # fmt: skip
