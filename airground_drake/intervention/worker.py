"""The process in which a policy of others runs: it gets observations and sends motions, as plain JSON.

`process.py` starts it in a fresh interpreter and ends it. Whatever the policy does here, to this module or to the
process, the other side takes nothing but a well-formed message in time for a proposal.
"""

from __future__ import annotations

import os
import socket
from typing import Any

from airground_drake.errors import AirgroundError, described
from airground_drake.intervention.codec import packed_motions, unpacked
from airground_drake.intervention.frames import LONGEST, receive, send
from airground_drake.intervention.policy import Policy, motions_of
from airground_drake.registry import POLICIES


def main(handle: int) -> None:
    """Serve one policy over a socket until it is closed."""
    channel = socket.socket(fileno=handle)
    order = receive(channel)
    try:
        policy = POLICIES.make(order["name"], of=Policy, **order["parameters"])
        send(channel, {"id": 0, "counted": policy.counted is True})
    except AirgroundError as error:
        send(channel, {"id": 0, "fault": str(error)})
        os._exit(0)
    try:
        while True:
            question = receive(channel)
            send(channel, {"id": question["id"], **answer(policy, question["seen"])})
    except EOFError:
        os._exit(0)  # not held up by threads that the policy has started


def answer(policy: Policy, seen: Any) -> dict[str, Any]:
    """What the policy proposes on an observation (packed): `motions`, or a `fault` in words."""
    try:
        observed = unpacked(seen)
        motions = packed_motions(motions_of(policy.propose(observed), observed))
        if (size := sum(len(part) for motion in motions for part in motion)) > LONGEST // 2:
            raise ValueError(f"a proposal of {size} characters; at most {LONGEST // 2} are allowed")
    except BaseException as error:  # whatever a user's policy does, it counts as no intervention
        return {"fault": described(error, type(policy).propose)}
    return {"motions": motions}
