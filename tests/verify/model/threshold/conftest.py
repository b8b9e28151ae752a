"""Findings about the threshold, made once."""

from __future__ import annotations

import pytest
from verify.judging import Judged
from verify.model.threshold.cases import INPUTS

from airground_drake.scenarios.load import load
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.thr_ddm import ThrDdm
from airground_drake.verify.model.thr_opt import ThrOpt
from airground_drake.verify.model.thr_root import ThrRoot


@pytest.fixture(scope="session")
def found() -> dict[str, tuple[Finding, Finding]]:
    return {name: (ThrRoot().judge(inputs), ThrOpt().judge(inputs)) for name, inputs in INPUTS.items()}


@pytest.fixture(scope="session")
def simulated(judged: Judged) -> Finding:
    return judged(ThrDdm(), ThrDdm().inputs(load("case_a")[0]))
