"""Waits for conditions that have no event."""

import time
from collections.abc import Callable


def wait_for(condition: Callable[[], bool], timeout_s: float = 20.0) -> None:
    """Wait until `condition()` holds; fails after `timeout_s`. For conditions without events."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.01)
