"""cvc5's own proofs beside a report's certificates: complete ones are kept, of the others it is said why not."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

from airground_drake.verify import proof_files
from airground_drake.verify.engines.smt import Result
from airground_drake.verify.model.avoidance.obligations import rest
from airground_drake.verify.proof_files import LARGEST_BYTES, outcome


def test_proofs_are_written_where_there_are_any(tmp_path: Path) -> None:
    scripts = tmp_path / "certificates" / "SAFE-GATE"
    scripts.mkdir(parents=True)
    proved = next(each for each in rest() if each.name == "zero_at_distance")
    (scripts / "proved.smt2").write_text(proved.smt2(), encoding="utf-8")
    (scripts / "satisfiable.smt2").write_text(proved.smt2(goal=False), encoding="utf-8")
    assert proof_files.main([str(tmp_path)]) == 0
    index = json.loads((tmp_path / "proofs" / "index.json").read_text(encoding="utf-8"))
    found = {Path(entry["script"]).stem: entry for entry in index}
    assert found["satisfiable"]["outcome"] == "no proof: sat"
    assert found["proved"]["outcome"] == "complete"
    content = (tmp_path / found["proved"]["file"]).read_bytes()
    assert hashlib.sha256(content).hexdigest() == found["proved"]["sha256"]
    assert content.startswith(b"(declare-const ")
    assert content.count(b"(") == content.count(b")")
    assert content.count(b"assume") >= 2
    assert b":rule trust" not in content


def test_what_is_no_proof_is_said() -> None:
    assert outcome(Result("timeout", detail="no answer")) == "no proof: no answer"
    assert outcome(Result("unsat")) == "no proof: cvc5 gives none"
    assert outcome(Result("unsat", proof="(step @p false :rule trust)")) == "no proof: 1 of its steps have no rule"
    assert outcome(Result("unsat", proof="x" * (LARGEST_BYTES + 1))).startswith("no proof: it has")


def test_a_folder_that_is_no_report_is_refused(tmp_path: Path) -> None:
    assert proof_files.main([str(tmp_path)]) == 2
