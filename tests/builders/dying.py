"""Work that ends its process: in a module that other processes can import."""

import os
import time
from pathlib import Path


def work(folder: Path, always: int, item: int) -> int:
    """Item 2 kills its process the first time, one item every time."""
    seen = folder / str(item)
    if item == always or (item == 2 and not seen.exists()):
        seen.touch()
        os._exit(1)
    return item * item


def times(factor: int, item: int) -> int:
    return factor * item


def process(item: int) -> int:
    return os.getpid()


def asleep(item: int) -> None:
    time.sleep(item)
