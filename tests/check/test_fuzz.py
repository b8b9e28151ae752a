"""Whatever is in a report's files: an exit code, strict JSON or one line, and no agreement on what was changed."""

import contextlib
import io
import json
import os
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from builders.nested import places
from check.forging import copy, mend, no_constants, seal, write
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake import check

pytestmark = pytest.mark.slow

FILES = (
    "report.json", "trace/d/meta.json", "trace/c/meta.json", "trace/d/timings.json", "trace/d/states.parquet",
    "trace/d/decisions.parquet", "trace/c/problems.parquet", "trace/d/proposals.parquet", "report.html",
)  # fmt: skip
VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 0.5, -0.0, 1e-300, 1e308, -1e12, 10**299, "", "0", "-1/3", "1/0", "1e1000000000",
    "9" * 5000, "d", "ugv1", "../../..", "\x00", "\ud800", "\u202e", "a*" * 60 + "a", "(" * 3000, [], {}, [[[]]],
    {"a": {}}, [None], ["x"] * 50, [0.0] * 50, "q**12", "exp(exp(exp(exp(exp(99)))))",
)  # fmt: skip
BYTES = (b"", b"\x00", b"\xff", b"NaN", b"1e999", b"[" * 3000, b'"', b"\xef\xbb\xbf", b"PAR1", b"9" * 400, b"}", b",")


class Change(NamedTuple):
    """A change to a file: to its bytes, or to its JSON.

    `place` is a share of its values or bytes; `value` is an index of VALUES or BYTES; `sealed` makes digests right.
    """

    file: str
    place: float
    how: str
    value: int
    sealed: bool


CHANGES = st.builds(
    Change,
    st.sampled_from(FILES),
    st.floats(0.0, 1.0, exclude_max=True),
    st.sampled_from(["value", "value", "value", "removed", "twice", "renamed", "bytes", "cut"]),
    st.integers(0, len(VALUES) - 1),
    st.booleans(),
)


def _changed(content: bytes, change: Change) -> bytes:
    with contextlib.suppress(ValueError, RecursionError):
        if change.file.endswith(".json") and change.how not in ("bytes", "cut"):
            value = json.loads(content)
            found = list(places(value))
            (*_, key), container = found[int(change.place * len(found))]
            if change.how == "value":
                container[key] = VALUES[change.value]
            elif change.how == "removed":
                del container[key]
            elif isinstance(container, list):
                container.insert(key, container[key])
            else:
                container[str(VALUES[change.value])] = container.pop(key)
            return json.dumps(value).encode()
    at = int(change.place * len(content))
    kept = b"" if change.how == "cut" else content[at + 1 + change.value :]
    return content[:at] + BYTES[change.value % len(BYTES)] + kept


def apply(change: Change, folder: Path) -> bool:
    """Make a change to a copy of a report; whether the content differs."""
    path = folder / change.file
    before = path.read_bytes()
    after = _changed(before, change)
    write(path, after)
    if change.sealed:
        with contextlib.suppress(Exception):  # what cannot be made right is left
            if change.file.endswith(".parquet"):
                seal(folder, path.parent.name)
        mend(folder)
    return after != before


@examples(12, fuzz=500)
@given(changes=st.lists(CHANGES, min_size=1, max_size=3))
def test_no_content_upsets_the_checker(report: Path, changes: list[Change]) -> None:
    folder = copy(report, report.with_name(f"fuzzed_{os.getpid()}"))
    changed = [apply(change, folder) for change in changes]
    said, complained = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(complained):
        code = check.main(["--json", str(folder)])
    assert code or not any(changed) or any(change.sealed or change.file == "report.json" for change in changes)
    assert complained.getvalue().count("\n") == (code == 2)
    if code < 2:
        json.loads(said.getvalue(), parse_constant=no_constants).pop("checks")
    said.getvalue().encode()
