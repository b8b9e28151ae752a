"""Values for reading, with their units: numbers, vectors, records. Pages, LaTeX and messages of tests show them so."""

from collections.abc import Mapping
from typing import Any

YES_NO = "yes/no"  # unit of 1 and 0 that stand for an answer
# Units with which the names of quantities end, and how they are written; the longest first.
UNITS = {
    "1_m2_s": "1/(m²s)", "1_m_s": "1/(m s)", "m_sqrt_s": "m/√s", "m2_s": "m²s", "m_s": "m/s", "1_s": "1/s",
    "1_m": "1/m", "m": "m", "s": "s",
}  # fmt: skip


def split(key: str) -> tuple[str, str]:
    """The name and the unit in a key: `min_distance_m` is "min distance" and "m"."""
    for unit in UNITS:
        if key.endswith(f"_{unit}"):
            return key.removesuffix(f"_{unit}").replace("_", " "), UNITS[unit]
    return key.replace("_", " "), ""


def number(x: Any, digits: int = 4) -> str:
    if x is None:
        return "\N{EN DASH}"
    if isinstance(x, bool) or not isinstance(x, (int, float)):
        return str(x)
    if isinstance(x, int) or (x == int(x) and abs(x) < 1e6):
        return str(int(x))
    return f"{x:.{digits}g}".replace("-", "\N{MINUS SIGN}")


def told(x: Any, unit: str = "", digits: int = 4) -> str:
    """A value in a line: numbers and vectors with their units, those of a record with their names."""
    if isinstance(x, Mapping):
        parts = ((split(str(key)), item) for key, item in x.items())
        return "; ".join(f"{name} {told(item, own or unit, digits)}" for (name, own), item in parts) or "none"
    if isinstance(x, list | tuple):
        if x and all(isinstance(item, int | float) for item in x):
            return f"({', '.join(number(item, digits) for item in x)}) {unit}".rstrip()
        return ", ".join(told(item, unit, digits) for item in x) or "none"
    if isinstance(x, bool) or (unit == YES_NO and x is not None):
        return "yes" if x else "no"
    return f"{number(x, digits)} {unit}".rstrip() if isinstance(x, int | float) else number(x)
