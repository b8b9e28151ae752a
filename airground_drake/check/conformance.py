"""What the records of proofs say besides their certificates: that the running code conforms, and what rounding takes.

Each follows from the scenario, or must say that nothing differed; nothing of the package is run here.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction

from .files import Json
from .polynomials import rational
from .rules import SMALL, Found, agrees, at_most, close, holds, same
from .scenario import disturbance_m_s, kinds_of, levels_of, rounding_m, views_of

SHORTEST_S = 1e-3
"""Bound that ZENO-PROOF tries where the scenario has none."""
ROUNDOFF = 2.0**-53
ALIKE = 1e-9
"""Numbers that follow from the scenario alone differ by less, relative."""
STEPS_UNDER_ATTACK = 4 * 250
"""Control periods that a scene of SAFE-DIST is run for: under four attacks."""
WAYS, LEGS = 4, 3
"""Runs of LIVE-GATE, and legs of the way of each."""
_CONFORMS: Json = {"conformance": {"agrees": True, "first_difference": None}}
_MET: Json = {"met": True, "missed": 0, "first_missed": None}
_WIRED: Json = {"agrees": True, "differences": 0, "first_difference": None}
"""What the evidence says of running code that conforms."""
A_POINT: Json = {"point": {"position_m": [0.0, 0.0, 0.0], "radius_m": 0.0, "known_to_uav": True}}
"""An obstacle of no size."""
TRIGGER_CONFORMS: Json = {"disagreements": 0, "first": None}
"""What the evidence says of a running trigger that conforms."""


def _recorded_of_inv(claim: Json, scenario: Json) -> Found:
    """The margin is what rounding leaves of the tolerance; the running code and its wiring were found to conform."""
    evidence = claim["evidence"]
    same("the running code conforms", evidence["conformance"]["agrees"], True)
    same("the running composition met its inequalities", evidence["composition"]["met"], True)
    same("inequalities missed by the composition", evidence["composition"]["missed"], 0)
    _nothing_was_missed(evidence["composition"])
    _wiring(evidence["wiring"], scenario)
    h, reach = rational(scenario["control"]["period_s"]), rational(scenario["control"]["sensing_range_m"])
    spare = {
        kind.name: float(reach - rational(kind.safe_m) - rational(kind.closing_m_s) * h) for kind in kinds_of(scenario)
    }
    agrees("spare of the sensing range", evidence["sensing_range_spare_m"], spare, within=SMALL)
    lost = {kind.name: rounding_m(scenario, kind) for kind in kinds_of(scenario)}
    _rounding(evidence["rounding"], lost, scenario)
    left = SMALL - max(lost.values())
    if not math.isfinite(left):
        return Found("inconclusive")
    worst = lost.get(claim["where"]["pair"], -1.0)
    holds("where the margin is attained", worst >= max(lost.values()) * (1.0 - ALIKE), claim["where"], str(lost))
    found = Found.with_margin("proved" if left >= 0.0 else "inconclusive", left, within=1e-15)
    return found.also(**_CONFORMS, composition=_MET | {"composition": "augmented"}, wiring=_WIRED).having_judged(
        "where.pair", "evidence.wiring.composition", "evidence.wiring.views.*",
        "evidence.sensing_range_spare_m.*", "evidence.rounding.*.margin_of_a_step_m",
        "evidence.rounding.*.margin_with_restoring_m",
    )  # fmt: skip


def _rounding(recorded: Json, lost_m: Mapping[str, float], scenario: Json) -> None:
    """What rounding may take from each kind of pairs, in a step and while the gain restores it."""
    same("kinds of pairs", sorted(recorded), sorted(lost_m))
    restored = scenario["control"]["avoidance_gain_1_s"] * scenario["control"]["period_s"]
    for name, lost in lost_m.items():
        if math.isfinite(lost):
            due = {"margin_of_a_step_m": lost * restored, "margin_with_restoring_m": lost}
            for key, value in due.items():
                close(f"rounding: {key}", recorded[name][key], value, within=ALIKE * value, about=name)


def _wiring(recorded: Json, scenario: Json) -> None:
    """The built diagram was compared for every robot and all that it must avoid, and did not differ."""
    same("the built diagram agrees with the scenario", [recorded["agrees"], recorded["differences"]], [True, 0])
    uav = scenario["uav"]["name"]
    counts = Counter(
        "obstacle" if view.share == 1.0 else "uav_ugv" if uav in (view.robot, view.other) else "ugv_ugv"
        for views in views_of(scenario).values()
        for view in views
    )
    same("robots and what they avoid", recorded["views"], dict(counts))
    for kind in counts:
        if kind != "obstacle":
            bound = recorded["least_times_bound"][kind]
            holds("an inequality of every two robots was seen to bind", bound > 0, bound, "1 or more", about=kind)


def _nothing_was_missed(layer: Json) -> None:
    """The slack of a running layer that met all its inequalities is not below 0."""
    slack = layer["worst_slack_m_s"]
    holds("slack of a layer that missed nothing", slack >= 0.0, slack, "0 or more", about=layer["composition"])


def _recorded_of_gate(claim: Json, scenario: Json) -> Found:
    """The proof is about the augmented composition; the running layer and controller missed no inequality."""
    evidence, compositions = claim["evidence"], claim["inputs"]["method_d"]["compositions"]
    same("the proof is about the composition in use", compositions, ["augmented"])
    same("method (d) in the evidence", evidence["method_d"], claim["inputs"]["method_d"])
    same("compositions attacked", [layer["composition"] for layer in evidence["layer"]], compositions)
    for layer in evidence["layer"]:
        same("the running layer met its inequalities", [layer["met"], layer["missed"]], [True, 0])
        _nothing_was_missed(layer)
    same("compositions wired", [each["composition"] for each in evidence["wiring"]], compositions)
    for wired in evidence["wiring"]:
        _wiring(wired, scenario)
    same("controllers attacked", len(evidence["controller"]), len(compositions))
    for team in evidence["controller"]:
        nothing = [team["missed"], team["worst_missed_by_m_s"]]
        same("inequalities missed by the running controller", nothing, [0, 0.0])
    worst = min(layer["worst_slack_m_s"] for layer in evidence["layer"])
    lowest = [layer["composition"] for layer in evidence["layer"] if layer["worst_slack_m_s"] == worst]
    holds("where the margin is attained", claim["where"]["composition"] in lowest, claim["where"], str(lowest))
    found = Found.with_margin("proved", worst, within=0.0, layer=[_MET] * len(compositions))
    found = found.also(wiring=[_WIRED] * len(compositions))
    return found.having_judged(
        "where.composition", "evidence.method_d", "evidence.layer.*.composition", "evidence.layer.*.worst_slack_m_s",
        "evidence.wiring.*.composition", "evidence.wiring.*.views.*",
        "evidence.controller.*.missed", "evidence.controller.*.worst_missed_by_m_s",
    )  # fmt: skip


def _recorded_of_dist(claim: Json, scenario: Json) -> Found:
    """No disturbed run broke a bound; the margin is the worst of those whose inequalities were all met."""
    evidence, w = claim["evidence"], disturbance_m_s(scenario)
    same("the running code conforms", evidence["conformance"]["agrees"], True)
    gain = scenario["control"]["avoidance_gain_1_s"]
    bounds = {kind.name: kind.safe_m - w / kind.share / gain for kind in kinds_of(scenario)}
    agrees("least distances", evidence["least_distances_m"], bounds, within=SMALL)
    with_a_point = kinds_of(scenario | {"obstacles": A_POINT})  # the experiment has obstacles of its own
    pairs = {(kind.safe_m, kind.share) for kind in (*kinds_of(scenario), *with_a_point)}
    pairs.add((float(scenario["safe_distance"]["obstacle_m"]), 1.0))
    admitted = {safe - w / share / gain: safe for safe, share in pairs}
    same("scenes of the disturbed runs", [row["scene"] for row in evidence["runs"]], _scenes(scenario))
    for row in evidence["runs"]:
        same("bounds broken by a disturbed run", row["broken"], 0, about=row["scene"])
        _worst_of_a_disturbed_run(row, admitted)
        _misses_of_a_disturbed_run(row)
    covered = [row["worst_margin_m"] for row in evidence["runs"] if not row["unmet"]]
    holds("a disturbed run met all inequalities", bool(covered), "none", "one or more")
    lowest = [row["where"] for row in evidence["runs"] if row["worst_margin_m"] == min(covered)]
    places = [{key: where[key] for key in ("scene", "attack", "robot", "t_s")} for where in lowest]
    holds("where the margin is attained", claim["where"] in places, claim["where"], str(places))
    found = Found.with_margin("proved", min(covered), within=0.0, disturbance_m_s=w, **_CONFORMS)
    return found.having_judged(
        "where.*", "evidence.least_distances_m.*", "evidence.runs.*.scene", "evidence.runs.*.broken",
        "evidence.runs.*.worst_margin_m", "evidence.runs.*.steps",
        *(f"evidence.runs.*.where.{key}" for key in ("scene", "distance_m", "bound_m", "safe_distance_m")),
    )  # fmt: skip


def _scenes(scenario: Json) -> list[str]:
    """What the disturbed runs start from: of two UGVs only where the scenario has two."""
    of_two = ["ugv_pair", "squeezed"] if len(scenario["ugvs"]) > 1 else []
    return ["obstacle", "notch", "gap", "triangle", "uav_low", *of_two, "field"]


def _misses_of_a_disturbed_run(row: Json) -> None:
    """Inequalities are missed by more than 1e-9 m/s, or none is; a bound is passed by more than 1e-9 m, or none is.

    Of a run that missed none no bound is passed: whatever passes one would have broken it.
    """
    about, passed = row["scene"], row["uncovered"] + row["broken"]
    same("steps of the disturbed runs", row["steps"], STEPS_UNDER_ATTACK, about=about)
    for key in ("unmet", "uncovered"):
        count = row[key]
        holds("counts of a disturbed run", type(count) is int and count >= 0, count, "0, 1, ...", about=about)
    shortfall = row["worst_shortfall_m_s"]
    missed = [row["unmet"] > 0, shortfall >= 0.0]
    same("inequalities missed by a disturbed run", missed, [shortfall > SMALL, True], about=about)
    margin = row["worst_margin_m"]
    same("bounds passed by a disturbed run", passed > 0, margin < -SMALL, about=about)
    if not row["unmet"]:
        holds("margin of a run that met all inequalities", margin >= -SMALL, margin, "-1e-9 or more", about=about)


def _worst_of_a_disturbed_run(row: Json, bounds_m: Mapping[float, float]) -> None:
    """The worst margin is that of the distance there, to a bound that is one of a kind of pairs.

    Args:
        row: the run.
        bounds_m: safe distance by bound.
    """
    where, about = row["where"], row["scene"]
    same("scene of the worst margin", where["scene"], row["scene"], about=about)
    close("worst margin", row["worst_margin_m"], where["distance_m"] - where["bound_m"], within=SMALL, about=about)
    both = [where["bound_m"], where["safe_distance_m"]]
    known = any(max(abs(both[0] - bound), abs(both[1] - safe)) <= SMALL for bound, safe in bounds_m.items())
    holds("bound of the worst margin", known, both, str(bounds_m), about=about)


def _recorded_of_zeno(claim: Json, scenario: Json) -> Found:
    """The running trigger conforms; the margin is what rounding `triggered_at + dwell` leaves of 1e-9 s."""
    evidence = claim["evidence"]
    same("the proof is about the trigger in use", scenario["decision"]["trigger"], "automaton")
    same("states in which the running trigger does not conform", evidence["conformance"]["disagreements"], 0)
    same("an invariant exists for the scenario's numbers", evidence["spacer"], "an invariant exists")
    rounding = rounding_of_the_dwell(evidence, scenario)
    bound = float(scenario["decision"]["min_inter_event_s"] or SHORTEST_S)
    agrees("where the margin is attained", claim["where"], {"bound_s": bound}, within=0.0)
    found = Found.with_margin("proved", SMALL - rounding, within=1e-16, bound_s=bound, conformance=TRIGGER_CONFORMS)
    return found.having_judged("where.bound_s", "evidence.rounding_s", "evidence.spacer")


def rounding_of_the_dwell(evidence: Json, scenario: Json) -> float:
    """What rounding `triggered_at + dwell` may take from a gap, s; the evidence has the same."""
    dwell = levels_of(scenario).dwell_s
    meant, kept = rational(dwell), Fraction(float(dwell))
    error = Fraction(ROUNDOFF) * (Fraction(float(scenario["duration_s"])) + kept) + abs(meant - kept)
    rounding = math.nextafter(float(error), math.inf)
    close("rounding of the dwell", evidence["rounding_s"], rounding, within=1e-24)
    return rounding


def _recorded_of_live(claim: Json, scenario: Json) -> Found:
    """Differences contract; no run that was disturbed within the bound was given back; the margin is what it left."""
    evidence, gate, control = claim["evidence"], scenario["gatekeeper"], scenario["control"]
    gain = control["intervention_gain_1_s"]
    at_most("gain times period", gain * control["period_s"], 1.0)
    close("disturbance allowed", evidence["disturbance_m_s"], gain * gate["lag_m"], within=SMALL)
    same("runs of the running code", len(evidence["runs"]), WAYS)
    for row in evidence["runs"]:
        same("given back before its time", row["given_back"], False)
        excess = row["largest_excess_m"]
        holds("excess of a run's lag, which has none at first", excess >= 0.0, excess, "0 or more")
        at_most("excess of a run's lag", excess, gate["lag_m"], within=SMALL)
        _samples_of_a_way(row, scenario)
    excess = max(row["largest_excess_m"] for row in evidence["runs"])
    return Found.with_margin("proved", gate["lag_m"] - excess, within=SMALL).having_judged(
        "evidence.disturbance_m_s", *(f"evidence.runs.*.{key}" for key in ("given_back", "samples", "over_after_s"))
    )


def _samples_of_a_way(row: Json, scenario: Json) -> None:
    """It is decided on once per period, the first time at 0, and is over at the first or second one after its end.

    Each leg takes 3 s, or 3/10 of the longest try if that is less, and at least a control period.
    """
    gate, h = scenario["gatekeeper"], scenario["control"]["period_s"]
    period = round(gate["period_s"] / h) * h
    end = LEGS * max(1, round(min(3.0, 0.3 * gate["longest_s"]) / h)) * h
    samples, over = row["samples"], row["over_after_s"]
    possible = type(samples) is int and end - SMALL <= (samples - 1) * period <= end + 2.0 * period + SMALL
    until = f"one per {period:.9g} s from 0 to {end:.9g} s"
    holds("samples of a run on a way", possible, samples, until)
    close("when a run on a way is over", over, (samples - 1) * period, within=SMALL)


def _recorded_of_wait(claim: Json, scenario: Json) -> Found:
    """The bound is all tries to their ends; no attack on the running gatekeeper kept a UGV for longer."""
    evidence, gate = claim["evidence"], scenario["gatekeeper"]
    bound = gate["tries"] * (gate["longest_s"] + gate["period_s"])
    close("the bound", evidence["bound_s"], bound, within=SMALL)
    names = [row["attack"] for row in evidence["attacks"]]
    forged = ["favours to nobody", "favours to itself"]
    same("attacks", names, ["endless", "greedy", "random", "brief", "stuck", "favours", *forged])
    gone_along = [row["tries"] for row in evidence["attacks"] if row["attack"] in forged]
    same("favours that no UGV is asked for", gone_along, [0, 0])
    same(
        "answers that the tries left do not allow", [row["unexpected"] for row in evidence["attacks"]], [0] * len(names)
    )
    longest = [row["longest_between_rests_s"] for row in evidence["attacks"]]
    at_most("time that an attack takes between two rests", longest, bound, within=SMALL)
    tries = [row["longest_try_s"] for row in evidence["attacks"]]
    at_most("time that a try takes", tries, gate["longest_s"] + gate["period_s"], within=SMALL)
    reasons = {reason for row in evidence["attacks"] for reason in row["reasons"]}
    due = set(_due(gate))
    same("reasons seen under attack", sorted(due & reasons), sorted(due))
    return Found.with_margin("proved", bound - max(longest), within=SMALL).having_judged(
        "evidence.bound_s", "evidence.attacks.*.attack", "evidence.attacks.*.unexpected"
    )


def _due(gate: Json) -> Iterator[str]:
    """Why an intervention must have ended, or none begun, under attacks of at most 20,000 samples."""
    h, longest_s = gate["period_s"], gate["longest_s"]
    lasts_s = h * min(20_000, int(1.2 * gate["tries"] * (longest_s + gate["rest_s"]) / h))
    if longest_s + 2.0 * h <= lasts_s:
        yield "over"
    if gate["tries"] * (longest_s + 2.0 * h) <= lasts_s:
        yield "exhausted"
    if gate["behind_s"] + 2.0 * h < min(longest_s, lasts_s):
        yield "no_progress"


def _recorded_of_iso(claim: Json, scenario: Json) -> Found:
    """The running trigger missed nothing that was due in a step, and invented nothing."""
    compared = claim["evidence"]["conformance"]
    same("crossings missed or invented by the running trigger", [compared["missed"], compared["spurious"]], [0, 0])
    return Found("proved", facts={"conformance": {"missed": 0, "spurious": 0, "first": None}})


RECORDED: Mapping[str, Callable[[Json, Json], Found]] = {
    "SAFE-INV": _recorded_of_inv,
    "SAFE-GATE": _recorded_of_gate,
    "SAFE-DIST": _recorded_of_dist,
    "ZENO-PROOF": _recorded_of_zeno,
    "LIVE-GATE": _recorded_of_live,
    "LIVE-WAIT": _recorded_of_wait,
    "THR-ISO": _recorded_of_iso,
}
"""By claim: what its record says besides the certificates."""
