"""Serving: an index, a page per run, nothing else, on this machine only."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest

from airground_drake.base.errors import ReplayError
from airground_drake.report.replay import live

asked: list[str] = []


def page(run: str) -> str:
    asked.append(run)
    if run == "broken":
        raise ReplayError("no port <b>")
    return f"page of {run}"


@contextmanager
def served(*runs: str) -> Iterator[str]:
    with live.server(runs, page) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            assert server.server_address[0] == "127.0.0.1"
            yield f"http://127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()


def test_index_and_pages() -> None:
    with served("a", "d") as address:
        assert 'href="/d"' in urlopen(f"{address}/").read().decode()
        asked.clear()
        assert [urlopen(f"{address}/d").read() for _ in range(2)] == [b"page of d"] * 2
        assert asked == ["d"]
        with pytest.raises(HTTPError, match="404"):
            urlopen(f"{address}/../etc/passwd")


def test_the_only_run_needs_no_index_and_a_page_that_cannot_be_made_is_an_error() -> None:
    with served("d") as address:
        assert urlopen(address).read() == b"page of d"
    with served("broken") as address, pytest.raises(HTTPError) as refused:
        urlopen(f"{address}/broken")
    assert refused.value.code == 500
    assert refused.value.read() == b"no port &lt;b&gt;"
