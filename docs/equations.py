"""The paper, place by place: the code that realises it, and where and why this code differs from the paper.

`docs/generate.py` makes a part of docs/paper.md of this table. A test imports every name in it, and requires that the
code named for an equation names the equation in its documentation.
"""

from typing import Literal, NamedTuple

Kind = Literal["faithful", "changed", "not realised"]


class PaperDeviation(NamedTuple):
    """One equation, table, figure or remark of the paper, and how the package realises it."""

    place: str  # where in the paper, such as "(6)" or "Table 1"
    says: str  # what it is about, in words
    realised_in: tuple[str, ...]  # the code, `module:name` below the package; empty if it is not realised
    kind: Kind  # faithful, changed or not realised
    here: str = ""  # what the code does, where it differs from the paper or the paper leaves it open
    why: str = ""  # the reason for a difference; '' for what is faithful
    findings: tuple[int, ...] = ()  # findings of the audit about this place, by number


_PROGRAM = ("ugv.problem:Problem", "ugv.binary_program:BinaryProgram")

# Every place of the paper that a model can realise, in the paper's order.
DEVIATIONS: tuple[PaperDeviation, ...] = (
    PaperDeviation(
        "(1)", "task value sigma = f(rho)",
        ("model.law.kernels:fill_half_spaces", "model.law.ugv_law:command", "model.law.task:Task.value"), "faithful",
        "The laws have their tasks written out: a robot's distances, a UGV's position, the UAV's position over the "
        "centroid. `model.law.task.Task` is the general form, for a task of your own (`uav.task`).",
    ),
    PaperDeviation(
        "(2)", "its rate, through the Jacobian",
        ("model.law.kernels:fill_half_spaces", "model.law.ugv_law:command", "model.law.task:Task.jacobian"), "faithful",
        "Of a distance it is a unit vector, of a position the identity.",
    ),
    PaperDeviation(
        "(3)", "velocity by the pseudoinverse", ("model.law.task:pseudoinverse",), "changed",
        "J^+ is applied to the rate of the task, not of the configuration. It is the Moore-Penrose inverse. The laws "
        "use it for J_int only: the other Jacobians are unit vectors and the identity.",
        "Otherwise the sizes do not match. J^T (J J^T)^-1 does not exist where a task is singular.", (8,),
    ),
    PaperDeviation(
        "(4)", "the same in closed loop", ("model.law.ugv_law:command", "model.law.tasks:PositionTask.velocity"),
        "changed",
        "Error and rate are those of the task, sigma_d - sigma, not of the configuration.",
        "Otherwise the sizes do not match.", (8,),
    ),
    PaperDeviation(
        "(5)", "composition by null-space projection",
        ("model.law.avoidance:Avoidance", "model.law.kernels:avoid_one", "model.law.ugv_law:command"), "changed",
        "Each task acts in the null space of the stacked Jacobian of all higher tasks (composition `augmented`). "
        "(5) as printed stays selectable: `recursion_nearest`, `recursion_listed`.",
        "(5) as printed is not safe with two obstacles, and does not stall where the paper's UGV1 stalls.", (1, 22),
    ),
    PaperDeviation(
        "(6)", "move to the target",
        ("sim.blocks.controllers:UgvController", "model.law.ugv_law:command"), "changed",
        "The desired value is the moving preset trajectory rho_rd, which ends at the target, not the fixed target. "
        "Its rate is fed forward. The command is shortened to the UGV's speed limit.",
        "(15) and (25) measure the error from the preset trajectory. With the fixed target a UGV would leave it at "
        "once. As printed, the rate is that of the task itself, and (6) has no solution.", (12,),
    ),
    PaperDeviation(
        "(7)", "obstacle avoidance of a UGV: task value",
        ("model.law.kernels:fill_half_spaces", "sim.blocks.controllers:UgvController"), "faithful",
        "Other robots count as obstacles, each of a pair with half of the task. Bodies have radii, which add to d.",
    ),
    PaperDeviation(
        "(8)", "obstacle avoidance of a UGV: velocity",
        ("model.law.kernels:fill_half_spaces", "model.law.avoidance:Avoidance"), "changed",
        "An inequality instead of an equality. The gain A acts only inside d, where n.v >= A (d - D). "
        "Outside, the inequality is n.v >= -(D - d) / h, without the gain. It binds only where the lower tasks would "
        "break it, and only within the sensing range. Obstacles count as standing.",
        "The paper does not say when avoidance is active. An equality would pull a robot back to the safe circle. "
        "With this bound the distance stays at least d between the samples, too.",
    ),
    PaperDeviation(
        "(9)", "centroid of the UGVs: task value", ("model.law.tasks:FormationTask",), "changed",
        "The UAV's own position minus the centroid, at a set altitude.",
        "The centroid of the UGVs does not depend on the UAV.", (13, 21),
    ),
    PaperDeviation(
        "(10)", "centroid of the UGVs: velocity",
        ("model.law.tasks:FormationTask", "sim.blocks.controllers:UavController"), "changed",
        "As (9); the UGVs' last commands are fed forward as the centroid's rate.",
        "The Jacobian of (9) as printed is 0.", (13,),
    ),
    PaperDeviation(
        "(11)", "obstacle avoidance of the UAV", ("sim.blocks.controllers:UavController",), "changed",
        "As (8): an inequality, with the gain A acting only inside d.", "As (8).",
    ),
    PaperDeviation(
        "(12)", "intervention: desired value",
        ("uav.policy:Proposal",), "changed",
        "The desired value is where the UAV wants the UGV at each time: a timed polyline.",
        "As printed it is a function of the UGV's own position, so that the error is 0.", (19,),
    ),
    PaperDeviation(
        "(13)", "intervention: its rate", ("model.law.ugv_law:AcceptedMotion",), "changed",
        "The rate is the polyline's velocity. J_int is a constant selection of directions, the identity by default.",
        "As printed the rate is J v_int, which contains the velocity that (14) is to find.", (19,),
    ),
    PaperDeviation(
        "(14)", "intervention: velocity",
        ("model.law.ugv_law:command",), "faithful",
        "With (12) and (13) as changed. The paper does not say what J_int is.", "", (16, 19),
    ),
    PaperDeviation(
        "(15)", "drift-diffusion model", ("sim.blocks.decision:DecisionVariable",), "changed",
        "The decision variable is the norm of the task error plus integrated noise. The scenario sets the noise "
        "intensity of a run; the noise may leak.",
        "A threshold needs a number, and the error is a vector. With Table 1's intensity of 10, noise alone would "
        "trigger at once.",
        (5,),
    ),
    PaperDeviation("(16)", "Bayes risk", ("model.trigger.bayes:bayes_risk",), "faithful"),
    PaperDeviation(
        "(17)", "mean decision time", ("model.trigger.bayes:decision_time",), "changed",
        "The initial deviation is in metres and divided by the drift. The drift is an assumed constant.",
        "As printed the formula takes seconds (Bogacz et al. 2006).", (3, 18),
    ),
    PaperDeviation(
        "(18)", "decision error", ("model.trigger.bayes:error_rate",), "changed",
        "As (17). Both assume two thresholds; the trigger has one.", "As (17).", (3, 18),
    ),
    PaperDeviation(
        "(19)", "optimal threshold", ("model.trigger.bayes:optimal_threshold",), "changed",
        "The right-hand side is c2/c1. By default the threshold is Table 1's 3 m and (19) is not used; "
        "`decision.threshold.rule: bayes` uses it.",
        "The root of (19) with c2/c1 minimises (16); the printed one does not. The paper gives no drift for its 3 m.",
        (2, 4),
    ),
    PaperDeviation(
        "(20)", "event-triggered composition",
        ("model.trigger.automaton:Trigger", "model.law.ugv_law:command", "sim.blocks.decision:EventTrigger"), "changed",
        "The trigger is an automaton with hysteresis and a minimum inter-event time; `decision.trigger: bare` is the "
        "paper's. In methods (b) and (c) the intervention is above avoidance as printed, in (d) below it.",
        "A bare threshold on (15) triggers without bound. An intervention above avoidance is not safe.", (9, 16, 18),
    ),
    PaperDeviation(
        "(21)", "gatekeeper: state", ("ugv.problem:Problem",), "changed",
        "Each UGV solves a problem of its own; the predicted motion of the others is data.",
        "The UGVs are coupled only through each other's motion. Each decides by itself.",
    ),
    PaperDeviation(
        "(22)", "gatekeeper: choice of each UGV", _PROGRAM, "changed",
        "One number omega per stage, 1 to accept. Refusing is 1 - omega. The superscript j is left out.",
        "The paper indexes the choice twice, by j and by the second subscript.", (22,),
    ),
    PaperDeviation(
        "(23)", "gatekeeper: predicted motion under both choices",
        ("ugv.problem:Problem", "ugv.problem:predicted_problem"), "changed",
        "The two velocities of a stage are taken along two roll-outs of the UGV's closed loop, accepting throughout "
        "and refusing throughout, not at the position that the plan has reached. A stage is one Euler step.",
        "The integer program needs a motion that is linear in omega. The motion is exact for the two constant plans.",
        (11, 25),
    ),
    PaperDeviation(
        "(24)", "gatekeeper: one choice per stage", _PROGRAM, "faithful",
        "Binary by default (route `mixed_integer`), in [0, 1] under the routes `relaxed` and `nonlinear`.", "", (22,),
    ),
    PaperDeviation(
        "(25)", "gatekeeper: cost", ("ugv.cost:plan_cost", "ugv.problem:Problem"), "changed",
        "The integral is a sum over the ends of the stages, times their length. One slack per stage serves all "
        "points. A terminal cost can be added; its weight is 0 by default.",
        "The sum in (27a) lacks the length. The paper does not give a_i and b_i.", (10, 14, 22),
    ),
    PaperDeviation(
        "(26)", "gatekeeper: mixed-integer optimal control problem",
        (*_PROGRAM, "ugv.mpc_gatekeeper:PaperGatekeepers"), "changed",
        "The kinematics (23) are among the constraints. (26d) is a half-plane for each point and stage, which implies "
        "the distance, and plans are also sought by the exact distances; the route `nonlinear` has the circles.",
        "Without kinematics the decision does not matter. With half-planes only the binary omega is not convex.",
        (10, 11, 22),
    ),
    PaperDeviation(
        "(27)", "its relaxation", ("ugv.routes.nonlinear:relaxation", "ugv.binary_program:BinaryProgram"),
        "changed",
        "The relaxation is solved under the routes `relaxed` (half-planes) and `nonlinear` (circles, "
        "multiple shooting, from the cheaper constant plan to a local optimum); the default route does not need it.",
        "As printed, (27c) is not relaxed, and (27) has no kinematics. The paper gives no start.", (8, 11, 14, 22, 25),
    ),
    PaperDeviation(
        "(28)", "sum-up rounding: accumulated deficit", ("ugv.relaxation:sum_up_rounding",), "changed",
        "The routes `relaxed` and `nonlinear` compute it. They return the cheapest plan by (25) among the rounded "
        "one and others, such as the two constant ones. A standing answer changes only by a margin and after a dwell. "
        "`gatekeeper.rule: first_stage` executes the first stage of the rounded plan; with the route `nonlinear` that "
        "is by the letter of (27)-(29), with two choices that the paper leaves open (finding 25): run `c_literal` of "
        "`case_a` and `case_b`.",
        "The rounded plan can cost more than refusing throughout. The first stage alone reverses answers.", (22, 25),
    ),
    PaperDeviation(
        "(29)", "sum-up rounding: choice", ("ugv.relaxation:sum_up_rounding",), "changed", "As (28).",
        "As (28).", (22, 25),
    ),
    PaperDeviation(
        "section 3.1.3", "rules (1) to (3) of the task hierarchy", ("model.law.kernels:avoid_one",), "changed",
        "Rules (1) and (2) hold with the augmented projector. Rule (3) is not used.",
        "(5) as printed breaks rule (1). Rule (3) contradicts its own reason.", (1, 15),
    ),
    PaperDeviation(
        "Assumption 1, Remark 1", "where interventions come from",
        ("uav.policy:Policy", "base.registry:POLICIES"), "changed",
        "Interventions come from policies: a detour, a coordinated plan, and wrong ones for tests. None uses fuzzy "
        "logic, reinforcement learning or neural networks; you can add a policy.",
        "The paper gives no intervention task. Its case B uses an intervention that is not proper.", (24,),
    ),
    PaperDeviation(
        "Table 1", "parameters", ("scenario.load:load",), "changed",
        "`case_a`, `case_a_table1` and `case_b`; each lists under `choices` the values that are not the paper's. "
        "[How we read the table](paper.md#table-1).",
        "Rows are scrambled in our text of the paper, and no single preset speed gives the reported times.",
        (4, 5, 6, 7, 17, 21),
    ),
    PaperDeviation("Figure 1", "geometry of the composition", (), "not realised", "A sketch; see (5)."),
    PaperDeviation(
        "Figure 2", "framework in three layers", ("sim.diagram:build_diagram",), "faithful",
        "Every block is a Drake system; `airground diagram case_a` draws those of method (c).",
    ),
    PaperDeviation(
        "Figures 3 and 7", "trajectories", ("report.figures.maps:plane",), "faithful",
        "Drawn from our runs, in the reports of `case_a` and `case_b`. We do not have the paper's pictures.",
    ),
    PaperDeviation(
        "Figures 4 and 8", "decision variables", ("report.figures.timelines:events",), "faithful",
        "As Figures 3 and 7.",
    ),
    PaperDeviation(
        "Figures 5 and 9", "distances to obstacles", ("report.figures.timelines:distances",), "faithful",
        "As Figures 3 and 7. While stalled, both distances are 2 m here, but not at the printed place.", "", (20,),
    ),
    PaperDeviation(
        "Figures 6 and 10", "triggers and answers", ("report.figures.timelines:events",), "faithful",
        "As Figures 3 and 7. The caption of Figure 10 is read with methods (b) and (c) swapped.", "", (8, 17, 23),
    ),
    PaperDeviation(
        "methods (a) to (c)", "what is compared in section 5", ("base.registry:METHODS",), "changed",
        "(a) no intervention, (b) every intervention is executed, (c) an MPC gatekeeper, in both cases. Ours solves "
        "each half-plane problem of (26) to optimality, keeps the best plan by (26) itself, and has hysteresis. "
        "Method (d), avoidance on top with an outcome gatekeeper, is ours.",
        "Method (b) has the MPC in section 5.1, but not in 5.2.", (23,),
    ),
    PaperDeviation(
        "section 6, behaviour database", "how the UAV selects an intervention, left open",
        ("uav.database:BehaviourDatabase",), "changed",
        "The UAV asks its policies in turn (`intervention.ranking: listed`), or all of them and takes the best by its "
        "own prediction (`predicted`). After a refusal the next one gets its turn. [Which policy helped how "
        "often](paper.md#the-behaviour-database).",
        "The paper leaves the selection to future work.", (24,),
    ),
    PaperDeviation(
        "section 6", "Zeno behaviour, left open", ("model.trigger.automaton:Trigger",), "changed",
        "A minimum inter-event time excludes it.", "As (20).", (9,),
    ),
)  # fmt: skip
