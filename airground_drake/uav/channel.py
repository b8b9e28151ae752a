"""Delay, loss, duplication and reordering of messages by a channel; the only state is messages in transit.

Delay and loss of a message are a function of the seed, the link, and the message's kind, number and attempt. So there
is no random state, values can be recomputed, and a run with another delay loses the same messages.
"""

import math
import random
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np

from airground_drake.base.arrays import Flags
from airground_drake.base.history import History, Immutable
from airground_drake.model.bodies.motion import SAME_S

Kind = Literal["proposal", "withdrawal", "answer"]


class Message(NamedTuple):
    """A message between a UAV and a UGV."""

    kind: Kind
    number: int  # counts the messages of its kind
    about: int  # number of the proposal
    ugv: int  # index of the UGV that sends or receives it
    sent_s: float  # s
    attempt: int = 0  # how often it was sent before
    content: Any = None  # a `Proposal`, or a `Told`


class Delivery(NamedTuple):
    """A message that arrives."""

    received_s: float  # s
    order: int  # of the message among all of its link
    copy: int  # 0, or 1 if the channel doubled it
    message: Message


@dataclass(frozen=True)
class Transit(Immutable):
    """The state of a link."""

    taken: int = 0  # messages taken from the sender
    under_way: tuple[Delivery, ...] = ()  # by time of arrival
    arrived: History[Delivery] = field(default_factory=History)  # by time of arrival
    lost: History[Message] = field(default_factory=History)
    # per UGV, of the messages that arrived, the one sent last
    newest: dict[int, Delivery] = field(default_factory=dict)


class Quality(NamedTuple):
    """Delay, loss and duplication of a link."""

    delay_s: float = 0.0
    jitter_s: float = 0.0  # a message is late by up to this, uniformly
    loss: float = 0.0  # share of messages lost
    burst_s: float = 0.0  # mean duration of a loss; 0: each message is lost for itself
    duplicate: float = 0.0  # share of messages that arrive twice
    reorder: bool = True  # whether a message may overtake another one


@dataclass(frozen=True)
class Link:
    """A link from a UAV to its UGVs, or back."""

    quality: Quality
    seed: int
    name: str  # of the link; links of different names are independent

    def carry(self, before: Transit, sent: Sequence[Message], t: float) -> Transit:
        """The state at time t, s, given all messages sent since the beginning."""
        now = before
        if len(sent) > before.taken:
            now = self._taken(before, sent)
        due = bisect_right(now.under_way, t + SAME_S, key=lambda delivery: delivery.received_s)
        if not due:
            return now
        newest = dict(now.newest)
        for delivery in now.under_way[:due]:
            last = newest.get(delivery.message.ugv)
            if last is None or delivery.order > last.order:
                newest[delivery.message.ugv] = delivery
        arrived = now.arrived.plus(now.under_way[:due])
        return replace(now, under_way=now.under_way[due:], arrived=arrived, newest=newest)

    def _taken(self, before: Transit, sent: Sequence[Message]) -> Transit:
        under_way, lost = list(before.under_way), list[Message]()
        for order in range(before.taken, len(sent)):
            message = sent[order]
            delays = self.fate(message)
            if not delays:
                lost.append(message)
            # without overtaking, none arrives before another one that was sent to or by the same UGV
            ahead = 0.0
            if not self.quality.reorder:
                ahead = max((d.received_s for d in under_way if d.message.ugv == message.ugv), default=0.0)
            under_way += [
                Delivery(max(message.sent_s + delay, ahead), order, copy, message) for copy, delay in enumerate(delays)
            ]
        return replace(before, taken=len(sent), under_way=tuple(sorted(under_way)), lost=before.lost.plus(lost))

    def fate(self, message: Message) -> list[float]:
        """The delay of each copy of a message, s; empty if it is lost."""
        quality, link = self.quality, f"{self.seed}/{self.name}/{message.ugv}"
        lot = random.Random(f"{link}/{message.kind}/{message.number}/{message.attempt}")
        lost, doubled, first, second = (lot.random() for _ in range(4))
        if quality.burst_s > 0.0:
            gone = quality.loss > 0.0 and _is_bad(link, quality.loss, quality.burst_s, message.sent_s)
        else:
            gone = lost < quality.loss
        delays = [quality.delay_s + quality.jitter_s * late for late in (first, second)]
        return [] if gone else delays if doubled < quality.duplicate else delays[:1]


def _is_bad(link: str, loss: float, burst_s: float, t: float) -> bool:
    """Whether a link is in an outage at time t, s: a two-state process with exponential durations (Gilbert)."""
    # No list is longer than needed, and a longer one begins like a shorter one.
    until = 256.0 * 2.0 ** max(0, math.ceil(math.log2(max(t, 1.0) / 256.0)))
    begins_bad, changes = _changes(link, loss, burst_s, until)
    return begins_bad != bool(bisect_right(changes, t) % 2)


@lru_cache(maxsize=256)
def _changes(link: str, loss: float, burst_s: float, until: float) -> tuple[bool, tuple[float, ...]]:
    """Whether a link starts in an outage, and the times of its changes, s."""
    lot, t, changes = random.Random(f"{link}/bursts"), 0.0, list[float]()
    begins_bad = bad = lot.random() < loss
    while t <= until:
        rate = 1.0 / burst_s if bad else loss / (burst_s * (1.0 - loss))
        t += lot.expovariate(rate) if rate > 0.0 else math.inf
        changes.append(t)
        bad = not bad
    return begins_bad, tuple(changes)


@lru_cache(maxsize=4)
def lost(seed: int, loss: float, count: int, sample: int) -> Flags:
    """Which positions between UGVs are lost at a control sample, (count, count), by receiver and sender."""
    lot = random.Random(f"{seed}/ugvs/{sample}")
    drawn = np.array([lot.random() for _ in range(count * count)]).reshape(count, count)
    return np.asarray((drawn < loss) & ~np.eye(count, dtype=np.bool_) & (sample > 0))  # starts are known
