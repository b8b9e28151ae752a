"""Serve replays to the browsers of this machine."""

import html
from collections.abc import Callable, Sequence
from functools import cache
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import quote, unquote

from airground_drake.base.errors import AirgroundError


def serve(runs: Sequence[str], page: Callable[[str], str]) -> None:
    """Serve the pages of runs until the process is interrupted, and print the address."""
    with server(runs, page) as running:
        print(f"http://localhost:{running.server_port}/  (Ctrl-C ends it)", flush=True)
        running.serve_forever()


def server(runs: Sequence[str], page: Callable[[str], str]) -> ThreadingHTTPServer:
    """A server at a free port of this machine; each page has its run's name and is made on its first request."""
    made = cache(page)
    index = "".join(f'<li><a href="/{quote(name)}">{html.escape(name)}</a></li>' for name in runs)

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            name = unquote(self.path.lstrip("/"))
            try:
                if name in runs or (not name and len(runs) == 1):
                    self._answer(200, made(name or runs[0]))
                else:
                    self._answer(404 if name else 200, f"<!DOCTYPE html><title>Runs</title><ul>{index}</ul>")
            except AirgroundError as error:
                self._answer(500, html.escape(str(error)))

        def _answer(self, code: int, text: str) -> None:
            body = text.encode()
            self.send_response(code)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, format: str, *args: object) -> None:
            pass

    return ThreadingHTTPServer(("127.0.0.1", 0), Handler)
