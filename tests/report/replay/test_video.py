"""Videos: as many pictures as the speed asks for, that differ; one line if a video cannot be made."""

from pathlib import Path

import pytest
from matplotlib.animation import FFMpegWriter
from PIL import Image

from airground_drake.base.errors import ReplayError
from airground_drake.report.replay import video
from airground_drake.report.replay.scene import Scene


def test_an_animated_webp(scene: Scene, tmp_path: Path) -> None:
    video.write(scene, tmp_path / "run.webp", speed=60.0)
    with Image.open(tmp_path / "run.webp") as picture:
        assert picture.n_frames == 9  # 30 s, 60 times as fast, 15 pictures per s, and the end
        first = picture.convert("RGB").tobytes()
        picture.seek(5)
        assert picture.convert("RGB").tobytes() != first
        assert max(picture.size) <= video.MOST_PX + 60


@pytest.mark.parametrize(
    ("name", "speed", "says"),
    [
        ("run.webp", 0.1, r"4500 pictures at speed 0.1; allowed: 600, at 1$"),
        ("run.gif", 4.0, "allowed: names that end in .webp or .mp4"),
        ("run.mp4", 4.0, "needs the program ffmpeg"),
    ],
)
def test_a_video_that_cannot_be_made(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, speed: float, says: str
) -> None:
    monkeypatch.setattr(FFMpegWriter, "isAvailable", lambda: False)
    with pytest.raises(ReplayError, match=says):
        video.write(scene, tmp_path / name, speed)
    assert list(tmp_path.iterdir()) == []


def test_an_ffmpeg_without_the_codec(scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "ffmpeg").write_text("#!/bin/sh\ncat > /dev/null\nexit 1\n")
    (tmp_path / "ffmpeg").chmod(0o755)
    monkeypatch.setattr(FFMpegWriter, "isAvailable", lambda: True)
    monkeypatch.setattr(FFMpegWriter, "bin_path", lambda self: str(tmp_path / "ffmpeg"))
    with pytest.raises(ReplayError, match=r"no encoder here for \.mp4"):
        video.write(scene, tmp_path / "run.mp4", 60.0)
    assert not (tmp_path / "run.mp4").exists()
