"""Units, numbers of frames and axes that a log leaves open: found only where they are certain, else asked for."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import logs
from builders.logs import BROKEN, Motion, document

from airground_drake.base.errors import LogError
from airground_drake.study.logs import words
from airground_drake.study.logs.judging import judge
from airground_drake.study.logs.stream import Stream

FULL = logs.motion()


def moved(bodies: Motion, **change: Callable[[Any, Any], tuple[Any, Any]]) -> Motion:
    return {name: change.get(name, change.get("all", lambda t, p: (t, p)))(*both) for name, both in bodies.items()}


def written(
    folder: Path, bodies: Motion, head: str = "t,body,x,y,z", stamp: str = "{:.6f}", scale: float = 1.0
) -> Path:  # fmt: skip
    (folder / "log.csv").write_text(logs.text(logs.long(bodies, head, lambda t: stamp.format(t), scale)))
    return folder / "log.csv"


def least_m(path: Path, scenario: dict[str, Any], **choice: Any) -> tuple[float, list[str]]:
    found = logs.read(path, scenario, **choice)
    pairs = {(pair.first, pair.second): pair for pair in judge(found, scenario).pairs}
    return pairs[BROKEN].least_m, found.remarks


RIGHT_M = logs.least_gaps(FULL)[BROKEN][0]


def offset(t: Any, p: Any) -> tuple[Any, Any]:
    return t, p + np.array([100.0, 60.0, 0.0])


def resting(t: Any, p: Any) -> tuple[Any, Any]:
    """An hour of which the robots stand still but for the last seconds."""
    return np.append(0.0, t + 3600.0), np.concatenate([p[:1], p])


@pytest.mark.parametrize("change", [offset, resting])
def test_metres_and_seconds_stand_unless_they_are_impossible(change: Callable[..., Any], tmp_path: Path) -> None:
    """Robots in a frame whose origin is far away are no robots in centimetres; nor does a long rest make a log one."""
    path = written(tmp_path, moved(FULL, all=change))
    found, said = least_m(path, document(tmp_path, obstacles={}), gap_s=1e4)
    assert found == pytest.approx(RIGHT_M, abs=1e-9)
    assert not any("taken as" in each for each in said)


def test_obstacles_are_not_judged_in_another_frame(tmp_path: Path) -> None:
    """Far from all that the scenario has, distances to its obstacles would be kept; near it, the verdict says 'if'."""
    with pytest.raises(LogError, match=r"tb_0 starts 117 m from its start in the scenario, .* is in another frame"):
        least_m(written(tmp_path, moved(FULL, all=offset)), document(tmp_path))
    aside = moved(FULL, all=lambda t, p: (t, p + np.array([3.0, 2.0, 0.0])))
    kept = moved(aside, tb_1=lambda t, p: (t, p + np.array([0.0, 0.5, 0.0])))
    for obstacles, says in ((logs.scenario()["obstacles"], ", if the log is in the scenario's frame."), ({}, ".")):
        scenario = document(tmp_path, obstacles=obstacles)
        judged = judge(logs.read(written(tmp_path, kept), scenario), scenario)
        assert words.headline(judged) == f"Every distance was kept, with straight motion between samples{says}"


@pytest.mark.parametrize("rate", [10.0, 25.0, 100.0])
@pytest.mark.parametrize("head", ["t,body,x,y,z", "frame,body,x,y,z", "Frame_Number,body,x,y,z"])
def test_numbers_of_frames_are_no_seconds(head: str, rate: float, tmp_path: Path) -> None:
    frames = moved(FULL, all=lambda t, p: (rate * t[:: round(20 / min(rate, 20))], p[:: round(20 / min(rate, 20))]))
    path = written(tmp_path, frames, head, "{:.0f}")
    with pytest.raises(LogError, match=r"wanted: --rate-hz"):
        logs.read(path, document(tmp_path))
    found, said = least_m(path, document(tmp_path), rate_hz=rate)
    coarse = {name: (t_s / rate, places) for name, (t_s, places) in frames.items()}
    assert found == pytest.approx(logs.least_gaps(coarse)[BROKEN][0], abs=1e-9)
    assert f"times are numbers of frames, {rate:g} per second: as chosen" in said


def test_a_rate_without_frames_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="--rate-hz is for logs whose times are numbers of frames"):
        logs.read(written(tmp_path, FULL, "t_s,body,x,y,z"), document(tmp_path), rate_hz=25.0)


def test_eight_columns_without_a_header_are_tum_only_if_four_are_a_quaternion(tmp_path: Path) -> None:
    """Frame, pedestrian, position and velocity, as in the ETH data set: the pedestrian is no place."""
    for name in ("tb_0", "tb_1"):
        lines = [f"{6 * k:.7e} 1.0e+00 {x:.7e} 0.0e+00 {y:.7e} 4.0e-01 0.0e+00 0.0e+00"
                 for k, (x, y, _) in enumerate(FULL[name][1])]  # fmt: skip
        (tmp_path / f"{name}.txt").write_text("\n".join(lines))
    scenario, paths = document(tmp_path), [tmp_path / "tb_0.txt", tmp_path / "tb_1.txt"]
    with pytest.raises(LogError, match="it lacks a column of times and columns x and y: its columns are 1, 2, 3"):
        logs.read(paths, scenario)
    columns = {"t": "1", "x": "3", "y": "5"}
    with pytest.raises(LogError, match=r"whole numbers that fit no unit.*wanted: --rate-hz"):
        logs.read(paths, scenario, columns=columns)
    found, _ = least_m(paths, scenario, columns=columns, rate_hz=120.0)  # type: ignore[arg-type]
    assert found == pytest.approx(RIGHT_M, abs=1e-6)


@pytest.mark.parametrize(
    ("columns", "head", "says"),
    [
        ({"frame": "battery"}, "t,body,x,y,z,battery", "--map-columns frame=battery has no effect"),
        ({"body": "battery"}, "t,who,tb_0_x,tb_0_y,tb_0_z,battery", "--map-columns body=battery has no effect"),
        ({"z": "battery"}, "t,who,tb_0_x,tb_0_y,tb_0_z,battery", "--map-columns z=battery has no effect"),
        ({"x": "east_ft"}, "t,body,east_ft,y,z,battery", "says 'ft'; wanted: a column in m, cm, mm; if its name is wr"),
        ({"x": "EastIn"}, "t,body,EastIn,y,z,battery", "x=EastIn: the name of that column says 'in'; wanted: a column"),
        ({"x_m": "east [mm]"}, "t,body,east [mm],y,z,b", r"says 'mm'; wanted: x_mm=east \[mm\]; if its name is wrong"),
        ({"t": "clock_min"}, "clock_min,body,x,y,z,battery", "says 'min'; wanted: a column in s, ms, us, ns; if its"),
    ],
)
def test_a_column_that_is_chosen_in_vain_or_in_another_unit_is_refused(
    columns: dict[str, str], head: str, says: str, tmp_path: Path
) -> None:
    rows = [[*line, "97"] for line in logs.long({"tb_0": FULL["tb_0"]})[1:]]
    (tmp_path / "tb_0.csv").write_text(logs.text([head.split(","), *rows]))
    with pytest.raises(LogError, match=says):
        logs.read(tmp_path / "tb_0.csv", document(tmp_path), columns=columns, without=["tb_1"])


def test_columns_are_not_chosen_of_messages(tmp_path: Path) -> None:
    logs.mcap_json(tmp_path / "a.mcap", logs.foxglove(FULL, {}))
    with pytest.raises(LogError, match="--map-columns is for tables"):
        logs.read(tmp_path / "a.mcap", document(tmp_path), columns={"x": "east"})


def up(t: Any, p: Any) -> tuple[Any, Any]:
    return t, np.stack([p[:, 0], p[:, 2] + 0.12, -p[:, 1]], axis=1)


def yawed(t: Any, p: Any) -> tuple[Any, Any]:
    """North is along no axis of the scenario, and z is down."""
    c, s = np.cos(0.7), np.sin(0.7)
    return t, np.stack([c * p[:, 0] + s * p[:, 1], s * p[:, 0] - c * p[:, 1], -p[:, 2]], axis=1)


def swapped(t: Any, p: Any) -> tuple[Any, Any]:
    return t, np.stack([p[:, 1], p[:, 0], -p[:, 2]], axis=1)


@pytest.mark.parametrize(
    ("change", "bodies", "says"),
    [
        (up, ("tb_0", "tb_1", "uav"), r"--axes x,-z,y, with which they begin at their starts, if y is up"),
        (yawed, ("tb_0", "tb_1", "uav"), r"uav is at a height of -1\.\d+ m, below the ground; wanted: --axes y,x,-z"),
        (swapped, ("tb_0", "tb_1"), r"begin where the scenario has them only if x is north, y east and z down"),
    ],
)
def test_axes_that_are_not_the_scenario_s_are_asked_for(
    change: Callable[..., Any], bodies: tuple[str, ...], says: str, tmp_path: Path
) -> None:
    path = written(tmp_path, moved(logs.motion(bodies), all=change))
    with pytest.raises(LogError, match=f"the axes of the log are not clear: .*{says}"):
        logs.read(path, document(tmp_path))
    found, said = least_m(path, document(tmp_path), axes={"": "x,y,z"})
    assert "axes: x,y,z are x, y, z, as chosen" in said
    assert found == pytest.approx(RIGHT_M, abs=1e-4) or change is up


def test_heights_alone_tell_y_up_where_starts_do_not(tmp_path: Path) -> None:
    aside = moved(logs.motion(("tb_0", "tb_1")), all=lambda t, p: up(t[20:], p[20:] + np.array([3.0, 1.0, 0.0])))
    turned = moved(aside, all=lambda t, p: (t, p[:, [2, 1, 0]]))
    for bodies, spans in ((aside, "0.7"), (turned, "1.92")):
        with pytest.raises(LogError, match=rf"y of what drives on the ground varies by \S+ m, and z spans {spans}"):
            logs.read(written(tmp_path, bodies), document(tmp_path))


def test_a_stamp_that_64_bits_do_not_hold_is_refused(tmp_path: Path) -> None:
    whole = np.array([10**9, 2 * 10**10])
    stream = Stream("a", "a", whole, 0 * whole, np.zeros((2, 3)))
    with pytest.raises(LogError, match="more than 292 years"):
        stream.ns("s")
    assert stream.elapsed_s("s").tolist() == [0.0, 1.9e10]
    path = written(tmp_path, moved(FULL, all=lambda t, p: (t + 1e10, p)), "t_s,body,x,y,z", "{:.3f}")
    with pytest.raises(LogError, match="more than 292 years"):
        logs.read(path, document(tmp_path))
