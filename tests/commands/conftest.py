"""What the tests of the commands share."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from airground_drake.campaign import pool
from airground_drake.campaign.pool import Pool


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """No processes, each of which takes seconds to begin, for what is not about them."""

    @contextmanager
    def local(jobs: int) -> Iterator[Pool]:
        yield lambda work, items: ((item, work(item)) for item in items)

    monkeypatch.setattr(pool, "local", local)
