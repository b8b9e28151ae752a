"""Parsers of command lines."""

from __future__ import annotations

import argparse
from typing import NoReturn

EXIT_USAGE = 2


class Parser(argparse.ArgumentParser):
    """Says in one line what is wrong with a command line."""

    def error(self, message: str) -> NoReturn:
        """Say so, and exit with 2."""
        self.exit(EXIT_USAGE, f"error: {message}; see {self.prog} --help\n")
