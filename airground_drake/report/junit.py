"""junit.xml: one test case per claim and run, for continuous integration servers."""

import json
import re
import xml.etree.ElementTree as ET

from airground_drake.base.statuses import NOT_EXERCISED, outcome
from airground_drake.report.model import Claim, Report

# Characters that XML 1.0 cannot hold, not even escaped.
_NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def render(report: Report) -> str:
    # A claim whose status is the expected one passes; it is skipped, with the reason, if not tested.
    # Otherwise it fails; an `error` is an error and a `not_run` is skipped. A run without a trace and an
    # unchecked claim are errors.
    name, missing = report.scenario.name, report.overall.missing
    root = ET.Element("testsuites", {"name": _text(f"airground_drake.{name}")})
    runs = list(dict.fromkeys([*report.runs, *(claim.run for claim in report.claims), *(item.run for item in missing)]))
    for run in runs:
        suite = ET.SubElement(root, "testsuite", {"name": _text(f"{name}.{run}")})
        for claim in report.claims:
            if claim.run == run:
                _outcome(_case(suite, name, run, claim.id), claim)
        for number in report.overall.numbers:
            if number.run == run:
                case = _case(suite, name, run, number.id)
                if not number.as_expected:
                    message = f"{number.found} {number.id}, expected at least {number.least}"
                    ET.SubElement(case, "failure", {"message": message, "type": "number"})
        for item in missing:
            if item.run == run:
                case = _case(suite, name, run, item.id or "run")
                ET.SubElement(case, "error", {"message": _text(item.why), "type": "missing"})
        seconds = report.runs[run].metrics.wall_s if run in report.runs else None
        _count(suite, [suite], seconds or 0.0)
    _count(root, list(root), sum(float(suite.get("time", 0.0)) for suite in root))
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def _case(suite: ET.Element, scenario: str, run: str, claim: str) -> ET.Element:
    attributes = {"classname": f"{scenario}.{run}", "name": claim, "time": "0"}
    return ET.SubElement(suite, "testcase", {key: _text(value) for key, value in attributes.items()})


def _outcome(case: ET.Element, claim: Claim) -> None:
    idle = outcome(claim.status, claim.exercised) == NOT_EXERCISED
    status = f"{claim.status}, not tested (0 {claim.exercised_by})" if idle else claim.status
    if claim.as_expected is not False:
        skipped = f"{status}, nothing promised" if claim.as_expected is None else status if idle else ""
        if skipped:
            ET.SubElement(case, "skipped", {"message": _text(f"{skipped}: {claim.statement}")})
        return
    margin = "" if claim.margin is None else f", margin {claim.margin:.4g} {claim.unit}".rstrip()
    if margin and claim.quantity:
        margin += f" ({claim.quantity})"
    message = _text(f"{status}, expected {claim.expected}{margin}: {claim.statement}")
    if claim.status == "not_run":
        ET.SubElement(case, "skipped", {"message": message})
        return
    kind = "error" if claim.status == "error" else "failure"
    element = ET.SubElement(case, kind, {"message": message, "type": claim.status})
    parts = {"where": claim.where, "counterexample": claim.counterexample, "evidence": claim.evidence}
    details = {name: part for name, part in parts.items() if part}
    element.text = _text(json.dumps(details, indent=1, ensure_ascii=False))


def _count(element: ET.Element, suites: list[ET.Element], seconds: float) -> None:
    paths = {"tests": "testcase", "failures": "*/failure", "errors": "*/error", "skipped": "*/skipped"}
    for total, path in paths.items():
        element.set(total, str(sum(len(suite.findall(path)) for suite in suites)))
    element.set("time", f"{seconds:.3f}")


def _text(text: str) -> str:
    return _NOT_XML.sub("\ufffd", text)
