"""Every mistake is one printable line that names file and line, key, value and what is allowed, as the table has it."""

from pathlib import Path

from scenario.bad_inputs import SHOWN, TABLE, messages


def test_bad_inputs_are_refused_as_the_table_says(tmp_path: Path) -> None:
    found = list(messages(tmp_path))
    assert len(found) >= 180
    assert all(message.isprintable() and "; " in message for message in found)
    assert [message[:SHOWN] for message in found] == TABLE.read_text(encoding="utf-8").splitlines()
