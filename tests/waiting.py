"""Waits for conditions that have no event."""

import time
from collections.abc import Callable

SHORTEST_S, LONGEST_S = 0.01, 0.1
LONGER = 0.1
"""How much longer the condition may have held than it was waited for."""


def wait_for(condition: Callable[[], bool], timeout_s: float = 20.0) -> None:
    """Wait until `condition()` holds; fails after `timeout_s`. For conditions without events."""
    began = time.monotonic()
    while not condition():
        looked = time.monotonic()
        assert looked < began + timeout_s, "waited in vain"
        # What is waited for needs the processor more than who asks for it.
        time.sleep(max(SHORTEST_S, min(LONGEST_S, LONGER * (looked - began))))


def again_and_again(act: Callable[[], object], *, while_: Callable[[], object]) -> None:
    """Act until the condition ends; nobody who comes late misses it, and the processor rests."""
    while while_():
        act()
        time.sleep(SHORTEST_S)
