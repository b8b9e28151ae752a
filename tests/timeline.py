"""Events of a run, in order of time."""

from airground_drake.sim.trace import Trace


def kinds(of_run: Trace, robot: str) -> list[str]:
    return [event["kind"] for event in of_run.events if event["robot"] == robot]


def times(of_run: Trace, kind: str) -> list[float]:
    return [event["t_s"] for event in of_run.events if event["kind"] == kind]
