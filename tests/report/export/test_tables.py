"""CSV files read back as the trace has it."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
from report.cases import GOING_ROUND, SUCCESS, make_scenario, make_trace

from airground_drake.report.export import recording
from airground_drake.sim.tables import TABLES


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
