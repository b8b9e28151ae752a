"""An axis of time without the stretches in which nothing happens."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.report.view.canvas import ticks_of

# Time shown before and after an event, shortest time that is cut out, s, and maximum number of cuts.
AROUND_S, CUT_S, MAX_CUTS = 0.7, 1.0, 5
CUT_SHARE = 0.05  # width of a cut on the axis, as a share of the time shown


class Clock(NamedTuple):
    """The stretches of time that are shown."""

    # begin, end: of the stretches, (n,), s.
    begin: Array
    end: Array
    place: Array  # of their begins on the axis, (n,), s

    @classmethod
    def around(cls, times_s: Sequence[float], first_s: float, last_s: float) -> Clock:
        """The stretches of a run around some times; the whole run without such times."""
        times = np.sort(times_s) if len(times_s) else np.array([first_s, last_s])
        gaps = np.diff(times) if len(times_s) else np.zeros(1)
        longest = np.sort(np.argsort(-gaps, kind="stable")[:MAX_CUTS])
        cuts = longest[gaps[longest] > 2.0 * AROUND_S + CUT_S]
        begin = np.maximum(times[np.append(0, cuts + 1)] - AROUND_S, first_s)
        end = np.minimum(times[np.append(cuts, -1)] + AROUND_S, last_s)
        steps = end - begin + CUT_SHARE * (end - begin).sum()
        return cls(begin, end, np.cumsum(steps) - steps)

    @property
    def shown_s(self) -> float:
        return float((self.end - self.begin).sum())

    @property
    def cuts(self) -> Array:
        """Begins and ends of the cuts on the axis, (n - 1, 2), s."""
        return np.column_stack([self.place[:-1] + (self.end - self.begin)[:-1], self.place[1:]])

    @property
    def length(self) -> float:
        return float(self.place[-1] + self.end[-1] - self.begin[-1])

    def at(self, t: Array | Sequence[float]) -> Array:
        """Places of times on the axis; a time that is left out is in a cut, or at an end."""
        knots, places = ([start, start + self.end - self.begin] for start in (self.begin, self.place))
        return np.asarray(np.interp(t, np.column_stack(knots).ravel(), np.column_stack(places).ravel()))

    def shows(self, t: Array) -> npt.NDArray[np.bool_]:
        k = np.maximum(np.searchsorted(self.begin, t, side="right") - 1, 0)
        return np.asarray((self.begin[k] <= t) & (t <= self.end[k]))

    def numbers(self, apart: float) -> dict[float, str]:
        """Round times in the stretches by their places, so far apart at least; the middle of a stretch without one."""
        first, second = ticks_of((0.0, self.shown_s), 5)[:2]
        step, numbers = second - first, dict[float, str]()
        for begin, end in zip(self.begin.tolist(), self.end.tolist(), strict=True):
            times = step * np.arange(np.ceil(begin / step), np.floor(end / step) + 1.0)
            for t in times.tolist() or [round((begin + end) / 2.0, 1)]:
                place = float(self.at([t])[0])
                if not numbers or place - max(numbers) >= apart:
                    numbers[place] = f"{round(t, 12):g}"
        return numbers
