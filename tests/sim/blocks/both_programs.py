"""What the claims and the checker, which share no code, say of a run."""

from airground_drake.check import safety
from airground_drake.check.run import Run
from airground_drake.scenario.load import resolved
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge


def found(trace: Trace, *claims: str) -> dict[str, str]:
    return {verdict.claim.id: verdict.status for verdict in judge(trace, claims or None)}


def checked(trace: Trace) -> Run:
    return Run(trace.run, resolved(trace.scenario), trace.events, trace.states, trace.samples)


def broken_rules(trace: Trace) -> list[str]:
    (verdict,) = judge(trace, ["SAFE-HYP"])
    ours = safety.safe_hyp(checked(trace))
    assert (verdict.status, ours.status) == ("refuted", "refuted")
    assert verdict.counterexample is not None
    assert ours.because is not None
    return [str(verdict.counterexample["hypothesis"]), ours.because.rule]
