"""Tampering with certificates."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import pandas as pd
from check.tampering.base import (
    claim_of,
    edited_certificate,
    edited_claim,
    edited_obligation,
    edited_report,
    ignored,
    read_json,
    refused_by,
    seal_certificate,
    write,
)

EXPANDS = "the certificate expands to its goal"


@refused_by("SAFE-INV", "SHA-256 of certificates", run="")
def certificate_missing(folder: Path) -> None:
    (folder / "certificates" / "SAFE-INV" / "obligations.json").unlink()


@refused_by("SAFE-INV", "the file can be read", run="")
def certificate_missing_and_not_listed(folder: Path) -> None:
    certificate_missing(folder)
    with edited_claim(folder, "SAFE-INV", "") as claim:
        del claim["certificates"]["obligations.json"]


@refused_by("SAFE-INV", "SHA-256 of certificates", run="")
def certificate_added(folder: Path) -> None:
    write(folder / "certificates" / "SAFE-INV" / "more.json", b"{}")


@refused_by("SAFE-INV", "SHA-256 of certificates", run="")
def certificate_changed_digest_left(folder: Path) -> None:
    path = folder / "certificates" / "SAFE-INV" / "obligations.json"
    write(path, path.read_bytes() + b"\n")


@refused_by("SAFE-INV", EXPANDS, run="")
def coefficient_changed(folder: Path) -> None:
    with edited_obligation(folder, "SAFE-INV", "pair_outside") as one:
        one["certificate"][2]["coefficient"] = "1"


@refused_by("SAFE-INV", "coefficients are not negative", run="")
def coefficient_negative(folder: Path) -> None:
    with edited_obligation(folder, "SAFE-INV", "outside") as one:
        one["goal"] = "d - D - s*r"
        for term in one["certificate"]:
            term["coefficient"] = "-1"


@refused_by("SAFE-INV", "a number is an integer or a fraction", run="")
def coefficient_without_a_sign(folder: Path) -> None:
    with edited_obligation(folder, "SAFE-INV", "outside") as one:
        one["goal"] = "h*d"
        one.update(multiplier=[], certificate=[{"coefficient": "h*d", "factors": [], "square": "1"}])


@refused_by("SAFE-INV", "the multiplier is positive", run="")
def multiplier_not_positive(folder: Path) -> None:
    with edited_obligation(folder, "SAFE-INV", "outside") as one:
        one.update(multiplier=[{"coefficient": "0", "factors": ["h"], "square": "1"}], certificate=[])


@refused_by("SAFE-INV", "the multiplier is positive", run="")
def multiplier_that_may_be_zero(folder: Path) -> None:
    """Anything times 0: s may be 0."""
    with edited_obligation(folder, "SAFE-INV", "outside") as one:
        one["multiplier"] = [{"coefficient": "1", "factors": ["s"], "square": "1"}]


@refused_by("SAFE-INV", "the goal is the claim's", run="")
def goal_weakened(folder: Path) -> None:
    with edited_obligation(folder, "SAFE-INV", "outside") as one:
        one["goal"] = "D + s*r - d + 1"
        one["certificate"].append({"coefficient": "1", "factors": ["h"], "square": "1"})


@refused_by("SAFE-INV", "the goal is the claim's", run="")
def goal_with_numbers_weakened(folder: Path) -> None:
    with edited_obligation(folder, "SAFE-INV", "inside_obstacle") as one:
        one["goal"] = "r*s + 1"
        one["certificate"].append({"coefficient": "1", "factors": [], "square": "1"})


@refused_by("SAFE-DIST", "no further premise", run="")
def hypothesis_added(folder: Path) -> None:
    with edited_obligation(folder, "SAFE-DIST", "inside_bound") as one:
        one["hypotheses"]["begged"] = one["goal"]
        one["certificate"] = [{"coefficient": "1", "factors": ["begged"], "square": "1"}]


@refused_by("SAFE-INV", "no further premise", run="")
def false_number_assumed(folder: Path) -> None:
    """From -1 >= 0 everything follows."""
    with edited_obligation(folder, "SAFE-INV", "unseen_obstacle") as one:
        one["hypotheses"]["false"] = "-1"


@refused_by("SAFE-GATE", "no further premise", run="")
def equation_added(folder: Path) -> None:
    with edited_obligation(folder, "SAFE-GATE", "zero_outside") as one:
        one.update(equations={"begged": "b"}, equation_multipliers={"begged": "-1"}, multiplier=[], certificate=[])


@refused_by("SAFE-INV", EXPANDS, run="")
def number_in_a_certificate_changed(folder: Path) -> None:
    with edited_obligation(folder, "SAFE-INV", "outside_obstacle") as one:
        one["hypotheses"]["rest"] = one["hypotheses"]["rest"].replace("1/20", "1/40")


@refused_by("SAFE-INV", "an obligation is there once", run="")
def name_twice(folder: Path) -> None:
    with edited_certificate(folder, "SAFE-INV") as obligations:
        true = next(entry for entry in obligations if entry["name"] == "outside")
        obligations.insert(0, {**true, "says": "the same again"})


@refused_by("SAFE-LEMMA", "no further premise", run="")
def hypotheses_made_strict(folder: Path) -> None:
    with edited_certificate(folder, "SAFE-LEMMA") as obligations:
        for one in obligations:
            one["strict"] = {**one["hypotheses"], **one["strict"]}
            one["hypotheses"] = {}


@refused_by("ZENO-PROOF", "the obligation is there", run="")
def invariant_of_the_automaton_not_shown(folder: Path) -> None:
    with edited_certificate(folder, "ZENO-PROOF") as obligations:
        obligations[:] = [one for one in obligations if one["name"].endswith("_claim")]


@refused_by("SAFE-DIST", "the obligation is there", run="")
def only_half_of_the_claim_shown(folder: Path) -> None:
    with edited_certificate(folder, "SAFE-DIST") as obligations:
        obligations[:] = [one for one in obligations if one["name"].endswith("_bound")]


@refused_by("SAFE-INV", "the obligation is one of the claim's", run="")
def obligation_invented(folder: Path) -> None:
    """It expands, and follows from anything: its premise is false."""
    invented = {
        "name": "never_collides", "says": "no robot ever collides", "variables": [], "goal": "1", "hypotheses": {},
        "strict": {"false": "-1"}, "equations": {}, "multiplier": [], "equation_multipliers": {},
        "certificate": [{"coefficient": "1", "factors": [], "square": "1"}],
    }  # fmt: skip
    with edited_certificate(folder, "SAFE-INV") as obligations:
        obligations.append(invented)
    with edited_claim(folder, "SAFE-INV", "") as claim:
        listed = claim["evidence"]["obligations"]
        listed.append({**listed[0], "name": "never_collides"})
        claim["exercised"] += 1


@refused_by("LIVE-WAIT", "the obligation is one of the claim's", run="")
def obligation_of_another_claim_put_in(folder: Path) -> None:
    with edited_certificate(folder, "SAFE-LEMMA") as others:
        borrowed = others[0]
    with edited_certificate(folder, "LIVE-WAIT") as obligations:
        obligations.append(borrowed)


def without_obligation(folder: Path, claim: str, name: str) -> None:
    """Remove an obligation from a certificate and from the evidence."""
    with edited_certificate(folder, claim) as obligations:
        obligations[:] = [one for one in obligations if one["name"] != name]
    with edited_claim(folder, claim, "") as entry:
        listed = entry["evidence"]["obligations"]
        listed[:] = [one for one in listed if one["name"] != name]


@refused_by("SAFE-INV", "the obligation is there", run="")
def key_obligation_removed(folder: Path) -> None:
    without_obligation(folder, "SAFE-INV", "pair_inside")


@refused_by("SAFE-INV", "the obligation is there", run="")
def obligation_with_numbers_removed(folder: Path) -> None:
    without_obligation(folder, "SAFE-INV", "pair_inside_uav_ugv")


@refused_by("SAFE-DIST", "the obligation is there", run="")
def positive_distance_not_shown(folder: Path) -> None:
    without_obligation(folder, "SAFE-DIST", "positive_obstacle")


@refused_by("ZENO-PROOF", "the obligation is there", run="")
def obligations_all_removed(folder: Path) -> None:
    with edited_certificate(folder, "ZENO-PROOF") as obligations:
        obligations.clear()


@refused_by("SAFE-LEMMA", "a polynomial is a sum of products", run="")
def code_in_a_certificate(folder: Path) -> None:
    with edited_certificate(folder, "SAFE-LEMMA") as obligations:
        obligations[0]["goal"] = "__import__('os').getcwd()"


@refused_by("SAFE-LEMMA", "a number is an integer or a fraction", run="")
def number_for_ever(folder: Path) -> None:
    with edited_certificate(folder, "SAFE-LEMMA") as obligations:
        obligations[0]["certificate"][0]["coefficient"] = "1e999999999"


@refused_by("SAFE-LEMMA", "a polynomial is a sum of products", run="")
def power_for_ever(folder: Path) -> None:
    with edited_certificate(folder, "SAFE-LEMMA") as obligations:
        obligations[0]["goal"] = "(" * 9 + "9" + "**12)" * 9


@refused_by("SAFE-LEMMA", "a polynomial is small enough", run="")
def product_for_ever(folder: Path) -> None:
    with edited_certificate(folder, "SAFE-LEMMA") as obligations:
        sum_of_names = " + ".join(f"x{i}" for i in range(500))
        obligations[0]["certificate"][0]["square"] = sum_of_names


@refused_by("SAFE-LEMMA", "G = L D L^T", run="")
def gram_matrix_changed(folder: Path) -> None:
    with edited_certificate(folder, "SAFE-LEMMA", "gram.json") as gram:
        gram["gram"][0][0] = "1"


@refused_by("SAFE-LEMMA", "the diagonal is not negative", run="")
def gram_matrix_indefinite(folder: Path) -> None:
    with edited_certificate(folder, "SAFE-LEMMA", "gram.json") as gram:
        gram["diagonal"][1] = "-1"


@refused_by("SAFE-LEMMA", "z.G z is Lagrange's difference", run="")
def monomials_exchanged(folder: Path) -> None:
    with edited_certificate(folder, "SAFE-LEMMA", "gram.json") as gram:
        gram["monomials"][1] = "x1*v1"


@refused_by("ZENO-PROOF", "no further premise", run="")
def dwell_of_the_proof_changed(folder: Path) -> None:
    with edited_obligation(folder, "ZENO-PROOF", "dwell_is_the_bound") as one:
        one["equations"].update(dwell="dwell - 1/4", bound="bound - 1/4")


@refused_by("ZENO-PROOF", "rounding of the dwell", run="")
def rounding_of_the_dwell_hidden(folder: Path) -> None:
    with edited_claim(folder, "ZENO-PROOF", "") as claim:
        claim["evidence"]["rounding_s"] = 0.0
        claim["margin"] = 1e-9


def refute_zeno_proof(folder: Path, rows: list[tuple[float, float, str, bool]]) -> None:
    """Make ZENO-PROOF a refutation by a run: time, s, x over the threshold, mode and trigger of each row."""
    with edited_claim(folder, "ZENO-PROOF", "") as claim:
        zeta, bound = claim["inputs"]["zeta_m"], claim["inputs"]["min_inter_event_s"]
        run = [
            {"t_s": when, "x_m": share * zeta, "mode": mode, "trigger": trigger} for when, share, mode, trigger in rows
        ]
        times = [row["t_s"] for row in run if row["trigger"]]
        gap = times[1] - times[0]
        evidence = {key: claim["evidence"][key] for key in ("bound_s", "conformance", "rounding_s")}
        claim.update(
            status="refuted", as_expected=False, margin=gap - bound, where={}, exercised=None,
            evidence=evidence | {"spacer": "violated"},
            counterexample={"run": run, "gap_s": gap, "bound_s": bound, "replayed": True},
        )  # fmt: skip


def bound_of_zeno_proof(folder: Path) -> float:
    """The bound, s, which is the dwell."""
    bound: float = claim_of(read_json(folder / "report.json"), "ZENO-PROOF", "")["inputs"]["min_inter_event_s"]
    return bound


@refused_by("ZENO-PROOF", "two triggers are closer than the bound", run="")
def refuted_by_a_gap_that_is_the_bound(folder: Path) -> None:
    bound = bound_of_zeno_proof(folder)
    rest = (bound / 2.0, 0.0, "REFRACTORY", False)
    refute_zeno_proof(folder, [(0.0, 1.0, "INTERVENING", True), rest, (bound, 1.0, "INTERVENING", True)])


@refused_by("ZENO-PROOF", "mode of the automaton", run="")
def refuted_by_rounding(folder: Path) -> None:
    """The rounded sum of a time and the dwell is reached a little before the dwell is over."""
    bound = bound_of_zeno_proof(folder)
    early = next(t for k in range(1, 10_000) if Fraction((t := k / 10.0) + bound) < Fraction(t) + Fraction(bound))
    rest = (early + bound / 2.0, 0.0, "REFRACTORY", False)
    last = (early + bound, 1.0, "INTERVENING", True)
    refute_zeno_proof(folder, [(early, 1.0, "INTERVENING", True), rest, last])


@refused_by("ZENO-PROOF", "time goes on in a run", run="")
def refuted_by_a_run_backwards_in_time(folder: Path) -> None:
    released = (20.0, 0.0, "SUPERVISING", False)
    refute_zeno_proof(folder, [(10.0, 1.0, "INTERVENING", True), released, (9.9, 1.0, "INTERVENING", True)])


@refused_by("ZENO-PROOF", "a run begins at 0 or later", run="")
def refuted_by_a_run_before_the_start(folder: Path) -> None:
    released = (-1.0, 0.0, "SUPERVISING", False)
    refute_zeno_proof(folder, [(-2.0, 1.0, "INTERVENING", True), released, (-0.9, 1.0, "INTERVENING", True)])


@refused_by("SAFE-INV", "an obligation is proved", run="")
def obligation_left_open(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["evidence"]["obligations"][0]["status"] = "inconclusive"


@refused_by("SAFE-INV", "the running code conforms", run="")
def disagreement_of_the_running_code_recorded(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["evidence"]["conformance"]["agrees"] = False


@refused_by("SAFE-GATE", "the running layer met its inequalities", run="")
def missed_inequality_recorded(folder: Path) -> None:
    with edited_claim(folder, "SAFE-GATE", "") as claim:
        claim["evidence"]["layer"][0]["missed"] = 1


@refused_by("SAFE-DIST", "bounds broken by a disturbed run", run="")
def broken_bound_recorded(folder: Path) -> None:
    with edited_claim(folder, "SAFE-DIST", "") as claim:
        claim["evidence"]["runs"][0]["broken"] = 1


def pass_a_bound(folder: Path, **counts: int) -> None:
    """Let the run whose margin is SAFE-DIST's come 0.5 m nearer than its bound, and say so as the margin."""
    with edited_claim(folder, "SAFE-DIST", "") as claim:
        row = next(row for row in claim["evidence"]["runs"] if row["scene"] == claim["where"]["scene"])
        row["where"]["distance_m"] = row["where"]["bound_m"] - 0.5
        row.update(worst_margin_m=-0.5, **counts)
        claim["margin"] = -0.5


@refused_by("SAFE-DIST", "bounds passed by a disturbed run", run="")
def passed_bound_recorded(folder: Path) -> None:
    pass_a_bound(folder)


@refused_by("SAFE-DIST", "margin of a run that met all inequalities", run="")
def passed_bound_recorded_as_uncovered(folder: Path) -> None:
    pass_a_bound(folder, uncovered=1)


@refused_by("SAFE-DIST", "inequalities missed by a disturbed run", run="")
def passed_bound_recorded_as_unmet(folder: Path) -> None:
    """What missed its inequalities is not covered by the claim; then something has to be missed."""
    pass_a_bound(folder, uncovered=1, unmet=1)


@refused_by("SAFE-DIST", "scenes of the disturbed runs", run="")
def scenes_all_removed_but_the_best(folder: Path) -> None:
    with edited_claim(folder, "SAFE-DIST", "") as claim:
        runs = claim["evidence"]["runs"]
        runs[:] = [row for row in runs if row["scene"] == "uav_low"]
        claim["margin"] = runs[0]["worst_margin_m"]
        claim["where"] = {key: runs[0]["where"][key] for key in ("scene", "attack", "robot", "t_s")}


@refused_by("SAFE-DIST", "steps of the disturbed runs", run="")
def disturbed_run_of_one_step(folder: Path) -> None:
    with edited_claim(folder, "SAFE-DIST", "") as claim:
        claim["evidence"]["runs"][0]["steps"] = 1


@refused_by("SAFE-GATE", "slack of a layer that missed nothing", run="")
def slack_of_the_layer_below_zero(folder: Path) -> None:
    with edited_claim(folder, "SAFE-GATE", "") as claim:
        claim["evidence"]["layer"][0]["worst_slack_m_s"] = claim["margin"] = -5.0


@refused_by("SAFE-INV", "slack of a layer that missed nothing", run="")
def slack_of_the_composition_below_zero(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["evidence"]["composition"]["worst_slack_m_s"] = -5.0


@refused_by("SAFE-GATE", "inequalities missed by the running controller", run="")
def miss_of_the_controller_without_its_count(folder: Path) -> None:
    with edited_claim(folder, "SAFE-GATE", "") as claim:
        claim["evidence"]["controller"][0]["worst_missed_by_m_s"] = 7.0


@refused_by("SAFE-GATE", "controllers attacked", run="")
def controller_not_attacked(folder: Path) -> None:
    with edited_claim(folder, "SAFE-GATE", "") as claim:
        claim["evidence"]["controller"].clear()


@refused_by("LIVE-GATE", "runs of the running code", run="")
def run_on_a_way_invented(folder: Path) -> None:
    with edited_claim(folder, "LIVE-GATE", "") as claim:
        invented = {"samples": 0, "given_back": False, "largest_excess_m": -1.0, "over_after_s": 1.0}
        claim["evidence"]["runs"] = [invented]
        claim["margin"] = claim["inputs"]["lag_m"] + 1.0


def change_runs_on_ways(folder: Path, **changes: float) -> None:
    """Change all runs of LIVE-GATE, and its margin with them."""
    with edited_claim(folder, "LIVE-GATE", "") as claim:
        for row in claim["evidence"]["runs"]:
            row.update(changes)
        excess = max(row["largest_excess_m"] for row in claim["evidence"]["runs"])
        claim["margin"] = claim["inputs"]["lag_m"] - excess


@refused_by("LIVE-GATE", "excess of a run's lag", run="")
def lag_below_the_first_one(folder: Path) -> None:
    change_runs_on_ways(folder, largest_excess_m=-1.0)


@refused_by("LIVE-GATE", "samples of a run on a way", run="")
def runs_without_samples(folder: Path) -> None:
    change_runs_on_ways(folder, samples=0)


@refused_by("LIVE-GATE", "when a run on a way is over", run="")
def runs_over_at_another_time(folder: Path) -> None:
    change_runs_on_ways(folder, over_after_s=1.0)


@refused_by("SAFE-DIST", "least distances", run="")
def bound_of_a_disturbed_run_changed(folder: Path) -> None:
    with edited_claim(folder, "SAFE-DIST", "") as claim:
        claim["evidence"]["least_distances_m"]["obstacle"] = 1.9


@refused_by("SAFE-GATE", "inputs", run="")
def interventions_put_on_top(folder: Path) -> None:
    with edited_claim(folder, "SAFE-GATE", "") as claim:
        claim["inputs"]["method_d"]["intervention_on_top"] = True


@refused_by("SAFE-INV", "inputs", run="")
def obstacle_left_out_of_a_proof(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        del claim["inputs"]["team"]["obstacles"][0]


@refused_by("SAFE-INV", "inputs", run="")
def obstacle_made_larger_in_a_proof(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["inputs"]["team"]["obstacle_radius"][0] = 0.5


@refused_by("SAFE-DIST", "inputs", run="")
def disturbance_lowered(folder: Path) -> None:
    with edited_claim(folder, "SAFE-DIST", "") as claim:
        claim["inputs"]["disturbance_m_s"] = 0.01


@refused_by("SAFE-INV", "margin", run="")
def margin_of_a_proof_changed(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["margin"] = 2.0


@refused_by("SAFE-INV", "margin", run="")
def margin_of_a_proof_that_leaves_out_the_extent(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["margin"] = 9.99e-10


@refused_by("SAFE-INV", "inputs", run="")
def diagram_of_another_scenario_compared(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["inputs"]["scenario"]["safe_distance"]["air_ground_m"] *= 0.9


@refused_by("SAFE-INV", "the built diagram agrees with the scenario", run="")
def wiring_that_differs(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["evidence"]["wiring"].update(agrees=False, differences=1)


@refused_by("SAFE-GATE", "the built diagram agrees with the scenario", run="")
def wiring_that_differs_under_method_d(folder: Path) -> None:
    with edited_claim(folder, "SAFE-GATE", "") as claim:
        claim["evidence"]["wiring"][0]["differences"] = 1


@refused_by("SAFE-GATE", "robots and what they avoid", run="")
def wiring_of_fewer_pairs(folder: Path) -> None:
    with edited_claim(folder, "SAFE-GATE", "") as claim:
        claim["evidence"]["wiring"][0]["views"]["uav_ugv"] -= 1


@refused_by("SAFE-INV", "an inequality of every two robots was seen to bind", run="")
def wiring_never_seen_to_bind(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["evidence"]["wiring"]["least_times_bound"]["ugv_ugv"] = 0


@refused_by("SAFE-DIST", "margin", run="")
def margin_of_the_disturbed_runs_changed(folder: Path) -> None:
    with edited_claim(folder, "SAFE-DIST", "") as claim:
        claim["margin"] = 0.1


@refused_by("THR-OPT", "margin", run="")
def margin_of_the_risk_changed(folder: Path) -> None:
    with edited_claim(folder, "THR-OPT", "") as claim:
        claim["margin"] *= 1.1


# ------------------------------------------------------------------------------------- threshold


def statements(folder: Path, claim: str) -> Any:
    """statements.json of a claim, to be changed in place."""
    return edited_certificate(folder, claim, "statements.json")


@refused_by("THR-ROOT", "f changes its sign in the enclosure", run="")
def enclosure_moved(folder: Path) -> None:
    with statements(folder, "THR-ROOT") as saved:
        end = saved["enclosures"]["u"][1]
        saved["enclosures"]["u"] = [end, str(Fraction(end) * (1 + Fraction(1, 10**13)))]


@refused_by("THR-ROOT", "the enclosure is narrow", run="")
def enclosure_widened(folder: Path) -> None:
    with statements(folder, "THR-ROOT") as saved:
        saved["enclosures"]["u"] = ["1/10", "1"]


@refused_by("THR-ROOT", "thresholds of the enclosure", run="")
def threshold_of_the_enclosure_changed(folder: Path) -> None:
    with statements(folder, "THR-ROOT") as saved:
        saved["enclosures"]["zeta_m"] = ["29/10", "29/10"]


@refused_by("THR-OPT", "the root is enclosed", run="")
def printed_root_missing(folder: Path) -> None:
    with statements(folder, "THR-OPT") as saved:
        del saved["enclosures"]["printed_u"]


@refused_by("THR-OPT", "f changes its sign in the enclosure", run="")
def printed_root_moved(folder: Path) -> None:
    with statements(folder, "THR-OPT") as saved:
        saved["enclosures"]["printed_u"] = saved["enclosures"]["u"]


@refused_by("THR-ROOT", "constants", run="")
def constants_of_the_root_changed(folder: Path) -> None:
    with statements(folder, "THR-ROOT") as saved:
        saved["constants"]["r"] = "3"


def statement(saved: Any, name: str) -> Any:
    """A statement by name."""
    return next(one for one in saved["statements"] if one["name"] == name)


IS_THE_CLAIMS = "the statement is the claim's"


@refused_by("THR-OPT", IS_THE_CLAIMS, run="")
def sign_turned(folder: Path) -> None:
    with statements(folder, "THR-OPT") as saved:
        statement(saved, "printed_risk")["sign"] = "<"


@refused_by("THR-OPT", IS_THE_CLAIMS, run="")
def derivative_changed(folder: Path) -> None:
    with statements(folder, "THR-OPT") as saved:
        one = statement(saved, "factorisation")
        one["derivative"] = one["derivative"].replace("+u)", "-u)")


@refused_by("THR-OPT", IS_THE_CLAIMS, run="")
def code_in_a_statement(folder: Path) -> None:
    with statements(folder, "THR-OPT") as saved:
        statement(saved, "printed_risk")["expression"] = "open('x')"


@refused_by("THR-OPT", "statements of the claim", run="")
def statement_removed(folder: Path) -> None:
    with statements(folder, "THR-OPT") as saved:
        saved["statements"].remove(statement(saved, "printed_risk"))


@refused_by("THR-OPT", IS_THE_CLAIMS, run="")
def statements_that_say_nothing(folder: Path) -> None:
    """All names are there, but for those that enclose the turn they stand for 1 > 0."""
    with statements(folder, "THR-OPT") as saved:
        for one in saved["statements"]:
            if not one["name"].startswith("turn"):
                nothing = {"kind": "sign", "expression": "1", "sign": ">", "values": {}}
                kept = {key: one[key] for key in ("name", "says")}
                one.clear()
                one.update(nothing | kept)


@refused_by("THR-ROOT", "statements of the claim", run="")
def statements_all_removed(folder: Path) -> None:
    with statements(folder, "THR-ROOT") as saved:
        saved["statements"] = []
    with edited_claim(folder, "THR-ROOT", "") as claim:
        claim["evidence"]["statements"] = {}
        claim["exercised"] = 0


@refused_by("THR-ROOT", "statements of the claim", run="")
def statement_invented(folder: Path) -> None:
    with statements(folder, "THR-ROOT") as saved:
        one = {"kind": "sign", "name": "safe", "says": "", "expression": "1", "sign": ">", "values": {}}
        saved["statements"].append(one)
    with edited_claim(folder, "THR-ROOT", "") as claim:
        claim["evidence"]["statements"]["safe"] = "true"
        claim["exercised"] += 1


@refused_by("THR-OPT", IS_THE_CLAIMS, run="")
def statement_about_another_place(folder: Path) -> None:
    """True, but at 1 and not at the ends of what is enclosed."""
    with statements(folder, "THR-OPT") as saved:
        statement(saved, "root_above")["values"]["u"] = "1"


@refused_by("THR-OPT", "the enclosure is narrow", run="")
def turn_enclosed_widely(folder: Path) -> None:
    with statements(folder, "THR-OPT") as saved:
        statement(saved, "turn_below")["values"]["u"] = "2"


@refused_by("THR-OPT", "what is enclosed", run="")
def enclosure_invented(folder: Path) -> None:
    with statements(folder, "THR-OPT") as saved:
        saved["enclosures"]["safe_m"] = ["1", "1"]
    with edited_claim(folder, "THR-OPT", "") as claim:
        claim["evidence"]["enclosures"]["safe_m"] = [1.0, 1.0]


def edit_enclosure(folder: Path, name: str, ends: list[Fraction], **values: Fraction) -> None:
    """Change something that THR-OPT encloses everywhere, and values of statements by name, with `__` for the key."""
    with statements(folder, "THR-OPT") as saved:
        saved["enclosures"][name] = [str(end) for end in ends]
        for place, value in values.items():
            one, _, key = place.partition("__")
            statement(saved, one)["values"][key] = str(value)
    with edited_claim(folder, "THR-OPT", "") as claim:
        claim["evidence"]["enclosures"][name] = [float(end) for end in ends]


@refused_by("THR-OPT", "the enclosure is narrow", run="")
def drift_made_up(folder: Path) -> None:
    edit_enclosure(folder, "drift_low_m_s", [Fraction(1), Fraction(1)])


@refused_by("THR-OPT", IS_THE_CLAIMS, run="")
def drift_moved(folder: Path) -> None:
    edit_enclosure(folder, "drift_high_m_s", [Fraction(1), 1 + Fraction(1, 10**13)])


@refused_by("THR-OPT", "a sign is right", run="")
def slope_moved_with_its_statements(folder: Path) -> None:
    low, high = Fraction(1), 1 + Fraction(1, 10**9)
    edit_enclosure(folder, "ahead_slope_1_m", [low, high], ahead_from__bound=low, ahead_to__bound=high)


@refused_by("THR-OPT", "the enclosure is narrow", run="")
def slope_made_up(folder: Path) -> None:
    edit_enclosure(folder, "ahead_slope_1_m", [Fraction(1), Fraction(1)])


@refused_by("THR-ROOT", "the code's threshold is the root", run="")
def running_threshold_changed(folder: Path) -> None:
    with edited_claim(folder, "THR-ROOT", "") as claim:
        claim["evidence"]["running_threshold_m"] = 2.9


# ------------------------------------------------------------------------------------- experiments


def edit_comparisons(folder: Path, edit: Any) -> None:
    """Change the comparisons of THR-DDM in the evidence and in the certificate."""
    with edited_certificate(folder, "THR-DDM", "paths.json") as paths:
        edit(paths["comparisons"])
    with edited_claim(folder, "THR-DDM", "") as claim:
        edit(claim["evidence"]["comparisons"])


@refused_by("THR-DDM", "interval of the error rate", run="")
def counts_of_paths_changed(folder: Path) -> None:
    def edit(rows: list[Any]) -> None:
        for row in rows:
            row["wrong_decisions"] += 50
            if row["quantity"] == "error rate":
                row["estimate"] = row["wrong_decisions"] / row["constants"]["paths"]

    edit_comparisons(folder, edit)


@refused_by("THR-DDM", "comparisons in the evidence", run="")
def experiments_removed(folder: Path) -> None:
    with edited_certificate(folder, "THR-DDM", "paths.json") as paths:
        del paths["comparisons"][1:]


@refused_by("THR-DDM", "number of comparisons", run="")
def experiments_removed_everywhere(folder: Path) -> None:
    def edit(rows: list[Any]) -> None:
        del rows[2:]

    edit_comparisons(folder, edit)


@refused_by("THR-DDM", "constants of an experiment", run="")
def experiment_made_easy(folder: Path) -> None:
    def edit(rows: list[Any]) -> None:
        for row in rows:
            row["constants"]["drift"] = 1.0

    edit_comparisons(folder, edit)


@refused_by("THR-DDM", "interval of the decision time", run="")
def interval_widened(folder: Path) -> None:
    def edit(rows: list[Any]) -> None:
        rows[0]["interval"] = [0.0, 1.0]

    edit_comparisons(folder, edit)


@refused_by("THR-DDM", "(18)", run="")
def formula_fitted(folder: Path) -> None:
    def edit(rows: list[Any]) -> None:
        rows[1]["formula"] = rows[1]["estimate"]

    edit_comparisons(folder, edit)


@refused_by("THR-DDM", "sum of squares", run="")
def variance_negative(folder: Path) -> None:
    def edit(rows: list[Any]) -> None:
        for row in rows[:2]:
            row["periods_sum_of_squares"] = 1

    edit_comparisons(folder, edit)


def edit_comparison(folder: Path, **changes: Any) -> None:
    """Change keys of the first comparison of THR-DDM, in the evidence and in the certificate."""

    def edit(rows: list[Any]) -> None:
        rows[0].update(changes)

    edit_comparisons(folder, edit)


@refused_by("THR-DDM", "numbers of a comparison", run="")
def margin_of_a_comparison_changed(folder: Path) -> None:
    edit_comparison(folder, margin=99.0)


@refused_by("THR-DDM", "numbers of a comparison", run="")
def score_of_a_comparison_changed(folder: Path) -> None:
    edit_comparison(folder, z_score=0.0)


@refused_by("THR-DDM", "quantities", run="")
def unit_of_a_comparison_changed(folder: Path) -> None:
    edit_comparison(folder, unit="h")


@refused_by("THR-DDM", "what a comparison consists of", run="")
def praise_put_into_a_comparison(folder: Path) -> None:
    edit_comparison(folder, proved_by_experts=True)


@refused_by("THR-DDM", "constants of an experiment", run="")
def seed_of_an_experiment_changed(folder: Path) -> None:
    def edit(rows: list[Any]) -> None:
        for row in rows[:2]:
            row["constants"]["seed"] = 1

    edit_comparisons(folder, edit)


@refused_by("THR-DDM", "counts of an experiment are whole numbers", run="")
def half_a_period_counted(folder: Path) -> None:
    def edit(rows: list[Any]) -> None:
        for row in rows[:2]:
            row["periods_sum"] += 0.5

    edit_comparisons(folder, edit)


@refused_by("THR-DDM", "numbers of all comparisons", run="")
def quantile_of_all_comparisons_changed(folder: Path) -> None:
    with edited_certificate(folder, "THR-DDM", "paths.json") as paths:
        paths["normal_quantile"] = 9.0


@refused_by("THR-DDM", "what paths.json consists of", run="")
def praise_put_into_the_paths(folder: Path) -> None:
    with edited_certificate(folder, "THR-DDM", "paths.json") as paths:
        paths["proved_by_experts"] = 1


def counts(folder: Path) -> pd.DataFrame:
    """The trigger counts of ZENO-REFINE."""
    return pd.read_csv(folder / "certificates" / "ZENO-REFINE" / "counts.csv")


def write_counts(folder: Path, frame: pd.DataFrame) -> None:
    """Put other counts in their place."""
    write(folder / "certificates" / "ZENO-REFINE" / "counts.csv", frame.to_csv(index=False).encode())
    seal_certificate(folder, "ZENO-REFINE", "counts.csv")


@refused_by("ZENO-REFINE", "verdict", run="")
def counts_of_triggers_raised(folder: Path) -> None:
    frame = counts(folder)
    frame["automaton"] *= 1000
    write_counts(folder, frame)


@refused_by("ZENO-REFINE", "margin", run="")
def counts_of_triggers_lowered(folder: Path) -> None:
    frame = counts(folder)
    frame["automaton"] = frame["automaton"].clip(upper=1)
    write_counts(folder, frame)


@refused_by("ZENO-REFINE", "evidence", run="")
def counts_of_the_quiet_series_changed(folder: Path) -> None:
    """No verdict follows from this series, but its mean is in the evidence."""
    frame = counts(folder)
    frame["automaton_at_scenario_noise"] += 1
    write_counts(folder, frame)


@refused_by("ZENO-REFINE", "inputs", run="")
def counts_of_triggers_raised_with_another_dwell(folder: Path) -> None:
    counts_of_triggers_raised(folder)
    with edited_claim(folder, "ZENO-REFINE", "") as claim:
        claim["inputs"]["dwell_s"] = 1e-6


@refused_by("ZENO-REFINE", "counts of every path at every step", run="")
def counts_of_a_path_missing(folder: Path) -> None:
    frame = counts(folder)
    write_counts(folder, frame[frame["path"] > 0])


@refused_by("ZENO-REFINE", "noise steps", run="")
def noise_steps_changed(folder: Path) -> None:
    frame = counts(folder)
    frame["dt_s"] *= 2.0
    write_counts(folder, frame)


@refused_by("ZENO-REFINE", "counts are whole numbers", run="")
def half_a_trigger_counted(folder: Path) -> None:
    frame = counts(folder)
    frame["bare"] = frame["bare"] + 0.5
    write_counts(folder, frame)


@refused_by("ZENO-REFINE", "evidence", run="")
def interval_of_the_exponent_moved(folder: Path) -> None:
    with edited_claim(folder, "ZENO-REFINE", "") as claim:
        claim["evidence"]["fit"]["automaton"]["interval"] = [-0.001, 0.001]


@refused_by("ZENO-REFINE", "evidence", run="")
def theory_of_the_bare_count_changed(folder: Path) -> None:
    with edited_claim(folder, "ZENO-REFINE", "") as claim:
        claim["evidence"]["expected_bare"][-1] *= 1.1


# ------------------------------------------------------------------------------------- not noticed


@ignored("the scripts for solvers are for solvers: the checker expands the certificates, which need none")
def script_for_solvers_replaced(folder: Path) -> None:
    path = folder / "certificates" / "SAFE-INV" / "outside.smt2"
    write(path, b"(assert false)\n(check-sat)\n")
    seal_certificate(folder, "SAFE-INV", "outside.smt2")


@ignored("the relation as read off the running trigger: whether it is the trigger's takes the trigger; see ZENO-PROOF")
def relation_of_the_automaton_changed(folder: Path) -> None:
    with edited_certificate(folder, "ZENO-PROOF", "relation.json") as relation:
        relation["transitions"][0]["after"]["n"] = "2"


@ignored("answers of solvers: they are not needed where a certificate expands, and are not taken on trust either")
def answer_of_a_solver_changed(folder: Path) -> None:
    with edited_report(folder) as report:
        claim_of(report, "SAFE-INV", "")["evidence"]["obligations"][0]["z3"] = "unknown"


@ignored("states and points with which the running code was compared are a sample that is not recorded")
def sample_of_the_running_code_enlarged(folder: Path) -> None:
    with edited_claim(folder, "SAFE-INV", "") as claim:
        claim["evidence"]["conformance"]["points"] = 10**9
