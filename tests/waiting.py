"""Other processes: waiting for them to get somewhere, and none of them outlives its test."""

import contextlib
import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from typing import Any


def wait_for(condition: Callable[[], bool], timeout_s: float = 20.0) -> None:
    """Until `condition()` holds; fails after `timeout_s`. For where there is no event to await."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.01)


@contextlib.contextmanager
def group(command: list[Any], **options: Any) -> Iterator[subprocess.Popen[Any]]:
    """A process and all that it starts, killed together when the `with` ends."""
    with subprocess.Popen(command, start_new_session=True, **options) as process:
        try:
            yield process
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
