"""Kinds of plain values in files that users write: pydantic's annotations, and the errors of what breaks a rule."""

import math
import unicodedata
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field
from pydantic_core import PydanticCustomError

from airground_drake.base.arrays import LARGEST
from airground_drake.base.limits import MAX_NAME, MAX_SEED, MAX_TEXT

SMALLEST = 1e-9  # of a positive number
NAME_PATTERN = "^[A-Za-z_][A-Za-z0-9_]*$"  # of a UGV, an obstacle, a run, a parameter
# Key for the words in which messages describe an allowed value, where its type and bounds do not say it.
WANTED = "x-wanted"


def refused(value: object, allowed: str, *at: str) -> PydanticCustomError:
    """The error of a value that breaks a rule; `allowed` states the rule, `at` the place within the checked value."""
    return PydanticCustomError("rule", "{allowed}", {"value": value, "allowed": allowed, "at": at})


def wanted(words: str, **bounds: Any) -> Any:
    """The bounds of a key's value, and what messages say is wanted."""
    return Field(json_schema_extra={WANTED: words}, **bounds)


def as_float(value: object) -> object:
    """A whole number as a floating-point number; infinite if it is too large."""
    if type(value) is not int:
        return value
    return float(value) if abs(value) < 1e300 else math.inf


def visible(text: str) -> str:
    """Refuse text with characters that could disguise it where it is shown."""
    if hidden := next(filter(_is_hidden, text), None):
        raise refused(hidden, "text without control characters and without marks that turn the direction of writing")
    return text


def _is_hidden(character: str) -> bool:
    """Whether a character is invisible and changes how others are shown; line breaks, tabs and joiners are allowed."""
    return character not in "\n\t\u200c\u200d" and unicodedata.category(character) in ("Cc", "Cf", "Cs", "Zl", "Zp")


Words = Annotated[str, Field(strict=True, max_length=MAX_TEXT), AfterValidator(visible)]
Name = Annotated[str, Field(strict=True, max_length=MAX_NAME, pattern=NAME_PATTERN)]
YesNo = Annotated[bool, Field(strict=True)]
Count = Annotated[int, Field(strict=True, ge=1, le=MAX_SEED)]
CountFromZero = Annotated[int, Field(strict=True, ge=0, le=MAX_SEED)]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False, le=LARGEST)]
Real = Annotated[Number, Field(ge=-LARGEST), BeforeValidator(as_float)]
Positive = Annotated[Number, Field(ge=SMALLEST), BeforeValidator(as_float)]
Share = Annotated[Number, Field(ge=SMALLEST, le=1.0), BeforeValidator(as_float)]
NotNegative = Annotated[Number, Field(ge=0.0), BeforeValidator(as_float)]
