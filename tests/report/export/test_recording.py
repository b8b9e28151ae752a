"""An MCAP file, read by the reader of the format's own package, and CSV files, read back."""

import io
import json
import sys
from collections import defaultdict
from pathlib import Path

import jsonschema
import numpy as np
import pandas as pd
import pytest
from mcap.reader import make_reader
from report.cases import GOING_ROUND, SUCCESS, make_scenario, make_trace

from airground_drake.base.errors import ExportError
from airground_drake.report.export import recording
from airground_drake.scenario.schema import Obstacle
from airground_drake.sim.tables import TABLES


def test_it_has_what_the_trace_has_as_its_schemas_say() -> None:
    trace = make_trace(make_scenario(), "c", GOING_ROUND, SUCCESS)
    messages = defaultdict(list)
    reader = make_reader(io.BytesIO(recording.recorded(trace, make_scenario())))
    for k, (schema, channel, message) in enumerate(reader.iter_messages()):
        data = json.loads(message.data)
        messages[channel.topic].append((message.log_time / 1e9, data))
        if schema is not None and k % 50 == 0:
            closed = schema.data.replace(b'"type": "object",', b'"type": "object", "additionalProperties": false,')
            jsonschema.validate(data, json.loads(closed))
    assert messages.keys() == {"/scene", "/events", "/robots/ugv1", "/robots/ugv2", "/robots/uav"}
    places = [[data["position_m"][axis] for axis in "xyz"] for _, data in messages["/robots/ugv1"]]
    assert places == trace.position("ugv1").tolist()
    (_, standing), *scenes = messages["/scene"]
    assert [entity["id"] for entity in standing["entities"]] == [f"obstacle {k}" for k in make_scenario().obstacles]
    assert [t for t, _ in scenes] == pytest.approx(trace.t.tolist(), abs=1e-9)
    drawn = [scene["entities"][0]["cylinders"][0]["pose"]["position"] for _, scene in scenes]
    assert [[at["x"], at["y"]] for at in drawn] == trace.position("ugv1")[:, :2].tolist()
    assert [(t, data["message"]) for t, data in messages["/events"]] == [
        (pytest.approx(event["t_s"], abs=1e-9), f"{event['robot']}: {event['kind']}") for event in trace.events
    ]


def test_walls_are_triangles_as_high_as_they_are_in_their_zones_and_the_arena_two_loops() -> None:
    scenario = make_scenario()
    trace = make_trace(scenario, "c", GOING_ROUND, SUCCESS)
    scenario.obstacles = {
        "box": Obstacle([9.0, 8.0, 0.0], size_m=[2.0, 1.0], height_m=2.5),
        "post": Obstacle([9, 3, 0]),
    }
    scenario.arena_m = [[-30.0, -9.0], [30.0, 19.0]]
    reader = make_reader(io.BytesIO(recording.recorded(trace, scenario)))
    box, post, arena = json.loads(next(reader.iter_messages(["/scene"]))[2].data)["entities"]
    body, zone = box["triangles"]
    points = [[at[axis] for axis in "xyz"] for at in body["points"]]
    assert sorted(points) == [[x, y, z] for x in (8.0, 10.0) for y in (7.5, 8.5) for z in (0.0, 2.5)]
    assert {*body["indices"]} == {*range(8)}
    assert max(at["x"] for at in zone["points"]) == pytest.approx(10.0 + scenario.safe_distance.obstacle_m)
    assert (len(post["cylinders"]), "triangles" in post) == (2, False)
    assert [[line["type"], len(line["points"])] for line in arena["lines"]] == [[1, 4], [1, 4]]


def test_without_the_package_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    with pytest.raises(ExportError, match=r"pip install 'airground_drake\[mcap\]'"):
        recording.recorded(make_trace(make_scenario(), "c", GOING_ROUND, SUCCESS), make_scenario())


def test_numbers_and_lists_read_back_equal(tmp_path: Path) -> None:
    trace = make_trace(make_scenario(), "c", GOING_ROUND, SUCCESS)
    written = list(recording.write(trace, tmp_path))
    names = (*TABLES, "events", "distances")
    assert [path.name for path in written] == [f"c_{name}.csv" for name in names]
    for path, table in zip(written, (trace.states, trace.samples), strict=False):
        pd.testing.assert_frame_equal(pd.read_csv(path, dtype=str).astype(float), table, check_exact=True)
    events = pd.read_csv(written[-2])
    places = [json.loads(cell) for cell in events["position_m"]]
    assert np.array_equal(places, [event["position_m"] for event in trace.events])
