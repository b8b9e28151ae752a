"""The links of a scenario's channel, between UAVs and their UGVs."""

import math

from airground_drake.scenario.schema import Channel, Scenario, WayBack
from airground_drake.uav.channel import Link, Quality

ANSWERING_S = 0.15  # time that an answer may take besides its way, s


def make_links(channel: Channel) -> tuple[Link, Link]:
    """The links from the UAV to UGVs, and back."""
    there = {name: getattr(channel, name) for name in Quality._fields}
    up = channel.up or WayBack()
    back = {name: value for name in Quality._fields if (value := getattr(up, name)) is not None}
    return Link(Quality(**there), channel.seed, "down"), Link(Quality(**{**there, **back}), channel.seed, "up")


def repeats_after(scenario: Scenario) -> float:
    """Time after which an unanswered message is repeated, s; infinite without a channel."""
    if scenario.channel is None:
        return math.inf
    down, up = (link.quality for link in make_links(scenario.channel))
    # so an answer in time is read a planning period before: then the planner asks whether a copy would come too late
    samples = scenario.gatekeeper.period_s, scenario.control.period_s, scenario.intervention.period_s
    answering = max(ANSWERING_S, sum(samples))
    return down.delay_s + up.delay_s + max(down.jitter_s, up.jitter_s) + answering
