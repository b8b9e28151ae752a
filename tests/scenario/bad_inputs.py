"""Bad inputs, one mistake each, and the messages that they are refused with (`bad_inputs.txt`).

`test_bad_inputs.py` compares line, key and value with the table, and the beginning of the sentence that says what is
allowed. After a sentence was improved: `python tests/scenario/bad_inputs.py`, and read the difference.
"""

import math
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

if __name__ == "__main__":
    import sys

    sys.path.insert(0, str(Path(__file__).parents[1]))

from scenario.cases import DATA, DELETE, SMALL, SMALL_DATA, edit

from airground_drake.base.errors import ScenarioError
from airground_drake.scenario.document import MAX_BYTES
from airground_drake.scenario.load import load
from airground_drake.scenario.shipped import shipped_files

TABLE = Path(__file__).with_suffix(".txt")
FILE, SHIPPED = "bad.yaml", shipped_files()["minimal"].parent
SHOWN = 200
"""Of a message, characters in the table: long lists of what is allowed are cut."""

EDITS: list[tuple[str, object]] = [
    # shape
    ("name", DELETE),
    ("ugvs", DELETE),
    ("runs.d.method", DELETE),
    ("obstacles.rock.position_m", DELETE),
    ("obstacles.rock.known_to_uav", "yes"),
    ("control.period_s", True),
    ("control.period_s", None),
    ("control.avoidance_gain_1_s", "high"),
    ("ugvs.one.start_m", [0, "0 m", 0]),
    ("ugvs.one.start_m", [0, 0]),
    ("ugvs.one", []),
    ("control", None),
    ("expected", ["SAFE-INV"]),
    ("intervention.policies", {"name": "detour"}),
    ("intervention.policies.0", "detour"),
    ("uav.phantoms_m", [[0, 0, 0], [1, 2]]),
    ("ugvs.one.start_m", [0, math.nan, 0]),
    ("duration_s", math.inf),
    ("duration_s", 10**400),
    ("duration_s", 1e10),
    ("duration_s", 1e-9),
    ("intervention.policies.0.parameters.speed_m_s", math.nan),
    # shapes
    ("obstacles.rock", {"polygon_m": [[4, 0], [5, 0], [6, 0], [5.5, 1]], "distance_m": 0.05}),
    ("obstacles.rock", {"polygon_m": [[4, 0], [6, 0], [4, 1], [6, 1]]}),
    ("obstacles.rock", {"polygon_m": [[4, 0], [6, 0], [6, 1], [4, 0]]}),
    ("obstacles.rock", {"polygon_m": [[4, 0, 0], [6, 0, 0], [6, 1, 0]]}),
    ("obstacles.rock", {"polygon_m": [[4, 0], [6, 0], [5, 1e-10]]}),
    ("obstacles.rock", {"polygon_m": [[4, 0], [5, 0], [6, 1e-12], [5.5, 2e-12]]}),
    ("arena_m", [[-1e7, -30], [1e7, 30]]),
    # what a person means: degrees, a list, millimetres, a path
    ("obstacles.rock", {"position_m": [5, -5], "size_m": [1, 1], "heading_rad": 90}),
    ("ugvs.one.plant", {"kind": "unicycle", "hand_point_m": 0.2, "heading_rad": -90}),
    ("obstacles", [{"name": "rock", "position_m": [5, -5]}]),
    ("uav.max_speed_m_s", 250),
    ("ugvs.one.start_m", [5000, 0, 0]),
    ("uav.task", "../mine.py:Mine"),
    ("ugv_controller", {"kind": "/home/me/mine.py:Mine"}),
    ("ugv_controller", {"kind": "m:C", "parameters": {"gain": "high"}}),
    ("claims", {"MINE": "/home/me/mine.py:Mine"}),
    # names
    ("name", "a b"),
    ("name", "n" * 65),
    ("title", "a\u202eb"),
    ("choices.0.reason", "r" * 10_001),
    ("obstacles.1st", {"position_m": [50, 50, 0]}),
    ("obstacles.one", {"position_m": [50, 50, 0]}),
    ("uav.name", "rock"),
    ("intervention.policies.0.parameters.not ok", 1),
    # counts
    ("ugvs", {}),
    ("seed", -1),
    ("gatekeeper.stages", 1001),
    # options
    ("gatekeeper.blocks", 61),
    ("gatekeeper", {"route": "relaxed", "blocks": 10}),
    ("gatekeeper.route", "exact"),
    ("gatekeeper.route", "mine.py:Mine"),
    ("runs.d.set", {"gatekeeper.route": "mine.py:Mine"}),
    ("decision.threshold.rule", "x"),
    ("runs.d.method", "e"),
    ("intervention.policies.0.name", "detuor"),
    ("channel.loss", 1),
    ("channel.delay_s", -0.1),
    ("channel.los", 0.1),
    ("channel.up", {"delay": 1}),
    ("channel.up", {"burst_s": 1e-9}),
    # runs, reproduction, choices
    ("runs.d.stalls_m.three", [1, 0, 0]),
    ("runs.d.expected.SAFE", "holds"),
    ("runs.d.expected.LIVE-HYP", "ok"),
    ("runs.d.expected.LIVE-HYP", "exercised, refuted"),
    ("runs.d.expected.SAFE-TRACE", 3),
    ("runs.d.expected.interventions", "exercised"),
    ("expected", {"SAFE-TRACE": "holds"}),
    ("claims", {"mine": "m:Claim"}),
    ("claims", {"LIVE-HYP": "m:Claim"}),
    ("claims", {"MINE": "mine"}),
    ("reproduction.0.run", "b"),
    ("reproduction.0.robot", "rock"),
    ("reproduction.0.id", ""),
    ("reproduction", DATA["reproduction"][:1] * 2),
    ("reproduction.0.paper", []),
    ("choices.0.key", "control.periods"),
    # what a run sets
    ("runs.d.set", {"gatekeeper.rul": "first_stage"}),
    ("runs.d.set", {"gatekeeper.tries": 2.5}),
    ("runs.d.set", {"decision.release_m": 4.0}),
    ("runs.d.set", {"decision.threshold": {"zeta_m": 2}}),
    ("runs.d.set", {"control.period_s": 0.1}),
    ("runs.d.set", {"gatekeeper": 3}),
    ("runs.d.set", {"intervention.policies.1.name": "detour"}),
    # plane, presets
    ("ugvs.one.start_m", [0, 0, 1]),
    ("uav.start_m", [0, 0, -3]),
    ("ugvs.one.preset.waypoints_m", [[0, 0, 0]]),
    ("ugvs.one.preset.waypoints_m.1", [0, 0, 0]),
    ("ugvs.one.preset.speed_m_s", 2.5),
    ("ugvs.two.preset.waypoints_m.1", [9, -5, 0]),
    # gains and periods
    ("control.avoidance_gain_1_s", 41),
    ("gatekeeper.period_s", 0.06),
    ("gatekeeper.period_s", 0.0125),
    ("gatekeeper.horizon_s", 3.1),
    ("gatekeeper.stages", 7),
    ("decision.noise_period_s", 0.01),
    ("decision.leak_1_s", 41),
    ("decision.noise_m_sqrt_s", 1001),
    # decision
    ("decision.release_m", 0),
    ("decision.release_m", 3),
    ("decision.threshold", {"rule": "bayes", "drift_m_s": 1000}),
    # distances
    ("uav.altitude_m", 1),
    ("safe_distance.collision_m", 1),
    ("control.sensing_range_m", 2.2),
    ("safe_distance.ugv_m", 3.9),
    ("ugvs.one.start_m", [5, -4, 0]),
    ("uav.start_m", [5, -5, 1]),
    ("ugvs.two.start_m", [0, 1, 0]),
    ("ugvs.one.target_m", [5, -4, 0]),
    ("ugvs.two.target_m", [9, 1, 0]),
    ("uav.start_m", [1e8, 0, 2]),
    ("control.avoidance_gain_1_s", 1e-9),
    # radii
    ("obstacles.rock.radius_m", -1),
    ("uav.radius_m", 1.5),
]
"""A key of `SMALL`, and what stands there instead."""

_ALIASES = "\n".join(["_0: &l0 [1, 1]"] + [f"_{i}: &l{i} [{', '.join([f'*l{i - 1}'] * 9)}]" for i in range(1, 30)])
_MERGES = "\n".join(
    ["_0: &m0 {k: 1}"] + [f"_{i}: &m{i} {{<<: [{', '.join([f'*m{i - 1}'] * 9)}]}}" for i in range(1, 30)]
)
_CHAIN = "\n".join(["_0: &c0 {k: 1}"] + [f"_{i}: &c{i} {{<<: *c{i - 1}}}" for i in range(1, 300)])

FILES: list[str | bytes] = [
    b"",
    b"name: \xff\xfe\n",
    b"just words\n",
    b"name: x\nugvs: [1, 2\nuav: 3\n",
    b"a: 1\n\tb: 2\n",
    b"a: 1\nb: \x07\n",
    b'a: "\\U99999999"\n',
    b"a: 1\n--- \nb: 2\n",
    b"[" * 1000,
    b"a: &a\n  <<: *a\n",
    b"name: " + b"x" * MAX_BYTES,
    b"? [a, b]\n: 1\n",
    b"<<: 5\n",
    # documents that are small as written and large as meant
    *(
        f"{bomb}\n{SMALL}"
        for bomb in (
            _ALIASES,
            _MERGES,
            _CHAIN,
            "_a: &a [*a]",
            "_a: &a {<<: *a}",
            "_a: " + "[" * 200 + "]" * 200,
            "_a: " + "{a: " * 200 + "1" + "}" * 200,
            "_a: [" + "1, " * 51_000 + "1]",
            "_a: &a {}\n_b: {<<: [" + "*a, " * 51_000 + "*a]}",
        )
    ),
]
"""What is not a scenario at all."""

REPLACEMENTS = [
    ("seed: 3", "seed: 3\nseed: 4"),
    ("  rock:", "  rock: {position_m: [9, 9, 9]}\n  rock:"),
    ("seed: 3", "sede: 3"),
    ("  rock: {", "  rock: {width_m: 1, "),
    ("duration_s: 5", "duration_s: 5 km"),
    ("duration_s: 5", "duration_s:\n  - 5"),
    ("ugvs:", "ugvs: &a\n  <<: *a"),
    ("name: small", "name: !custom x"),
    ("name: small", 'name: "\\ud800"'),
    ("seed: 3", "seed: !!int x"),
    ("seed: 3", f"seed: {'1' * 5000}"),
    ("seed: 3", "seed: 3.5"),
    ("name: small", "name: 17"),
    ("obstacles:\n  rock: {position_m: [5, -5, 0]}", "obstacles:"),
    ("obstacles:\n", "obstacles:\n  stone:\n    known_to_uav: false\n"),
    ("name: small", "name:small"),
    ("name: small", "name: small\ntitle: one: two"),
    ("name: small", 'name: small\ntitle: "one'),
    ("name: small", "name: small\ntitle: %one"),
    ("name: small", "name: small\n  title: one"),
    ("  rock: {", "  rock: {radius_m: [1, "),
    ("obstacles:\n", "obstacles:\n\tstone: 1\n"),
]
"""A text of `SMALL`, and what stands there instead."""

OVERRIDES = [
    "seed",
    "=1",
    "contrl.period_s=1",
    "ugvs.ugv9.max_speed_m_s=1",
    "ugvs.ugv1.max_acceleration_m_s2=1",
    "intervention.message_delay_s=1",
    "runs.d.expected.LIVE-GAOL=refuted",
    "obstacles.box.x.position_m=[1, 2, 0]",
    "ugvs..start_m=1",
    "intervention.policies.3.name=x",
    "intervention.policies.0.parameters.=1",
    "seed.x=1",
    "control.period_s=5 km",
    "control.period_s=",
    "control.period_s=-1",
    "runs.d.set.decision.threshold.zeta_m=-1",
    "seed=1\n2",
    "ugvs=null",
    "faults={position_error_m: 0.1}",
    "faults={late: 0.1}",
    f"ugvs={{{', '.join(f'r{k}: {{start_m: [{k}, 0, 0]}}' for k in range(50))}}}",
]
"""`--set` on case_a."""

PLANTS = [
    "{kind: unicycle}",
    "{kind: unicycle, hand_point_m: 0.01}",
    "{kind: unicycle, hand_point_m: 0.2, wheel_base_m: 0.3}",
    "{kind: unicycle, hand_point_m: 0.2, delay_s: 0.1}",
    "{kind: unicycle, hand_point_m: 3.0}",
    "[{kind: delay, delay_s: 0.1}, {kind: unicycle, hand_point_m: 0.2}]",
    "{kind: delay, delay_s: 0.03}",
    "{kind: lag}",
    "{kind: spring}",
    "{sort: lag}",
    "lag",
    "[3]",
    "{kind: ackermann, hand_point_m: 0.3, wheelbase_m: 0.3, max_steering_rad: 30}",
    "{kind: ackermann, hand_point_m: 0.3, wheelbase_m: 0.3, max_steering_rad: 0.6, backwards: true}",
    "{kind: ackermann, hand_point_m: 0.001, wheelbase_m: 0.3, max_steering_rad: 0.6}",
    "{kind: weak.py:Weak, hand_point_m: 1.0}",
    "{kind: lag, time_constant_s: 0.1, cover_m: 1.0}",
    "[{kind: delay, delay_s: 0.05}, {kind: weak.py:Weak}]",
    "{kind: weak.py:Weak, drift_m_s: 9.0}",
]
"""Of the UGV of minimal."""
CAR = "uav.plant={kind: ackermann, hand_point_m: 0.3, wheelbase_m: 0.3, max_steering_rad: 0.6}"
DRIFTS = "ugvs.ugv1.plant={kind: mine.py:Mine, drift_m_s: 0.1}"
ERRORS = ["sensing={position_error_m: 0.05, errors: away}", "control.avoidance_gain_1_s=8"]
MINE = "ugv_controller={kind: mine.py:Mine}"
OLD = ["channel={ugvs: {delay_s: 0.3, loss: 0.1}}", "control.law=asynchronous", "runs={a: {method: a}, d: {method: d}}"]
PRINTED = "runs={a: {method: a, composition: recursion_listed}}"
TOGETHER = [
    *(("minimal", [f"ugvs.ugv1.plant={plant}"]) for plant in PLANTS),
    ("minimal", [CAR]),
    ("minimal", ["ugvs.ugv1.plant={kind: weak.py:Weak, drift_m_s: 0.1}", "control.avoidance_gain_1_s=0"]),
    # positions between UGVs that come late or are lost
    ("swap", ["channel.ugvs={delay_s: 0.06}"]),
    ("swap", ["channel.ugvs={delay_s: -0.1}"]),
    ("swap", ["channel.ugvs={loss: 1.0}"]),
    ("swap", ["channel.ugvs={loss: 0.2}", "runs={a: {method: a, set: {channel.ugvs.loss: 0.9}}}"]),
    ("swap", ["channel.ugvs={loss: 0.2}", MINE]),
    ("swap", ["channel.ugvs={loss: 0.2}", DRIFTS]),
    ("swap", ["channel.ugvs={delay_s: 0.02}", DRIFTS]),
    ("swap", ["channel.ugvs={loss: 0.2}", "sensing={position_error_m: 0.05}"]),
    *(
        ("swap", [*OLD, *more])
        for more in (
            ["channel=null"],
            ["ugvs.ugv1.plant={kind: lag, time_constant_s: 0.1}"],
            ["sensing={position_error_m: 0.01}"],
            ["sensing={uav_error_m: 0.01}"],
            ["runs={c: {method: c}}"],
            [PRINTED],
            [MINE],
            ["ugvs.ugv2.target_m=[6, 1.1, 0]", "ugvs.ugv2.preset.waypoints_m.1=[6, 1.1, 0]"],
            ["control.law=late"],
        )
    ),
    # errors of measured positions
    *(
        ("swap", [*ERRORS, *more])
        for more in (
            ["control.avoidance_gain_1_s=3.6"],
            ["control.avoidance_gain_1_s=0"],
            [DRIFTS],
            [PRINTED],
            ["ugvs.ugv2.start_m=[-6, 1.1, 0]"],
            ["sensing.position_error_m=-0.1"],
            ["sensing.errors=loud"],
            ["sensing.shared=false", "channel.ugvs={loss: 0.2}"],
            ["sensing.shared=false", "ugvs.ugv2.start_m=[-6, 1.2, 0]"],
        )
    ),
]
"""A shipped scenario, and several `--set` that do not go together."""

PATHS = ["", ".", "/", "a\0b", "no/such/file.yaml", "x" * 5000, "line\nbreak", "case-a"]


def messages(folder: Path) -> Iterator[str]:
    """What each bad input is refused with, its file named `FILE`."""
    file = folder / FILE

    def refusal(content: str | bytes | None, path: str, overrides: list[str]) -> str:
        if content is not None:
            file.write_bytes(content if isinstance(content, bytes) else content.encode())
        try:
            load(path, overrides)
        except ScenarioError as error:
            return str(error).replace(f"{folder}/", "").replace(f"{SHIPPED}/", "")
        return "accepted"

    for key, value in EDITS:
        yield refusal(yaml.safe_dump(_edited(key, value), sort_keys=False), str(file), [])
    for content in FILES:
        yield refusal(content, str(file), [])
    for old, new in REPLACEMENTS:
        yield refusal(SMALL.replace(old, new), str(file), [])
    for override in OVERRIDES:
        yield refusal(None, "case_a", [override])
    for name, overrides in TOGETHER:
        yield refusal(None, name, overrides)
    for path in PATHS:
        yield refusal(None, path, [])


def _edited(key: str, value: object) -> dict[str, Any]:
    """`SMALL` with one change; it runs long enough that a robot must arrive, where a preset is changed."""
    data = edit(SMALL_DATA, key, value)
    return edit(data, "duration_s", 15) if key.startswith("ugvs.two.preset") else data


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as made:
        TABLE.write_text("\n".join(message[:SHOWN] for message in messages(Path(made))) + "\n", encoding="utf-8")
