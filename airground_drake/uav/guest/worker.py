"""The process in which a third-party policy runs: it receives observations and sends motions.

`process.py` starts it in a fresh interpreter and ends it. A policy can change anything in here, so the other side
checks every message, and accepts only a well-formed one in time.
"""

import os
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from airground_drake.base.errors import AirgroundError, described, traceback_of
from airground_drake.base.registry import POLICIES
from airground_drake.uav.guest.codec import KINDS, LONGEST, decoded, encoded
from airground_drake.uav.policy import Policy, motions_of


def main(channel: int) -> None:
    """Serve one policy over the `Connection` with this descriptor until it is closed."""
    with suppress(EOFError, OSError):
        connection: Connection[bytes, bytes] = Connection(channel)
        order = decoded(connection.recv_bytes(), ())
        try:
            policy = POLICIES.make(order["name"], of=Policy, **dict(order["parameters"]))
            counted = policy.counted is True
        except AirgroundError as error:
            connection.send_bytes(encoded({"fault": str(error)}))
            os._exit(0)
        except BaseException as error:  # `counted` may be a property
            connection.send_bytes(encoded({"fault": f"its `counted` raised {described(error)}"}))
            os._exit(0)
        connection.send_bytes(encoded({"counted": counted}))
        while True:
            connection.send_bytes(encoded(answer(policy, connection.recv_bytes())))
    os._exit(0)  # also if the policy has started threads that still run


def answer(policy: Policy, data: bytes) -> dict[str, Any]:
    # Returns `motions`, a list of names and motions, or a `fault` and its `traceback`.
    try:
        seen = decoded(data, KINDS)
        answered = {"motions": list(motions_of(policy.propose(seen), seen).items())}
        if (size := len(encoded(answered))) > LONGEST:
            raise ValueError(f"a proposal of {size} bytes; at most {LONGEST} are allowed")
    except BaseException as error:  # any failure counts as no intervention
        return {"fault": described(error, type(policy).propose), "traceback": traceback_of(error)}
    return answered
