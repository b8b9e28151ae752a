"""`airground run`: what it prints and saves."""

from pathlib import Path

from commands.conftest import Airground

from airground_drake.sim import trace


def test_events_are_printed_and_the_trace_is_saved(tmp_path: Path, airground: Airground) -> None:
    said = airground("run", "case_a", "b", "--set", "duration_s=15", "-o", tmp_path / "b")
    first, *events = said.splitlines()
    assert first.startswith("case_a, run b: method (b), ")
    assert [line.split()[2:4] for line in events] == [["ugv1", "trigger"], ["ugv1", "proposal"]]
    assert trace.load(tmp_path / "b").run == "b"
