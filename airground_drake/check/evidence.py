"""What of a claim's entry is established again, and what is taken as recorded: every key is in one or the other.

Of `where`, `counterexample` and `evidence` a value is established if the claim's own code recomputes it (`Found.facts`)
or has a rule for its key (`Found.judged`). What is neither must have its key in `AS_RECORDED`, which says so openly;
else the entry is refused. So nothing new comes into the evidence unnoticed.

Keys are written with dots; `*` stands for any key, or for the entries of a list; a key stands for all that is below it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from .files import Json
from .rules import Found, agrees, holds, same

PARTS = ("where", "counterexample", "evidence")
"""Of a claim's entry: what it rests on."""
KEYS = frozenset(
    (
        "id", "summary", "statement", "formula", "latex", "method", "equations", "assumptions", "does_not_establish",
        "exercised_by", "run", "expected", "as_expected", "inputs", "status", "margin", "unit", "quantity", "where",
        "counterexample", "evidence", "exercised", "from_cache", "rerun",
    )
)  # fmt: skip
"""What a claim's entry consists of."""
_EVERYWHERE = ("from_cache", "evidence.reason", "evidence.applies_to", "evidence.of")
_OF_A_THEOREM = ("evidence.proof", "evidence.theorems")

AS_RECORDED: Mapping[str, tuple[str, ...]] = {
    "GATE-FEAS": ("evidence.comparisons",),
    "GATE-MODEL": (
        "evidence.answers_that_stood_to_the_horizon", "evidence.farthest_from_predicted", "evidence.regrets",
        "evidence.largest_regret_against_constant_plans", "evidence.largest_regret_against_blocks",
    ),
    "GATE-OPT": ("evidence.first_stage_certified",),
    "SAFE-HYP": ("evidence.pairs_in_reach", "evidence.different_parameters"),
    **dict.fromkeys(
        ("SAFE-LEMMA", "SAFE-INV", "SAFE-GATE", "SAFE-DIST", "ZENO-PROOF", "LIVE-GATE", "LIVE-WAIT", "THR-ISO"),
        _OF_A_THEOREM,
    ),
    "THR-ROOT": (*_OF_A_THEOREM, "evidence.enclosures", "evidence.computed_threshold_m"),
    "THR-OPT": (
        *_OF_A_THEOREM, "evidence.enclosures", "evidence.optimal_for_drifts_m_s", "evidence.threshold_in_force_m",
        "evidence.risk_at_the_root", "evidence.risk_at_the_threshold_in_force",
    ),
    "THR-DDM": (
        "evidence.pyddm",
        *(
            f"evidence.comparisons.*.{key}"
            for key in ("wrong_decisions", "periods_sum", "periods_sum_of_squares")
        ),
    ),
}  # fmt: skip
"""Keys of values that are taken as recorded, by claim: nothing here establishes them, and no verdict rests on them but
where docs/checker.md says so."""


def as_recorded(claim: str) -> tuple[str, ...]:
    """The keys of a claim's entry that are taken as recorded."""
    return (*_EVERYWHERE, *AS_RECORDED.get(claim, ()))


def check_entry(claim: Json, found: Found, *, whole: bool) -> Mapping[str, int]:
    """Compare what a claim's entry rests on with what was found; say how much of it is taken as recorded.

    Args:
        claim: its entry in report.json.
        found: what its own formula gives.
        whole: whether all of it is to be established. Of a refutation by a broken rule, and of a verdict that decides
            nothing, the evidence is not.

    Returns:
        By key, how many values are taken as recorded.

    Raises:
        Disagreement: if a value is another, or its key is neither established nor to be taken as recorded.
    """
    same("what an entry consists of", sorted({*claim} - KEYS), [])
    agrees("evidence", claim["evidence"], found.facts, within=1e-8)
    for rule in found.rules:
        rule()
    established = {path for path, _ in _leaves(found.facts, ("evidence",))}
    taken: Counter[str] = Counter({"from_cache": 1} if claim.get("from_cache") else {})
    known: dict[tuple[str, ...], bool] = {}
    for part in PARTS:
        for path, value in _leaves(claim[part], (part,)):
            if path in established or _is_nothing(path, value):
                continue
            if path not in known:
                known[path] = _first(found.judged, path) is not None
            if known[path]:
                continue
            key = _first(as_recorded(claim["id"]), path) or (None if whole else part)
            holds("something establishes the evidence", key is not None, value, "nothing does", about=".".join(path))
            taken[str(key)] += 1
    return dict(taken)


def nothing_besides(rule: str, recorded: Any, recomputed: Any) -> None:
    """Whatever is recorded is there among what is recomputed.

    Raises:
        Disagreement: if something is not.
    """
    known = {path for path, _ in _leaves(recomputed, ())}
    for path, value in _leaves(recorded, ()):
        holds(rule, path in known, value, "nothing", about=".".join(path))


def _leaves(value: Any, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Values that have no parts, with their keys; entries of a list are all called `*`."""
    if isinstance(value, Mapping) and value:
        for key, part in value.items():
            yield from _leaves(part, (*path, str(key)))
    elif isinstance(value, (list, tuple)) and len(value):
        for part in value:
            yield from _leaves(part, (*path, "*"))
    else:
        yield path, value


def _is_nothing(path: tuple[str, ...], value: Any) -> bool:
    """No place, no counterexample, no evidence."""
    return len(path) == 1 and value in ({}, None)


def _first(keys: Any, path: tuple[str, ...]) -> str | None:
    """The first of the keys that a path is below of, or is."""
    for key in keys:
        parts = _parts(key)
        if len(parts) <= len(path) and all(mine in ("*", its) for mine, its in zip(parts, path, strict=False)):
            return str(key)
    return None


@cache
def _parts(key: str) -> tuple[str, ...]:
    return tuple(key.split("."))
