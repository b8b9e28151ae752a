"""`airground run SCENARIO`: simulate one run and print its events; with `--meshcat`, watch it while it runs."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from threading import Event
from typing import TYPE_CHECKING

from airground_drake.base import files
from airground_drake.base.errors import UnknownNameError
from airground_drake.base.registry import METHODS
from airground_drake.base.usage import positive, refuse
from airground_drake.scenario import plugins
from airground_drake.scenario.estimate import estimate
from airground_drake.scenario.options import Parser, option, parser_of

if TYPE_CHECKING:
    from airground_drake.sim.trace import Trace

SPEED = 1.0  # default speed in Meshcat, simulated seconds per second


def parser() -> Parser:
    return parser_of("run", "Simulate one run of a scenario and print its events.", {
        "scenario": None,
        "run": "default: the run with the most complete method",
        "--meshcat": "show the robots in a browser while they move",
        "--speed": option(f"with --meshcat: speed of the display (default: {SPEED:g})", "X", positive),
        "-o --output": "also save the trace in this folder",
        "--set": None,
        "--seed": None,
        plugins.OPTION: None,
        plugins.SHOW: None,
    })  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    if options.speed and not options.meshcat:
        return refuse("--speed needs --meshcat")
    from airground_drake.scenario.load import load
    from airground_drake.scenario.notes import notes

    overrides = [*options.set, *([] if options.seed is None else [f"seed={options.seed}"])]
    scenario = load(options.scenario, overrides)
    methods = {name: run.method for name, run in scenario.runs.items()}
    name = options.run or max(methods, key=lambda run: list(METHODS).index(methods[run]))
    if name not in methods:
        raise UnknownNameError("run", name, methods)
    if options.output is not None:
        files.make_folder(options.output, "the trace")
    if announced := estimate(replace(scenario, runs={name: scenario.runs[name]})).announcement:
        print(announced, file=sys.stderr)
    for note in notes(scenario):
        print(f"note: {note}", file=sys.stderr)
    if scenario.map is not None:
        print(scenario.map.cells, file=sys.stderr)
    from airground_drake.sim import trace as traces
    from airground_drake.sim.simulation import simulate

    with (
        plugins.admitted(scenario, options.scenario, allow=options.allow_plugins),
        plugins.shown(options.show_policy_output),
    ):
        if options.meshcat:
            from airground_drake.report.view.draw import served
            from airground_drake.report.view.live_view import LiveView

            meshcat = served()
            print(f"{meshcat.web_url()}  (Ctrl-C ends it)", flush=True)
            meshcat.StartRecording()
            view = LiveView(meshcat, scenario)
            trace = simulate(scenario, name, observers=[view], speed=options.speed or SPEED)
            meshcat.PublishRecording()
        else:
            trace = simulate(scenario, name)
    if options.output is not None:
        traces.save(trace, options.output)
    print("\n".join(_said(trace)), flush=True)
    if trace.meta["faults"]:
        from airground_drake.report import attention

        print("\n".join(attention.failures({name: trace.meta["faults"]})), file=sys.stderr)
    if options.meshcat:
        Event().wait()  # the page stays until the process is interrupted
    return 0


def _said(trace: Trace) -> Iterator[str]:
    method = str(trace.meta["method"])
    yield f"{trace.scenario.name}, run {trace.run}: method ({method}), {METHODS[method].says}; {trace.t[-1]:g} s"
    for event in trace.events:
        x, y, _ = event["position_m"]
        yield f"{event['t_s']:9.3f} s  {event['robot']:12} {event['kind']:10} at ({x:.2f}, {y:.2f}) m"
