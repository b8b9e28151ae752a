"""Limits of solving one problem: iteration counts in simulation, a clock in real time."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

Clock = Callable[[], float]  # gives a time in s that never runs backwards


@dataclass(frozen=True)
class Budget:
    """Limits of one call of a route. Counts make a run reproducible; a deadline keeps a real robot's pace.

    A route asks `spent()` between its steps and hands the counts, and `left_s()`, to the solvers that it calls.

    Attributes:
        iterations: of each call of the solver of a relaxation.
        search_iterations: of all searches by branch and bound; the result of a longer one is not used, so that the
            same searches count on every machine.
        search_s: time after which they are stopped, s: several times what `search_iterations` take. No signal ends the
            process during a search, so it is not long.
        deadline_s: time on `clock` at which the solution must stand, s; inf: counted work only.
        clock: what `deadline_s` refers to.
    """

    iterations: int = 100
    search_iterations: int = 2_000
    search_s: float = 1.0
    deadline_s: float = math.inf
    clock: Clock = field(default=time.monotonic, compare=False)

    def spent(self) -> bool:
        """Whether the deadline has passed; counted work alone never makes it so."""
        return self.deadline_s < math.inf and self.clock() >= self.deadline_s

    def left_s(self) -> float:
        """Time to the deadline, s, not below 0; inf without one."""
        return math.inf if self.deadline_s == math.inf else max(0.0, self.deadline_s - self.clock())


COUNTED = Budget()  # counted work only, as in simulations
