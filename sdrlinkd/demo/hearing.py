"""Listens to a daemon's bus on a thread."""

import contextlib
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Self

from sdrlinkd.client import Message, NoDaemonError, Subscriber

POLL_S = 0.1


class Hearing(threading.Thread):
    """Receives what a daemon republishes on its own thread, and calls `take(message, at)`.

    `at` is the arrival time on the monotonic clock. `topic` is a filter as for Subscriber.
    """

    def __init__(
        self, directory: Path, take: Callable[[Message, float], None], topic: str = "/*"
    ) -> None:
        super().__init__(name="hearing", daemon=True)
        self._take = take
        self._subscriber = Subscriber(topic, runtime_dir=directory, depth=0)
        self._done = threading.Event()
        self.count = 0
        self.last_at = 0.0

    def run(self) -> None:
        """Receive until the context ends."""
        while not self._done.is_set():
            message = self._subscriber.receive(timeout_s=POLL_S)
            if message is not None:
                self.last_at = time.monotonic()
                self._take(message, self.last_at)
                self.count += 1

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()
        self.join()
        with contextlib.suppress(NoDaemonError):
            self._subscriber.close()
