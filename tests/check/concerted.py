"""32 forgeries that somebody might try, and which of the three programs of `airground check --simulate` refuses each.

`PYTHONPATH=tests python -m check.concerted DIR` makes the report that is forged, tries them, and prints a table: the
checker (i), the report made again from its traces (ii), and the runs simulated again (iii). A forger who knows this
package does not stop at one number: after an edit that is `made_again`, verdicts, counts, pages and digests follow from
the forged traces and scenario.
"""

import hashlib
import json
import re
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from builders.hostile_policies import KINDS
from check.forgeries import RULES, all_of, both, claim, everywhere, leap, report, rows, words
from check.forging import (
    RUN,
    UGV,
    Edit,
    claim_of,
    edited_json,
    edited_report,
    edited_table,
    forged,
    judged,
    read_table,
    remembered,
    remembering,
    trace,
    write,
    write_table,
)

from airground_drake.base.errors import AirgroundError
from airground_drake.base.progress import SILENT
from airground_drake.check import command as checker
from airground_drake.check.line import AGREES, RECORDED
from airground_drake.report import junit, proved, rebuild, simulated
from airground_drake.report.__main__ import main as write_report
from airground_drake.report.figures import draw as drawing
from airground_drake.report.html import page
from airground_drake.report.model import of
from airground_drake.scenario.load import from_data
from airground_drake.scenario.plugins import OPTION
from airground_drake.sim.trace import load

POLICIES = [
    {"name": "builders.hostile_policies:Hostile", "parameters": {"kind": [*KINDS].index("raises")}},
    {"name": "towards", "parameters": {"x_m": 5.5, "y_m": 5.8, "speed_m_s": 3.0}},
    {"name": "detour", "parameters": {"speed_m_s": 5.0, "clearance_m": 0.05}},
]
"""Those of case B, and a third-party one that fails."""
OTHER = {"name": "stale_map", "parameters": {"speed_m_s": 5.0}}
"""In the place of the detour."""
RUNS = {
    "b": {"method": "b", "expected": dict.fromkeys(("SAFE-TRACE", "SAFE-HYP", "LIVE-GOAL"), "refuted")},
    "c": {"method": "c", "expected": dict.fromkeys(("SAFE-TRACE", "SAFE-HYP"), "nothing")},
    "d": {"method": "d"},
}
SETTINGS = (
    f"intervention.policies={json.dumps(POLICIES)}", "claims={MINE: 'check.foreign:Short'}",
    f"runs={json.dumps(RUNS)}", "reproduction=[]", "choices=[]",
)  # fmt: skip


def make(folder: Path) -> None:
    settings = [word for each in SETTINGS for word in ("--set", each)]
    assert write_report(["case_b", "-o", str(folder), "-q", "--seeds", "2", *settings, OPTION]) == 0


def made_again(*edits: Edit) -> Edit:
    """After the edits, verdicts, counts, events and pages are made again from the forged traces and scenario."""

    def edit(folder: Path) -> None:
        all_of(*edits)(folder)
        follow(folder)

    return edit


@remembering()
def follow(folder: Path) -> None:
    with edited_report(folder) as document:
        scenario = from_data(document["scenario"]["resolved"], "forged")
        for run in scenario.runs:
            of_run = rebuild.with_events(load(trace(folder, run)))
            with edited_json(trace(folder, run) / "meta.json") as about:
                about["events"] = of_run.meta["events"]
        traces = {run: load(trace(folder, run)) for run in scenario.runs}
        document |= rebuild.document_again(document, scenario, traces, judged)
        made = of(document)
        write(folder / "junit.xml", junit.render(made).encode())
        text = page(made, drawing.draw(scenario, traces), (folder / "diagram.svg").read_text(encoding="utf-8"))
        write(folder / "report.html", text.encode())


# ------------------------------------------------------------------------------------- edits


def crash_called_safe(folder: Path) -> None:
    everywhere("runs", "b", "expected", value={})(folder)
    with edited_report(folder) as document:
        for name in ("SAFE-TRACE", "SAFE-HYP"):
            claim_of(document, name, "b").update(status="holds", expected="holds", counterexample=None)
        counts = document["overall"]["counts"]
        counts["holds"] += counts.pop("refuted")


def crash_expected_by_nobody(folder: Path) -> None:
    """The scenario no longer says that the crash is a deviation: it promises nothing."""
    everywhere("runs", "b", "expected", value=lambda old: old | {"SAFE-TRACE": "nothing"})(folder)


def without_claim(name: str, run: str = RUN) -> Edit:
    return report("claims", value=lambda old: [each for each in old if (each["id"], each["run"]) != (name, run)])


def seed_everywhere(folder: Path) -> None:
    everywhere("seed", value=2)(folder)
    for run in "bcd":
        both("seed", value=2, run=run)(folder)
    report("provenance", "seed", value=2)(folder)


def fault_left_out(folder: Path) -> None:
    for run in "bcd":
        both("faults", value=[], run=run)(folder)


def refusal_forgotten(folder: Path) -> None:
    issued = read_table(folder, "decisions", "c")["issued_s"]
    which = np.flatnonzero(issued != issued.iloc[0])
    for table in ("decisions", "problems"):
        write_table(folder, read_table(folder, table, "c").iloc[which], table, "c")
    with edited_json(trace(folder, "c") / "timings.json") as timings:
        timings["decision_times_s"] = [timings["decision_times_s"][k] for k in which]


def bound_lowered(folder: Path) -> None:
    with edited_table(folder, "decisions", "c") as frame:
        frame["route_bound"] *= 0.98
        frame["gap"] = 1.0 - frame["route_bound"] / frame["objective"]


def other_motion(folder: Path) -> None:
    with edited_table(folder, "proposals") as frame:
        positions = [value.copy() for value in frame["positions_m"]]
        positions[0][-2] += 0.5
        frame["positions_m"] = positions


def drawing_moved(folder: Path) -> None:
    text = (folder / "report.html").read_text(encoding="utf-8")
    begins = re.search(r' d="M (\d+\.\d+)', text)
    assert begins is not None
    moved = f"{text[: begins.start(1)]}{float(begins[1]) + 0.1:.2f}{text[begins.end(1) :]}"
    write(folder / "report.html", moved.encode())


def painted_over(folder: Path) -> None:
    """A drawing that covers the page, in a page whose drawings are said to come from another version of matplotlib."""
    page_file = folder / "report.html"
    with edited_report(folder) as document:
        drawn_by = document["provenance"]["packages"]["matplotlib"]
        document["provenance"]["packages"]["matplotlib"] = "3.10.0"
    text = page_file.read_text(encoding="utf-8").replace(f"matplotlib {drawn_by}", "matplotlib 3.10.0")
    over = '<path d="M -999 -9999 h 1999 v 9999 h -1999 z" fill="#ffffff" /></svg>'
    text = text.replace("</svg>", over, 1).replace("<svg ", '<svg overflow="visible" ', 1)
    write(page_file, text.encode())


def crash_called_proved(folder: Path) -> None:
    from airground_drake.verify.proofs.export import distances_file, recorded
    from airground_drake.verify.proofs.readback import compare
    from airground_drake.verify.proofs.record import ALLOWED_AXIOMS, FOLDER, closure, digest
    from airground_drake.verify.proofs.runs import CHECKERS
    from airground_drake.verify.proofs.table import lawful

    run = load(trace(folder, "b"))
    exact = recorded(run)
    rounded = compare(distances_file(exact), run)
    proof = {"proved": True, "axioms": sorted(ALLOWED_AXIOMS), "seconds": 1.0}
    entry = {
        "expected": False,
        "meta_sha256": hashlib.sha256((trace(folder, "b") / "meta.json").read_bytes()).hexdigest(),
        "rows": len(read_table(folder, run="b")), "pairs": len(exact.demands),
        "lawful_pairs": len(lawful(exact.demands)),
        "rounded_coordinates": rounded.coordinates, "rounded_by_m": rounded.most_m,
        "distances": proof | {"theorem": f"{exact.name}_keeps_its_distances", "file": f"{exact.name}.v"},
        "law": {
            "proved": False, "theorem": f"{exact.name}_obeys_the_law", "file": f"{exact.name}_law.v",
            "why": "it took longer than 1 s",
        },
    }  # fmt: skip
    (folder / "proofs").mkdir()
    found = {"schema": "airground_drake.proofs/1", "coq": "8.16.1", "runs": {"b": entry}}
    found["theory"] = {name: digest(FOLDER / name) for name in closure(CHECKERS)}
    write(folder / "proofs" / "proofs.json", json.dumps(found).encode())
    write(folder / "proofs" / f"{exact.name}.v", distances_file(exact).encode())
    proved.write(folder)


FORGERIES: dict[str, tuple[str, Edit]] = {
    # statuses
    "crash called safe": ("i, ii", crash_called_safe),
    "margin of a distance": ("i, ii", RULES["margin"][1]),
    "constants of a proof": ("ii", claim("SAFE-INV", "", inputs=lambda old: dict.fromkeys(old, 0.5))),
    "words of a claim": ("ii", claim("SAFE-GATE", "", statement="No robot can ever collide.")),
    "expectation of a claim": ("ii", claim("LIVE-GOAL", expected="nothing")),
    "verdict over all": ("ii", report("overall", "checks", value=lambda old: old + 1)),
    "outcome of a third-party claim": ("iii", made_again(claim("MINE", margin=59.0))),
    # claims left out
    "claim about distances left out": ("i, ii", RULES["claim left out"][1]),
    "proof left out": ("ii", without_claim("SAFE-INV", "")),
    "third-party claim left out of a run": ("iii", made_again(without_claim("MINE"))),
    # the scenario, in all its places
    "other gain": ("iii", made_again(everywhere("control", "motion_gain_1_s", value=2.5))),
    "other speed of a policy": (
        "iii", made_again(everywhere("intervention", "policies", 2, "parameters", "speed_m_s", value=4.0)),
    ),
    "another policy": ("iii", made_again(everywhere("intervention", "policies", 2, value=OTHER))),
    "another seed": ("iii", made_again(seed_everywhere)),
    "smaller safe distance": ("i, ii, iii", everywhere("safe_distance", "obstacle_m", value=1.9)),
    "crash declared irrelevant": ("", made_again(crash_expected_by_nobody)),
    # motion
    "UGV elsewhere, and back": ("ii, iii", leap(UGV, 1e-3)),
    "run elsewhere throughout": ("i, ii, iii", RULES["elsewhere throughout"][1]),
    "trigger late": ("i, ii, iii", RULES["trigger late"][1]),
    "rows between samples left out": (
        "iii", made_again(rows(lambda f: f[np.abs(f["t_s"] / 0.05 - (f["t_s"] / 0.05).round()) < 1e-6])),
    ),
    "collision left out": ("i, ii, iii", RULES["collision left out"][1]),
    "column of real positions": ("iii", made_again(rows(lambda frame: frame.assign(true_x_m=0.0)))),
    # messages, decisions, faults
    "refusal forgotten": ("ii, iii", made_again(refusal_forgotten)),
    "bound lowered": ("iii", made_again(bound_lowered)),
    "another motion of a refused proposal": ("iii", made_again(other_motion)),
    "faults left out": ("iii", made_again(fault_left_out)),
    # pages
    "drawing moved": ("ii", drawing_moved),
    "drawing over the page": ("ii", painted_over),
    "another diagram": ("iii", made_again(words("diagram.svg", "gatekeeper", "oracle"))),
    "crash called proved": ("ii", crash_called_proved),
    # metadata
    "outcome of another seed": ("iii", made_again(report("seeds", -1, "min_distance_m", value=2.5))),
    "another machine": ("", made_again(report("provenance", "platform", value="a robot"))),
}  # fmt: skip
"""32 forgeries, and who refuses them at least: '' what is taken as recorded."""


# ------------------------------------------------------------------------------------- who refuses


PROGRAMS = ("i", "ii", "iii")


@remembering()
def refused_by(folder: Path, programs: Sequence[str] = PROGRAMS) -> dict[str, str]:
    """Of each of these programs that refuses a report, the first line that says so."""

    def lines(by: str) -> Iterator[tuple[str, str]]:
        if by == "i":
            for line in checker.checked(folder, checker.LIMIT_S):
                yield line.outcome, f"{line.claim} {line.run}: {line.text}"
        else:
            again = partial(rebuild.lines, judge=judged) if by == "ii" else partial(simulated.lines, allow_plugins=True)
            for each in again(folder):
                yield each["outcome"], f"{each['claim']} {each['run']}: {each['text']}"

    found = {}
    for by in programs:
        try:
            said = next((text for outcome, text in lines(by) if outcome not in (AGREES, RECORDED)), "")
        except (AirgroundError, checker.UsageError) as error:
            said = str(error)
        if said:
            found[by] = said
    return found


def simulating_once(patch: pytest.MonkeyPatch) -> None:
    """Simulate each scenario once: most forgeries leave it as it is."""
    with_seeds = remembered(partial(simulated.with_seeds, progress=SILENT))
    patch.setattr(simulated, "simulate_all", remembered(simulated.simulate_all))
    patch.setattr(simulated, "with_seeds", lambda scenario, made, seeds, _: with_seeds(scenario, made, seeds))


def main(folder: Path) -> None:
    if not folder.exists():
        make(folder)
    print("| forgery | (i) | (ii) | (iii) |\n| --- | --- | --- | --- |")
    with pytest.MonkeyPatch.context() as patch:
        simulating_once(patch)
        for name, (due, edit) in FORGERIES.items():
            found = refused_by(forged(folder, edit))
            cells_of = " | ".join("x" if by in found else "" for by in PROGRAMS)
            note = "" if {*filter(None, due.split(", "))} <= {*found} else f"  NOT AS DUE: {due}"
            print(f"| {name} | {cells_of} |{note}", flush=True)
            for by, text in found.items():
                print(f"    {by}: {text[:200]}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
