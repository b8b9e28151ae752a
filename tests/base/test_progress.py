"""The progress of long work, on a terminal and elsewhere."""

import io
import sys
import threading
from contextlib import suppress

import pytest

from airground_drake.base import progress
from airground_drake.base.progress import progress_bar


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def work(*, fails: bool = False, **asked: bool) -> None:
    with progress_bar(**asked) as progress:
        progress.stage("simulating", 40.0, "s")
        progress.advance(10.0)
        if fails:
            raise ValueError
        progress.stage("checking", 3, "claims")
        progress.advance(1.0, "MINE a")
        progress.elapsed_s("THEIRS a", 1.5)
        progress.elapsed_s("OURS a", 1e-6)
        helper = threading.Thread(target=progress.advance, args=(1.0, "MINE b"))
        helper.start()
        helper.join()
        progress.stage("writing")


@pytest.mark.parametrize("fails", [False, True])
def test_a_terminal_is_shown_a_bar_that_leaves_nothing_behind(fails: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    monkeypatch.setenv("COLUMNS", "100")
    before = threading.active_count()
    with suppress(ValueError):
        work(fails=fails)
    said = terminal.getvalue()
    assert all(each in said for each in ("0/40 s", "left", *(["0/3 claims"][fails:])))
    assert "\n" not in said  # each bar takes the place of the one before
    assert said.rstrip(" ").endswith("\r")
    assert threading.active_count() == before


@pytest.mark.parametrize(("asked", "lines"), [({}, 0), ({"quiet": True}, 0), ({"verbose": True}, 1)])
def test_elsewhere_there_are_lines_only_if_they_are_asked_for(
    asked: dict[str, bool], lines: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stderr", file := io.StringIO())
    monkeypatch.setattr(progress, "SHOWN_S", 1.0)  # on a busy machine a stage may take longer than the package's 0.01 s
    work(**asked)
    assert file.getvalue() == "    1.50 s  THEIRS a\n" * lines


def test_elsewhere_a_stage_that_lasts_gets_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", file := io.StringIO())
    monkeypatch.setattr(progress, "TOLD_S", 0.0)
    work()
    assert file.getvalue() == "simulating: 10 of 40 s done\nchecking: 1 of 3 claims done\n"
    work(quiet=True)
    assert file.getvalue().count("\n") == 2
