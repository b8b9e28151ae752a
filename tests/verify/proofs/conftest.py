"""What the tests of the theorems share."""

import shutil
from pathlib import Path

import pytest

from airground_drake.verify.proofs.record import FOLDER, digest
from airground_drake.verify.proofs.runs import Workshop


@pytest.fixture
def workshop(compiled: Path, coq_version: str, tmp_path: Path) -> Workshop:
    folder = tmp_path / "workshop"
    shutil.copytree(compiled, folder)
    return Workshop(folder, coq_version, {path.name: digest(FOLDER / path.name) for path in folder.glob("*.v")})
