"""What a user's machine may lack: a folder for compiled functions, characters, paths in UTF-8."""

import os
import subprocess
import sysconfig
from pathlib import Path

import pytest
from numba.core import caching

from airground_drake.base import compiling, files

WORLD = (
    "<sdf><world name='w'><model name='box'><link><collision><geometry><box><size>1 1 1</size></box></geometry>"
    "</collision></link></model></world></sdf>"
)


def test_where_nothing_can_be_kept_functions_are_compiled_and_it_is_said_once(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(caching.CacheImpl, "_locator_classes", [])  # none of numba's folders can be written
    compiling._say.cache_clear()
    one, two = (compiling.njit(cache=True)(lambda x, more=more: x + more) for more in (1, 2))
    assert (one(1), two(1)) == (2, 3)
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "NUMBA_CACHE_DIR can name a folder" in said


def test_what_is_called_with_a_constant_is_not_compiled_for_it_alone() -> None:
    inner = compiling.njit(cache=False)(lambda x, k: x * k)
    outer = compiling.njit(cache=False)(lambda x, k: inner(x, 2) + inner(x, k))
    assert outer(1.5, 3) == 7.5
    assert len(inner.signatures) == 1


@pytest.mark.slow
@pytest.mark.parametrize(("name", "encoding"), [(b"b\xff.yaml", "utf-8"), ("ü.yaml".encode(), "ascii")])
def test_a_path_that_cannot_be_printed_is_escaped(name: bytes, encoding: str, tmp_path: Path) -> None:
    """Under the folder's name, too, which is in the lines that the command prints."""
    (tmp_path / "box.world").write_text(WORLD)
    command = [os.path.join(sysconfig.get_path("scripts"), "airground"), "import", "barn", "box.world", "-o", name]
    environment = {**os.environ, "PYTHONIOENCODING": encoding}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"\\" in done.stdout
    assert os.path.exists(os.path.join(os.fsencode(tmp_path), name))


def test_a_text_with_a_path_that_is_not_utf_8_is_written_with_the_byte_escaped(tmp_path: Path) -> None:
    files.write_text(tmp_path / "a.txt", os.fsdecode(b"b\xff"))
    files.write_json(tmp_path / "a.json", [os.fsdecode(b"b\xff")])
    assert (tmp_path / "a.txt").read_bytes() == b"b\\udcff"
    assert (tmp_path / "a.json").read_bytes().split() == [b"[", b'"b\\udcff"', b"]"]
