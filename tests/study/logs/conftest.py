"""The scenario by which logs are judged."""

from typing import Any

import pytest
from builders import logs


@pytest.fixture(scope="module")
def document(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return logs.document(tmp_path_factory.mktemp("lab"))
