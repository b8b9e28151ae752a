"""The theorems, by Coq: what may not be assumed and what cannot be proved. CI proves all with `airground prove`."""

import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from airground_drake.verify.proofs import coq
from airground_drake.verify.proofs.coq import Checked, differences, write_record
from airground_drake.verify.proofs.record import FOLDER

ASSUMED = "Variable it_is_so : forall n : nat, n = 0.\nTheorem so : 1 = 0.\nProof. apply it_is_so. Qed.\n"


def test_what_differs_from_the_record_is_named(tmp_path: Path) -> None:
    before = Checked("8.16.1", {"A.v": "1", "B.v": "2"}, {"A.a": [], "B.b": []}, 0.0, 0.0)
    write_record(before, tmp_path)
    assert differences(replace(before, coq="8.20.0"), tmp_path) == []
    now = replace(before, sha256={"A.v": "1", "B.v": "3", "C.v": "4"}, axioms={"A.a": ["Classical_Prop.classic"]})
    assert differences(now, tmp_path) == [f"{name} differs from its record" for name in ("B.v", "C.v", "A.a", "B.b")]
    (tmp_path / "record.json").unlink()
    assert differences(now, tmp_path) == ["record.json cannot be read"]


@pytest.mark.parametrize(
    "cheat",
    [
        "Theorem so : False. Proof. admit. Admitted.",
        "Axiom so : False.",
        "Parameter so : False.",
        "#[bypass_check(guard)] Fixpoint f (n : nat) : False := f n.",
        "Unset Guard Checking.",
        "Set Type In Type.",
        '(* " (* " *) Axiom so : False.',
        'Definition a := "(*". Axiom so : False. Definition b := "*)".',
    ],
)
def test_words_that_assume_something_are_refused(cheat: str) -> None:
    comment = "(* no Axiom (* is Admitted *), no Parameter *)\n"
    coq.screen(f"{comment}Definition a := 1.\n", "fine.v")
    with pytest.raises(coq.CoqError, match=r"so\.v has the word '.*': a theory may assume nothing"):
        coq.screen(f"{comment}{cheat}\n", "so.v")


def test_what_is_assumed_in_other_words_is_found_among_the_axioms(coq_version: str, tmp_path: Path) -> None:
    for name, text in (("so", ASSUMED), ("fine", "Theorem fine : 1 + 1 = 2.\nProof. reflexivity. Qed.\n")):
        (tmp_path / f"{name}.v").write_text(text, encoding="utf-8")
        coq.compile_file(tmp_path / f"{name}.v")
    with pytest.raises(coq.CoqError, match=r"so\.so rests on so\.it_is_so, which is not allowed"):
        coq.axioms_of(["so.so"], tmp_path)
    with pytest.raises(coq.CoqError, match=r"coqchk finds the axiom so\.it_is_so, which is not allowed"):
        coq.check_again(["so"], tmp_path)
    coq.check_again(["fine"], tmp_path)
    assert coq.axioms_of(["fine.fine"], tmp_path) == {"fine.fine": []}


def test_an_axiom_with_the_name_of_an_allowed_one_is_found(coq_version: str, tmp_path: Path) -> None:
    (tmp_path / "so.v").write_text("Module Classical_Prop.\nVariable classic : False.\nEnd Classical_Prop.\n")
    coq.compile_file(tmp_path / "so.v")
    with pytest.raises(coq.CoqError, match=r"coqchk finds the axiom so\.Classical_Prop\.classic, which is not allowed"):
        coq.check_again(["so"], tmp_path)


WRONG = [
    pytest.param("Safety.v", "share i j + share j i = 1.", "share i j + share j i = 9 / 10.", "between", id="shares"),
    pytest.param("Safety.v", " (no_overshoot : A * h <= 1)", "", "missing_nonneg", id="no A h <= 1"),
    pytest.param("Safety.v", "else - (D - d) / h.", "else - (D - d).", "period", id="bound without 1/h"),
    pytest.param("Safety.v", "norm n = 1 /\\ forall y", "forall y", "lemma", id="vectors of any length"),
    pytest.param("Convex.v", "norm e <= - gap x ->", "norm e <= - gap x / 2 ->", "leads_away", id="half the depth"),
    pytest.param("Passive.v", "+ f + (w + Vo) * h <= L ->", "+ f + w * h <= L ->", "kept", id="no Vo"),
    pytest.param("Passive.v", "W <= r k -> m <= L - W * h ->", "m <= L - W * h ->", "held_off", id="no retreat"),
    pytest.param("Budget.v", "err * (1 - A * h) <= A * h * m)", "0 <= A * h * m)", "after", id="no condition on eps"),
    pytest.param("Budget.v", "loss i j / A + sqrt", "sqrt", "budget", id="no W/A"),
    pytest.param("Budget.v", "dip i + dip j) ^ 2 +", "dip i) ^ 2 +", "budget", id="one dip"),
    pytest.param("Pieces.v", "M * (h * h) / 8.", "M * (h * h) / 9.", "leaves_chord", id="a smaller dip"),
    pytest.param("Plants.v", "om = 2 * be / h", "om = be / h", "arrives_on_arc", id="half the turning rate"),
    pytest.param("Plants.v", "0 <= m -> 0 <= v -> 0 <= s", "0 <= m -> 0 <= s", "forwards_period", id="backwards"),
    pytest.param("Plants.v", "- Rabs (tj - tau) * Vj in", "in", "lag_pair", id="lag of one body"),
    pytest.param("Turning.v", "T := tan (W * h / 2)", "T := tan (W * h)", "T_positive", id="twice the limit"),
    pytest.param("Mixed.v", "<= drift b * h) /\\", "<= drift b * h + dip b) /\\", "drifting", id="dips add up"),
    pytest.param("Mixed.v", "-> drift i + Vo <= r k", "-> Vo <= r k", "entry_keeps", id="retreat without drift"),
    pytest.param("LawChecker.v", "if 0 <=? w then", "if 0 <=? - w then", "meets_law_sound", id="wrong sign"),
    pytest.param("DistanceChecker.v", "Z.max 1 (Z.sqrt_up", "Z.max 0 (Z.sqrt_up", "root_sound", id="vector 0"),
    pytest.param("DistanceChecker.v", "Z.min (e / cost)", "Z.min (2 * e / cost)", "lasts_known", id="lasts too long"),
    pytest.param("Trigger.v", "if Rle_dec (dwell_end s) t then", "if Rle_dec 0 0 then", "invariant", id="no dwell"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("theory", "right", "wrong", "lemma"), WRONG)
def test_wrong_variants_are_not_proved(
    theory: str, right: str, wrong: str, lemma: str, compiled: Path, tmp_path: Path
) -> None:
    """A hypothesis or a rule is changed: the proof breaks in the lemma that needs it."""
    text = (FOLDER / theory).read_text(encoding="utf-8")
    assert right in text
    shutil.copytree(compiled, tmp_path / "theories")
    (tmp_path / "theories" / theory).write_text(text.replace(right, wrong), encoding="utf-8")
    with pytest.raises(coq.CoqError) as refused:
        coq.compile_file(tmp_path / "theories" / theory)
    before = "\n".join(text.splitlines()[: refused.value.line])
    assert re.findall(r"^(?:Lemma|Theorem|Corollary) (\w+)", before, re.MULTILINE)[-1] == lemma, refused.value
    assert "yntax" not in str(refused.value)
