"""A hostile name in forged metadata is refused in one line, or it is text wherever it is shown."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from report.cases import FINE, GOING_ROUND, SUCCESS, built, make_scenario, make_trace, make_traces

from airground_drake.commands import main
from airground_drake.scenario.load import resolved
from airground_drake.sim import trace

HOSTILE = "<script>alert(1)</script>"
FORGED = dict.fromkeys(("robots", "run", "method", "scenario"), (0, 0, 2, 2)) | {"events": (0,) * 4}
"""Exit codes of index, compare, replay and figures, by the part of a run's metadata that has the name."""


def forge(part: str, folder: Path) -> None:
    scenario = make_scenario()
    made = make_trace(scenario, "c", GOING_ROUND, SUCCESS)
    meta: dict[str, Any] = {**made.meta, "scenario": resolved(scenario), "schema": trace.SCHEMA}
    for key in {"robots": ("robots", "ugvs")}.get(part, (part,)):
        text = json.dumps(meta[key])
        for name in ("ugv1", "trigger", "c"):
            text = text.replace(json.dumps(name), json.dumps(HOSTILE))
        meta[key] = json.loads(text)
    columns = {name: name.replace("ugv1.", f"{HOSTILE}.") for name in made.states if part == "robots"}
    trace.save(replace(made, meta=meta, states=made.states.rename(columns=columns)), folder / "trace" / "c")
    (folder / "report.json").write_text(json.dumps(built(scenario, make_traces(scenario), FINE)))


@pytest.mark.parametrize("part", FORGED)
def test_a_name_in_forged_metadata_is_refused_or_text(
    part: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = str(tmp_path / "report")
    forge(part, tmp_path / "report")
    drawn = (
        ["index", str(tmp_path)],
        ["compare", report, report, "--html", str(tmp_path / "compare.html")],
        ["replay", report, "c", "-o", str(tmp_path / "replay.html")],
        ["figures", report, "-o", str(tmp_path / "figures"), "--format", "svg"],
    )
    for arguments, code in zip(drawn, FORGED[part], strict=True):
        assert main(arguments) == code, arguments
        assert capsys.readouterr().err.count("\n") == bool(code)
    pages = [path.read_text("utf-8") for path in tmp_path.rglob("*") if path.suffix in (".html", ".svg", ".tex")]
    assert not any(HOSTILE in page for page in pages)
    assert any("&lt;script&gt;" in page for page in pages) == (part == "events")
