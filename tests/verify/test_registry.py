"""Which claims there are, and that a claim is one file and one line."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from builders.runs import run_of

import airground_drake.registry
import airground_drake.verify
from airground_drake.base.errors import UnknownNameError
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify import MODEL_CLAIMS, TRACE_CLAIMS, registry, verify, verify_model
from airground_drake.verify.claim import ModelClaim, TraceClaim

FOLDER = Path(airground_drake.verify.__file__).parent
TABLES: dict[str, type[Any]] = {"RUN_CLAIMS": TraceClaim, "MODEL_CLAIMS": ModelClaim}


@pytest.mark.parametrize("name", TABLES)
def test_every_entry_is_the_claim_of_that_identifier_in_the_file_of_that_name(name: str) -> None:
    registered = getattr(airground_drake.registry, name)
    for identifier in registered.own:
        kind = registered.load(identifier, of=TABLES[name])
        assert kind().id == identifier
        assert kind.__module__.rpartition(".")[2] == identifier.lower().replace("-", "_")


def test_every_claim_in_the_folders_is_registered() -> None:
    tables = [(getattr(airground_drake.registry, name), kind) for name, kind in TABLES.items()]
    registered = {table.load(identifier, of=kind) for table, kind in tables for identifier in table.own}
    for path in FOLDER.glob("*/*.py"):
        module = import_module(".".join(["airground_drake.verify", *path.relative_to(FOLDER).with_suffix("").parts]))
        for kind in vars(module).values():
            if isinstance(kind, type) and issubclass(kind, (TraceClaim, ModelClaim)) and "id" in vars(kind):
                assert kind in registered


def test_the_public_tables_are_in_the_order_of_the_report() -> None:
    assert [claim.id for claim in TRACE_CLAIMS] == list(airground_drake.registry.RUN_CLAIMS)
    assert [claim.id for claim in MODEL_CLAIMS] == list(airground_drake.registry.MODEL_CLAIMS)


def test_only_the_claims_asked_for_are_judged(case_a: Scenario) -> None:
    asked = [verdict.claim.id for verdict in verify(run_of("d"), claims=["THR-TRIG", "SAFE-TRACE"])]
    assert asked == ["SAFE-TRACE", "THR-TRIG"]
    assert verify(run_of("d"), claims=[]) == []
    assert [verdict.claim.id for verdict in verify_model(case_a, claims=["THR-ROOT"])] == ["THR-ROOT"]


@pytest.mark.parametrize("unknown", ["SAFE-TRACES", "SAFE-INV", ""])
def test_an_unknown_claim_is_refused_with_what_is_allowed(unknown: str, case_a: Scenario) -> None:
    with pytest.raises(UnknownNameError, match=rf"unknown claim '{unknown}'; allowed: SAFE-TRACE, .*COMM"):
        verify(run_of("d"), claims=["COMM", unknown])
    with pytest.raises(UnknownNameError, match=r"unknown claim 'COMM'; allowed: SAFE-LEMMA, .*THR-DDM"):
        verify_model(case_a, claims=["COMM"])


def test_nothing_is_imported_before_use() -> None:
    code = "import sys, airground_drake.verify.registry as r; print(len([*r.RUN_CLAIMS]), *sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    count, *loaded = done.stdout.split()
    assert int(count) == len([*airground_drake.registry.RUN_CLAIMS])
    assert not [name for name in loaded if name.startswith(("pydrake", "cvxpy", "airground_drake.verify.model"))]


def test_claims_of_one_name_in_files_of_two_folders_are_two(tmp_path: Path) -> None:
    found = []
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "claims.py").write_text(
            "from airground_drake.verify.runs.comm import Comm\n"
            f"class Mine(Comm):\n    id = 'MINE'\n    summary = {folder!r}\n"
        )
        with pytest.MonkeyPatch.context() as patch:
            patch.syspath_prepend(tmp_path / folder)
            found += registry.run_claims(["MINE"], {"MINE": "claims.py:Mine"})
    assert [claim.summary for claim in found] == ["one", "two"]
