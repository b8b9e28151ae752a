"""The links of a scenario's channel, between UAVs and their UGVs."""

from airground_drake.scenario.schema import Channel, WayBack
from airground_drake.uav.channel import Link, Quality


def make_qualities(channel: Channel) -> tuple[Quality, Quality]:
    """The ways from the UAV to UGVs, and back."""
    there = {name: getattr(channel, name) for name in Quality._fields}
    up = channel.up or WayBack()
    back = {name: value for name in Quality._fields if (value := getattr(up, name)) is not None}
    return Quality(**there), Quality(**{**there, **back})


def make_links(channel: Channel) -> tuple[Link, Link]:
    down, up = make_qualities(channel)
    return Link(down, channel.seed, "down"), Link(up, channel.seed, "up")
