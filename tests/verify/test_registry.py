"""Which claims there are, and that a claim is one file and one line."""

import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from builders.runs import run_of

import airground_drake.verify
from airground_drake.base.errors import PluginError, UnknownNameError
from airground_drake.base.registry import MODEL_CLAIMS, RUN_CLAIMS
from airground_drake.scenario.schema import Scenario
from airground_drake.verify import judge, judge_model, registry
from airground_drake.verify.claim import Claim, ModelClaim, TraceClaim

FOLDER = Path(airground_drake.verify.__file__).parent
SAYS = "statement = formula = method = equations = does_not_establish = 'Said.'; assumptions = ()"
"""What a claim must say of itself, in a class of one line."""
SAID = ("statement", "method", "equations", "does_not_establish", "exercised_by")
REGISTERED = [
    table.load(name, of=kind)
    for table, kind in ((RUN_CLAIMS, TraceClaim), (MODEL_CLAIMS, ModelClaim))
    for name in table.own
]


def test_every_claim_is_in_the_file_of_its_name_is_registered_and_says_what_it_is() -> None:
    for kind in REGISTERED:
        assert kind.__module__.rpartition(".")[2] == kind.id.lower().replace("-", "_")
        assert all((*(getattr(kind, word).strip() for word in SAID), kind.assumptions, *kind.assumptions)), kind
    for path in FOLDER.glob("*/*.py"):
        module = import_module(".".join(["airground_drake.verify", *path.relative_to(FOLDER).with_suffix("").parts]))
        found = [each for each in vars(module).values() if isinstance(each, type) and issubclass(each, Claim)]
        assert {each for each in found if "id" in vars(each)} <= set(REGISTERED)


def test_only_the_claims_asked_for_are_judged_in_the_order_of_the_report(case_a: Scenario) -> None:
    asked = [verdict.claim.id for verdict in judge(run_of("d"), claims=["THR-TRIG", "SAFE-TRACE"])]
    assert asked == ["SAFE-TRACE", "THR-TRIG"]
    assert judge(run_of("d"), claims=[]) == []
    assert [verdict.claim.id for verdict in judge_model(case_a, claims=["THR-ROOT"])] == ["THR-ROOT"]


def test_an_unknown_claim_is_refused_with_what_is_allowed(case_a: Scenario) -> None:
    with pytest.raises(UnknownNameError, match=r"unknown claim 'SAFE-INV'; allowed: SAFE-TRACE, .*LIVE-GOAL"):
        judge(run_of("d"), claims=["LIVE-GOAL", "SAFE-INV"])
    with pytest.raises(UnknownNameError, match=r"unknown claim 'LIVE-GOAL'; allowed: SAFE-INV, .*THR-DDM"):
        judge_model(case_a, claims=["LIVE-GOAL"])


def test_nothing_is_imported_before_use() -> None:
    code = "import sys, airground_drake.verify.registry as r; [*r.RUN_CLAIMS]; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not [
        name
        for name in loaded
        if name.startswith(("pydrake", "cvxpy", "airground_drake.verify.claims", "airground_drake.verify.model"))
    ]


def test_claims_of_one_name_in_files_of_two_folders_are_two(tmp_path: Path) -> None:
    found: list[Any] = []
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "claims.py").write_text(
            "from airground_drake.verify.claims.live_goal import LiveGoal\n"
            f"class Mine(LiveGoal):\n    id = 'MINE'\n    summary = {folder!r}\n"
        )
        with pytest.MonkeyPatch.context() as patch:
            patch.syspath_prepend(tmp_path / folder)
            found += registry.run_claims(["MINE"], {"MINE": "claims.py:Mine"})
    assert [claim.summary for claim in found] == ["one", "two"]


@pytest.mark.parametrize(
    ("says", "why"),
    [
        ("", "has no 'statement'; wanted: id, statement, method, equations, assumptions"),
        (f"{SAYS}; del assumptions", "has no 'assumptions'"),
        (f"{SAYS}; formula = ''", "has neither 'formula' nor 'latex'"),
        (f"{SAYS}; assumptions = 'All is well.'", "'assumptions' 'All is well.': Input should be a valid tuple"),
        (f"{SAYS}; expected = 'fine'", "'expected' 'fine': Input should be 'proved', 'holds'"),
    ],
)
@pytest.mark.parametrize("kind", ["TraceClaim", "ModelClaim"])
def test_a_claim_that_does_not_say_what_it_is_is_refused_before_it_is_judged(
    says: str, why: str, kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mute.py").write_text(
        f"from airground_drake.verify.claim import {kind}\n"
        f"class Mine({kind}):\n    id = 'MINE'; {says}\n    def check(self, *_): ...\n    def inputs(self, _): ...\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    kinds: dict[str, Any] = {"TraceClaim": registry.run_claims, "ModelClaim": registry.model_claims}
    with pytest.raises(PluginError, match=f"claim 'MINE': mute.py:Mine .*{why}"):
        kinds[kind](["MINE"], {"MINE": "mute.py:Mine"})
