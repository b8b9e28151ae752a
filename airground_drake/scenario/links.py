"""The links of a scenario's channel, between UAVs and their UGVs."""

from airground_drake.scenario.schema import Channel, WayBack
from airground_drake.uav.channel import Link, Quality


def make_links(channel: Channel) -> tuple[Link, Link]:
    """The links from the UAV to UGVs, and back."""
    there = {name: getattr(channel, name) for name in Quality._fields}
    up = channel.up or WayBack()
    back = {name: value for name in Quality._fields if (value := getattr(up, name)) is not None}
    return Link(Quality(**there), channel.seed, "down"), Link(Quality(**{**there, **back}), channel.seed, "up")
