"""Joins a hub's air."""

import contextlib
import threading
import time

import zmq

from backends.base import AbsentError, RefusalError
from backends.ether import protocol
from backends.ether.sockets import NOBLOCK
from backends.hub_address import HubAddress

LOOK_MS = 100
AGAIN_S = 0.5


def join(
    down: "zmq.Socket[bytes]",
    hello: protocol.Hello,
    hub: HubAddress,
    within_s: float,
    is_over: threading.Event,
) -> protocol.Welcome:
    """Join, and return the hub's welcome; runs on a thread.

    A hub that started after our Hello, or died before its answer, does not know us. Therefore we
    ask which nodes it knows, and send the Hello again. Raises AbsentError, RefusalError.
    """
    _say(down, hello)
    asked_at = time.monotonic()
    until = asked_at + within_s
    while not is_over.is_set() and time.monotonic() < until:
        if down.poll(LOOK_MS):
            answer = protocol.from_hub(down.recv_multipart()[0])
            if isinstance(answer, protocol.Welcome):
                return answer
            if isinstance(answer, protocol.Refused):
                raise RefusalError(answer.reason)
            if isinstance(answer, protocol.Answer) and hello.node not in answer.nodes:
                _say(down, hello)
        elif time.monotonic() - asked_at >= AGAIN_S:
            asked_at = time.monotonic()
            _say(down, protocol.Question())
    raise no_hub(hub)


def no_hub(hub: HubAddress) -> AbsentError:
    """The error when no hub answers at an address."""
    return AbsentError(f"{hub.name}: no hub answers there; start one: {hub.start}")


def _say(down: "zmq.Socket[bytes]", message: protocol.Hello | protocol.Question) -> None:
    with contextlib.suppress(zmq.Again):
        down.send(protocol.encode(message), NOBLOCK)
