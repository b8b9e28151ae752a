"""Kinds of values in a scenario file: pydantic's annotations for the dataclasses of `schema.py`."""

import re
from collections.abc import Iterable
from importlib import import_module
from typing import Annotated, Any

from pydantic import AfterValidator, Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from airground_drake.base.limits import MAX_CORNERS, MAX_NAME, MAX_SEED
from airground_drake.base.registry import MODEL_CLAIMS, PLUGIN, PLUGIN_PATTERN, RUN_CLAIMS, Registry, is_plugin
from airground_drake.base.statuses import COUNTS, EXPECTATIONS, NOTHING, alternatives, declared
from airground_drake.base.values import Positive, Real, ValueRule, refused, visible
from airground_drake.scenario.hints import plugin_path
from airground_drake.scenario.maps.rectangles import MOST_CELLS

CLAIM_PATTERN = f"^[A-Z][A-Z0-9-]{{0,{MAX_NAME - 1}}}$"

PLUG_IN = {"type": "string", "pattern": PLUGIN_PATTERN}
# Key for a registry of claims; `json_schema.py` replaces it by the claims and their expected verdicts.
EXPECTED = "x-expected"
# Unit by the suffix of a key, the longest suffix first.
_UNITS = {"rad": "rad", "rad_s": "rad/s", "m_sqrt_s": "m/sqrt(s)", "1_m2_s": "1/(m^2 s)", "m_s": "m/s", "1_s": "1/s",
          "m": "m", "s": "s"}  # fmt: skip


def unit_of(name: str, before: str = "") -> str:
    """Unit in the suffix of a key, with words before it; '' without a unit."""
    return next((before + unit for suffix, unit in _UNITS.items() if name.endswith(f"_{suffix}")), "")


def _on_the_ground(point: list[float]) -> list[float]:
    if point[2] != 0.0:
        raise refused(point, "z must be 0 m: a UGV moves on the ground")
    return point


def _in_the_air(point: list[float]) -> list[float]:
    if point and point[2] < 0.0:
        raise refused(point, "z must be 0 m or more: below is the ground")
    return point


def _all_or_none(point: list[float]) -> list[float]:
    if len(point) not in (0, 3):
        raise refused(point, "3 numbers in m: [x, y, z]")
    return _in_the_air(point)


def _place(point: list[float]) -> list[float]:
    if len(point) not in (2, 3):
        raise refused(point, "2 or 3 numbers in m: [x, y] or [x, y, z]")
    return [*point, 0.0] if len(point) == 2 else point


def _two_or_none(value: list[Any]) -> list[Any]:
    if len(value) not in (0, 2):
        raise refused(value, "2 entries")
    return value


Point = Annotated[list[Real], Field(strict=True, min_length=3, max_length=3)]  # no set, which has no order
GroundPoint = Annotated[Point, AfterValidator(_on_the_ground)]
AirPoint = Annotated[Point, AfterValidator(_in_the_air)]


class OneOrList:
    """One mapping stands for a list with that mapping."""

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Make a list before all other checks."""
        return core_schema.no_info_before_validator_function(
            lambda value: [value] if isinstance(value, dict) else value, handler(source)
        )

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        several = handler(schema)
        return {"anyOf": [several["items"], several]}


AirPointOrNone = Annotated[
    list[Real], Field(strict=True), ValueRule(_all_or_none, lambda: {"minItems": 0, "maxItems": 3})
]
PlaceOrNone = Annotated[
    list[Real],
    Field(strict=True),
    ValueRule(lambda point: _place(point) if point else point, lambda: {"minItems": 0, "maxItems": 3}),
]
Place = Annotated[list[Real], Field(strict=True), ValueRule(_place, lambda: {"minItems": 2, "maxItems": 3})]
Corner = Annotated[list[Real], Field(strict=True, min_length=2, max_length=2)]
CornersOrNone = Annotated[list[Corner], Field(strict=True, max_length=MAX_CORNERS)]
Cell = Annotated[int, Field(strict=True, ge=0, le=MOST_CELLS)]
CellRectangle = Annotated[list[Cell], Field(strict=True, min_length=4, max_length=4)]
TwoCornersOrNone = Annotated[
    list[Corner], Field(strict=True), ValueRule(_two_or_none, lambda: {"minItems": 0, "maxItems": 2})
]
SizeOrNone = Annotated[
    list[Positive], Field(strict=True), ValueRule(_two_or_none, lambda: {"minItems": 0, "maxItems": 2})
]


def one_of(options: Iterable[str], place: str = "") -> ValueRule:
    """A name from a collection, or from another one at a place, `module:NAME`, which is imported when needed."""

    def allowed() -> list[str]:
        module, _, name = place.partition(":")
        return [*options, *(getattr(import_module(f"airground_drake.{module}"), name) if place else ())]

    def check(value: str) -> str:
        if value not in allowed():
            raise refused(value, f"one of {', '.join(name or repr(name) for name in allowed())}")
        return value

    return ValueRule(check, lambda: {"enum": allowed()})


def registered(registry: Registry) -> ValueRule:
    def check(value: str) -> str:
        if not registry.accepts(value):
            raise refused(value, f"one of {', '.join(registry.allowed)}{plugin_path(value)}")
        return value

    return ValueRule(check, lambda: {"anyOf": [{"enum": registry}, PLUG_IN]})


def expected_of(claims: Registry) -> ValueRule:
    """Expected verdicts by claim, of runs also numbers; `validate.py` checks the names, as a scenario adds claims."""
    # Claims about the model have no numbers beside them.
    counts = COUNTS if claims is RUN_CLAIMS else {}

    def check(value: dict[str, Any]) -> dict[str, Any]:
        for name, expected in value.items():
            if name in counts:
                if type(expected) is not int or not 1 <= expected <= MAX_SEED:
                    raise refused(expected, f"a whole number from 1 to {MAX_SEED}", name)
            elif expected != NOTHING and not {*alternatives(str(expected))} <= {*EXPECTATIONS}:
                several = f"several of them, such as: holds or supported; or {NOTHING}"
                raise refused(expected, f"one of {', '.join(EXPECTATIONS)}, {several}", name)
        return {name: declared(expected) if isinstance(expected, str) else expected for name, expected in value.items()}

    return ValueRule(check, lambda: {EXPECTED: claims})


def _one_value(value: object) -> object:
    if not isinstance(value, bool | int | float | str):
        raise refused(value, "one value: a number, a text, true or false")
    return visible(value) if isinstance(value, str) else value


OneValue = Annotated[Any, ValueRule(_one_value, lambda: {"type": ["number", "string", "boolean"]})]


def settings_of(sections: tuple[str, ...]) -> ValueRule:
    """Values by dotted keys of some sections of a scenario."""

    def check(value: dict[str, object]) -> dict[str, object]:
        for key, given in value.items():
            if key.partition(".")[0] not in sections or "." not in key:
                allowed = f"a run may set keys of {', '.join(sections)}, such as gatekeeper.rule"
                raise refused(given, allowed, key)
        return value

    return ValueRule(check, lambda: {"propertyNames": {"pattern": rf"^(({'|'.join(sections)})\..+|<<)$"}})


def _claims_of_others(value: dict[str, str]) -> dict[str, str]:
    """Refuse identifiers of the package's own claims, and values that do not name a class."""
    for claim, place in value.items():
        if claim in (*RUN_CLAIMS, *MODEL_CLAIMS) or not re.fullmatch(CLAIM_PATTERN, claim):
            what = f"a new identifier of at most {MAX_NAME} capitals, digits and hyphens, such as MY-CLAIM"
            raise refused(claim, what, claim)
        if not is_plugin(place):
            raise refused(place, f"{PLUGIN}{plugin_path(place)}", claim)
    return value


CLAIMS = ValueRule(
    _claims_of_others, lambda: {"patternProperties": {CLAIM_PATTERN: PLUG_IN}, "additionalProperties": False}
)
