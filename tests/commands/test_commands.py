"""The command line `airground`: commands are imported when used, and mistakes are one line."""

import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import entry_points
from pathlib import Path

import pytest
from commands.conftest import Airground

from airground_drake.base.limits import MAX_UGVS
from airground_drake.base.registry import METHODS, MODEL_CLAIMS, POLICIES, ROUTES, RUN_CLAIMS, SAMPLERS, UAV_TASKS
from airground_drake.commands import COMMANDS
from airground_drake.commands.listing import KINDS
from airground_drake.scenario.load import load, resolved
from airground_drake.scenario.shipped import shipped

AIRGROUND = (sys.executable, "-m", "airground_drake")


WITHOUT_WORK = ("--version", "--help", "list", *(f"{name} --help" for name in COMMANDS))
HEAVY = "numpy pandas scipy numba cvxpy flint matplotlib jinja2 pydantic pydrake pygraphviz"
IMPORTED = f"""
import sys
from airground_drake.commands import main
for line in {WITHOUT_WORK}:
    try: main(line.split())
    except SystemExit: pass
    print(line, *set({HEAVY.split()}) & set(sys.modules), sep=": ", file=sys.stderr)
"""


def test_slow_packages_are_imported_when_they_are_used_and_each_command_has_its_help() -> None:
    """Whichever line imports one is the first that has it after its name."""
    ran = subprocess.run([sys.executable, "-c", IMPORTED], capture_output=True, text=True, check=True)
    assert ran.stderr.splitlines() == [*WITHOUT_WORK]
    for name in COMMANDS:
        assert f"  {name} " in ran.stdout  # a line of `airground --help`
        assert f"usage: airground {name} " in ran.stdout  # the first line of its own


def test_module_and_console_script_are_the_same_command() -> None:
    script = next(each for each in entry_points(group="console_scripts") if each.name == "airground")
    assert script.value == "airground_drake.commands:entry"
    ran = subprocess.run([*AIRGROUND, "list", "methods"], capture_output=True, text=True)
    assert (ran.returncode, ran.stderr, ran.stdout.splitlines()[0]) == (0, "", "methods:")


def test_list_has_every_name(airground: Airground) -> None:
    lines = airground("list").splitlines()
    assert [line for line in lines if not line.startswith(" ")] == [f"{kind}:" for kind in KINDS]
    listed = {line.split()[0]: line.split(maxsplit=1)[1:] for line in lines if line.startswith("  ")}
    assert set(listed) == {*shipped(), *METHODS, *POLICIES, *ROUTES, *UAV_TASKS, *SAMPLERS, *RUN_CLAIMS, *MODEL_CLAIMS}
    assert all(listed.values())


def test_list_tells_all_about_one_name(airground: Airground) -> None:
    for kind, names in KINDS.items():
        for name, _ in [*names()][
            : 1 if kind == "scenarios" else None
        ]:  # each time the title of every scenario is read
            assert airground("list", kind, name).startswith(f"{name}: ")
    assert "Parameters: speed_m_s, clearance_m = 0.05, follow_s = 5.0." in airground("list", "policies", "detour")
    assert "Does not establish: " in airground("list", "claims", "SAFE-TRACE")
    said = airground("list", "policies", "detuor", code=2)
    assert "unknown name among the policies 'detuor'; allowed: detour, coordinate" in said


def test_list_has_every_key_that_scenarios_have(airground: Airground) -> None:
    listed = {line.partition(" (")[0] for line in airground("list", "keys").splitlines() if not line.startswith(" ")}

    def keys(value: object, path: str) -> Iterator[str]:
        if isinstance(value, dict):
            named = path in ("ugvs", "obstacles", "runs")
            for key, each in value.items():
                yield from keys(each, f"{path}.{'NAME' if named else key}".lstrip("."))
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            yield from keys(value[0], f"{path}.N")
        elif not path.endswith((".NAME", ".N")):
            yield path

    for name in ("case_a", "crowd"):
        found = {key for key in keys(resolved(load(name)), "") if not key.startswith(FREE)}
        found = {key for key in found if not re.search(r"\.(parameters|expected|set|stalls_m)\.", key)}
        assert found - listed == set()
    assert len(listed) > 100
    assert airground("list", "keys", "control").count("control.period_s (") == 1
    assert "channel.up.loss (a number, 0 or more, below 1): " in airground("list", "keys", "channel.up")
    assert "ugvs.NAME.max_speed_m_s (" in airground("list", "keys", "max_speed_m_s")
    assert "unknown key 'nothing'" in airground("list", "keys", "nothing", code=2)


@pytest.mark.parametrize(
    ("file", "name", "taken"),
    [
        ("mine.yaml", "mine", "mine.yaml"),
        ("case_a", "case_a", "./case_a"),
        ("audit", "audit", "./audit"),
        ("-x.yaml", "x", "./-x.yaml"),
        ("new/on the floor.yaml", "on_the_floor", "'new/on the floor.yaml'"),
        ("nowhere/../here.yaml", "here", "here.yaml"),
        ("7 floors.yaml", "floors", "'7 floors.yaml'"),
        ("7.yaml", "minimal", "7.yaml"),
        ("n" * 100 + ".yaml", "n" * 64, "n" * 100 + ".yaml"),
    ],
)
def test_init_writes_a_scenario_and_prints_what_runs_it(
    file: str, name: str, taken: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, airground: Airground
) -> None:
    monkeypatch.chdir(tmp_path)
    assert airground("init", "--", file).endswith(f"next: airground report {taken}\n")
    scenario = load(*shlex.split(taken))
    assert (scenario.name, list(scenario.ugvs)) == (name, ["ugv1"])
    assert not Path("nowhere").exists()


def test_init_copies_a_shipped_scenario(tmp_path: Path, airground: Airground) -> None:
    for name in shipped():
        airground("init", tmp_path / f"copy_of_{name}.yaml", "--like", name)
        copy, model = load(tmp_path / f"copy_of_{name}.yaml"), load(name)
        assert copy.name == f"copy_of_{name}"
        assert replace(copy, name=name) == model


def test_init_writes_a_fleet(tmp_path: Path, airground: Airground) -> None:
    airground("init", tmp_path / "field.yaml", "--fleet", 4, "--obstacles", 6, "--seed", 2)
    scenario = load(tmp_path / "field.yaml")
    assert (scenario.name, len(scenario.ugvs), len(scenario.obstacles)) == ("field", 4, 6)
    airground("init", tmp_path / "large.yaml", "--fleet", MAX_UGVS)
    assert len(load(tmp_path / "large.yaml").ugvs) == MAX_UGVS


def test_diagram_writes_the_formats_and_the_part_that_are_named(tmp_path: Path, airground: Airground) -> None:
    airground("diagram", "minimal", "--method", "b", "--format", "dot", "--format", "png", "-o", tmp_path)
    assert "minimal_method_b" in (tmp_path / "minimal.dot").read_text(encoding="utf-8")
    assert (tmp_path / "minimal.png").read_bytes().startswith(b"\x89PNG")
    extra = "ugvs.ugv2={start_m: [9, 9, 0], target_m: [9, 8, 0], "
    extra += "preset: {waypoints_m: [[9, 9, 0], [9, 8, 0]], speed_m_s: 1}}"
    airground("diagram", "minimal", "--set", extra, "--part", "vehicles", "--format", "dot", "-o", tmp_path)
    assert "ugv2_plant" in (tmp_path / "minimal_vehicles.dot").read_text(encoding="utf-8")


def test_diagram_shows_figure_2_of_the_paper(tmp_path: Path, airground: Airground) -> None:
    """Method (c), whose gatekeeper is an MPC, where the scenario has it; else the most complete method."""
    airground("diagram", "case_a", "--format", "dot", "-o", tmp_path)
    assert "MPC, (21)-(26)" in (tmp_path / "case_a.dot").read_text(encoding="utf-8")
    airground("diagram", "contact", "--format", "dot", "-o", tmp_path)
    assert "contact_method_d" in (tmp_path / "contact.dot").read_text(encoding="utf-8")
    assert (tmp_path / "case_a.dot").read_bytes() == Path(__file__).parents[2].joinpath(
        "diagrams/case_a.dot"
    ).read_bytes()


FREE = ("expected.", "claims.")
"""Mappings with free names at the top of a scenario."""
SPEC = "scenario: minimal\nruns: [d]\nset: {duration_s: 1.0}\ndraw: {seed: {integer: [0, 9]}}\n"
MISTAKES = """
                                        # a command is needed: report, run
--versoin                               # is no command: commands are report
repot case_a                            # did you mean report?
report                                  # a scenario is needed
report minimal --format html,,json      # formats are html, json, junit
report minimal --limit-steps x          # a number above 0, at most 1e+15
report minimal --limit-memory nan       # a number above 0, at most 1e+15
report no_such_scenario                 # case_a
report minimal --set no.such=1          # no
report case_a --set intervention.policies.0.name=teleport # teleport
report case_a --set intervention.policies.0.parameters.warp=9 # allowed: speed_m_s (needed), clearance_m
report case_a --set decision.noise_period_s=1e-9 # allowed: 1e+07 steps, 8 GiB
report case_a --limit-steps 100 --limit-memory 0.1 # allowed: 1e+02 steps, 0.1 GiB
report minimal --seed x                 # invalid int value: 'x'
report minimal -o spec.yaml             # spec.yaml cannot be written
report minimal --set gatekeeper=&a      #
report spec.yaml                        # spec.yaml:1: scenario: unknown key
report a b                              # unrecognized arguments: b; wanted: scenario
report minimal --fromat html            # did you mean --format?
run minimal d --set duration_s=1e12     # duration_s
run minimal d -o spec.yaml/below        # cannot be written: Not a directory; wanted: a folder for the trace
run minimal z                           # unknown run 'z'; allowed: a, d
run minimal d --speed 2                 # --speed needs --meshcat
check                                   # the following arguments are required: DIR
check .                                 # report.json: No such file or directory; wanted: the file can be read
check --limit-s 0 report                # a number above 0
check spec.yaml                         # report.json: Not a directory; wanted: the file can be read
list nothing                            # invalid choice: 'nothing'
verify                                  # the following arguments are required: target
verify . SAFE-TRACE                     # . is not a saved run: it has no meta.json; wanted: DIR/trace/RUN
compare one                             # the following arguments are required: AFTER
compare . .                             # is not a report
index .                                 # there are no reports
index nowhere                           # there are no reports
prove . --run z                         #
prove --run z                           # --run needs DIR
prove report --record                   # --record and DIR exclude each other
campaign                                # the following arguments are required: spec
campaign .                              #
campaign minimal                        # no such file; wanted: the path of a campaign
campaign spec.yaml -n 0                 # a whole number from 1 on
campaign spec.yaml -n 99999999999999999999 # allowed: 4e+06 rows, one for each draw, run and claim
campaign spec.yaml --only -1            # a whole number from 0 to 2147483647
campaign spec.yaml --only 2 --resume    # --only excludes -n
campaign spec.yaml --only 2 -n 3        # --only excludes -n
campaign spec.yaml --only 2 -o mine.txt # mine.txt exists; name a file that does not
campaign spec.yaml --only 2 -o mine.txt/one.yaml # cannot be written
campaign spec.yaml -n 2 --jobs 1000000  # a whole number from 1 to 1000
campaign spec.yaml --limit-steps nan    # a number above 0
campaign spec.yaml --limit-time inf     # a number above 0
campaign spec.yaml -o spec.yaml         # cannot be written: File exists; wanted: a folder for the campaign
campaign spec.yaml --stop-when e        # wanted: CLAIM < PROBABILITY
campaign spec.yaml --stop-when COMMA<.1 # unknown claim that is judged 'COMMA'
falsify spec.yaml -n x                  # a whole number from 1 on
falsify spec.yaml --shrink -1           # a whole number from 0 on
falsify spec.yaml --jobs 0              # a whole number from 1 to 1000
falsify spec.yaml --limit 1             # --limit needs --most
falsify spec.yaml --most intervened_s --limit 0 # a number above 0
falsify spec.yaml --claim SAFE-INV      # unknown claim about runs 'SAFE-INV'
falsify spec.yaml --sampler nothing     # one of cma, halton, random, module:Class or file.py:Class
falsify spec.yaml --sampler os:path     # --allow-plugins
falsify spec.yaml --sampler os:path --allow-plugins # --sampler: sampler 'os:path'
falsify nothing.yaml                    # nothing is drawn
falsify spec.yaml -o .                  # . exists; name a file that does not
falsify spec.yaml -o new/               # 'new/' is a folder
falsify spec.yaml -o spec.yaml/x.yaml   # cannot be written
falsify spec.yaml -o /proc/found.yaml   # cannot be written
judge /dev/zero --scenario minimal      # not a regular file
judge nowhere.csv --scenario minimal    # nowhere.csv: No such file
judge spec.yaml --scenario minimal      # spec.yaml:
judge spec.yaml --scenario spec.yaml    # spec.yaml:
export report x --to csv                # unknown run 'x'; allowed: c, d
export report --to csv -o report        # is in the report
export . --to csv                       # . is not a report
replay report x                         # unknown run 'x'; allowed: c, d
replay report/trace                     # is not a report
replay nowhere d                        # is not a report
replay report -o report/new             # is in the report
replay report -o mine.txt               # mine.txt cannot be written: File exists; wanted: a folder for the pages
replay report -o x.html                 # x.html is one file for the runs c, d; name a RUN, or a folder
replay report d --video report/d.webp   # is in the report
replay report d --video d.avi           # allowed: names that end in .webp or .mp4
replay report --video x.webp            # --video needs a RUN
replay report d --video x.webp -o y   # not allowed with
replay report d --video x.webp --speed nan # a number from 0.1 to 100
replay report d --speed 2               # --speed needs --video
figures spec.yaml                       # is not a report
diagram nowhere.yaml                    # nowhere.yaml
diagram minimal --set duration_s=-1     # duration_s
diagram minimal --part nothing          # unknown part 'nothing'; allowed: decision_making
diagram minimal -o spec.yaml            # cannot be written
init mine.yaml --obstacles 3            # --obstacles and --seed need --fleet
init mine.yaml --fleet 4 --like lab     # --like and --fleet exclude each other
init mine.yaml --like nowhere           # invalid choice: 'nowhere'
init mine.yaml --fleet 101              # a whole number from 1 to 100
init spec.yaml                          # spec.yaml exists; name a file that does not
init nowhere/../spec.yaml               # spec.yaml exists; name a file that does not
init spec.yaml/below                    # cannot be written
init new/                               # 'new/' is a folder; wanted: the name of a file
"""


@pytest.mark.parametrize(
    ("line", "says"), [[part.strip() for part in each.split("#")] for each in MISTAKES.strip("\n").splitlines()]
)
def test_a_mistake_is_one_line_and_leaves_nothing(
    line: str, says: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, airground: Airground
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in (("spec.yaml", SPEC), ("nothing.yaml", "scenario: minimal\n"), ("mine.txt", "mine")):
        Path(name).write_text(text, encoding="utf-8")
    before = {path: path.is_file() and path.read_bytes() for path in tmp_path.rglob("*")}
    assert says in airground(*line.split(), code=2)
    assert {path: path.is_file() and path.read_bytes() for path in tmp_path.rglob("*")} == before


def test_a_closed_output_pipe_is_no_error() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    ran = subprocess.run([*AIRGROUND, "list", "methods"], stdout=writing, stderr=subprocess.PIPE, check=False)
    os.close(writing)
    assert (ran.returncode, ran.stderr) == (128 + signal.SIGPIPE, b"")


def test_a_full_disk_is_one_line() -> None:
    with Path("/dev/full").open("w") as full:
        ran = subprocess.run([*AIRGROUND, "list", "methods"], stdout=full, stderr=subprocess.PIPE, check=False)
    assert (ran.returncode, ran.stderr.count(b"\n")) == (4, 1)


@pytest.mark.parametrize("stderr", ["2>&-", "2>/dev/full"])
@pytest.mark.parametrize(("line", "code"), [("list methods", 0), ("report", 2), ("check .", 2)])
def test_without_standard_error_the_exit_code_is_the_same(line: str, code: int, stderr: str) -> None:
    command = f'exec "{sys.executable}" -m airground_drake {line} >/dev/null {stderr}'
    assert subprocess.run(command, shell=True, check=False).returncode == code


def test_an_unexpected_exception_is_the_tools_fault() -> None:
    program = "from airground_drake.base import interruption; interruption.run(lambda: 1 // 0)"
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (ran.returncode, "ZeroDivisionError" in ran.stderr) == (4, True)
