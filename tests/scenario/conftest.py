"""Files to be loaded."""

from pathlib import Path

import pytest
from scenario.cases import Write


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def _write(content: str | bytes) -> str:
        path = tmp_path / "bad.yaml"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return str(path)

    return _write
