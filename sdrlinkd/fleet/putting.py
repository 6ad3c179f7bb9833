"""Puts on Zenoh from threads of their own, as a put may block while the network is slow."""

import queue
import threading
from collections.abc import Callable

MOST_WAITING = 4096
"""Puts that wait in one lane; further ones are refused."""
CLOSING_S = 1.0

Action = Callable[[], None]


class Lane:
    """Carries out actions in their order, one after the other, in one thread."""

    def __init__(self, name: str, most: int = MOST_WAITING) -> None:
        self._waiting: queue.Queue[Action | None] = queue.Queue(most)
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()
        self.failed = 0
        """Actions that Zenoh refused."""

    def offer(self, action: Action) -> bool:
        """Have an action carried out; False if too many wait."""
        try:
            self._waiting.put_nowait(action)
        except queue.Full:
            return False
        return True

    def close(self) -> None:
        """Carry out what waits, as long as that takes no longer than CLOSING_S."""
        try:
            self._waiting.put(None, timeout=CLOSING_S)
        except queue.Full:
            return
        self._thread.join(CLOSING_S)

    def _run(self) -> None:
        while (action := self._waiting.get()) is not None:
            try:
                action()
            except Exception:
                self.failed += 1
