"""Whether theorems count as proved: the theories are compared with the record of their last check, without Coq."""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from airground_drake.base.registry import MODEL_CLAIMS, RUN_CLAIMS
from airground_drake.verify.claim import Claim
from airground_drake.verify.proofs import THEOREMS, runs, standing
from airground_drake.verify.proofs.coq import CoqError
from airground_drake.verify.proofs.record import FOLDER, file_of, read_record


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    folder = tmp_path / "proofs"
    shutil.copytree(FOLDER, folder, ignore=shutil.ignore_patterns("*.py", "__pycache__"))
    return folder


def test_the_theories_of_this_release_are_those_that_coq_has_checked() -> None:
    found, record = standing(), read_record()
    assert found.checked, found.words
    assert found.words.startswith("checked by Coq ")
    assert record is not None
    assert set(record["axioms"]) == set(THEOREMS)
    assert set(found.theory) == set(record["sha256"]) == {path.name for path in FOLDER.glob("*.v")}


def test_a_changed_theory_and_what_builds_on_it_are_not_checked(copy: Path) -> None:
    with (copy / "Safety.v").open("a", encoding="utf-8") as file:
        file.write("(* another word *)\n")
    wanted = "not checked: Safety.v differs from its record: run `airground prove`"
    for name in ("Safety.safe_always", "Gate.scaled_back", "LawChecker.sound"):
        assert (standing(name, folder=copy).checked, standing(name, folder=copy).words) == (False, wanted)
    assert standing("Trigger.dwell_apart", "Threshold.least", folder=copy).checked


def test_runs_are_proved_with_the_theories_of_the_record_only(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a changed Run.v, say, every position could be far from all others."""
    with (copy / "Run.v").open("a", encoding="utf-8") as file:
        file.write("(* another word *)\n")
    monkeypatch.setattr(runs, "standing", partial(standing, folder=copy))
    wanted = r"the theories are not checked: Run\.v differs from its record: run `airground prove`"
    with pytest.raises(CoqError, match=wanted), runs.workshop():
        pass


def _with(change: Callable[[dict[str, dict[str, object]]], object]) -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        record = json.loads((folder / "record.json").read_text(encoding="utf-8"))
        change(record)
        (folder / "record.json").write_text(json.dumps(record), encoding="utf-8")

    return edit


@pytest.mark.parametrize(
    ("edit", "why"),
    [
        (lambda folder: (folder / "record.json").unlink(), "record.json cannot be read"),
        (lambda folder: (folder / "record.json").write_text("[]"), "record.json cannot be read"),
        (lambda folder: (folder / "Trigger.v").unlink(), "Trigger.v cannot be read"),
        (_with(lambda record: record["axioms"].pop("Trigger.at_most")), "Trigger.at_most is not in the record"),
        (
            _with(lambda record: record["axioms"].update({"Trigger.at_most": ["Trigger.it_is_so"]})),
            "Trigger.at_most rests on the axiom Trigger.it_is_so",
        ),
    ],
)
def test_what_is_not_in_the_record_is_not_checked(copy: Path, edit: Callable[[Path], None], why: str) -> None:
    edit(copy)
    found = standing("Trigger.at_most", folder=copy)
    assert not found.checked
    assert found.words.startswith(f"not checked: {why}")


def test_an_unknown_theorem_is_refused_with_those_that_there_are() -> None:
    with pytest.raises(ValueError, match=r"no theorem 'Safety.always'; there are Async.half_shares_fail, "):
        standing("Safety.always")


def test_all_hypotheses_are_checked_somewhere() -> None:
    claims = [registry.load(name, of=Claim) for registry in (MODEL_CLAIMS, RUN_CLAIMS) for name in registry.own]
    checked = {*runs.THEOREMS, *(name for claim in claims for name in claim.theorems)}
    theories = {name: file_of(name).removesuffix(".v") for name in THEOREMS}
    assert checked <= {*THEOREMS, *theories.values()}
    for name, theorem in THEOREMS.items():
        assert not theorem.hypotheses or {name, theories[name]} & checked, name
        assert theorem.statement.endswith(".")


def test_every_comment_about_a_theorem_is_read() -> None:
    comments = sum(file.read_text(encoding="utf-8").count("(** THEOREM") for file in FOLDER.glob("*.v"))
    assert comments == len(THEOREMS)


def test_the_standing_of_theorems_needs_neither_drake_nor_numpy() -> None:
    code = "from airground_drake.verify.proofs import standing; import sys; standing(); print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"numpy", "pandas", "pydrake"} & set(ran.stdout.split())
