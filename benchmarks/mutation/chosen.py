"""The mutants that matter: faults that once were real, or that would break a claim; every room of the core has some."""

from __future__ import annotations

from mutation.mutant import Mutant

WIRING = ("tests/hypotheses/test_wiring.py",)
CROWD = ("tests/check/test_honest_runs.py::test_a_crowd",)
BODY = ("tests/sim/test_events.py", "tests/test_bodies.py")
TRIGGER = (
    "tests/hypotheses/test_transitions.py", "tests/hypotheses/test_isolation.py", "tests/model/trigger",
    "tests/sim/blocks/test_decision.py",
)  # fmt: skip
ATTACKS = ("tests/hypotheses/test_patience_attacks.py",)
PLANNER = ("tests/uav",)
ROUTES = ("tests/ugv/test_relaxation.py", "tests/ugv/routes/test_contract.py")
RUNS = "tests/verify/runs"
ASSOCIATED, FORMS = ("tests/study/logs/test_association.py",), ("tests/study/logs/test_forms.py",)

WIRINGS = (
    Mutant(
        "safe distance air/ground at 0.9 of its value",
        "scenario/world.py",
        "make_world",
        'frozenset(("ugv", "uav")): safe.air_ground_m',
        'frozenset(("ugv", "uav")): 0.9 * safe.air_ground_m',
        tests=(*WIRING, *CROWD),
    ),
    Mutant(
        "share 1 for robots",
        "model/bodies/world.py",
        "World.around",
        "for body in self.moving]), 0.5, 1.0)",
        "for body in self.moving]), 1.0, 1.0)",
        tests=("tests/model/bodies", *WIRING),
    ),
    Mutant(
        "UGVs may leave the ground",
        "model/bodies/world.py",
        "Body.mobility",
        'if self.kind == "ugv" else',
        "if False else",
        tests=("tests/model/bodies", *WIRING),
    ),
    Mutant(
        "robots avoid only what the UAV knows",
        "scenario/world.py",
        "make_world",
        "for name, body in scenario.barriers.items()",
        "for name, body in scenario.barriers.items() if body.known_to_uav",
        tests=(*WIRING, *CROWD),
    ),
    Mutant(
        "sensing range cut",
        "sim/components.py",
        "make_avoidance",
        "control.period_s, control.sensing_range_m, composition)",
        "control.period_s, 0.6 * control.sensing_range_m, composition)",
        tests=(*WIRING, *CROWD),
    ),
    Mutant(
        "the disturbance is subtracted",
        "sim/blocks/plant.py",
        "VelocityDisturbance._calc",
        "velocity[3 * i : 3 * i + 3] += port.Eval(context)",
        "velocity[3 * i : 3 * i + 3] -= port.Eval(context)",
        tests=(*WIRING, "tests/sim/test_simulation.py", "tests/test_python_api.py"),
    ),
)
"""Wiring: who keeps what distance, with which share, on which plants."""

BODIES = (
    Mutant(
        "obstacles have no radius",
        "scenario/outlines.py",
        "outlines_of",
        "rows = balls(obstacle.position_m or np.zeros(3), obstacle.radius_m, gap)",
        "rows = balls(obstacle.position_m or np.zeros(3), 0.0, gap)",
        tests=BODY,
    ),
    Mutant(
        "collisions are of centres",
        "sim/events.py",
        "_add_collisions",
        "within = collision_m + float(radius)",
        "within = collision_m",
        tests=BODY,
    ),
    Mutant(
        "plans take robots for points",
        "uav/coordination/single.py",
        "_wished",
        "return space.apart + other.radius + space.spacing",
        "return space.apart + space.spacing",
        tests=("tests/uav/coordination",),
    ),
)
"""Bodies: radii count."""

LAW = (
    Mutant(
        "no scaling back",
        "model/law/kernels.py",
        "avoid_one",
        "velocity = _scale_back(velocity, normal, bound)",
        "velocity = velocity",
        tests=(*WIRING, "tests/model/law/test_avoidance.py"),
    ),
    Mutant(
        "contradictions are not looked for",
        "model/law/kernels.py",
        "_closest_feasible",
        "return velocity if missed == 0.0 else _least_violation(normal, within)",
        "return velocity",
        tests=(*WIRING, "tests/model/law/test_projection.py"),
    ),
    Mutant(
        "interventions not filtered under (d)",
        "model/law/ugv_law.py",
        "command",
        "    if law.intervention_on_top:\n        return task\n",
        "    if not law.intervention_on_top:\n        return task\n",
        tests=(*CROWD, *WIRING),
    ),
    Mutant(
        "own task not filtered",
        "model/law/ugv_law.py",
        "command",
        "        return avoid_one(own, normal, bound, composition)\n",
        "        return own\n",
        tests=(*WIRING, *CROWD),
    ),
    Mutant(
        "UGVs sampled at half the rate",
        "sim/blocks/controllers.py",
        "UgvController.__init__",
        "self.DeclarePeriodicDiscreteUpdateEvent(law.avoidance.period, 0.0, weakly(self._update))",
        "self.DeclarePeriodicDiscreteUpdateEvent(2.0 * law.avoidance.period, 0.0, weakly(self._update))",
        tests=(*CROWD, *WIRING),
    ),
    Mutant(
        "executed whatever the answer, the answer recorded",
        "sim/blocks/controllers.py",
        "UgvController._update",
        "reference, rate, proposals, headings, law)",
        "reference, rate, self._proposals.Eval(context), headings, law)",
        tests=(*CROWD, *WIRING),
    ),
    Mutant(
        "presets end with a jump to the target",
        "model/geometry/motion.py",
        "Motion.at",
        "return self.positions[max(k, 0)], np.zeros(3)",
        "return self.positions[-1], np.zeros(3)",
        tests=("tests/model/geometry/test_motion.py",),
    ),
)
"""The avoidance law and the controllers."""

TRIGGERS = (
    Mutant(
        "the dwell is 10 % short",
        "model/trigger/automaton.py",
        "step",
        "status[TRIGGERED] + dwell if",
        "status[TRIGGERED] + 0.9 * dwell if",
        tests=TRIGGER,
    ),
    Mutant(
        "releases at the threshold",
        "model/trigger/automaton.py",
        "step",
        "if x <= release and x < zeta:",
        "if x <= zeta and x < zeta:",
        tests=TRIGGER,
    ),
    Mutant(
        "events come at the ends of steps",
        "sim/blocks/decision.py",
        "EventTrigger.nothing_due",
        "return -1.0 if anything_due(",
        "return 1.0 if anything_due(",
        tests=TRIGGER,
    ),
    Mutant(
        "corners of presets are not looked at",
        "model/trigger/excursion.py",
        "ranges",
        "if last > first:",
        "if last < first:",
        tests=TRIGGER,
    ),
    Mutant(
        "c1 and c2 of the Bayes risk exchanged",
        "model/trigger/bayes.py",
        "optimal_threshold",
        "level = c2 / c1 * drift**2 / noise**2",
        "level = c1 / c2 * drift**2 / noise**2",
        tests=("tests/verify/model/threshold/test_thr_root.py",),
    ),
    Mutant(
        "the noise is 5 % too strong",
        "sim/components.py",
        "integrated_noise",
        "B=intensity / np.sqrt(period) * eye",
        "B=1.05 * intensity / np.sqrt(period) * eye",
        tests=("tests/sim/blocks/test_decision.py",),
    ),
)
"""The trigger: dwell, release, events, threshold, noise."""

PROTOCOL = (
    Mutant(
        "an answer to another proposal counts",
        "uav/messages.py",
        "answer_to",
        "if proposal is None or answers[2 * robot + 1] != proposal.number:",
        "if proposal is None:",
        tests=WIRING,
    ),
    Mutant(
        "answers are decided on and not sent",
        "sim/blocks/gatekeeper.py",
        "Gatekeeper._calc_answers",
        "output.SetFromVector(self._memory(context).answers)",
        "pass",
        tests=CROWD,
    ),
    Mutant(
        "proposals are not withdrawn after a release",
        "uav/planner.py",
        "Planner._after_answers",
        "            if called.isdisjoint((name, talk.cause, *party)):\n",
        "            if False:\n",
        tests=("tests/uav/test_planner.py", *CROWD),
    ),
    Mutant(
        "a part of a joint plan outlives another UGV's refusal",
        "uav/planner.py",
        "Planner._after_answers",
        "(party_refused or answer == DONE",
        "(answer == DONE",
        tests=PLANNER,
    ),
    Mutant(
        "detours inside the safe distance",
        "uav/detour.py",
        "Detour._in_the_way",
        "reach = np.clip(from_target, least, least + self.clearance)",
        "reach = 0.8 * least",
        tests=PLANNER,
    ),
    Mutant(
        "messages of ticks that differ by rounding come late",
        "sim/blocks/ticks.py",
        "Ticks.__init__",
        "exact = Fraction(period) == self._every * Fraction(control)",
        "exact = True",
        tests=("tests/sim/blocks/test_ticks.py",),
    ),
    Mutant(
        "the monitor's inequalities are never broken",
        "sim/blocks/monitor.py",
        "Monitor._first",
        "if not amount[robot] <= INEQUALITY_TOLERANCE_M_S:",
        "if not amount[robot] <= 10.0:",
        tests=("tests/sim/blocks/test_monitor.py",),
    ),
)
"""Proposals, answers and what becomes of them."""

GATEKEEPER = (
    Mutant(
        "the bound is overstated",
        "ugv/relaxation.py",
        "_dual_bound",
        "total -= pressure * pressure / (4.0 * ",
        "total -= pressure * pressure / (8.0 * ",
        tests=ROUTES,
    ),
    Mutant(
        "the prediction has no avoidance",
        "ugv/rollout.py",
        "_command",
        "mode == ACCEPTED, normal[:count], bound[:count], retreat[:count])",
        "mode == ACCEPTED, normal[:0], bound[:0], retreat[:0])",
        tests=("tests/ugv/test_closed_loop.py", *CROWD),
    ),
    Mutant(
        "a first stage that refuses is accepted",
        "ugv/answer.py",
        "_first_answer",
        "    if solution.accept_first:",
        "    if True:",
        tests=("tests/ugv/test_mpc_gatekeeper.py", *CROWD),
    ),
    Mutant(
        "obstacles out of sight are forgotten",
        "ugv/outcome_gatekeeper.py",
        "OutcomeGatekeepers._remembered",
        "return known | within(still, own, reach, True) if",
        "return within(still, own, reach, True) if",
        tests=("tests/ugv/test_outcome_gatekeeper.py",),
    ),
    Mutant(
        "what makes no difference is accepted",
        "ugv/outcome_gatekeeper.py",
        "reason_of",
        "if accept.better_than(refuse):",
        "if not refuse.better_than(accept):",
        tests=("tests/ugv/test_outcome_gatekeeper.py",),
    ),
    Mutant(
        "a withdrawal is not noticed before the next proposal",
        "ugv/mpc_gatekeeper.py",
        "Gatekeepers.idle",
        "return not any(proposals) and not any(before.answers[::2])",
        "return not any(proposals)",
        tests=ATTACKS,
    ),
    Mutant(
        "a replaced proposal does not end its try",
        "ugv/outcome_gatekeeper.py",
        "OutcomeGatekeepers.sample",
        "if held[i].executing and standing != ACCEPT:  # withdrawn",
        "if held[i].executing and proposal is None:  # withdrawn",
        tests=ATTACKS,
    ),
    Mutant(
        "a UGV rests only where nothing is proposed",
        "ugv/outcome_gatekeeper.py",
        "OutcomeGatekeepers.sample",
        "            held[i] = self._patience.rested(held[i], now.t)\n",
        "            held[i] = held[i] if now.proposals[i] else self._patience.rested(held[i], now.t)\n",
        tests=ATTACKS,
    ),
)
"""The gatekeepers."""

RULES = "tests/check/test_forgeries.py::test_each_rule_of_the_checker_refuses_what_it_is_for"
JUDGES = (
    Mutant(
        "array judges pass over too much of a way",
        "model/geometry/encounter.py",
        "least_apart",
        "gone[following + 1] - gone[k] < here - best",
        "gone[following + 1] - gone[k] < here",
        tests=("tests/model/geometry/test_encounter.py",),
    ),
    Mutant(
        "array judges pass a late trigger",
        "verify/array_judges.py",
        "ArrayJudges._thr_trig",
        "lag > EVENT_TOLERANCE_S / 2.0",
        "lag > 1.0",
        tests=("tests/verify/test_array_judges.py",),
    ),
    Mutant(
        "array judges do not look where commands lead to",
        "verify/array_judges.py",
        "ArrayJudges._is_a_run",
        "np.abs(off).max() <= MOTION_TOLERANCE_M",
        "np.abs(off).max() < np.inf",
        tests=("tests/verify/test_array_judges.py",),
    ),
    Mutant(
        "SAFE-TRACE allows 5 cm",
        "verify/claims/safe_trace.py",
        "SafeTrace.check",
        ">= -DISTANCE_TOLERANCE_M",
        ">= -0.05",
        tests=(f"{RUNS}/test_distances.py",),
    ),
    Mutant(
        "SAFE-HYP gives every robot the whole share",
        "verify/engines/shortfalls.py",
        "_shortfall",
        "max(part * bound - ",
        "max(bound - ",
        tests=("tests/verify/engines/test_shortfalls.py",),
    ),
    Mutant(
        "THR-TRIG allows 0.1 s",
        "verify/claims/thr_trig.py",
        "",
        "EVENT_TOLERANCE_S = 1e-5",
        "EVENT_TOLERANCE_S = 0.1",
        tests=(f"{RUNS}/test_tolerances.py",),
    ),
    Mutant(
        "LIVE-HYP takes every reversal for one with news",
        "verify/claims/live_hyp.py",
        "_wrong",
        "if early and end_s not in acceptance.news_s:",
        "if False:",
        tests=(f"{RUNS}/test_breakages.py",),
    ),
    Mutant(
        "half a run is enough",
        "verify/claim.py",
        "TraceClaim.judge",
        "            if finding.status in PASSING:\n",
        "            if False:\n",
        tests=("tests/verify/test_claim.py",),
    ),
    Mutant(
        "checker: digests are not compared",
        "check/run.py",
        "read_run",
        'same("SHA-256 of a table", meta["files"][table], sha256(content[table]), about=table)',
        "pass",
        tests=(f"{RULES}[table with other bytes]",),
    ),
    Mutant(
        "checker: commands need not lead anywhere",
        "check/run.py",
        "_moves_as_commanded",
        'close("law of motion", place[1:], led, within=SMALL,',
        'close("law of motion", place[1:], led, within=1e9,',
        tests=(f"{RULES}[elsewhere in a row]",),
    ),
)
"""What judges: claims and the checker. On honest runs one that demands less says the same."""

LOGS = (
    Mutant(
        "log: times of receipt in place of stamps",
        "study/logs/messages.py",
        "Gathered.streams",
        "times = [stamp if stamped and stamp is not None else received",
        "times = [received",
        tests=FORMS,
    ),
    Mutant(
        "log: a body may leap",
        "study/logs/tracks.py",
        "Track.is_known",
        "& ~np.isin(self.t_s[1:], self.leaps_s)",
        "",
        tests=ASSOCIATED,
    ),
    Mutant(
        "log: a straight line across a gap",
        "study/logs/tracks.py",
        "Track.is_known",
        "<= self.gap_s * (1.0 + 1e-9)",
        "<= 1e9",
        tests=ASSOCIATED,
    ),
    Mutant(
        "log: positions in different frames",
        "study/logs/tracks.py",
        "_in_one_frame",
        "if len({*stated.values()}) > 1:",
        "if False:",
        tests=ASSOCIATED,
    ),
    Mutant(
        "log: frames called odom are one",
        "study/logs/tracks.py",
        "_in_one_frame",
        "if len(frames) > 1 and",
        "if False and",
        tests=ASSOCIATED,
    ),
    Mutant(
        "log: all robots start at zero",
        "study/logs/tracks.py",
        "_apart_at_the_start",
        "if len(there) > 1 and len(starts) > 1:",
        "if False:",
        tests=ASSOCIATED,
    ),
    Mutant(
        "log: the last of two contradicting rows counts",
        "study/logs/tracks.py",
        "_track",
        "new = np.append(True, np.diff(ns) > 0)",
        "new = np.append(np.diff(ns) > 0, True)",
        tests=ASSOCIATED,
    ),
    Mutant(
        "log: rows are in the order of the file",
        "study/logs/tracks.py",
        "_track",
        'order = np.argsort(ns, kind="stable")',
        "order = np.arange(len(ns))",
        tests=FORMS,
    ),
    Mutant(
        "log: the first of several streams counts",
        "study/logs/tracks.py",
        "_assigned",
        "if len(of_one) > 1:",
        "if False:",
        tests=ASSOCIATED,
    ),
    Mutant(
        "log: a robot's arm is where it is",
        "study/logs/tracks.py",
        "_links",
        "if stream.frame not in carried",
        "if True",
        tests=ASSOCIATED,
    ),
    Mutant(
        "log: a goal is where a robot is",
        "study/logs/names.py",
        "is_elsewhere",
        "return not ELSEWHERE.isdisjoint(words)",
        "return False",
        tests=ASSOCIATED,
    ),
    Mutant(
        "log: stamps as floating-point numbers",
        "study/logs/stream.py",
        "Stream.ns",
        "return self.whole * per + self.nano * per // 10**9",
        "return (self.whole * float(per) + self.nano * per // 10**9).astype(np.int64)",
        tests=FORMS,
    ),
    Mutant(
        "log: milliseconds pass as seconds",
        "study/logs/units.py",
        "_likely",
        'return time or "s", length or "m"',
        'return "s", length or "m"',
        tests=FORMS,
    ),
    Mutant(
        "log: millimetres pass as metres",
        "study/logs/units.py",
        "_likely",
        'return time or "s", length or "m"',
        'return time or "s", "m"',
        tests=FORMS,
    ),
    Mutant(
        "log: a decimal comma separates columns",
        "study/logs/text.py",
        "_form",
        'for delimiter in (*DELIMITERS, " "):',
        'for delimiter in (",", *DELIMITERS, " "):',
        tests=FORMS,
    ),
    Mutant(
        "log: only the robot's own times are looked at",
        "study/logs/judging.py",
        "_knots",
        "[own.t_s, other.t_s, span]",
        "[own.t_s, span]",
        tests=FORMS,
    ),
    Mutant(
        "log: markers of robots at different heights",
        "study/logs/judging.py",
        "_seen",
        "if not (flat or is_obstacle):",
        "if not is_obstacle:",
        tests=ASSOCIATED,
    ),
    Mutant(
        "log: position errors do not count",
        "study/logs/judging.py",
        "_judged",
        "eps = errors_m.get(pair.robot, 0.0) + errors_m.get(pair.other, 0.0)",
        "eps = 0.0",
        tests=ASSOCIATED,
    ),
    Mutant(
        "log: the law in intervals of their mean length",
        "study/logs/judging.py",
        "_Law.add",
        "for step_s in h.tolist()]",
        "for step_s in [float(h.mean())] * len(h)]",
        tests=ASSOCIATED,
    ),
    Mutant(
        "log: what is gone is still there",
        "study/logs/judging.py",
        "_both",
        "during = (other.t_s >= begin - SMALL) & (other.t_s <= end + SMALL)",
        "during = other.t_s >= begin - SMALL",
        tests=("tests/check/test_moving.py::test_a_person_counts_only_while_it_is_there",),
    ),
)
"""How a log becomes tracks, and how these are judged: a mutant for each rule."""

CHOSEN = (*WIRINGS, *BODIES, *LAW, *TRIGGERS, *PROTOCOL, *GATEKEEPER, *JUDGES, *LOGS)
