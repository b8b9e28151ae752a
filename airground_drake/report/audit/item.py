"""The form of a finding about the paper."""

from collections.abc import Mapping
from typing import Any

from airground_drake.verify import Finding

Item = dict[str, Any]

# Findings, by number, that a fault in our text conversion of the paper could explain, and how.
CONVERSION = {
    6: "The table's '1t' may have lost something.",
    7: "A minus sign is easily lost.",
    8: "rho and sigma, {0, 1} and [0, 1], (b) and (c) are easily mistaken for each other.",
    12: "The subscripts m and md, j and d are easily mistaken for each other.",
    22: "Some of the indices may have been other letters: n and N, j and r.",
}


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
