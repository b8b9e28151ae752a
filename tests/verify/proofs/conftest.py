"""What the tests of the theorems share: theories that are compiled once per session, whatever its workers."""

import os
import shutil
from pathlib import Path

import pytest
from sharing import once

from airground_drake.verify.proofs import coq
from airground_drake.verify.proofs.record import FOLDER, digest, file_of
from airground_drake.verify.proofs.runs import Workshop
from airground_drake.verify.proofs.theorems import THEOREMS


@pytest.fixture(scope="session")
def coq_version() -> str:
    """The installed Coq; without one a test is skipped, but in continuous integration it fails."""
    if shutil.which("coqc") is None and not os.environ.get("CI"):
        pytest.skip("Coq is not installed")
    return coq.version()


@pytest.fixture(scope="session")
def compiled(shared: Path, coq_version: str) -> Path:
    def make(folder: Path) -> None:
        folder.mkdir()
        coq.install(dict.fromkeys(map(file_of, THEOREMS)), folder)

    return once(shared / "theories", make)


@pytest.fixture
def workshop(compiled: Path, coq_version: str, tmp_path: Path) -> Workshop:
    folder = tmp_path / "workshop"
    shutil.copytree(compiled, folder)
    return Workshop(folder, coq_version, {path.name: digest(FOLDER / path.name) for path in folder.glob("*.v")})
