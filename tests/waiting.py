"""Waits for conditions that have no event."""

import time
from collections.abc import Callable

LOOK_S = 0.01


def wait_for(condition: Callable[[], bool], timeout_s: float = 20.0) -> None:
    """Wait until `condition()` holds; fails after `timeout_s`. For conditions without events."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(LOOK_S)


def again_and_again(act: Callable[[], object], *, while_: Callable[[], object]) -> None:
    """Act until the condition ends; nobody who comes late misses it, and the processor rests."""
    while while_():
        act()
        time.sleep(LOOK_S)
