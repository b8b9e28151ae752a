"""A replay seen from above as a video: animated WebP, or MP4 where ffmpeg is installed."""

from collections.abc import Callable
from pathlib import Path
from subprocess import CalledProcessError

import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from airground_drake.base import files
from airground_drake.base.arrays import Array
from airground_drake.base.errors import ReplayError
from airground_drake.report.replay.scene import DrawnBody, Scene, Sent
from airground_drake.report.view import canvas
from airground_drake.report.view.labels import place
from airground_drake.report.view.plane import draw_barriers, draw_robot
from airground_drake.report.view.stage import OUTCOME_COLORS, PATH_COLOR, STATE_COLORS, STATE_MARKS, UAV_COLOR, Barrier
from airground_drake.scenario.schema import Scenario

PICTURES_PER_S = 15  # pictures in a second of the video
MOST_PICTURES = 600  # pictures of a video at most: the encoder of WebP keeps all in memory, 1.6 MB each
WIDTH_PX, DPI, MOST_PX = 640, 100, 1000
SUFFIXES = (".webp", ".mp4")

_WAY = canvas.Look(PATH_COLOR, "-", "")
_BOX = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 1.0}

Update = Callable[[int], None]  # sets a part of the picture to a frame of the scene, by its index


def write(scene: Scene, path: Path, speed: float) -> None:
    """Write the video of a run, `speed` times as fast as the run."""
    shown = np.arange(0.0, scene.times_s[-1], speed / PICTURES_PER_S)
    if len(shown) > MOST_PICTURES:
        least = np.ceil(scene.times_s[-1] * PICTURES_PER_S / MOST_PICTURES)
        raise ReplayError(f"{path}: {len(shown)} pictures at speed {speed:g}; allowed: {MOST_PICTURES}, at {least:g}")
    frames = [*np.searchsorted(scene.times_s, shown - 1e-9), len(scene.times_s) - 1]
    with canvas.style(), files.temporary_folder() as folder:
        encoder = _encoder(path)
        figure, update = _picture(scene)
        part = folder / f"video{path.suffix}"
        try:
            with encoder.saving(figure, str(part), DPI):
                for frame in frames:
                    update(int(frame))
                    encoder.grab_frame()
        except (ValueError, OSError, CalledProcessError) as error:  # Pillow without WebP, ffmpeg without H.264
            raise ReplayError(f"{path}: no encoder here for {path.suffix}: {error}") from error
        files.write_bytes(path, part.read_bytes())


def _encoder(path: Path) -> AbstractMovieWriter:
    if path.suffix not in SUFFIXES:
        raise ReplayError(f"{path}: no video of this kind; allowed: names that end in {' or '.join(SUFFIXES)}")
    if path.suffix == ".webp":
        return PillowWriter(fps=PICTURES_PER_S)
    if not FFMpegWriter.isAvailable():
        raise ReplayError(f"{path}: MP4 needs the program ffmpeg, which is not installed; allowed: .webp")
    return FFMpegWriter(fps=PICTURES_PER_S, extra_args=["-pix_fmt", "yuv420p"])


def _picture(scene: Scene) -> tuple[Figure, Update]:
    """The picture of a scene, without a frame yet."""
    low, high = scene.low_m[:2] - 3.0 * scene.mark_m, scene.high_m[:2] + 3.0 * scene.mark_m
    width, height = high - low
    scale = min(WIDTH_PX / width, MOST_PX / height)
    size = 2 * np.round(np.array([max(width * scale, 240.0), height * scale + 50.0]) / 2.0)  # even, as codecs want it
    figure = Figure(figsize=tuple(size / DPI), dpi=DPI)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0 - 50.0 / size[1]))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    axes.set_axis_off()
    labels, edges = draw_barriers(axes, scene.scenario, moving=False)
    place(axes, labels, [*(body.positions for body in scene.robots), *edges])
    updates = [_proposal(axes, scene, proposal) for proposal in scene.proposals]
    updates += [_barrier(axes, scene.barriers[k], moved) for k, moved in scene.moved_m.items()]
    updates += [_robot(axes, scene.scenario, body) for body in scene.robots]
    figure.text(8.0 / size[0], 1.0 - 10.0 / size[1], f"{scene.scenario.name}, run {scene.run}: {scene.says}", va="top")
    clock = figure.text(8.0 / size[0], 1.0 - 30.0 / size[1], "", va="top", fontweight="bold")

    def update(frame: int) -> None:
        clock.set_text(f"{scene.times_s[frame]:.2f} s")
        for part in updates:
            part(frame)

    return figure, update


def _robot(axes: Axes, scenario: Scenario, body: DrawnBody) -> Update:
    draw_robot(axes, scenario, body.name, body.positions, _WAY, linewidth=0.7)
    shape = Circle((0.0, 0.0), body.radius_m, zorder=4, linewidth=2.0, fill=body.kind == "UGV")
    axes.add_patch(shape)
    name = axes.annotate(
        "", (0.0, 0.0), (0, 4), textcoords="offset points", ha="center", fontweight="bold", zorder=5, bbox=_BOX
    )

    def update(frame: int) -> None:
        at, state = body.positions[frame, :2], body.states[frame]
        color = STATE_COLORS[state] if body.kind == "UGV" else UAV_COLOR
        shape.set_center((float(at[0]), float(at[1])))
        shape.set(facecolor=color, edgecolor=color)
        name.xy = (float(at[0]), float(at[1]) + body.radius_m)
        name.set_text(f"{body.name} {STATE_MARKS[state]}".rstrip())

    return update


def _barrier(axes: Axes, barrier: Barrier, moved: Array) -> Update:
    """A barrier that moves, by (F, 3), m."""
    parts = PolyCollection(barrier.body, facecolor=barrier.color, edgecolor=canvas.INK, zorder=3)
    axes.add_collection(parts)
    name = axes.annotate(barrier.name, (0.0, 0.0), (0, 4), textcoords="offset points", ha="center", zorder=5, bbox=_BOX)

    def update(frame: int) -> None:
        by = moved[frame, :2]
        parts.set_verts([part + by for part in barrier.body])
        x, y = barrier.place_m[:2] + by
        name.xy = (float(x), float(y))

    return update


def _proposal(axes: Axes, scene: Scene, proposal: Sent) -> Update:
    (line,) = axes.plot(*proposal.path[:, :2].T, linewidth=2.2, visible=False, zorder=2)

    def update(frame: int) -> None:
        now = scene.times_s[frame]
        outcome = next((span.outcome for span in proposal.spans if span.start_s <= now < span.end_s), None)
        line.set_visible(outcome is not None)
        if outcome is not None:
            line.set(color=OUTCOME_COLORS[outcome], linestyle="-" if outcome == "accepted" else (0, (3, 2)))

    return update
