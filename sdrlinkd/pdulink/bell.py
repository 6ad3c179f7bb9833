"""An event that wakes a link that had nothing to send."""

import asyncio
import contextlib


class Bell:
    """An event, set when there may be something to send, and kept until a task waits for it."""

    def __init__(self) -> None:
        self._rung = asyncio.Event()

    def ring(self) -> None:
        """Wake the waiting task, or the next one to wait."""
        self._rung.set()

    def hush(self) -> None:
        """Clear the event."""
        self._rung.clear()

    async def wait(self, most_s: float) -> None:
        """Wait for the event, for at most `most_s`, which may be infinite."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(None if most_s == float("inf") else most_s):
                await self._rung.wait()
