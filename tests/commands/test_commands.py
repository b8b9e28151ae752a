"""The command line `airground`: every command is found, and imported only when used."""

from __future__ import annotations

import ast
import contextlib
import os
import shlex
import signal
import subprocess
import sys
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path

import pytest

import airground_drake
from airground_drake.commands import COMMANDS, main
from airground_drake.commands.listing import KINDS
from airground_drake.registry import METHODS, MODEL_CLAIMS, POLICIES, ROUTES, RUN_CLAIMS, SAMPLERS, UAV_TASKS
from airground_drake.scenarios.limits import MAX_UGVS
from airground_drake.scenarios.load import load, shipped


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_says_how_it_is_used(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert callable(import_module(COMMANDS[name].module).main)
    with contextlib.suppress(SystemExit):
        assert main([name, "--help"]) == 0
    assert "usage:" in capsys.readouterr().out


def imported(*arguments: str) -> tuple[str, set[str]]:
    """What `airground ARGUMENTS` prints in a process of its own, and which modules are then imported."""
    code = "import sys; from airground_drake.commands import main\ntry: main(sys.argv[1:])\nexcept SystemExit: pass\n"
    code += "print(*sys.modules, file=sys.stderr)"
    ran = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True)
    return ran.stdout, set(ran.stderr.split())


def test_help_names_all_commands() -> None:
    said, modules = imported("--help")
    assert all(f"  {name} " in said for name in COMMANDS)
    assert not {command.module for command in COMMANDS.values()} & modules


@pytest.mark.parametrize(
    "arguments", [("--version",), ("list",), ("completion", "bash"), *((name, "--help") for name in COMMANDS)]
)
def test_what_takes_long_is_imported_when_it_is_used(arguments: tuple[str, ...]) -> None:
    said, modules = imported(*arguments)
    heavy = "numpy pandas scipy numba cvxpy flint matplotlib jinja2 pydantic pydrake pygraphviz"
    assert said
    assert not set(heavy.split()) & modules


def test_a_command_that_is_none(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["repot", "case_a"]) == 2
    assert "did you mean report?" in capsys.readouterr().err
    with pytest.raises(SystemExit) as ended:
        main([])
    assert ended.value.code == 2


def test_module_and_console_script_are_the_same_command() -> None:
    script = next(each for each in entry_points(group="console_scripts") if each.name == "airground")
    assert script.value == "airground_drake.commands:entry"
    ran = subprocess.run([sys.executable, "-m", "airground_drake", "list", "methods"], capture_output=True, text=True)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert ran.stdout.splitlines()[0] == "methods:"


def test_list_has_everything_that_can_be_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if not line.startswith(" ")] == [f"{kind}:" for kind in KINDS]
    listed = {line.split()[0]: line.split(maxsplit=1)[1:] for line in lines if line.startswith("  ")}
    assert set(listed) == {*shipped(), *METHODS, *POLICIES, *ROUTES, *UAV_TASKS, *SAMPLERS, *RUN_CLAIMS, *MODEL_CLAIMS}
    assert all(listed.values())


@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("mine.yaml", "mine"),
        ("new/on the floor.yaml", "on_the_floor"),
        ("7 floors.yaml", "floors"),
        ("7.yaml", "minimal"),
        ("n" * 100 + ".yaml", "n" * 64),
    ],
)
def test_init_writes_a_scenario_that_is_valid(tmp_path: Path, file: str, name: str) -> None:
    path = tmp_path / file
    assert main(["init", str(path)]) == 0
    assert load(path)[0].name == name
    assert len(path.read_text(encoding="utf-8").splitlines()) < 26


def test_init_writes_a_fleet(tmp_path: Path) -> None:
    path = tmp_path / "field.yaml"
    assert main(["init", str(path), "--fleet", "4", "--obstacles", "6", "--seed", "2"]) == 0
    scenario = load(str(path))[0]
    assert (scenario.name, len(scenario.ugvs), len(scenario.obstacles)) == ("field", 4, 6)
    assert main(["init", str(tmp_path / "large.yaml"), "--fleet", str(MAX_UGVS)]) == 0
    assert len(load(tmp_path / "large.yaml")[0].ugvs) == MAX_UGVS


@pytest.mark.parametrize(
    ("file", "taken"),
    [
        ("mine.yaml", "mine.yaml"),
        ("case_a", "./case_a"),
        ("audit", "./audit"),
        ("on the floor.yaml", "'on the floor.yaml'"),
        ("-x.yaml", "./-x.yaml"),
    ],
)
def test_what_init_prints_can_be_run(
    file: str, taken: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["init", "--", file]) == 0
    assert capsys.readouterr().out.endswith(f"next: airground report {taken}\n")
    assert load(*shlex.split(taken))[0].ugvs.keys() == {"ugv1"}


def test_diagram_writes_what_was_asked_for(tmp_path: Path) -> None:
    assert main(["diagram", "minimal", "--method", "b", "--format", "dot", "--format", "png", "-o", str(tmp_path)]) == 0
    assert (tmp_path / "minimal.dot").read_text(encoding="utf-8").startswith("digraph")
    assert (tmp_path / "minimal.png").read_bytes().startswith(b"\x89PNG")
    assert "minimal_method_b" in (tmp_path / "minimal.dot").read_text(encoding="utf-8")
    assert main(["diagram", "minimal", "--part", "task_planning", "--format", "svg", "-o", str(tmp_path)]) == 0
    assert "ugv_controller" in (tmp_path / "minimal_task_planning.svg").read_text(encoding="utf-8")
    preset = "{waypoints_m: [[9, 9, 0], [9, 8, 0]], speed_m_s: 1}"
    extra = f"ugvs.ugv2={{start_m: [9, 9, 0], target_m: [9, 8, 0], preset: {preset}}}"
    assert (
        main(["diagram", "minimal", "--set", extra, "--part", "vehicles", "--format", "dot", "-o", str(tmp_path)]) == 0
    )
    assert "ugv2_plant" in (tmp_path / "minimal_vehicles.dot").read_text(encoding="utf-8")


def test_diagram_shows_the_method_that_a_report_shows(tmp_path: Path) -> None:
    """The last run of case_a has method (a)."""
    assert main(["diagram", "case_a", "--format", "dot", "-o", str(tmp_path)]) == 0
    shipped = Path(__file__).parents[2] / "diagrams" / "case_a.dot"  # of method (d), held by tests/test_diagram.py
    assert (tmp_path / "case_a.dot").read_text(encoding="utf-8") == shipped.read_text(encoding="utf-8")


SPEC = "scenario: minimal\nruns: [d]\nset: {duration_s: 1.0}\ndraw: {seed: {integer: [0, 9]}}\n"
MISTAKEN = """
--versoin
-x
report
report minimal --format pdf
report minimal --format html,,json
report minimal --limit-steps x
report minimal --limit-memory nan
report minimal --seed x
report minimal -o spec.yaml
report minimal --set gatekeeper=&a
report spec.yaml
report a b
run minimal d --set duration_s=1e12
run minimal d -o spec.yaml/below
run minimal z
run minimal d --speed 2
replay . d --speed 2
replay . --video x.webp
check
check spec.yaml
list nothing
verify
verify . SAFE-TRACE
compare one
compare . .
index .
proofs
prove . --run z
campaign
campaign .
campaign minimal
campaign spec.yaml -n 0
campaign spec.yaml -n 99999999999999999999
campaign spec.yaml --only x
campaign spec.yaml --only -1
campaign spec.yaml --only 99999999999999999999
campaign spec.yaml --only 2 --resume
campaign spec.yaml --only 2 -n 3
campaign spec.yaml -n 2 --jobs -1
campaign spec.yaml -n 2 --jobs 1000000
campaign spec.yaml --limit-steps nan
campaign spec.yaml --limit-steps 0
campaign spec.yaml --limit-time 0
campaign spec.yaml --limit-time inf
campaign spec.yaml -o spec.yaml
falsify spec.yaml -n 0
falsify spec.yaml -n x
falsify spec.yaml --shrink -1
falsify spec.yaml --jobs 0
falsify spec.yaml --limit 1
falsify spec.yaml --most intervened_s --limit 0
falsify spec.yaml --most intervened_s --limit nan
falsify spec.yaml --most intervened_s --limit inf
falsify spec.yaml --claim NONE
falsify spec.yaml -o .
judge /dev/zero --scenario minimal
judge spec.yaml --scenario minimal
judge spec.yaml --scenario spec.yaml
export . --to csv
replay . d
figures spec.yaml
diagram nowhere.yaml
diagram minimal --set duration_s=-1
diagram minimal --part nothing
diagram minimal -o spec.yaml
init mine.yaml --obstacles 3
init mine.yaml --seed 3
init mine.yaml --fleet 0
init mine.yaml --fleet 101
init spec.yaml
init spec.yaml/below
completion fish
"""


@pytest.mark.parametrize("line", MISTAKEN.splitlines())
def test_a_mistaken_command_line_is_one_line_and_leaves_nothing(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("spec.yaml").write_text(SPEC, encoding="utf-8")
    try:
        code: int | str | None = main(line.split())
    except SystemExit as ended:
        code = ended.code
    said = capsys.readouterr()
    assert (code, said.out, said.err.count("\n")) == (2, "", 1)
    assert said.err.startswith("error: ")
    assert [*tmp_path.iterdir()] == [tmp_path / "spec.yaml"]
    assert Path("spec.yaml").read_text(encoding="utf-8") == SPEC


def test_a_reader_that_has_gone_is_no_error() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "airground_drake", "list", "--schema"]
    ran = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, check=False)
    os.close(writing)
    assert (ran.returncode, ran.stderr) == (128 + signal.SIGPIPE, b"")


@pytest.mark.parametrize("line", ["list methods", "list --schema"])
def test_what_cannot_be_printed_is_one_line(line: str) -> None:
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "airground_drake", *line.split()]
        ran = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, check=False)
    assert (ran.returncode, ran.stderr.count(b"\n")) == (4, 1)


def test_exit_codes_that_commands_share_are_defined_once() -> None:
    package = Path(airground_drake.__file__).parent
    defined = [
        (path.relative_to(package).as_posix(), name.id)
        for path in package.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_bytes()))
        for name in (ast.walk(node) if isinstance(node, ast.Assign) else ())
        if isinstance(name, ast.Name) and isinstance(name.ctx, ast.Store) and name.id in ("EXIT_USAGE", "EXIT_TOOL")
    ]
    assert sorted(defined) == [("base/usage.py", "EXIT_TOOL"), ("base/usage.py", "EXIT_USAGE")]


@pytest.mark.parametrize("stderr", ["2>&-", "2>/dev/full"])
@pytest.mark.parametrize(
    ("line", "code"),
    [("list methods", 0), ("nothing", 2), ("report", 2), ("verify minimal NOTHING", 2), ("check .", 2)],
)
def test_where_nobody_can_be_told_the_exit_code_is_the_same(line: str, code: int, stderr: str) -> None:
    command = f'exec "{sys.executable}" -m airground_drake {line} >/dev/null {stderr}'
    assert subprocess.run(command, shell=True, check=False).returncode == code


def test_what_no_command_expects_is_the_tools_fault() -> None:
    program = "from airground_drake.base import interruption; interruption.run(lambda: 1 // 0)"
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert ran.returncode == 4
    assert "ZeroDivisionError" in ran.stderr
