"""A process that is interrupted ends at once, with one line, and with all that descends from it."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from airground_drake.base import interruption

pytestmark = pytest.mark.slow

PROGRAM = """
import multiprocessing, os, subprocess, sys, time
from pathlib import Path
from airground_drake.base import files
from airground_drake.base import interruption

def sleep(done): done.set(); time.sleep(600)

def parent(done):
    child = multiprocessing.get_context("fork").Process(target=sleep, args=(done,))
    child.start()
    child.join()

interruption.end_on_signals()
if sys.argv[1] == "exec":
    subprocess.Popen(["sleep", "600"], close_fds=False)
fork = multiprocessing.get_context("fork")
done = fork.Event()
fork.Process(target=parent, args=(done,)).start()
done.wait()
os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
name = Path(sys.argv[2]) / "file"
os.fsync = lambda _: (os.write(int(sys.argv[3]), b"!"), time.sleep(600))
files.write_text(name, "never")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="descendants are found in /proc")
@pytest.mark.parametrize("children", ["fork", "exec"])
@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_nobody_and_nothing_is_left(children: str, name: str, code: int, tmp_path: Path) -> None:
    reader, writer = os.pipe()  # every descendant holds the writing end: once it is closed, all have ended
    command = [sys.executable, "-c", PROGRAM, children, str(tmp_path), str(writer)]
    with subprocess.Popen(command, pass_fds=[writer], stderr=subprocess.PIPE, text=True) as process:
        os.close(writer)
        assert os.read(reader, 1) == b"!"
        process.send_signal(signal.Signals[name])
        assert os.read(reader, 1) == b""
        os.close(reader)
        said = process.communicate()[1]
    assert (process.returncode, said) == (code, f"error: interrupted ({name})\n")
    assert os.listdir(tmp_path) == []


BEGUN = """
import os, signal, subprocess, sys, time
from collections import deque
from itertools import repeat
from airground_drake.base import files
from airground_drake.base import interruption

interruption.begin()
with files.temporary_folder():
    reader, writer = os.pipe()
    if os.fork() == 0:  # in code that never returns to the interpreter no handler is called
        os.write(writer, b"!")
        deque(repeat(0), maxlen=0)
    os.read(reader, 1)  # else it may be killed before it has run at all
    subprocess.Popen(["sleep", "600"], close_fds=False, start_new_session=True)
    os.write(int(sys.argv[2]), b"!")
    exec(sys.argv[1])
    time.sleep(600)
"""
ENDS = {
    "os.kill(os.getpid(), signal.SIGKILL)": (4, "the process of this command died (signal 9)"),
    "os._exit(0)": (4, "the process of this command died (exit code 0)"),
    "os.kill(os.getpid(), signal.SIGTERM)": (143, "interrupted (SIGTERM)"),
    "os.kill(os.getppid(), signal.SIGINT)": (130, "interrupted (SIGINT)"),
    "os.kill(os.getppid(), signal.SIGKILL)": (-9, "interrupted (SIGTERM)"),
}


@pytest.mark.skipif(sys.platform != "linux", reason="a command works in a child on Linux only")
@pytest.mark.parametrize("end", ENDS)
def test_whichever_process_of_a_command_is_killed_nothing_is_left(end: str, tmp_path: Path) -> None:
    reader, writer = os.pipe()  # as above
    command = [sys.executable, "-c", BEGUN, end, str(writer)]
    with subprocess.Popen(
        command, pass_fds=[writer], stderr=subprocess.PIPE, text=True, env={**os.environ, "TMPDIR": str(tmp_path)}
    ) as process:
        os.close(writer)
        assert b"".join(iter(lambda: os.read(reader, 100), b"")) == b"!"
        os.close(reader)
        said = process.communicate()[1]
    code, why = ENDS[end]
    assert (process.returncode, said) == (code, f"error: {why}\n")
    assert os.listdir(tmp_path) == []


def test_a_command_leaves_at_once_with_its_own_code_and_lets_others_go_on() -> None:
    program = "import subprocess, threading, time; from airground_drake.base.interruption import begin, leave; begin();"
    program += "print('done'); threading.Thread(target=time.sleep, args=(600,)).start(); "
    program += "left = subprocess.Popen(['sleep', '600'], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL); "
    program += "print(left.pid); leave(3)"
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    done, pid = ended.stdout.split()
    assert (ended.returncode, done, ended.stderr) == (3, "done", "")
    os.kill(int(pid), signal.SIGKILL)  # such as a browser that shows the report: it is still there


def test_killed_descendants_are_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a busy machine they end later; until then they hold the lock by which their folder is kept."""
    with subprocess.Popen(["sleep", "600"]) as slow:
        seen = iter([*[[slow.pid]] * 50, []])
        monkeypatch.setattr(interruption, "_descendants", lambda: next(seen))
        interruption.end_descendants()
    assert list(seen) == []
