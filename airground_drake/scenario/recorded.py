"""The typed scenario from the metadata of a run. Only types are checked here, not names or values."""

import copy
import functools
from collections.abc import Mapping
from typing import Any

from pydantic import TypeAdapter, ValidationError

from airground_drake.base.errors import TraceError
from airground_drake.base.values import RECORDED
from airground_drake.scenario.schema import Scenario


def of_run(data: Mapping[str, Any], run: str) -> Scenario:
    """The scenario of a run, with the values that the run sets."""
    # data: nested dicts and lists with the keys of the schema, with all defaults.
    try:
        scenario: Scenario = adapter(Scenario).validate_python(data, context=RECORDED)
        if run in scenario.runs and scenario.runs[run].set:
            scenario = adapter(Scenario).validate_python(_with(data, scenario.runs[run].set), context=RECORDED)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(map(str, first["loc"]))
        raise TraceError(f"run {run}: the scenario in its metadata: {key or 'all of it'}: {first['msg']}") from None
    except (LookupError, TypeError, ValueError) as error:
        raise TraceError(f"run {run}: its metadata set what its scenario does not have: {error}") from None
    return scenario


@functools.cache
def adapter(kind: type) -> TypeAdapter[Any]:
    """pydantic's adapter, which checks nested data and makes the dataclass."""
    return TypeAdapter(kind)


def _with(data: Mapping[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    """A copy of nested dicts and lists with other values at dotted keys."""
    changed = copy.deepcopy(dict(data))
    for key, value in settings.items():
        *above, last = key.split(".")
        place: Any = changed
        for part in above:
            place = place[int(part) if isinstance(place, list) else part]
        place[last] = value
    return changed
