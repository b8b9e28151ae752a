"""The form of a finding about the paper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from airground_drake.verify import Finding

Item = dict[str, Any]


def item(
    number: int, where: str, finding: str, paper: Any, ours: Any, shown: bool, evidence: Item, unit: str = ""
) -> Item:
    """Item `number`, about the place `where` of the paper; `evidence` is what shows it, or does not."""
    return {
        "id": number,
        "where": where,
        "finding": finding,
        "paper": paper,
        "ours": ours,
        "unit": unit,
        "demonstrated": bool(shown),
        "evidence": evidence,
    }


def status(proofs: Mapping[str, Finding], claim: str) -> str:
    """Status of a claim, 'not_run' if it is not there."""
    return proofs[claim].status if claim in proofs else "not_run"
