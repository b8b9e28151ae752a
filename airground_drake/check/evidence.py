"""What of a claim's entry is established again, and what is taken as recorded: every key is in one or the other.

Of `where`, `counterexample` and `evidence` a value is established if the claim's own code recomputes it (`Found.facts`)
or has a rule for its key (`Found.judged`). What is neither must have its key in `AS_RECORDED`, which says so openly;
else the entry is refused. So nothing new comes into the evidence unnoticed.

Keys are written with dots; `*` stands for any key, or for the entries of a list; a key stands for all that is below it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import Any

from .files import Json
from .rules import Found, agrees, close, holds, same

PARTS = ("where", "counterexample", "evidence")
"""Of a claim's entry: what it rests on."""
KEYS = frozenset(
    (
        "id", "summary", "statement", "formula", "latex", "method", "equations", "assumptions", "does_not_establish",
        "exercised_by", "run", "expected", "as_expected", "inputs", "status", "margin", "unit", "quantity", "where",
        "counterexample", "evidence", "certificates", "exercised", "from_cache", "rerun",
    )
)  # fmt: skip
"""What a claim's entry consists of."""
AGREEMENT = 1e-10
"""A second engine's robustness and the margin that it is compared with may differ by this."""

_SECOND_OPINION = tuple(
    f"evidence.stl.checks.*.{key}"
    for key in (
        "part", "formula", "signals", "semantics", "relation", "compares", "unit", "tolerance", "robustness",
        "verdict", "engine", "reason",
    )
)  # fmt: skip
_ANSWERS = tuple(
    f"evidence.obligations.*.{key}" for key in ("says", "certificate", "z3", "cvc5", "hypotheses", "detail")
)
_CONFORMANCE = tuple(f"evidence.conformance.{key}" for key in ("points", "unseen", "worst_ratio"))
_LAYER = ("states", "inequalities", "worst_loss_over_rounding", "largest_gain_in_speed")
_WIRING = (
    "states", "inequalities", "commands", "executed", "proposals", "never_bound", "never_bound_count",
    "least_times_bound", "least_slack_m_s",
)  # fmt: skip
_EVERYWHERE = ("from_cache", "evidence.reason", "evidence.applies_to", "evidence.of", *_SECOND_OPINION, *_ANSWERS)

AS_RECORDED: Mapping[str, tuple[str, ...]] = {
    "GATE-FEAS": ("evidence.comparisons",),
    "GATE-MODEL": (
        "evidence.answers_that_stood_to_the_horizon", "evidence.farthest_from_predicted", "evidence.regrets",
        "evidence.largest_regret_against_constant_plans", "evidence.largest_regret_against_blocks",
    ),
    "GATE-OPT": ("evidence.first_stage_certified",),
    "SAFE-HYP": ("evidence.pairs_in_reach", "evidence.different_parameters"),
    "SAFE-LEMMA": ("evidence.gram_matrix",),
    "SAFE-INV": (
        *_CONFORMANCE,
        *(f"evidence.composition.{key}" for key in (*_LAYER, "worst_slack_m_s")),
        *(f"evidence.wiring.{key}" for key in _WIRING),
    ),
    "SAFE-GATE": (
        *(f"evidence.layer.*.{key}" for key in _LAYER),
        *(f"evidence.controller.*.{key}" for key in ("composition", "states", "ugvs")),
        *(f"evidence.wiring.*.{key}" for key in _WIRING),
        "evidence.non_finite",
    ),
    "SAFE-DIST": (
        *_CONFORMANCE,
        *(f"evidence.runs.*.{key}" for key in ("unmet", "uncovered", "worst_shortfall_m_s")),
        *(
            f"evidence.runs.*.where.{key}"
            for key in ("attack", "robot", "t_s", "positions_m", "avoided_m", "velocity_with_disturbance_m_s")
        ),
    ),
    "ZENO-PROOF": (
        *(f"evidence.conformance.{key}" for key in ("states", "within_rounding", "transitions")),
        "evidence.invariant",
    ),
    "LIVE-GATE": ("evidence.runs.*.largest_excess_m",),
    "LIVE-WAIT": tuple(
        f"evidence.attacks.*.{key}" for key in ("tries", "longest_between_rests_s", "longest_try_s", "reasons")
    ),
    "THR-ISO": ("evidence.conformance.steps", "evidence.conformance.within_rounding"),
    "THR-ROOT": ("evidence.cvc5_on_two_roots", "evidence.cvc5_says"),
    "THR-OPT": ("evidence.difference_quotient_with_deviation_ahead_1_m",),
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
    _second_opinion(claim)
    agrees("evidence", claim["evidence"], found.facts, within=1e-8)
    for rule in found.rules:
        rule()
    established = {path for path, _ in _leaves(found.facts, ("evidence",))} | {("evidence", "stl", "agrees")}
    judged = [*found.judged, *(f"evidence.stl.checks.*.{key}" for key in ("run", "claim", "ours"))]
    taken: Counter[str] = Counter({"from_cache": 1} if claim.get("from_cache") else {})
    known: dict[tuple[str, ...], bool] = {}
    for part in PARTS:
        for path, value in _leaves(claim[part], (part,)):
            if path in established or _is_nothing(path, value):
                continue
            if path not in known:
                known[path] = _first(judged, path) is not None
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


def _second_opinion(claim: Json) -> None:
    """What a second engine said is about this claim, and compared with its margins."""
    if "stl" not in claim["evidence"]:
        return
    said, decided = claim["evidence"]["stl"], claim["status"] in ("holds", "refuted")
    checks = said["checks"]
    decided = decided and all(check["verdict"] in ("satisfied", "violated") for check in checks)
    same("whether a second engine agrees", said["agrees"], True if decided else None)
    if claim["status"] == "refuted":
        _found_something(checks)
    for check in checks:
        about = str(check["part"])
        same("what a second engine was asked about", [check["claim"], check["run"]], [claim["id"], claim["run"]])
        worst = [
            each["margin"] for each in claim["evidence"].get("worst", ()) if each["hypothesis"] in check["compares"]
        ]
        ours = claim["margin"] if check["compares"] == ["margin"] else min(worst, default=None)
        same("number that a second engine's is compared with", check["ours"], ours, about=about)
        if decided and None not in (ours, check["robustness"]):
            close("number of a second engine", check["robustness"], ours, within=AGREEMENT, about=about)
        if claim["status"] == "holds" and not _by_rounding(check):
            said_so = check["verdict"]
            holds("a second engine finds no violation", said_so != "violated", said_so, "no violation", about=about)


def _found_something(checks: Sequence[Json]) -> None:
    """What is refuted violates a formula that says the same, unless one could not be decided."""
    alike = [check for check in checks if check["relation"] == "equivalent"]
    wrong = bool(alike) and all(check["verdict"] == "satisfied" and not _by_rounding(check) for check in alike)
    holds("a second engine finds a violation", not wrong, "every formula satisfied", "one violated")


def _by_rounding(check: Json) -> bool:
    """Whether rounding decides: the number, which is compared, is within what it may be off of the level asked for."""
    asked = bool(check["compares"]) and check["robustness"] is not None
    return asked and bool(abs(check["robustness"] + check["tolerance"]) <= AGREEMENT)
