"""A finished draw stays finished, and counts once."""

import errno
import json
import math
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pandas as pd
import pytest

from airground_drake.base.errors import FolderError
from airground_drake.study.campaign import store as module
from airground_drake.study.campaign.rows import COLUMNS, JUDGED, Row, blank
from airground_drake.study.campaign.store import JOURNAL, Store, read

MANIFEST = {"name": "x", "spec_sha256": "0"}
PART = "parts/part-000000.parquet"
Edit = Callable[[pd.DataFrame], pd.DataFrame]


def draw(index: int) -> list[Row]:
    return [blank() | {"index": index, "run": "d", "ended": JUDGED, "claim": claim, "drawn": "{}"} for claim in "AB"]


def opened(folder: Path, *indices: int, resume: bool = True, **manifest: object) -> Store:
    store = Store(folder, MANIFEST | manifest, resume=resume and folder.exists())
    for index in indices:
        store.add(draw(index))
    return store


def killed(store: Store) -> None:
    """As far as its files go: the lock goes with the process."""
    module.os.close(store._journal)


def indices(folder: Path) -> list[int]:
    """Of all rows, in their order, for one who opens the folder and one who only reads it."""
    found = read(folder)[1]["index"].tolist()
    store = opened(folder)
    assert store.table()["index"].tolist() == found
    assert store.finished == set(found)
    killed(store)
    return list(found)


def test_draws_come_back_by_index_with_their_types_also_after_a_kill(tmp_path: Path) -> None:
    store = opened(tmp_path, 3, resume=False)
    store.flush()
    store.add(draw(1))
    manifest, table = read(tmp_path)  # while it runs
    assert (manifest["name"], table["index"].tolist()) == ("x", [1, 1, 3, 3])
    assert {name: str(kind) for name, kind in table.dtypes.items() if COLUMNS[str(name)] == "int64"}["index"] == "int64"
    assert table["margin"].isna().all()
    killed(store)
    with (tmp_path / JOURNAL).open("a") as file:
        file.write('[{"index": 7, "run"')  # a torn line
    assert indices(tmp_path) == [1, 1, 3, 3]
    opened(tmp_path, 7).close()
    assert indices(tmp_path) == [1, 1, 3, 3, 7, 7]


def test_a_kill_between_a_part_and_the_journal_counts_nothing_twice(tmp_path: Path) -> None:
    store = opened(tmp_path, 1)
    journal = (tmp_path / JOURNAL).read_bytes()
    store.flush()
    killed(store)
    (tmp_path / JOURNAL).write_bytes(journal)
    store = opened(tmp_path, 1)
    assert store.table()["index"].tolist() == [1, 1]
    killed(store)
    assert indices(tmp_path) == [1, 1]


def test_a_long_journal_becomes_a_part_and_a_removed_part_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "DRAWS_IN_A_PART", 3)
    killed(opened(tmp_path, *range(7)))
    assert [len(pd.read_parquet(path)) for path in sorted((tmp_path / "parts").iterdir())] == [6, 6]
    (tmp_path / PART).unlink()
    assert indices(tmp_path) == sorted(2 * [3, 4, 5, 6])
    opened(tmp_path, 0, 1, 2).close()
    assert indices(tmp_path) == sorted(2 * list(range(7)))


@pytest.mark.parametrize(
    "line", ["[]", "{}", "5", "null", '[{"run": "d"}]', "[" * 10**5, json.dumps([blank() | {"ugvs": math.inf}])]
)
def test_a_journal_of_something_else_is_refused(line: str, tmp_path: Path) -> None:
    opened(tmp_path).close()
    (tmp_path / JOURNAL).write_text(f"{line}\n")
    with pytest.raises(FolderError, match="a line that is no draw"):
        opened(tmp_path)


def edit_part(folder: Path, edit: Edit) -> None:
    edit(pd.read_parquet(folder / PART)).to_parquet(folder / PART, index=False)


def edit_journal(folder: Path, edit: Edit) -> None:
    *before, last = (folder / JOURNAL).read_text().splitlines()
    rows = edit(pd.DataFrame(json.loads(last))).to_dict("records")
    (folder / JOURNAL).write_text("\n".join([*before, json.dumps(rows)]) + "\n")


@pytest.mark.parametrize("place", [edit_part, edit_journal])
@pytest.mark.parametrize(
    "edit",
    [
        lambda rows: pd.concat([rows] * 50),
        lambda rows: rows.assign(status="holds", as_expected=True),
        lambda rows: rows.assign(index=10**9),
        lambda rows: rows[:1],
    ],
    ids=["repeated", "turned into holds", "another index", "dropped"],
)
def test_changed_rows_are_refused(edit: Edit, place: Callable[..., None], tmp_path: Path) -> None:
    store = opened(tmp_path, 7)
    if place is edit_part:
        store.flush()
    killed(store)
    place(tmp_path, lambda rows: rows)
    assert indices(tmp_path) == [7, 7]
    place(tmp_path, edit)
    for reading in (opened, read):
        with pytest.raises(FolderError, match=r"draw (7|1000000000): its rows were changed, repeated or removed"):
            reading(tmp_path)


def test_a_foreign_a_repeated_and_an_incomplete_part_are_refused(tmp_path: Path) -> None:
    for name in ("a", "b"):
        opened(tmp_path / name, 3, name=name).close()
    part = (tmp_path / "a" / PART).read_bytes()
    for path in (tmp_path / "a" / "parts" / "part-000001.parquet", tmp_path / "b" / PART):
        path.write_bytes(part)
        with pytest.raises(FolderError, match="draw 3: "):
            read(path.parents[1])
    changes: list[tuple[str, Edit]] = [("index", lambda rows: rows.drop(columns="index"))]
    for name, value in (("index", None), ("ugvs", 0.9), ("ugvs", math.inf), ("margin", [1.0]), ("as_expected", "")):
        changes.append((name, partial(pd.DataFrame.assign, **{name: [value] * 2})))
    for column, change in changes:
        path.write_bytes(part)
        edit_part(tmp_path / "b", change)
        with pytest.raises(FolderError, match=f"no column '{column}' of type {COLUMNS[column]}"):
            read(tmp_path / "b")


def test_a_full_disk_leaves_the_draw_unfinished(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It takes a part of a line before it refuses the rest."""
    store = opened(tmp_path)
    room, write = 10**6, module.os.write

    def nearly_full(handle: int, data: bytes) -> int:
        nonlocal room
        if not room:
            raise OSError(errno.ENOSPC, "No space left on device")
        taken = write(handle, data[: min(100, room)])
        room -= taken
        return taken

    monkeypatch.setattr(module.os, "write", nearly_full)
    store.add(draw(0))
    store.add(draw(1))
    room = 250
    with pytest.raises(OSError, match=f"No space left on device: .*{JOURNAL}"):
        store.add(draw(2))
    monkeypatch.undo()
    killed(store)
    assert indices(tmp_path) == [0, 0, 1, 1]
    killed(opened(tmp_path, 2))
    assert indices(tmp_path) == [0, 0, 1, 1, 2, 2]


def test_a_folder_of_something_else_or_of_another_campaign_is_refused(tmp_path: Path) -> None:
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "me.png").write_bytes(b"")
    opened(tmp_path / "c").close()
    for resume, says in ((False, r"holds 'me\.png'"), (True, "no campaign to resume")):
        with pytest.raises(FolderError, match=says):
            opened(tmp_path / "photos", resume=resume)
    with pytest.raises(FolderError, match="no campaign"):
        read(tmp_path / "photos")
    with pytest.raises(FolderError, match="--resume"):
        opened(tmp_path / "c", resume=False)
    for key, value in (("spec_sha256", "1"), ("limits", {"time": 2.0})):
        with pytest.raises(FolderError, match=rf"another campaign \({key}\)"):
            opened(tmp_path / "c", **{key: value})
    (tmp_path / "c" / "campaign.json").write_text("[" * 10**5)
    with pytest.raises(FolderError, match="no campaign to resume"):
        opened(tmp_path / "c")


def test_one_command_at_a_time_and_the_later_one_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second looks at the folder before, and writes to it after the first has begun."""
    first: list[Store] = []

    def late(path: Path) -> bool:
        monkeypatch.undo()
        first.append(opened(tmp_path, resume=False))
        return True

    (tmp_path / JOURNAL).touch()  # of a command that was killed at once
    monkeypatch.setattr(module, "_is_nothing", late)
    with pytest.raises(FolderError, match="in use"):
        opened(tmp_path, resume=False, name="another")
    with pytest.raises(FolderError, match="in use"):
        opened(tmp_path)
    first[0].add(draw(0))
    first[0].close()
    assert (read(tmp_path)[0]["name"], indices(tmp_path)) == ("x", [0, 0])
