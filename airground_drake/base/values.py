"""Types of plain values in users' files: pydantic annotations, and their errors."""

import math
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from airground_drake.base.arrays import LARGEST
from airground_drake.base.limits import MAX_NAME, MAX_SEED, MAX_TEXT

SMALLEST = 1e-9  # of a positive number
NAME_PATTERN = "^[A-Za-z_][A-Za-z0-9_]*$"  # of a UGV, an obstacle, a run, a parameter
# Key for the words in which messages describe an allowed value, where its type and bounds do not say it.
WANTED = "x-wanted"
RECORDED = "recorded"  # pydantic's context for the scenario in a run's metadata: its rules are not checked again


def refused(value: object, allowed: str, *at: str) -> PydanticCustomError:
    """The error of a value that violates a rule; `allowed` states the rule, `at` its place in the value."""
    return PydanticCustomError("rule", "{allowed}", {"value": value, "allowed": allowed, "at": at})


def wanted(words: str, **bounds: Any) -> Any:
    """The bounds of a key's value, and their description in messages."""
    return Field(json_schema_extra={WANTED: words}, **bounds)


def as_float(value: object) -> object:
    """An integer as a float; infinite if it is too large."""
    if type(value) is not int:
        return value
    return float(value) if abs(value) < 1e300 else math.inf


def visible(text: str) -> str:
    """Refuse text with invisible characters that could disguise it."""
    if not text.isprintable() and (hidden := next(filter(_is_hidden, text), None)):
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
Loss = Annotated[Number, wanted("a number from 0 to below 1", ge=0.0, lt=1.0), BeforeValidator(as_float)]
Chance = Annotated[Number, Field(ge=0.0, le=1.0), BeforeValidator(as_float)]
NotNegative = Annotated[Number, Field(ge=0.0), BeforeValidator(as_float)]
Noise = Annotated[Number, Field(ge=0.0, le=1000.0), BeforeValidator(as_float)]  # rounding of more spoils verdicts


@dataclass(frozen=True)
class ValueRule:
    """A function that returns a value or raises `refused`, and the rule in JSON Schema.

    A registry in the schema stands for its names; `json_schema.py` inserts them.
    """

    check: Callable[[Any], Any]
    says: Callable[[], dict[str, Any]]

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Check a value after the annotations before this one, except in the metadata of a run."""
        # A run may be judged on a machine without its plug-ins.

        def checked(value: Any, info: ValidationInfo) -> Any:
            return value if info.context == RECORDED else self.check(value)

        return core_schema.with_info_after_validator_function(checked, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """The schema of the annotations before this one, with this rule added."""
        return {**handler(schema), **self.says()}


def _within_a_turn(heading: float) -> float:
    """Refuse headings of more than one turn, which are probably in degrees."""
    if abs(heading) > math.tau + SMALLEST:
        degrees = f"{heading:g} degrees are {math.radians(heading):.6g} rad"
        raise refused(heading, f"from -{math.tau:.6g} to {math.tau:.6g} rad; {degrees}")
    return heading


_TURN = math.tau + SMALLEST
Heading = Annotated[Real, ValueRule(_within_a_turn, lambda: {"minimum": -_TURN, "maximum": _TURN})]
