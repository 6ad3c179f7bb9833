"""Waiting for what has no event of its own."""

import time
from collections.abc import Callable


def wait_for(condition: Callable[[], bool], timeout_s: float = 20.0) -> None:
    """Until `condition()` holds; fails after `timeout_s`. For where there is no event to await."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.01)
