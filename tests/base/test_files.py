"""Files are written whole or not at all, and what killed processes have left is swept."""

import errno
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from airground_drake.base import files


def test_a_file_replaces_another_and_leaves_nothing_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "file.txt"
    for text in ("one", "two"):
        files.write_text(path, text)
        assert path.read_text() == text
    assert os.listdir(path.parent) == ["file.txt"]


@pytest.mark.parametrize("call", ["fsync", "replace", "chmod"])
def test_a_full_disk_names_the_path_and_leaves_the_old_file(
    call: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "file.txt"
    files.write_text(path, "old")

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, call, full)
    with pytest.raises(OSError, match=r"No space left on device.*file\.txt"):
        files.write_text(path, "new")
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["file.txt"]


def test_the_temporary_files_of_a_killed_process_are_swept_and_nothing_else(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", ""]) as ended:
        pass
    left = tmp_path / f".states.parquet.{ended.pid}.abc_12.partial"
    kept = [
        tmp_path / f".states.parquet.{os.getpid()}.abc_12.partial",
        tmp_path / ".x.partial",
        tmp_path / "a.1.b.partial",
    ]
    for path in (left, *kept):
        path.touch()
    files.sweep(tmp_path.parent)
    assert not left.exists()
    assert all(path.exists() for path in kept)


def test_the_temporary_folder_of_a_killed_process_is_swept_and_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    program = "import os; from airground_drake.base import files; made = files.temporary_folder(); "
    program += "(made.__enter__() / 'trace').mkdir(); os.kill(os.getpid(), 9)"
    subprocess.run([sys.executable, "-c", program], env={**os.environ, "TMPDIR": str(tmp_path)}, check=False)
    (left,) = tmp_path.iterdir()
    with files.temporary_folder() as mine, files.temporary_folder() as another:
        assert (left.exists(), mine.is_dir(), another.is_dir()) == (False, True, True)
    assert os.listdir(tmp_path) == []
