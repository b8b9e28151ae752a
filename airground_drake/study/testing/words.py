"""A verdict in words, for the output of a failed test."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from airground_drake.base.statuses import PASSING
from airground_drake.scenario.kinds import unit_of
from airground_drake.verify.claim import Verdict
from airground_drake.verify.finding import Finding

# Keys of evidence whose values are names of robots and obstacles.
WHO = ("robot", "first", "second", "other", "ugv", "obstacle")

_FOUND = {
    "refuted": "is refuted",
    "inconclusive": "is inconclusive: neither established nor refuted",
    "error": "could not be decided",
    "not_run": "was not decided",
}


def told(verdict: Verdict, place: str) -> str:
    """A verdict in several lines: what was claimed, which robots, when, what was found and needed."""
    claim = verdict.claim
    lines = [f"{claim.id} {_found(verdict)}, {place}", f"  claim: {claim.statement}"]
    seen = verdict.counterexample or verdict.where
    if names := [str(seen[key]) for key in WHO if key in seen]:
        lines.append(f"  who: {', '.join(names)}")
    if isinstance(seen.get("t_s"), int | float):
        lines.append(f"  when: t = {seen['t_s']:.6g} s")
    if verdict.margin is not None and verdict.status not in PASSING:
        of = verdict.quantity or "margin"
        lines.append(f"  value: {of}: {_amount(verdict.margin, verdict.unit)}; at least 0 is needed")
    told_already = {*WHO, "t_s", "margin", "margin_m", "unit", "exercised", "row"}
    if more := [_told(key, value) for key, value in seen.items() if key not in told_already]:
        lines.append(f"  seen: {'; '.join(more)}")
    if verdict.status not in ("refuted", *PASSING):
        lines += [f"  why: {_told(key, value)}" for key, value in Finding.to_json(verdict)["evidence"].items()][:5]
    return "\n".join(lines)


def _found(verdict: Verdict) -> str:
    if verdict.status not in PASSING:
        return _FOUND[verdict.status]
    if verdict.exercised is None:
        return f"{verdict.status}, but does not count what tests it"
    what = verdict.claim.exercised_by or "things"
    return f"{verdict.status}, but nothing tested it ({verdict.exercised} {what})"


def _told(key: str, value: Any) -> str:
    """An entry of evidence: `min_distance_m: 1.9` is "min distance 1.9 m"."""
    unit = unit_of(key)
    suffix = {"m/sqrt(s)": "m_sqrt_s", "1/(m^2 s)": "1_m2_s", "m/s": "m_s", "1/s": "1_s"}.get(unit, unit)
    return f"{key.removesuffix(f'_{suffix}').replace('_', ' ')} {_amount(value, unit)}"


def _amount(value: Any, unit: str) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_amount(number, unit)}" for name, number in value.items())
    if isinstance(value, list | tuple):
        return f"({', '.join(_amount(number, '') for number in value)}) {unit}".rstrip()
    number = f"{value:.6g}" if isinstance(value, float) else str(value)
    return f"{number} {unit}".rstrip()
