"""Exceptions of the package; messages name the fault, its place and the allowed values."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import PurePath
from traceback import extract_tb, format_list, walk_tb

# Maximum characters of values, of messages, and of tracebacks of third-party code (the end is kept).
VALUE_WIDTH, FAULT_WIDTH, TRACEBACK_CHARS = 120, 300, 4000


class AirgroundError(Exception):
    """Base class of the package's own exceptions. Its text is one printable line."""

    def __str__(self) -> str:
        return one_line(super().__str__())


class Fault(str):
    """A description of a fault without a single offending value."""


class ScenarioError(AirgroundError):
    """A scenario file that cannot be used.

    Attributes:
        source: file (with line where known) or command-line option.
        key: dotted path of the offending key, or ''.
        value: the offending value, or a `Fault`.
        allowed: what is allowed there.
    """

    def __init__(self, source: str, key: str, value: object, allowed: str) -> None:
        self.source, self.key, self.value, self.allowed = source, key, value, allowed
        where = f"{source}: {key}: " if key else f"{source}: "
        fault = str(value) if isinstance(value, Fault) else f"{short(repr(value))} is not allowed"
        super().__init__(f"{where}{fault}; {allowed}")


class LimitError(AirgroundError):
    """A scenario that asks for more work than is allowed."""

    def __init__(self, scenario: str, asked: str, allowed: str) -> None:
        """Keep the arguments for pickling; `asked` and `allowed` are amounts in words."""
        super().__init__(scenario, asked, allowed)

    def __str__(self) -> str:
        return one_line("{} asks for about {}; allowed: {}".format(*self.args))


class FolderError(AirgroundError):
    """A command cannot write to a folder or file, or would overwrite its content."""


class UnknownNameError(AirgroundError):
    """An unknown name of a run, a method, a route, a policy or a claim.

    Attributes:
        kind: what the name should stand for.
        name: as given.
        allowed: names that exist.
    """

    def __init__(self, kind: str, name: object, allowed: Iterable[str]) -> None:
        self.kind, self.name, self.allowed = kind, name, tuple(allowed)
        options = ", ".join(self.allowed) or "none"
        super().__init__(f"unknown {kind} {short(repr(name))}; allowed: {options}")


class PluginError(AirgroundError):
    """A class named in a scenario cannot be imported, is of another kind, or breaks the contract of its kind."""


class PolicyError(AirgroundError):
    """A policy's process failed; the message is the policy's exception, or how the process ended."""

    def __init__(self, what: str, traceback: str = "") -> None:
        super().__init__(what)
        self.traceback = traceback  # of the policy's own exception, see `traceback_of`; '' without one


class ReportError(AirgroundError):
    """A report is missing, or was changed."""


class ExportError(AirgroundError):
    """A run cannot be written as a file of the kind that was asked for."""


class LogError(AirgroundError):
    """A recorded log cannot be read or judged; one line says why, and what is wanted."""


class ReplayError(AirgroundError):
    """A replay cannot be made on this machine, for lack of a port for Meshcat or a video encoder."""


class SimulationError(AirgroundError):
    """A simulation that stopped before its end.

    Attributes:
        run: name of the run.
        t: simulated time, s.
        what: first line of the exception.
    """

    def __init__(self, run: str, t: float, what: str) -> None:
        super().__init__(run, t, what)
        self.run, self.t, self.what = run, t, what

    def __str__(self) -> str:
        return one_line(f"run {self.run} stopped at t = {self.t:.6g} s: {self.what}")


class TraceError(AirgroundError):
    """A trace that is missing, truncated, tampered with or not finite."""


def short(text: str) -> str:
    """The text, truncated for a message."""
    return text if len(text) <= VALUE_WIDTH else f"{text[: VALUE_WIDTH - 3]}..."


def described(error: BaseException, function: object = None) -> str:
    """An exception of third-party code as one printable line of bounded length, even if its `__str__` raises."""
    # function: of that code. If the exception passed its file, the line begins with the place, such as `boom.py:5`.
    try:
        text = f"{_place(error, function)}{type(error).__name__}: {error}"[:FAULT_WIDTH]
    except BaseException:  # its text is third-party code, too
        text = "an exception that cannot be put into words"
    return one_line(text)


@contextmanager
def raised_as(made: Callable[[BaseException], Exception]) -> Iterator[None]:
    """Convert any exception of third-party code in the body into an error of the package."""
    try:
        yield
    except (Exception, SystemExit) as error:
        raise made(error) from error


def traceback_of(error: BaseException) -> str:
    """The traceback of an exception of third-party code, from the function that this package called: printable."""
    frames = extract_tb(error.__traceback__)[1:]
    for frame in frames:
        frame.filename = PurePath(frame.filename).name
    lines = "".join(format_list(frames)).splitlines()
    return printable("\n".join(["Traceback (most recent call last):", *lines, described(error)]))


def printable(text: str) -> str:
    """The last `TRACEBACK_CHARS` of a text of third-party code, with each line as by `one_line`."""
    return "\n".join(map(one_line, text[-TRACEBACK_CHARS:].split("\n")))


def _place(error: BaseException, function: object) -> str:
    """The last line of the function's file in the traceback, and a space; '' without such a line."""
    file = getattr(getattr(function, "__code__", None), "co_filename", None)
    lines = [line for frame, line in walk_tb(error.__traceback__) if frame.f_code.co_filename == file]
    return f"{PurePath(str(file)).name}:{lines[-1]} " if lines else ""


def one_line(text: str) -> str:
    """The text with characters escaped that break lines, control terminals or change the writing direction."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
