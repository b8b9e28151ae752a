"""What is finished stays finished, and counts once."""

from __future__ import annotations

import errno
import json
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from airground_drake.base.errors import FolderError
from airground_drake.campaign import store as module
from airground_drake.campaign.rows import COLUMNS, JUDGED, Row, blank
from airground_drake.campaign.store import JOURNAL, Store, read

MANIFEST = {"name": "x", "spec_sha256": "0"}


def draw(index: int) -> list[Row]:
    return [blank() | {"index": index, "run": "d", "ended": JUDGED, "claim": claim, "drawn": "{}"} for claim in "AB"]


def indices(store: Store) -> list[int]:
    return store.table()["index"].tolist()


def test_draws_come_back_by_index_with_their_types(tmp_path: Path) -> None:
    store = Store(tmp_path / "c", MANIFEST, resume=False)
    for index in (3, 1):
        store.add(draw(index))
    store.close()
    manifest, table = read(tmp_path / "c")
    assert manifest["name"] == "x"
    assert table["index"].tolist() == [1, 1, 3, 3]
    assert {name: str(kind) for name, kind in table.dtypes.items() if COLUMNS[str(name)] == "int64"}["index"] == "int64"
    assert table["margin"].isna().all()


def test_what_was_not_flushed_is_there_after_a_kill(tmp_path: Path) -> None:
    store = Store(tmp_path / "c", MANIFEST, resume=False)
    store.add(draw(1))
    store.flush()
    store.add(draw(2))
    assert read(tmp_path / "c")[1]["index"].tolist() == [1, 1, 2, 2]  # while it runs
    killed(store)
    with (tmp_path / "c" / JOURNAL).open("a") as file:
        file.write('[{"index": 7, "run"')  # a torn line
    again = Store(tmp_path / "c", MANIFEST, resume=True)
    assert again.finished == {1, 2}
    again.add(draw(7))
    killed(again)
    assert indices(Store(tmp_path / "c", MANIFEST, resume=True)) == [1, 1, 2, 2, 7, 7]


def test_a_kill_between_a_part_and_the_journal_counts_nothing_twice(tmp_path: Path) -> None:
    store = Store(tmp_path / "c", MANIFEST, resume=False)
    store.add(draw(1))
    journal = (tmp_path / "c" / JOURNAL).read_bytes()
    store.flush()
    killed(store)
    (tmp_path / "c" / JOURNAL).write_bytes(journal)
    again = Store(tmp_path / "c", MANIFEST, resume=True)
    assert indices(again) == [1, 1]
    again.add(draw(1))
    assert indices(again) == [1, 1]


def test_a_long_journal_becomes_a_part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "DRAWS_IN_A_PART", 3)
    store = Store(tmp_path / "c", MANIFEST, resume=False)
    for index in range(7):
        store.add(draw(index))
    parts = sorted((tmp_path / "c" / "parts").iterdir())
    assert [len(pd.read_parquet(path)) for path in parts] == [6, 6]
    assert indices(store) == sorted(2 * list(range(7)))


def test_a_part_that_was_removed_is_made_again_and_takes_no_others_place(tmp_path: Path) -> None:
    for index in range(3):
        store = Store(tmp_path / "c", MANIFEST, resume=index > 0)
        store.add(draw(index))
        store.close()
    (tmp_path / "c" / "parts" / "part-000000.parquet").unlink()
    store = Store(tmp_path / "c", MANIFEST, resume=True)
    assert store.finished == {1, 2}
    store.add(draw(0))
    store.close()
    assert sorted({*read(tmp_path / "c")[1]["index"]}) == [0, 1, 2]


@pytest.mark.parametrize("line", ["[]", "{}", "5", "null", '[{"run": "d"}]'])
def test_a_journal_of_something_else_is_refused(line: str, tmp_path: Path) -> None:
    Store(tmp_path / "c", MANIFEST, resume=False).close()
    (tmp_path / "c" / JOURNAL).write_text(f"{line}\n")
    with pytest.raises(FolderError, match="a line that is no draw"):
        Store(tmp_path / "c", MANIFEST, resume=True)


@pytest.mark.parametrize("column", ["index", "margin"])
def test_a_part_without_a_column_is_refused(column: str, tmp_path: Path) -> None:
    store = Store(tmp_path / "c", MANIFEST, resume=False)
    store.add(draw(0))
    store.close()
    part = tmp_path / "c" / "parts" / "part-000000.parquet"
    pd.read_parquet(part).drop(columns=column).to_parquet(part)
    with pytest.raises(FolderError, match=f"no column '{column}'"):
        Store(tmp_path / "c", MANIFEST, resume=True)


def edit_part(folder: Path, edit: Callable[[pd.DataFrame], pd.DataFrame]) -> None:
    part = folder / "parts" / "part-000000.parquet"
    edit(pd.read_parquet(part)).to_parquet(part, index=False)


def edit_journal(folder: Path, edit: Callable[[pd.DataFrame], pd.DataFrame]) -> None:
    *before, last = (folder / JOURNAL).read_text().splitlines()
    rows = edit(pd.DataFrame(json.loads(last))).to_dict("records")
    (folder / JOURNAL).write_text("\n".join([*before, json.dumps(rows)]) + "\n")


@pytest.mark.parametrize("place", [edit_part, edit_journal])
@pytest.mark.parametrize(
    "edit",
    [
        lambda rows: pd.concat([rows] * 50),
        lambda rows: rows.assign(status="fine"),
        lambda rows: rows.assign(status="holds", as_expected=True),
        lambda rows: rows.assign(index=10**9),
        lambda rows: rows.assign(claim="SAFE"),
        lambda rows: rows[:1],
    ],
    ids=["repeated", "unknown status", "turned into holds", "another index", "unknown claim", "dropped"],
)
def test_a_draw_whose_rows_were_changed_is_refused_by_its_number(
    edit: Callable[[pd.DataFrame], pd.DataFrame], place: Callable[..., None], tmp_path: Path
) -> None:
    store = Store(tmp_path / "c", MANIFEST, resume=False)
    refuted = [row | {"status": "refuted"} for row in draw(7)]
    store.add(refuted)
    if place is edit_part:
        store.flush()
    killed(store)
    place(tmp_path / "c", lambda rows: rows)
    again = Store(tmp_path / "c", MANIFEST, resume=True)
    assert again.table()["status"].tolist() == ["refuted", "refuted"]
    killed(again)
    place(tmp_path / "c", edit)
    for reading in (lambda: Store(tmp_path / "c", MANIFEST, resume=True), lambda: read(tmp_path / "c")):
        with pytest.raises(FolderError, match=r"draw (7|1000000000): its rows were changed, repeated or removed"):
            reading()


def test_a_draw_of_another_campaign_or_a_part_that_is_there_twice_is_refused(tmp_path: Path) -> None:
    for name in ("a", "b"):
        store = Store(tmp_path / name, MANIFEST | {"name": name}, resume=False)
        store.add(draw(3))
        store.close()
    part = (tmp_path / "a" / "parts" / "part-000000.parquet").read_bytes()
    for name, number in (("a", 1), ("b", 0)):
        (tmp_path / name / "parts" / f"part-{number:06d}.parquet").write_bytes(part)
        with pytest.raises(FolderError, match="draw 3: "):
            read(tmp_path / name)


def test_a_disk_that_takes_a_part_of_a_line_gets_the_rest_or_the_draw_is_not_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Store(tmp_path / "c", MANIFEST, resume=False)
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
    assert store.finished == {0, 1}
    killed(store)
    again = Store(tmp_path / "c", MANIFEST, resume=True)
    assert again.finished == {0, 1}
    again.add(draw(2))
    killed(again)
    assert indices(Store(tmp_path / "c", MANIFEST, resume=True)) == [0, 0, 1, 1, 2, 2]


def test_a_folder_of_something_else_or_of_another_campaign_is_refused(tmp_path: Path) -> None:
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "me.png").write_bytes(b"")
    with pytest.raises(FolderError, match=r"holds 'me\.png'"):
        Store(tmp_path / "photos", MANIFEST, resume=False)
    with pytest.raises(FolderError, match="no campaign to resume"):
        Store(tmp_path / "photos", MANIFEST, resume=True)
    Store(tmp_path / "c", MANIFEST, resume=False).close()
    with pytest.raises(FolderError, match="--resume"):
        Store(tmp_path / "c", MANIFEST, resume=False)
    for another in ({"spec_sha256": "1"}, {"limits": {"time": 2.0}}):
        with pytest.raises(FolderError, match=rf"another campaign \({next(iter(another))}\)"):
            Store(tmp_path / "c", MANIFEST | another, resume=True)
    with pytest.raises(FolderError, match="no campaign"):
        read(tmp_path / "photos")


def test_of_two_that_begin_at_once_the_one_that_is_late_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second looks at the folder before, and writes to it after the first has begun."""
    first: list[Store] = []

    def late(path: Path) -> bool:
        monkeypatch.undo()
        first.append(Store(tmp_path / "c", MANIFEST, resume=False))
        return True

    (tmp_path / "c").mkdir()
    (tmp_path / "c" / JOURNAL).touch()  # of one that was killed at once
    monkeypatch.setattr(module, "_is_nothing", late)
    with pytest.raises(FolderError, match="in use"):
        Store(tmp_path / "c", MANIFEST | {"name": "another"}, resume=False)
    first[0].add(draw(0))
    first[0].close()
    assert read(tmp_path / "c")[0]["name"] == MANIFEST["name"]


def test_one_command_at_a_time(tmp_path: Path) -> None:
    store = Store(tmp_path / "c", MANIFEST, resume=False)
    with pytest.raises(FolderError, match="in use"):
        Store(tmp_path / "c", MANIFEST, resume=True)
    store.close()
    Store(tmp_path / "c", MANIFEST, resume=True).close()


def killed(store: Store) -> None:
    """As far as its files go: the lock goes with the process."""
    module.os.close(store._journal)
