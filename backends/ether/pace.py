"""Asks a hub whether its air keeps real time, before a radio joins it."""

import asyncio
import threading
import time

import zmq

from backends.base import Patience
from backends.ether import protocol
from backends.ether.joining import AGAIN_S, LOOK_MS, no_hub
from backends.ether.sockets import NOBLOCK, connect
from backends.hub_address import HubAddress

ANSWER_S = 5.0


async def hub_keeps_pace(hub: HubAddress, patience: Patience) -> bool:
    """Whether the air of `hub` keeps real time; false: lock-step.

    Raises AbsentError when no hub answers; with `patience` it waits for one.
    """
    is_over = threading.Event()
    within_s = ANSWER_S if patience is Patience.NONE else float("inf")
    try:
        return await asyncio.to_thread(_ask, hub, within_s, is_over)
    finally:
        is_over.set()


def _ask(hub: HubAddress, within_s: float, is_over: threading.Event) -> bool:
    began_s = time.monotonic()
    asked_s = float("-inf")
    with zmq.Context() as context, connect(context, zmq.DEALER, hub.air) as air:
        air.setsockopt(zmq.LINGER, 0)
        while not is_over.is_set() and time.monotonic() < began_s + within_s:
            if time.monotonic() >= asked_s + AGAIN_S:
                asked_s = time.monotonic()
                air.send(protocol.encode(protocol.Question()), NOBLOCK)
            if air.poll(LOOK_MS):
                answer = protocol.from_hub(air.recv_multipart()[0])
                if isinstance(answer, protocol.Answer):
                    return answer.paced
    raise no_hub(hub)
