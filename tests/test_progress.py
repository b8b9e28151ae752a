"""What long work says of itself, to a terminal and to none."""

from __future__ import annotations

import io
import sys
import threading

import pytest

from airground_drake.base import progress
from airground_drake.base.progress import progress_bar


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def work(**asked: bool) -> None:
    with progress_bar(**asked) as progress:
        progress.stage("simulating", 40.0, "s")
        progress.advance(10.0)
        progress.stage("checking", 3, "claims")
        progress.advance(1.0, "MINE a")
        progress.elapsed_s("THEIRS a", 1.5)
        progress.elapsed_s("OURS a", 1e-6)
        helper = threading.Thread(target=progress.advance, args=(1.0, "MINE b"))
        helper.start()
        helper.join()
        progress.stage("writing")


def test_a_terminal_is_shown_what_of_how_much_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    monkeypatch.setenv("COLUMNS", "100")
    before = threading.active_count()
    work()
    said = terminal.getvalue()
    assert "0/40 s" in said
    assert "0/3 claims" in said
    assert "left" in said
    assert "\n" not in said  # each bar takes the place of the one before
    assert said.rstrip(" ").endswith("\r")
    assert threading.active_count() == before


@pytest.mark.parametrize(("asked", "lines"), [({}, 0), ({"quiet": True}, 0), ({"verbose": True}, 1)])
def test_what_is_no_terminal_is_told_what_it_has_asked_for(
    asked: dict[str, bool], lines: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stderr", file := io.StringIO())
    monkeypatch.setattr(progress, "SHOWN_S", 1.0)  # on a busy machine a stage may take longer than the package's 0.01 s
    work(**asked)
    assert file.getvalue() == "    1.50 s  THEIRS a\n" * lines


def break_off() -> None:
    with progress_bar() as progress:
        progress.stage("simulating", 40.0, "s")
        raise ValueError("why")


def test_what_breaks_off_leaves_no_bar_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    with pytest.raises(ValueError, match="why"):
        break_off()
    assert terminal.getvalue().rstrip(" ").endswith("\r")
