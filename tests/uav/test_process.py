"""Third-party policies in processes of their own: what goes wrong there is one line and counts as no intervention."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.hostile_policies import KINDS, TO_PARENT
from builders.observations import mate, seen

from airground_drake.base.errors import PluginError, PolicyError
from airground_drake.model.geometry.motion import Motion
from airground_drake.scenario.load import load
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.uav.database import Asked, BehaviourDatabase, Negotiation, make_policy
from airground_drake.uav.guest import process
from airground_drake.uav.guest.codec import KINDS as CLASSES
from airground_drake.uav.guest.codec import decoded, encoded
from airground_drake.uav.guest.process import LIVES, GuestPolicy
from airground_drake.uav.policy import Observation, Proposal
from airground_drake.verify.claim import TraceClaim

TEAM = seen([mate("a", (0, 0), (10, 0)), mate("b", (0, 5), (10, 5))], [(5, 0), (7, 1)])
LONG_S, SHORT_S = 60.0, 0.2
HOSTILE = "builders.hostile_policies:Hostile"


def doing(name: str) -> Observation:
    """What makes `Hostile` do this; '' for what it does well."""
    return replace(TEAM, refusals=[*KINDS, ""].index(name))


@pytest.fixture(scope="module")
def guests() -> Iterator[dict[bool, GuestPolicy]]:
    """One process for those that hang, which are stopped soon, and one for those that do not."""
    made = {True: GuestPolicy(HOSTILE, {}, SHORT_S), False: GuestPolicy(HOSTILE, {}, LONG_S)}
    yield made
    for guest in made.values():
        guest.close()


def planned(database: BehaviourDatabase, held: Negotiation) -> tuple[dict[str, Negotiation], list[Asked]]:
    """The negotiations after a question to the policies, and those that failed."""
    found, asked = database.plan(held, TEAM)
    return found, [each for each in asked if each.what]


@pytest.mark.parametrize("name", KINDS)
def test_whatever_a_policy_does_counts_as_no_intervention(name: str, guests: dict[bool, GuestPolicy]) -> None:
    if name in TO_PARENT and not _confined():
        pytest.skip("this system cannot keep a process from changing others")
    kind, before = KINDS[name], TraceClaim.judge
    guest = guests[kind.hangs]
    database = BehaviourDatabase([("hostile", guest)], ranking="predicted")
    found, faults = planned(database, Negotiation(refusals=doing(name).refusals))
    if kind.reported is None:
        assert not faults
    else:
        # one that answers in the worker's place does so from the next question on
        found, faults = (found, faults) if faults else planned(database, Negotiation())
        (fault,) = faults
        assert re.search(kind.reported, fault.what), fault.what
        assert fault.what.isprintable()
        assert len(fault.what) <= 600
    assert [talk.proposal for talk in found.values()] == [None]
    assert TraceClaim.judge == before
    if not kind.tame or not guest._end.alive:
        guest.close()  # the next kind gets a new process


def test_after_a_fault_the_policy_is_asked_again_but_not_for_ever(guests: dict[bool, GuestPolicy]) -> None:
    guest = guests[False]
    guest.close()
    for life in range(1, LIVES + 1):
        with pytest.raises(PolicyError, match="no plan"):
            guest.propose(doing("raises"))
        assert guest.propose(doing("")) is not None
        with pytest.raises(PolicyError, match="exit code 0") as ended:
            guest.propose(doing("os_exit_0"))
        assert ("not asked again" in str(ended.value)) == (life == LIVES)
    assert guest.propose(doing("")) is None
    guest.close()
    assert guest.propose(doing("")) is not None


def test_after_a_hang_the_policy_is_not_asked_again(
    guests: dict[bool, GuestPolicy], monkeypatch: pytest.MonkeyPatch
) -> None:
    guest = guests[True]
    guest.close()
    assert guest.propose(doing("")) is not None
    monkeypatch.setattr(process, "START_S", SHORT_S)  # what counts as a hang
    with pytest.raises(PolicyError, match=r"OutOfTime: .*; not asked again in this run"):
        guest.propose(doing("loops_and_swallows_everything"))
    assert guest.propose(doing("")) is None
    guest.close()


def test_what_a_policy_has_started_ends_with_it(guests: dict[bool, GuestPolicy]) -> None:
    guest = guests[False]
    guest.close()
    guest.propose(doing("leaves_a_child_behind"))
    group = guest._process.pid
    os.killpg(group, 0)
    guest.close()
    _gone(group)


STARTER = """
import time, threading
from dataclasses import replace
from builders.hostile_policies import KINDS
from builders.observations import mate, seen
from airground_drake.uav.guest.process import GuestPolicy

def hang():
    guest = GuestPolicy("builders.hostile_policies:Hostile", {}, 1000.0)
    print(guest._process.pid, flush=True)
    team = seen([mate("a", (0, 0), (10, 0))], [])
    guest.propose(replace(team, refusals=[*KINDS].index("loops_and_swallows_everything")))

def in_a_thread():
    thread = threading.Thread(target=hang)
    thread.start()
    thread.join()

START()
"""


@pytest.mark.slow
@pytest.mark.parametrize("start", ["hang", "in_a_thread"])
def test_a_policys_process_ends_with_the_one_that_started_it(start: str) -> None:
    """Though it hangs, and whether the main thread has started it or another one, as those of a Dask worker do."""
    with subprocess.Popen(
        [sys.executable, "-c", STARTER.replace("START", start)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])},
    ) as starter:
        assert starter.stdout is not None
        worker = int(starter.stdout.readline())
        starter.kill()
        starter.wait()
    _gone(worker)


def _gone(group: int) -> None:
    """Wait until no process of a group is left but zombies that nobody has waited for yet."""
    for _ in range(6000):
        states = []
        for stat in Path("/proc").glob("[0-9]*/stat"):
            try:
                state, _, its_group = stat.read_text().rpartition(")")[2].split()[:3]
            except (OSError, ValueError):
                continue
            states += [state] if int(its_group) == group else []
        if set(states) <= {"Z", "X"}:
            return
        time.sleep(0.01)
    raise AssertionError(f"group {group} is still there: {states}")


MODULES = {
    "import sys; sys.exit(0)": "cannot be imported: SystemExit: 0",
    "import os; os._exit(0)": r"its process ended or closed its channel \(exit code 0",
    "class E(BaseException):\n    def __str__(self): raise E\nraise E": "an exception that cannot be put into words",
    "while True: pass": "OutOfTime",
    "a syntax error": "cannot be imported: SyntaxError",
    "": "cannot be imported: AttributeError",
    "It = 3": "is not a subclass",
    "from airground_drake.uav.policy import Policy as It": "abstract",
    "It.__init__ = lambda self: __import__('os')._exit(0)": r"its process ended or closed its channel \(exit code 0",
    "It.__init__ = lambda self: None.thing": "AttributeError",
    "It.__init__ = lambda self, speed: None": "speed",
}
SOUND = """
from airground_drake.uav.policy import Policy
class It(Policy):
    def propose(self, seen): return None
"""


@pytest.mark.parametrize(("number", "text"), list(enumerate(MODULES)))
def test_a_policy_that_cannot_be_made_is_one_line(
    number: int, text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = f"cannot_be_made_{number}"
    (tmp_path / f"{name}.py").write_text(SOUND + text if text.startswith("It.") else text)
    monkeypatch.syspath_prepend(str(tmp_path))
    if "while" in text:
        monkeypatch.setattr(process, "START_S", 2.0)
    with pytest.raises(PluginError, match=MODULES[text]) as refused:
        make_policy(f"{name}:It", {})
    assert str(refused.value).isprintable()
    assert name not in sys.modules


def test_all_that_is_seen_and_proposed_arrives_to_the_bit() -> None:
    draw = np.random.default_rng(3)
    motion = Motion(np.cumsum(draw.random(50)), draw.normal(size=(50, 3)) * 10.0 ** draw.integers(-300, 300, (50, 1)))
    proposal = Proposal("x", 0.1 + 0.2, motion, mapped=draw.normal(size=(4, 3)), cause="b")
    given = seen([mate("a", (0.1, 0), (1 / 3, 0), preset=motion, proposal=proposal, answered="accepted"), TEAM.team[1]])
    there = decoded(encoded(given), CLASSES)
    assert encoded(there) == encoded(given) == encoded(given.fresh())
    for copy in (there, given.fresh()):
        assert not copy.position.flags.writeable
        assert not np.shares_memory(copy.target, given.target)
        assert not np.shares_memory(copy.team[0].proposal.mapped, proposal.mapped)
        assert not np.shares_memory(copy.preset.positions, motion.positions)
    assert isinstance(there.team, tuple)
    [[name, back]] = decoded(encoded([["a", motion]]), (Motion,))
    assert name == "a"
    assert back.times.tobytes() == motion.times.tobytes()
    assert back.positions.tobytes() == motion.positions.tobytes()


def test_a_run_with_a_policy_in_another_process_is_the_same_to_the_bit(run: Callable[[str, str], Trace]) -> None:
    scenario = load("case_a")
    scenario.intervention.policies[0].name = "airground_drake.uav.detour:Detour"
    one, other = run("case_a", "d"), simulate(scenario, "d")
    assert (one.states.to_numpy() == other.states.to_numpy()).all()
    assert len(one.proposals) > 0
    for column in ("issued_s", "times_s", "positions_m", "mapped"):
        for a, b in zip(one.proposals[column], other.proposals[column], strict=True):
            assert np.array_equal(a, b)


def test_the_process_loads_what_a_policy_needs_and_no_more() -> None:
    program = "import sys, airground_drake.uav.guest.worker; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.split()
    assert not {"pydrake", "numba", "pandas", "scipy"} & set(loaded)


def _confined() -> bool:
    program = "from airground_drake.uav.guest import confinement as c; print(c.restrict_access(), c.filter_calls())"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return done.stdout == "True True\n"


def test_a_policy_that_cannot_say_whether_its_work_is_counted_says_why() -> None:
    with pytest.raises(PluginError, match=r"its `counted` raised .*RuntimeError: not counted"):
        GuestPolicy("builders.hostile_policies:CountedRaises", {}, LONG_S)
