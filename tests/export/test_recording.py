"""An MCAP file, read by the reader of the format's own package."""

from __future__ import annotations

import io
import json
import sys
from typing import Any

import jsonschema
import pytest
from mcap.reader import make_reader
from report.cases import GOING_ROUND, SUCCESS, make_scenario, make_trace

from airground_drake.base.errors import ExportError
from airground_drake.export import recording
from airground_drake.run.trace import Trace

Read = list[tuple[str, dict[str, Any], float, dict[str, Any]]]


@pytest.fixture(scope="module")
def trace() -> Trace:
    return make_trace(make_scenario(), "c", GOING_ROUND, SUCCESS)


@pytest.fixture(scope="module")
def messages(trace: Trace) -> Read:
    """Topic, schema, time, s, and content of every message of the file, in its order."""
    reader = make_reader(io.BytesIO(recording.recorded(trace, make_scenario())))
    return [
        (channel.topic, json.loads(schema.data), message.log_time / 1e9, json.loads(message.data))
        for schema, channel, message in reader.iter_messages()
        if schema is not None
    ]


def test_every_message_is_as_its_schema_says(messages: Read) -> None:
    assert {topic for topic, *_ in messages} == {
        "/scene", "/events", "/robots/ugv1", "/robots/ugv2", "/robots/uav",
    }  # fmt: skip
    for _, schema, _, data in messages[::50]:
        closed = json.dumps(schema).replace('"type": "object",', '"type": "object", "additionalProperties": false,')
        jsonschema.validate(data, json.loads(closed))


def test_robots_are_where_the_trace_has_them(messages: Read, trace: Trace) -> None:
    of_ugv1 = [data for topic, _, _, data in messages if topic == "/robots/ugv1"]
    assert [[data["position_m"][axis] for axis in "xyz"] for data in of_ugv1] == trace.position("ugv1").tolist()
    scenes = [(t, data["entities"]) for topic, _, t, data in messages if topic == "/scene"]
    assert len(scenes) == len(trace.t) + 1
    obstacles = [entity["id"] for entity in scenes[0][1]]
    assert obstacles == [f"obstacle {name}" for name in make_scenario().obstacles]
    for (t, entities), row in zip(scenes[1:], range(len(trace.t)), strict=True):
        assert t == pytest.approx(trace.t[row], abs=1e-9)
        centre = entities[0]["cylinders"][0]["pose"]["position"]
        assert [centre["x"], centre["y"]] == trace.position("ugv1")[row, :2].tolist()


def test_events_are_log_messages(messages: Read, trace: Trace) -> None:
    logged = [(t, data["message"]) for topic, _, t, data in messages if topic == "/events"]
    assert logged == [
        (pytest.approx(event["t_s"], abs=1e-9), f"{event['robot']}: {event['kind']}") for event in trace.events
    ]


def test_without_the_package_one_line_says_what_to_install(trace: Trace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    with pytest.raises(ExportError, match=r"pip install 'airground_drake\[mcap\]'"):
        recording.recorded(trace, make_scenario())
