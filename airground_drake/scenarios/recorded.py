"""The scenario that the metadata of a run hold, typed again. Only types are checked here, no names, no values."""

import copy
import functools
from collections.abc import Mapping
from typing import Any

from pydantic import TypeAdapter, ValidationError

from airground_drake.base.errors import TraceError
from airground_drake.scenarios.kinds import RECORDED
from airground_drake.scenarios.schema import Scenario


def of_run(data: Mapping[str, Any], run: str) -> Scenario:
    """The scenario as a run of it had it: with the values that the run sets.

    Args:
        data: nested dicts and lists with the keys of the schema, defaults filled in.
        run: name of the run.

    Raises:
        TraceError: if they are no scenario; names the first key and what is wrong there.
    """
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
    """What checks nested data against the types of a dataclass, and makes it."""
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
